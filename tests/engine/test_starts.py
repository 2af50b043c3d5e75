"""Where the search for a flow begins: along the slopes of one nearby, and where chord steps with its factors ended."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vegglue.arrays import Array
from vegglue.engine import newton
from vegglue.engine.interface import Point
from vegglue.engine.newton import SteadyFlow
from vegglue.flow.chord import ChordSolution
from vegglue.flow.newton import CLOSE

SHAPE = (4, 5)
SLOPES = np.random.default_rng(1).standard_normal((4, 3, 5, 2))
SLOPES[:, 1, 0] = 0.0  # nothing flows through the first side
NO_FACTORS: Any = None
BEFORE = SteadyFlow(np.zeros((4, 3, 5, 1)), (0, 5), 5, NO_FACTORS, SLOPES, 0.0)
NEAR = Point(np.array([1.0, 2.0]), np.zeros(0), np.zeros((0, 2)), {"low": BEFORE})


@pytest.fixture
def starts(monkeypatch: pytest.MonkeyPatch) -> list[Array]:
    """Where flows with factors of their own are searched from."""
    found = list[Array]()

    def settled(problem: Any, warm: Array, tolerance: float) -> tuple[Any, None, tuple[int, int]]:
        found.append(warm)
        return None, None, (0, 5)

    monkeypatch.setattr(newton, "settled", settled)
    return found


def searched(monkeypatch: pytest.MonkeyPatch, z: Array, left: float) -> Array:
    """Where chord steps began that end at a state of sevens, `left` away from a root."""
    begun = list[Array]()

    def chord(problem: Any, start: Array, *_: Any) -> ChordSolution:
        begun.append(start)
        return ChordSolution(np.full_like(start, 7.0), np.array([left]), np.array([10]), np.array([False]))

    monkeypatch.setattr(newton, "chord_in_band", chord)
    model: Any = SimpleNamespace(case=SimpleNamespace(numerics=SimpleNamespace(tolerance=1e-6)))
    problem: Any = SimpleNamespace(shape=SHAPE)
    assert newton._state_and_factors(model, "low", problem, z, NEAR) is None
    return begun[0]


@pytest.mark.parametrize("z", [(1.1, 1.8), (1.1, 1.8, 0.7)])
def test_a_start_follows_the_slopes_also_where_an_effect_was_added(
    z: tuple[float, ...], starts: list[Array], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert searched(monkeypatch, np.array(z), np.inf) == pytest.approx(SLOPES @ np.array([[0.1], [-0.2]]))


@pytest.mark.parametrize(("left", "goes_on"), [(0.5 * CLOSE, True), (2.0 * CLOSE, False), (np.inf, False)])
def test_new_factors_are_made_where_borrowed_ones_led_near(
    left: float, goes_on: bool, starts: list[Array], monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = searched(monkeypatch, np.array([1.1, 1.8]), left)
    assert len(starts) == 1
    assert np.array_equal(starts[0], np.full_like(begun, 7.0) if goes_on else begun)
