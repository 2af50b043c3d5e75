"""The short channel of twins on cells of twice the size, and its flow in the middle of the prior."""

from functools import lru_cache
from pathlib import Path

import numpy as np
from built_models import model_of

from vegglue.case.config import load_case
from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.model import coarser
from vegglue.measurements.observations import read_observations

CASE = load_case(Path(__file__).parents[1] / "configs" / "twin.yaml")


@lru_cache
def coarse_twin() -> tuple[Model, Point]:
    model = coarser(model_of(CASE, read_observations(CASE)))
    assert model is not None
    point = linearise(model, np.zeros(len(model.names)))
    assert point is not None
    return model, point
