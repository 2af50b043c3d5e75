"""Flow that speeds up or slows down right at the inflow and the outlet, against Bernoulli's equation."""

from dataclasses import replace

import numpy as np
import pytest
from channels import GRAVITY, centres, changed, filled, make_problem, order, shown, solved, trapezoid
from scipy.optimize import brentq

from vegglue.effects import bed_laws
from vegglue.flow.equations import residual, side_fluxes
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, InflowSegment

LENGTH, FLUX, OUTLET = 24.0, 0.6, 0.9  # m, m2/s, m
SMOOTH = (bed_laws.CHEZY, 1e5)  # loses a micrometre over the length


def bed(x, rises):
    """A bed that goes on rising, or falling, by 0.2 m through both ends."""
    return (0.2 if rises else -0.2) * x / LENGTH


def level(x, rises):
    """z with z + q^2 / (2 g h^2) = E, subcritical, E from the level at the outlet."""

    def head(z, at):
        return z + 0.5 * (FLUX / (z - bed(at, rises))) ** 2 / GRAVITY

    energy = head(OUTLET, LENGTH)
    return np.array([brentq(lambda z, at=at: head(z, at) - energy, bed(at, rises) + 0.45, 2.0) for at in x])


def errors(cells, rises):
    """Largest error of levels [m] and of velocities [m/s] over all columns, the outlet among them."""
    x, size = centres(LENGTH, cells), LENGTH / cells
    problem = make_problem(
        np.repeat(bed(x, rises)[:, None], 3, axis=1), (size, 1.0), 3.0 * FLUX, OUTLET, SMOOTH, film=1e-6
    )
    state = solved(problem)[..., 0]
    face = x + 0.5 * size
    velocity = FLUX / (level(face, rises) - bed(face, rises))
    return (np.abs(state[:, LEVEL] - level(x, rises)[:, None]).max(), np.abs(state[:, ALONG] - velocity[:, None]).max())


@pytest.mark.parametrize("rises", [True, False])
def test_momentum_is_carried_to_second_order_through_both_ends(rises):
    """Measured order 2.0 of levels and velocities, with cells of 2 to 0.5 m."""
    found = np.array([errors(cells, rises) for cells in (12, 24, 48)])
    for number, name in enumerate(("level", "velocity")):
        print(f"{name}: {shown(list(found[:, number]))}")
        assert order(list(found[:, number])) > 1.8


def test_velocity_across_that_grows_along_x_is_carried_exactly():
    """u dv/dx of v = a x and an even u over an even depth, in every column, in a row that no wall is near."""
    a, speed, cells = 0.01, 0.5, 12
    problem = make_problem(np.zeros((cells, 8)), (2.0, 1.0), 8.0 * speed, 1.0, (bed_laws.CHEZY, 1e6), film=1e-6)
    state = np.zeros((cells, 3, 8, 1))
    state[:, LEVEL], state[:, ALONG] = 1.0, speed
    state[:, ACROSS, 1:] = a * centres(24.0, cells)[:, None, None]
    rate = residual(problem, state)[:, ACROSS, 4, 0]
    assert rate == pytest.approx(np.full(cells, a * speed), rel=1e-6)


@pytest.mark.parametrize("kind", [ALONG, ACROSS], ids=["along", "across"])
def test_what_disturbs_water_that_flows_in_at_the_outlet_does_not_grow(kind):
    """Carried from upstream, it would grow by |c| / dx = 0.5 1/s."""
    problem = changed(make_problem(np.zeros((12, 8)), (1.0, 1.0), 0.0, 1.0, (bed_laws.CHEZY, 1e9)), inflows=())
    calm = filled(problem, 1.0)
    calm[:, ALONG] = -0.5
    disturbed = calm.copy()
    disturbed[-1, kind, 4] += 1e-3
    rate = (residual(problem, disturbed) - residual(problem, calm))[-1, kind, 4, 0] / 1e-3
    assert rate > -1e-6


def test_an_eddy_may_reach_through_the_outlet():
    """Water enters through a third of the width, and some flows back in at the outlet, at up to 0.08 m/s."""
    smooth, mixing = (bed_laws.CHEZY, 80.0), np.full(1, 0.005)
    problem = make_problem(np.zeros((20, 12)), (0.5, 0.5), 2.0, 1.0, smooth, viscosity=mixing)
    outlet = solved(changed(problem, inflows=(InflowSegment("west", 0, 4, np.full(1, 2.0)),)))[-1, ALONG, :, 0]
    assert outlet.min() == pytest.approx(-0.083, abs=0.005)
    assert outlet.max() == pytest.approx(0.993, abs=0.005)


def test_a_waterline_may_cross_the_first_column():
    """On a rough bed, where cells are thinner than their faces: counted by the flux over their depth alone, one held
    15 m/s and Newton ran away.
    """
    bed = trapezoid(20.0, 4.5, (30, 18))[0] + 0.1 * np.random.default_rng(9).standard_normal((30, 18))
    problem = make_problem(
        bed, (20.0 / 30, 0.5), 1.0, 0.6, (bed_laws.CHEZY, 40.0), viscosity=np.full(1, 0.01), film=2e-3
    )
    assert np.abs(solved(problem)[0, ALONG]).max() < 0.6


@pytest.mark.parametrize(("level", "share"), [(1.0, 0.0), (1.25, 0.5), (1.4, 1.0)], ids=["below", "over", "far over"])
def test_a_hollow_takes_water_by_what_stands_over_its_rim(level, share):
    """0.3 m deep at 0.8 m: the inflow filled it until it ran over its rim, on which Newton and the march ran away."""
    bed = np.zeros((6, 4))
    bed[:, :2] = [0.8, 1.1]
    problem = make_problem(bed, (1.0, 1.0), 1.0, level, SMOOTH, film=1e-6)
    rim = np.array([[0.3], [0.0], [0.0], [0.0]])
    hollow = changed(problem, inflows=tuple(replace(one, rim=rim) for one in problem.boundaries.inflows))
    depth = np.maximum(level - bed[:1, :, None], 0.0)
    (west, _, _), (plain, _, _) = side_fluxes(hollow, depth), side_fluxes(problem, depth)
    assert west.sum() == pytest.approx(plain.sum())
    assert west[0, 0] / west[2, 0] == pytest.approx(share * plain[0, 0] / plain[2, 0], abs=1e-9)
