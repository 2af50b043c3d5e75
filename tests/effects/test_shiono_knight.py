"""Shiono and Knight's channel with its lateral viscosity and secondary currents, both as effects of the library.

    g h S (1 - k) - c_f u^2 + d/dy(lambda h^2 c_f^(1/2) u du/dy) = 0,    k = Gamma / (rho g h S) in each panel

has the solution u^2 = (1 - k) C^2 h S + A cosh(gamma s), gamma^2 = 2 c_f^(1/2) / (lambda h^2), s from the smooth wall
of each panel; u and the flux of momentum meet where the panels do (1991, doi:10.1017/S0022112091001246).
"""

import numpy as np
import pytest
from channels import GRAVITY, centres, discharge, make_problem, order, shown, sloping, solved
from scipy.integrate import quad

from vegglue.effects import bed_laws
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.library import library
from vegglue.effects.surroundings import ChannelGeometry
from vegglue.flow.equations import faces

pytestmark = pytest.mark.slow

WIDTH, DEPTH, SLOPE = 6.0, 0.5, 0.001
SMOOTH, ROUGH = 45.0, 25.0
COLUMNS, SPACING = 60, 25.0
LAMBDA = 0.3


def exact(chezy, strength, ratio):
    """u(y) [m/s]: the first panel to y = 3 m with k = strength, the second one beyond with k = ratio strength."""
    root = np.sqrt(GRAVITY) / np.array(chezy)  # c_f^(1/2)
    gamma = np.sqrt(2.0 * root / LAMBDA) / DEPTH
    far = (1.0 - np.array([strength, ratio * strength])) * np.array(chezy) ** 2 * DEPTH * SLOPE
    arm = gamma * 0.5 * WIDTH
    flux = root * gamma * np.sinh(arm)
    meet = np.array([[np.cosh(arm[0]), -np.cosh(arm[1])], flux])
    height = np.linalg.solve(meet, [far[1] - far[0], 0.0])

    def profile(y):
        panel = (np.asarray(y) > 0.5 * WIDTH).astype(int)
        wall = np.where(panel == 0, y, WIDTH - y)
        return np.sqrt(far[panel] + height[panel] * np.cosh(gamma[panel] * wall))

    return profile


def panels(bed, rows):
    """Floor and bank as the two panels, without any patch."""
    y = centres(WIDTH, rows)
    other = np.broadcast_to((y > 0.5 * WIDTH).astype(float)[None, :, None], (COLUMNS, rows, 1))
    nothing, far = np.zeros_like(other), np.full_like(other, np.inf)
    return ChannelGeometry(
        x=centres(COLUMNS * SPACING, COLUMNS)[:, None, None], y=y[None, :, None],
        share_along=np.zeros((COLUMNS, 1, 1)), length=COLUMNS * SPACING, dx=SPACING, dy=WIDTH / rows,
        filter_width=SPACING,
        bed=bed[..., None], offset=nothing, half_width=nothing + 3.0, side_slope=nothing, bank=other, planted=nothing,
        front=far, edge=far, wake=far, patch=nothing - 1.0,
    )  # fmt: skip


def developed(chezy, strength, ratio, flow, rows):
    """u [m/s] across the middle of the reach."""
    y, shape = centres(WIDTH, rows), (COLUMNS, rows)
    bed = sloping(COLUMNS * SPACING, COLUMNS, rows, SLOPE)
    values = {"strength": strength, "slope": SLOPE, "bank_ratio": ratio}
    effects = (
        ActiveEffect(library()["elder"], {"coefficient": np.array([LAMBDA])}),
        ActiveEffect(library()["panel_current"], {name: np.array([value]) for name, value in values.items()}),
    )
    problem = make_problem(
        bed,
        (SPACING, WIDTH / rows),
        flow,
        DEPTH - SLOPE * COLUMNS * SPACING,
        friction_class=np.broadcast_to((y > 0.5 * WIDTH).astype(np.int64), shape).copy(),
        law=np.array([bed_laws.CHEZY, bed_laws.CHEZY]),
        coefficient=np.array(chezy)[:, None],
        effects=effects,
        geometry=panels(bed, rows),
        film=1e-5,
    )
    state = solved(problem)
    assert discharge(problem, state) == pytest.approx(flow, rel=1e-9)
    return faces(problem, state).u[COLUMNS // 2, :, 0]


def errors(chezy, strength, ratio, sizes):
    """Largest difference from the solution [m/s] on grids of so many rows."""
    profile = exact(chezy, strength, ratio)
    flow = DEPTH * (quad(profile, 0.0, 3.0, epsabs=1e-12)[0] + quad(profile, 3.0, 6.0, epsabs=1e-12)[0])
    return [
        float(np.abs(developed(chezy, strength, ratio, flow, rows) - profile(centres(WIDTH, rows))).max())
        for rows in sizes
    ]


@pytest.mark.parametrize(("strength", "ratio"), [(0.3, -1.0), (0.3, 0.5)])
def test_secondary_currents_between_panels_alike(strength, ratio):
    """One roughness: speeds differ by the secondary currents alone."""
    found = errors((SMOOTH, SMOOTH), strength, ratio, (12, 24, 48))
    print(f"k = {strength:g} and {ratio * strength:g}: {shown(found)}")
    assert found[-1] < 6e-4
    assert order(found) > 1.7


@pytest.mark.parametrize(("strength", "ratio"), [(0.0, -1.0), (0.15, -1.0)])
def test_secondary_currents_between_panels_of_two_roughnesses(strength, ratio):
    """Speeds from 0.56 to 1.01 m/s; viscosity jumps where panels meet, which costs an error of first order there."""
    (found,) = errors((SMOOTH, ROUGH), strength, ratio, (48,))
    print(f"k = {strength:g} and {ratio * strength:g}: error {found:.1e} m/s")
    assert found < 1e-3


def test_far_from_where_panels_meet_each_has_its_own_speed():
    """u = C ((1 - k) h S)^(1/2)."""
    speed = np.sqrt(np.array([1.0 - 0.2, 1.0 + 0.2]) * DEPTH * SLOPE) * np.array([SMOOTH, ROUGH])
    assert exact((SMOOTH, ROUGH), 0.2, -1.0)(np.array([0.0, 6.0])) == pytest.approx(speed, rel=2e-2)
