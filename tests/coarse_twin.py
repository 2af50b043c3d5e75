"""The short channel of twins on cells of twice the size, and its flow in the middle of the prior."""

from dataclasses import replace
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
def coarse_twin(*left_out: str) -> tuple[Model, Point]:
    """left_out: experiments; without "mid" a diagnosis takes half the time."""
    case, observations = CASE, read_observations(CASE)
    if left_out:  # else scales are those of all that is made of the same parts of the case
        experiments = {name: one for name, one in CASE.experiments.items() if name not in left_out}
        case = CASE.model_copy(update={"experiments": experiments})
    fine = model_of(case, observations)
    station = fine.station[fine.station["experiment"].isin(list(case.experiments))].reset_index(drop=True)
    model = coarser(replace(fine, station=station))
    assert model is not None
    point = linearise(model, np.zeros(len(model.names)))
    assert point is not None
    return model, point
