"""The limit of the data: what is told of evidence as a diagnosis tells it, and where."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from blind import planned_trials
from object_limits import _is_told, _places_told, shares

NOTHING = np.array([-9.0])


def test_a_place_is_told_where_it_leads_all_that_is_known() -> None:
    assert _is_told(np.array([-9.0, -8.0]), np.array([4.0, -2.0]), NOTHING)
    assert not _is_told(np.array([-9.0, 3.5]), np.array([4.0, -2.0]), NOTHING)
    assert not _is_told(np.array([-9.0, -8.0]), np.array([4.0, -2.0]), np.array([3.0]))
    assert not _is_told(np.array([4.0, -8.0]), np.array([-4.0, -2.0]), NOTHING)


def test_places_that_rival_each_other_say_the_same() -> None:
    assert _is_told(np.array([-9.0]), np.array([4.0, 3.9]), NOTHING)


def test_the_guess_is_where_most_chance_lies() -> None:
    """One spot is the likeliest, but two others, a metre apart, hold more together."""
    spots: Any = SimpleNamespace(x=np.array([0.0, 10.0, 11.0]), y=np.zeros(3))
    likeliest, guess = _places_told(SimpleNamespace(places=[spots]), np.log([[0.4], [0.3], [0.3]]))  # type: ignore
    np.testing.assert_array_equal(likeliest, [[0.0, 0.0]])
    np.testing.assert_array_equal(guess, [[10.0, 0.0]])


@pytest.mark.slow
def test_a_longer_trace_is_told_more_often() -> None:
    """An object of nine standard errors is, of three hardly, and the gain of a probe of six is no place."""
    trial = next(one for one in planned_trials() if one.key == "second/twin/unlisted/2")
    pier = {"name": "unlisted:pier", "shapes": {"x": 12.0, "y": 0.5, "radius": 0.6}, "x": 12.0, "y": 0.5}
    gain = {"name": "probe_gain[C]", "shapes": {}, "x": None, "y": None}
    long, short = (shares(replace(trial, signal=signal), pier) for signal in (9.0, 3.0))
    assert long["told"] > short["told"] + 0.2
    assert long["near"] > short["near"] + 0.2
    assert shares(trial, gain)["told"] < 0.1
