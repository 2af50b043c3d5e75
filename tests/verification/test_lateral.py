"""Velocity across a channel of two roughnesses, mixed by eddy viscosity, far from both ends of a long uniform reach.

g h S - c_f u^2 + d/dy(nu h du/dy) = 0,    c_f = g / C^2,    du/dy = 0 at smooth walls.
"""

import numpy as np
import pytest
from channels import GRAVITY, centres, discharge, make_problem, order, shown, sloping, solved
from scipy.integrate import quad, solve_bvp

from vegglue.arrays import Array
from vegglue.effects import bed_laws
from vegglue.flow.equations import faces

WIDTH, DEPTH, SLOPE = 6.0, 0.5, 0.001
SMOOTH, ROUGH = 45.0, 25.0
COLUMNS, SPACING = 60, 25.0


def developed(viscosity: Array, flow: float, rows: int) -> Array:
    """u [m/s] across the middle of the reach, a viscosity (rows,) given; the southern half is the smooth one."""
    y, shape = centres(WIDTH, rows), (COLUMNS, rows)
    problem = make_problem(
        sloping(COLUMNS * SPACING, COLUMNS, rows, SLOPE),
        (SPACING, WIDTH / rows),
        flow,
        DEPTH - SLOPE * COLUMNS * SPACING,
        friction_class=np.broadcast_to((y > 0.5 * WIDTH).astype(np.int64), shape).copy(),
        law=np.array([bed_laws.CHEZY, bed_laws.CHEZY]),
        coefficient=np.array([[SMOOTH], [ROUGH]]),
        viscosity=viscosity[:, None],  # of all columns alike: given in full, its loops would be compiled anew
        film=1e-5,
    )
    state = solved(problem)
    assert discharge(problem, state) == pytest.approx(flow, rel=1e-9)
    return faces(problem, state).u[COLUMNS // 2, :, 0]


def halves(smooth, rough):
    """A profile from its two halves, each a function of the distance from its own wall."""
    return lambda y: np.where(y < 0.5 * WIDTH, smooth(np.minimum(y, 0.5 * WIDTH)), rough(np.minimum(WIDTH - y, 3.0)))


def shiono_knight(mixing: float):
    """nu = mixing h u: u^2 = C^2 h S + A cosh(gamma s) in each half, gamma^2 = 2 c_f / (mixing h^2), s from the wall.

    Shiono and Knight (1991), doi:10.1017/S0022112091001246, without secondary current; mixing = lambda sqrt(f/8) is one
    number for both halves; A makes u and the flux of momentum meet in the middle.
    """
    gamma = [np.sqrt(2.0 * GRAVITY / mixing) / (chezy * DEPTH) for chezy in (SMOOTH, ROUGH)]
    far = [chezy**2 * DEPTH * SLOPE for chezy in (SMOOTH, ROUGH)]
    arm = [g * 0.5 * WIDTH for g in gamma]
    meet = np.array([[np.cosh(arm[0]), -np.cosh(arm[1])], [gamma[0] * np.sinh(arm[0]), gamma[1] * np.sinh(arm[1])]])
    height = np.linalg.solve(meet, [far[1] - far[0], 0.0])
    return halves(*(lambda s, k=k: np.sqrt(far[k] + height[k] * np.cosh(gamma[k] * s)) for k in (0, 1)))


def integrated(viscosity: float):
    """The same with a constant viscosity, where u^2 has no closed form: solved as a boundary-value problem."""

    def slopes(_, u):
        smooth = GRAVITY * (u[0] ** 2 / (SMOOTH**2 * DEPTH) - SLOPE) / viscosity
        rough = GRAVITY * (u[2] ** 2 / (ROUGH**2 * DEPTH) - SLOPE) / viscosity
        return np.array([u[1], smooth, u[3], rough])

    def ends(wall, middle):
        return np.array([wall[1], wall[3], middle[0] - middle[2], middle[1] + middle[3]])

    s = np.linspace(0.0, 0.5 * WIDTH, 200)
    guess = np.zeros((4, s.size))
    guess[0], guess[2] = SMOOTH * np.sqrt(DEPTH * SLOPE), ROUGH * np.sqrt(DEPTH * SLOPE)
    found = solve_bvp(slopes, ends, s, guess, tol=1e-9, max_nodes=20000)
    assert found.success
    return halves(lambda s: found.sol(s)[0], lambda s: found.sol(s)[2])


@pytest.mark.slow
@pytest.mark.parametrize("kind", [pytest.param("shiono-knight", marks=pytest.mark.slow), "constant"])
def test_velocity_across_two_roughnesses(kind):
    """Far speeds 1.01 and 0.56 m/s. With 0.125 m cells within 0.34 mm/s, order 1.93 (closed form), 1.95 (constant)."""
    exact = shiono_knight(0.1) if kind == "shiono-knight" else integrated(0.05)
    flow = DEPTH * (quad(exact, 0.0, 3.0, epsabs=1e-12)[0] + quad(exact, 3.0, 6.0, epsabs=1e-12)[0])
    errors = []
    for rows in (12, 24, 48):
        y = centres(WIDTH, rows)
        viscosity = 0.1 * DEPTH * exact(y) if kind == "shiono-knight" else np.full(rows, 0.05)
        errors.append(float(np.abs(developed(viscosity, flow, rows) - exact(y)).max()))
    print(f"{kind}: u from {exact(6.0):.3f} to {exact(0.0):.3f} m/s, {shown(errors)}")
    assert errors[-1] < 4e-4
    assert order(errors) > 1.8


def test_without_viscosity_each_half_has_its_own_normal_speed():
    """No mixing: u = C sqrt(h S) in each half, and nothing in between."""
    flow = DEPTH * 3.0 * (SMOOTH + ROUGH) * np.sqrt(DEPTH * SLOPE)
    u = developed(np.zeros(12), flow, 12)
    assert u[:6] == pytest.approx(SMOOTH * np.sqrt(DEPTH * SLOPE), rel=1e-4)
    assert u[6:] == pytest.approx(ROUGH * np.sqrt(DEPTH * SLOPE), rel=1e-4)
