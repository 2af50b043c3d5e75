"""What a diagnosis concludes is told in the units that its words say."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from linear_baseline import CASE_OF_TWINS, at_best, stations_of

from vegglue.calibration.noise import GRID_ERROR_SHARE, with_grid_error
from vegglue.diagnosis.conclusion import estimated_errors
from vegglue.diagnosis.findings import Findings


@pytest.mark.parametrize(("kinds", "told"), [(("velocity", "discharge"), 0.001), (("level", "discharge"), np.nan)])
def test_the_error_of_the_grid_is_that_of_velocities(kinds: tuple[str, str], told: float) -> None:
    """With discharges, wrong by 0.02 m3/s, and levels beside them the mean of all was told as one of mm/s."""
    station = stations_of(CASE_OF_TWINS, ("A",), 4)
    station = station.assign(kind=np.resize(kinds, len(station)))
    base = at_best(CASE_OF_TWINS, station, np.zeros(len(station)), np.zeros((len(station), 2)))
    difference = np.where(station["kind"] == "velocity", 0.001, 0.02) / GRID_ERROR_SHARE
    screening: Any = SimpleNamespace(base=replace(base, noise=with_grid_error(base.noise, difference)))
    assert estimated_errors(screening, Findings()).grid_error == pytest.approx(told, nan_ok=True)
