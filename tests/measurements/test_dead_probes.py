"""Which probes are taken for dead, and which slow ones are not."""

import numpy as np
import pytest

from vegglue.measurements.dead_probes import dead_probes

EDGES = (0.0, 8.0)
Y = np.arange(1.0, 8.0)
COUNT = np.full(7, 20)


def judge(mean, deviation=0.07, plants=False, largest=None, count=COUNT):
    mean = np.array(mean)
    deviation, plants = np.broadcast_to(deviation, 7).astype(float), np.broadcast_to(plants, 7)
    largest = np.abs(mean) + 0.004 if largest is None else np.array(largest)
    return [reason != "" for reason in dead_probes(EDGES, Y, count, largest, mean, deviation, plants)]


ONLY_FOURTH = [False, False, False, True, False, False, False]
NONE = [False] * 7


def test_dead_probe_is_flagged_with_its_numbers():
    mean, deviation = np.array([0.2, 0.5, 0.5, 0.001, 0.5, 0.5, 0.2]), np.full(7, 0.07)
    deviation[3] = 0.004
    reason = dead_probes(EDGES, Y, COUNT, np.abs(mean) + 0.004, mean, deviation, np.zeros(7, bool))[3]
    assert "all 20 heights" in reason
    assert "0.005 m/s" in reason
    assert "0.50 m/s" in reason
    assert "0.004 against 0.070" in reason


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
    few = np.array([2, 20, 20, 20, 20, 20, 20])
    assert judge([0.001, 0.5, 0.5, 0.5, 0.5, 0.5, 0.2], calm, count=few) == NONE


def test_fast_vertical_is_not_flagged():
    assert judge([0.2, 0.5, 0.5, 0.9, 0.5, 0.5, 0.2]) == NONE


def test_two_dead_neighbours_do_not_vouch_for_each_other():
    calm = np.where((Y == 4.0) | (Y == 5.0), 0.004, 0.07)
    assert judge([0.2, 0.5, 0.5, 0.001, -0.002, 0.5, 0.2], calm) == [False, False, False, True, True, False, False]


@pytest.mark.parametrize("still", [0.0, 0.001])
def test_still_water_everywhere_is_no_evidence(still):
    assert judge(np.full(7, still), 0.004) == NONE
