"""The short channel of twins on cells of twice the size, and its flow in the middle of the prior."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from built_models import model_of

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.model import coarser
from vegglue.measurements.observations import read_observations

CASE = load_case(Path(__file__).parents[1] / "configs" / "twin.yaml")


@lru_cache
def coarse_twin(*left_out: str) -> tuple[Model, Point]:
    """left_out: experiments; without "mid" a diagnosis takes half the time."""
    model = coarser(model_of(CASE, read_observations(CASE)))
    assert model is not None
    experiments = {name: one for name, one in CASE.experiments.items() if name not in left_out}
    case = model.case.model_copy(update={"experiments": experiments})
    station = model.station[model.station["experiment"].isin(list(experiments))].reset_index(drop=True)
    model = replace(model, case=case, station=station, site=build_site(case))
    point = linearise(model, np.zeros(len(model.names)))
    assert point is not None
    return model, point
