"""A baseline and its point on cells of twice the size."""

from dataclasses import replace

import numpy as np
import pytest
from linear_baseline import CASE_OF_TWINS, at_best, stations_of

from vegglue.arrays import Array
from vegglue.calibration import baseline
from vegglue.engine.interface import Model, Point


@pytest.mark.parametrize("away", [0.0, 0.1])
def test_a_flow_on_coarse_cells_is_found_once_at_a_place(away: float, monkeypatch: pytest.MonkeyPatch) -> None:
    station, places = stations_of(CASE_OF_TWINS, ("A", "B"), 4), list[Array]()
    slope = np.zeros((len(station), len(CASE_OF_TWINS.parameters)))
    base = at_best(CASE_OF_TWINS, station, np.zeros(len(station)), slope)
    known = replace(base.fitted.point, z=base.fitted.point.z + away)

    def linearise(model: Model, z: Array, near: Point) -> Point:
        places.append(z)
        return replace(near, z=z)

    monkeypatch.setattr(baseline, "linearise", linearise)
    found = baseline.with_coarse_point(replace(base, coarse=base.model, on_coarse=known)).on_coarse
    assert found is not None
    assert np.array_equal(found.z, base.fitted.point.z)
    assert len(places) == (away > 0.0)
