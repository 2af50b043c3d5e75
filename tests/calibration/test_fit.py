"""The search for the best place, on a model whose answer to one parameter dies out towards the bound of its prior."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.optimize
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.fit import MOST_STEPS, NEGLIGIBLE_DECREASE, STALLED_STEPS, fit, objective
from vegglue.calibration.noise import noise_of
from vegglue.case.parameter_space import FURTHEST
from vegglue.decision_constants import constants
from vegglue.engine.interface import Point, Wanted

MEASURED = pd.DataFrame({"experiment": "a", "kind": "level", "section": "", "x": 0.0, "y": 0.0,
                         "value": [1.1, 1.05, 0.3], "standard_error": 0.005, "used": True})  # fmt: skip
NOISE = noise_of(MEASURED)


def at(z: Array) -> Point:
    """More is measured than the first parameter can give; the second is plain."""
    slope = scipy.stats.norm.pdf(z[0])
    prediction = np.array([scipy.stats.norm.cdf(z[0])] * 2 + [0.5 * z[1]])
    return Point(z, prediction, np.array([[slope, 0.0], [slope, 0.0], [0.0, 0.5]]), {})


def model_of(point_at: Callable[[Array], Point | None] = at, asked: list[Array] | None = None) -> Any:
    """A model of such points, whose engine gives none if slopes are not wanted; asked: gets the points that it kept."""

    def linearise(model: Any, z: Array, near: Point | None, wanted: Wanted) -> Point | None:
        point = point_at(z)
        if point is None or not wanted(point.prediction):
            return None
        if asked is not None:
            asked.append(z)
        return point

    return SimpleNamespace(engine=SimpleNamespace(linearise=linearise))


@pytest.mark.parametrize("start", [(0.0, 0.0), (1.0, 0.0), (2.5, -1.0), (4.0, 1.0), (6.0, 3.0)])
def test_a_search_ends_beside_a_bound(start: tuple[float, float]) -> None:
    found = fit(model_of(), NOISE, at(np.array(start)))
    best = scipy.optimize.minimize(lambda z: objective(NOISE, at(z)), found.point.z, method="Nelder-Mead")
    assert found.objective < best.fun + 2.0 * NEGLIGIBLE_DECREASE


def test_a_search_ends_at_the_end_of_all_places() -> None:
    """Ever more of a parameter would help, but further out it no longer differs from the bound of its prior."""

    def endless(z: Array) -> Point:
        slope = np.array([[1.0 if np.abs(z[0]) < FURTHEST else 0.5, 0.0]] * 2 + [[0.0, 0.5]])  # by central differences
        return Point(z, np.array([*np.clip(z[[0, 0]], -FURTHEST, FURTHEST), 0.5 * z[1]]), slope, {})

    kept: list[Array] = []
    found = fit(model_of(endless, kept), noise_of(MEASURED.assign(value=[9.0, 9.0, 0.3])), endless(np.zeros(2)))
    assert len(kept) < MOST_STEPS, "it ended by itself"
    assert found.point.z == pytest.approx([FURTHEST, 0.6], abs=0.01)


def test_a_place_without_flow_is_stepped_back_from() -> None:
    found = fit(model_of(lambda z: at(z) if z[0] < 2.0 else None), NOISE, at(np.array([1.5, 0.0])))
    assert 1.9 < found.point.z[0] < 2.0
    assert found.point.z[1] == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize(("worth", "followed"), [(-1.0, False), (1.0, True)])
def test_a_search_that_promises_too_little_is_not_followed(worth: float, followed: bool) -> None:
    """Of a model linear in z the slopes promise what is there."""
    start, best = at(np.array([0.0, -3.0])), fit(model_of(), NOISE, at(np.array([1.0, 0.6])))
    linear = Point(start.z, start.prediction, best.point.slope, {})
    white = NOISE.whiten(linear.slope)
    wide, target = np.vstack([white, np.eye(2)]), np.append(NOISE.whiten(NOISE.residual(linear.prediction)), -linear.z)
    least = float(np.sum((target - wide @ np.linalg.lstsq(wide, target)[0]) ** 2))
    found = fit(model_of(), NOISE, linear, enough=least + worth)
    assert (found.point is not linear) == followed


@pytest.mark.parametrize(("steps_away", "followed"), [(0.9, True), (1.1, False)])
def test_a_search_far_from_the_evidence_that_is_needed_is_given_up(steps_away: float, followed: bool) -> None:
    """In times hopeless_search of what the first step promises, which goes all the way in this linear model."""

    def linear(z: Array) -> Point:
        slope = np.array([[0.01, 0.0], [0.0, 0.01], [0.0, 0.0]])
        return Point(z, slope @ z + (1.1, 1.05, 0.3), slope, {})

    start, white = linear(np.array([1.0, 0.0])), NOISE.whiten(linear(np.zeros(2)).slope)
    before, determinant = objective(NOISE, start), np.linalg.slogdet(white.T @ white + np.eye(2))[1]
    needed = -0.5 * (before - steps_away * constants().hopeless_search * before + determinant)
    assert (fit(model_of(linear), NOISE, start, needed=needed).point is not start) == followed


def rosenbrock(z: Array) -> Point:
    """The curved valley of Rosenbrock (1960), y = x^2: across it a step of 0.05 is felt, along it one of 0.25."""
    slope = np.array([[-0.2 * z[0], 0.1], [0.02, 0.0], [0.0, 0.0]])
    return Point(z, np.array([0.1 * (z[1] - z[0] ** 2), 0.02 * z[0], 0.0]), slope, {})


def test_steps_follow_the_bend_of_a_valley(monkeypatch: pytest.MonkeyPatch) -> None:
    noise, start = noise_of(MEASURED.assign(value=[0.0, 0.03, 0.0])), rosenbrock(np.array([-1.5, 2.25]))
    bent, straight = list[Array](), list[Array]()
    found = fit(model_of(rosenbrock, bent), noise, start, steps=100)
    monkeypatch.setattr("vegglue.calibration.fit.STRAIGHT_DECREASE", np.inf)
    other = fit(model_of(rosenbrock, straight), noise, start, steps=100)
    assert found.objective == pytest.approx(other.objective, abs=NEGLIGIBLE_DECREASE)
    assert len(bent) <= 2 / 3 * len(straight)


def test_a_search_that_stalls_ends() -> None:
    """Slopes promise what steps hardly keep, as where an outline crosses cells."""

    def stair(z: Array) -> Point:
        value = 0.9 + 1e-5 * z[0]
        return Point(z, np.array([value, value, 0.3]), np.array([[0.05, 0.0], [0.05, 0.0], [0.0, 0.5]]), {})

    asked: list[Array] = []

    def counted(z: Array) -> Point:
        asked.append(z)
        return stair(z)

    found = fit(model_of(counted), NOISE, stair(np.zeros(2)), 100)
    assert len(asked) == 2 * STALLED_STEPS, "of each step a flow ahead, for its bend, and one at its end"
    assert found.objective <= objective(NOISE, stair(np.zeros(2)))
