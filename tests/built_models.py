"""A case as a model on its grid, which a run builds once and keeps."""

from vegglue.case.gridded_site import build_site
from vegglue.case.schema import Case
from vegglue.engine.interface import Engine, Model
from vegglue.engine.newton import NEWTON
from vegglue.measurements.observations import Observations


def model_of(case: Case, observations: Observations, engine: Engine = NEWTON) -> Model:
    """The case on its grid, read where it was measured."""
    return Model(case, build_site(case), observations.table, engine)
