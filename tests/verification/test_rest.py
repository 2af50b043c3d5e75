"""Water at rest over any bed stays at rest, exactly: wet, dry and in between."""

from dataclasses import replace

import numpy as np
import pytest
from channels import filled, make_problem, river

from vegglue.effects import bed_laws
from vegglue.flow.equations import faces, residual
from vegglue.flow.march import march
from vegglue.flow.problem import ALONG, LEVEL


def rough_bed(shape: tuple[int, int]) -> np.ndarray:
    """Hollows, ridges and islands of half a metre with scattered stones of a decimetre."""
    chance = np.random.default_rng(7)
    x, y = np.meshgrid(np.linspace(0, 3, shape[0]), np.linspace(0, 2, shape[1]), indexing="ij")
    return 0.5 * np.sin(2.1 * x) * np.cos(3.3 * y) + 0.1 * chance.standard_normal(shape)


def lake(level: float, film: float = 0.01):
    bed = rough_bed((40, 30))
    return make_problem(bed, (0.5, 0.375), 0.0, level, (bed_laws.KEULEGAN, 1.0), viscosity=np.array([0.01]), film=film)


@pytest.mark.parametrize("level", [1.5, 0.1, -0.3], ids=["wet", "islands", "ponds"])
def test_a_lake_has_no_residual(level):
    problem = lake(level)
    dry = (problem.bed > level).mean()
    assert (dry == 0.0) if level > 1.0 else (0.2 < dry < 0.9)
    assert np.abs(residual(problem, filled(problem, level))).max() == 0.0


@pytest.mark.parametrize("level", [1.5, 0.1, -0.3], ids=["wet", "islands", "ponds"])
def test_marching_leaves_a_lake_at_rest(level):
    problem = lake(level)
    start = filled(problem, level)
    assert np.abs(march(problem, start, 0.5, 200) - start).max() == 0.0


def test_a_lake_in_the_papers_channel():
    """Banks, classes, plants: none of them moves water that stands level, also beyond the waterline."""
    problem = river(inflows=(), outlet_level=np.array([0.6]))
    assert (problem.bed > 0.6).any()
    assert np.abs(residual(problem, filled(problem, 0.6))).max() == 0.0


def test_a_tilted_lake_is_not_at_rest():
    """The test above can fail: a millimetre of slope is seen as gravity, 9.81 m/s2 times the slope."""
    problem = replace(lake(1.5), film=1e-6)
    state = filled(problem, 1.5)
    state[:, LEVEL] += 1e-4 * 0.5 * np.arange(40)[:, None, None]
    assert residual(problem, state)[5:-5, ALONG] == pytest.approx(9.81 * 1e-4, rel=1e-9)


@pytest.mark.slow
def test_a_disturbed_lake_comes_to_rest():
    """A hump of water between islands runs out over the outlet, and the lake lies still at the outlet's level.

    On faces between cells deeper than 10 cm. The rest feeds the water table under the stones, e times less in 2,200 s.
    """
    problem = lake(0.1)
    state = filled(problem, 0.1)
    state[10:15, LEVEL, 10:15] += 0.1
    rest = march(problem, state, 0.5, 8000)
    wet = problem.bed < 0.1
    assert np.abs(rest[:, LEVEL, :, 0] - 0.1)[wet].max() < 1e-3
    deep = (problem.bed[1:] < 0.0) & (problem.bed[:-1] < 0.0)
    assert np.abs(faces(problem, rest).u[1:-1, :, 0])[deep].max() < 5e-4
