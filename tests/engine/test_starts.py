"""Where the search for a flow begins: along the slopes of one nearby, with its factors or with new ones."""

from typing import Any

import numpy as np
import pytest
from coarse_twin import coarse_twin

from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.newton import SteadyFlow
from vegglue.flow.newton import CLOSE

SLOPES = np.random.default_rng(1).standard_normal((4, 3, 5, 2))
SLOPES[:, 1, 0] = 0.0  # nothing flows through the first side
NO_FACTORS: Any = None


def test_a_start_follows_the_slopes_of_the_parameters_that_they_are_of() -> None:
    flow = SteadyFlow(np.ones((4, 3, 5, 1)), (0, 5), 5, NO_FACTORS, SLOPES, 0.0)
    assert flow.after(np.array([0.1, -0.2])) == pytest.approx(1.0 + SLOPES @ np.array([[0.1], [-0.2]]))
    assert flow.after(np.array([0.1])) == pytest.approx(1.0 + 0.1 * SLOPES[..., :1])


@pytest.fixture(scope="module")
def twin() -> tuple[Model, Point]:
    return coarse_twin()


@pytest.mark.parametrize(("step", "reuses"), [(0.02, True), (1.5, False)])
def test_factors_nearby_are_reused_while_they_lead_there(twin: tuple[Model, Point], step: float, reuses: bool) -> None:
    """Whatever they are, the flow is the one that is found from afar."""
    model, point = twin
    z = point.z + step
    beside, afar = linearise(model, z, point), linearise(model, z)
    assert beside is not None
    assert afar is not None
    np.testing.assert_allclose(beside.prediction, afar.prediction, atol=2e-5)
    np.testing.assert_allclose(beside.slope, afar.slope, atol=2e-3)
    moved = max(flow.moved for flow in beside.flows.values())
    assert (0.0 < moved < CLOSE) if reuses else moved == 0.0
