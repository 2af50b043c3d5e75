"""The search for the best place, on a model whose answer to one parameter dies out towards the bound of its prior."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.optimize
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.fit import NEGLIGIBLE_DECREASE, fit, objective
from vegglue.calibration.fit import _step as a_step
from vegglue.calibration.noise import noise_of
from vegglue.case.parameter_space import FURTHEST
from vegglue.engine.interface import Point, Wanted, always

MEASURED = pd.DataFrame({"experiment": "a", "kind": "level", "section": "", "x": 0.0, "y": 0.0,
                         "value": [1.1, 1.05, 0.3], "standard_error": 0.005, "used": True})  # fmt: skip
NOISE = noise_of(MEASURED)


def at(z: Array) -> Point:
    """More is measured than the first parameter can give; the second is plain."""
    slope = scipy.stats.norm.pdf(z[0])
    prediction = np.array([scipy.stats.norm.cdf(z[0])] * 2 + [0.5 * z[1]])
    return Point(z, prediction, np.array([[slope, 0.0], [slope, 0.0], [0.0, 0.5]]), {})


def told(point: Point, wanted: Wanted) -> Point | None:
    """As an engine does: nothing where slopes are not wanted."""
    return point if wanted(point.prediction) else None


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Array]:
    """The points z that a search computed."""
    points: list[Array] = []

    def linearise(model: Any, z: Array, near: Point, wanted: Wanted) -> Point | None:
        points.append(z)
        return told(at(z), wanted)

    monkeypatch.setattr("vegglue.calibration.fit.linearise", linearise)
    return points


@pytest.fixture
def promised(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The decrease that each step of a search promised: negligible at last where it ended by itself."""
    found: list[float] = []

    def step(*given: Any) -> tuple[Array, Array, float]:
        one = a_step(*given)
        found.append(one[2])
        return one

    monkeypatch.setattr("vegglue.calibration.fit._step", step)
    return found


@pytest.mark.parametrize("start", [(0.0, 0.0), (1.0, 0.0), (2.5, -1.0), (4.0, 1.0), (6.0, 3.0)])
def test_a_search_ends_beside_a_bound(asked: list[Array], promised: list[float], start: tuple[float, float]) -> None:
    found = fit(None, NOISE, at(np.array(start)))  # type: ignore[arg-type]
    best = scipy.optimize.minimize(lambda z: objective(NOISE, at(z)), found.point.z, method="Nelder-Mead")
    assert found.objective < best.fun + 2.0 * NEGLIGIBLE_DECREASE
    assert promised[-1] < NEGLIGIBLE_DECREASE


def test_a_search_ends_at_the_end_of_all_places(promised: list[float], monkeypatch: pytest.MonkeyPatch) -> None:
    """Ever more of a parameter would help, but further out it is no longer told from the bound of its prior."""

    def endless(model: Any, z: Array, near: Point | None, wanted: Wanted = always) -> Point | None:
        slope = np.array([[1.0 if np.abs(z[0]) < FURTHEST else 0.5, 0.0]] * 2 + [[0.0, 0.5]])  # by central differences
        return told(Point(z, np.array([*np.clip(z[[0, 0]], -FURTHEST, FURTHEST), 0.5 * z[1]]), slope, {}), wanted)

    monkeypatch.setattr("vegglue.calibration.fit.linearise", endless)
    noise, start = noise_of(MEASURED.assign(value=[9.0, 9.0, 0.3])), endless(None, np.zeros(2), None)
    found = fit(None, noise, start)  # type: ignore[arg-type]
    assert promised[-1] < NEGLIGIBLE_DECREASE
    assert found.point.z == pytest.approx([FURTHEST, 0.6], abs=0.01)


def test_a_place_without_flow_is_stepped_back_from(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "vegglue.calibration.fit.linearise", lambda model, z, near, wanted: told(at(z), wanted) if z[0] < 2.0 else None
    )
    found = fit(None, NOISE, at(np.array([1.5, 0.0])))  # type: ignore[arg-type]
    assert 1.9 < found.point.z[0] < 2.0
    assert found.point.z[1] == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize(("worth", "followed"), [(-1.0, False), (1.0, True)])
def test_a_search_that_promises_too_little_is_not_followed(asked: list[Array], worth: float, followed: bool) -> None:
    """Of a model linear in z the slopes promise what is there."""
    start, best = at(np.array([0.0, -3.0])), fit(None, NOISE, at(np.array([1.0, 0.6])))  # type: ignore[arg-type]
    linear = Point(start.z, start.prediction, best.point.slope, {})
    white = NOISE.whiten(linear.slope)
    wide, target = np.vstack([white, np.eye(2)]), np.append(NOISE.whiten(NOISE.residual(linear.prediction)), -linear.z)
    least = float(np.sum((target - wide @ np.linalg.lstsq(wide, target)[0]) ** 2))
    asked.clear()
    fit(None, NOISE, linear, enough=least + worth)  # type: ignore[arg-type]
    assert bool(asked) == followed


def rosenbrock(z: Array) -> Point:
    """The curved valley of Rosenbrock (1960), y = x^2: across it a step of 0.05 is felt, along it one of 0.25."""
    slope = np.array([[-0.2 * z[0], 0.1], [0.02, 0.0], [0.0, 0.0]])
    return Point(z, np.array([0.1 * (z[1] - z[0] ** 2), 0.02 * z[0], 0.0]), slope, {})


def test_steps_follow_the_bend_of_a_valley(monkeypatch: pytest.MonkeyPatch) -> None:
    noise = noise_of(MEASURED.assign(value=[0.0, 0.03, 0.0]))
    kept: list[Array] = []

    def linearise(model: Any, z: Array, near: Point, wanted: Wanted) -> Point | None:
        found = told(rosenbrock(z), wanted)
        kept.extend([] if found is None else [z])
        return found

    monkeypatch.setattr("vegglue.calibration.fit.linearise", linearise)
    start = rosenbrock(np.array([-1.5, 2.25]))
    found = fit(None, noise, start, steps=100)  # type: ignore[arg-type]
    bent = len(kept)
    monkeypatch.setattr("vegglue.calibration.fit._bent", lambda model, noise, point, damped, step: step)
    kept.clear()
    straight = fit(None, noise, start, steps=100)  # type: ignore[arg-type]
    assert found.objective == pytest.approx(straight.objective, abs=NEGLIGIBLE_DECREASE)
    assert bent <= 2 / 3 * len(kept)
