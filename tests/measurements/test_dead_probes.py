"""Which probes are dead, and which slow ones are not."""

import numpy as np
import pandas as pd
import pytest

from vegglue.measurements.adv_section import DeadProbe, dead_probes

Y = np.arange(1.0, 8.0)
ONLY_FOURTH = [False, False, False, True, False, False, False]
NONE = [False] * 7


def found(mean, deviation=0.07, plants=False, largest=None, count=20) -> dict[float, DeadProbe]:
    """Dead probes among verticals with these means and largest speeds [m/s] between edges at 0 and 8 m."""
    mean = np.array(mean)
    deviation, plants, count = (np.broadcast_to(one, 7) for one in (deviation, plants, count))
    largest = np.copysign(np.abs(mean) + 0.004 if largest is None else largest, mean)
    rows = [
        {"y": y, "u": u, "u_std": float(deviation[k]), "plants": bool(plants[k])}
        for k, y in enumerate(Y)
        for u in (largest[k], 2.0 * mean[k] - largest[k]) * (count[k] // 2)
    ]
    return dead_probes((0.0, 8.0), pd.DataFrame(rows))


def judge(mean, deviation=0.07, plants=False, largest=None, count=20) -> list[bool]:
    dead = found(mean, deviation, plants, largest, count)
    return [y in dead for y in Y]


def test_a_dead_probe_is_found_with_its_numbers():
    calm = np.where(Y == 4.0, 0.004, 0.07)
    expected = DeadProbe(20, *(pytest.approx(one, abs=1e-9) for one in (0.005, 0.5, 0.004, 0.07)))
    assert found([0.2, 0.5, 0.5, 0.001, 0.5, 0.5, 0.2], calm) == {4.0: expected}
    assert found([0.2, 0.5, 0.5, 0.001, 0.5, 0.5, 0.2], np.nan)[4.0].deviation is None


def test_slow_water_that_fluctuates_is_not_a_dead_probe():
    assert judge([0.2, 0.5, 0.5, 0.02, 0.5, 0.5, 0.2], deviation=0.07) == NONE


def test_slow_water_inside_plants_is_not_a_dead_probe():
    assert judge([0.2, 0.5, 0.4, 0.02, 0.4, 0.5, 0.2], [0.07, 0.07, 0.07, 0.1, 0.07, 0.07, 0.07]) == NONE
    assert judge([0.2, 0.5, 0.4, 0.02, 0.4, 0.5, 0.2], np.nan, Y == 4.0) == NONE


def test_without_turbulence_in_the_file_the_mean_decides_outside_plants():
    assert judge([0.2, 0.5, 0.5, 0.001, 0.5, 0.5, 0.2], deviation=np.nan) == ONLY_FOURTH


def test_slow_vertical_at_the_bank_is_not_a_dead_probe():
    calm = [0.005, 0.07, 0.07, 0.07, 0.07, 0.07, 0.07]
    assert judge([-0.01, 0.1, 0.4, 0.5, 0.5, 0.4, 0.1], calm, largest=[0.03, 0.2, 0.6, 0.7, 0.7, 0.6, 0.2]) == NONE
    few = [2, 20, 20, 20, 20, 20, 20]
    assert judge([0.001, 0.5, 0.5, 0.5, 0.5, 0.5, 0.2], calm, count=few) == NONE


def test_fast_vertical_is_not_flagged():
    assert judge([0.2, 0.5, 0.5, 0.9, 0.5, 0.5, 0.2]) == NONE


def test_two_dead_neighbours_do_not_vouch_for_each_other():
    calm = np.where((Y == 4.0) | (Y == 5.0), 0.004, 0.07)
    assert judge([0.2, 0.5, 0.5, 0.001, -0.002, 0.5, 0.2], calm) == [False, False, False, True, True, False, False]


@pytest.mark.parametrize("still", [0.0, 0.001])
def test_still_water_everywhere_is_no_evidence(still):
    assert judge(np.full(7, still), 0.004) == NONE
