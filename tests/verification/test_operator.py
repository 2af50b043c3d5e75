"""The residual against the differential operator on smooth flow, and what the film does where there is none."""

import numpy as np
import pytest
from channels import GRAVITY, changed, filled, make_problem, order, shown
from scipy.integrate import cumulative_simpson

from vegglue.case.grid import Centreline, Grid, heading_at, on_map
from vegglue.effects import bed_laws
from vegglue.flow.equations import faces, push_momentum, residual, storage
from vegglue.flow.problem import ACROSS, ALONG, LEVEL
from vegglue.flow.problem_setup import bend_of

VISCOSITY, CHEZY, REACH = 0.3, 20.0, (12.0, 9.0)


def level(x, y):
    return 1.2 + 0.10 * np.sin(0.5 * x + 0.3) * np.cos(0.6 * y)


def bed(x, y):
    return 0.15 * np.cos(0.4 * x) * np.sin(0.5 * y + 0.2)


def along(x, y):
    return 0.9 + 0.25 * np.sin(0.5 * x - 0.4 * y + 0.5)


def across(x, y):
    return 0.4 * np.cos(0.45 * x + 0.2) * np.sin(0.7 * y + 0.4)


def slope(function, axis):
    """The derivative along x (0) or y (1), by five points a hundredth of a metre apart."""

    def derivative(x, y):
        at = lambda n: function(x + 0.01 * n, y) if axis == 0 else function(x, y + 0.01 * n)  # noqa: E731
        return (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / 0.12

    return derivative


def depth(x, y):
    return level(x, y) - bed(x, y)


def operator(velocity, axis):
    """U.grad u + g dz/dx + g |U| u / (C^2 h) - [d/dx 2 nu h du/dx + d/dy nu h (du/dy + dv/dx)] / h, v alike."""
    other = across if velocity is along else along

    def stretched(x, y):
        return 2.0 * VISCOSITY * depth(x, y) * slope(velocity, axis)(x, y)

    def sheared(x, y):
        return VISCOSITY * depth(x, y) * (slope(velocity, 1 - axis)(x, y) + slope(other, axis)(x, y))

    def rate(x, y):
        u, v, h = along(x, y), across(x, y), depth(x, y)
        carried = u * slope(velocity, 0)(x, y) + v * slope(velocity, 1)(x, y)
        friction = GRAVITY * np.hypot(u, v) * velocity(x, y) / (CHEZY**2 * h)
        mixed = slope(stretched, axis)(x, y) + slope(sheared, 1 - axis)(x, y)
        return carried + GRAVITY * slope(level, axis)(x, y) + friction - mixed / h

    return rate


def continuity(x, y):
    """d(hu)/dx + d(hv)/dy."""

    def flux(velocity):
        return lambda x, y: depth(x, y) * velocity(x, y)

    return slope(flux(along), 0)(x, y) + slope(flux(across), 1)(x, y)


def places(cells):
    """x and y of levels (centres), v (south faces) and u (east faces), in the order of a state."""
    dx, dy = REACH[0] / cells[0], REACH[1] / cells[1]
    x, y = np.meshgrid(np.arange(cells[0]) * dx, np.arange(cells[1]) * dy, indexing="ij")
    return (x + 0.5 * dx, y + 0.5 * dy), (x + 0.5 * dx, y), (x + dx, y + 0.5 * dy)


def operator_errors(cells):
    """Largest difference of each residual from its operator, four cells away from the boundaries."""
    where = places(cells)
    cell = (REACH[0] / cells[0], REACH[1] / cells[1])
    problem = make_problem(
        bed(*where[LEVEL]), cell, 1.0, 1.2, (bed_laws.CHEZY, CHEZY), viscosity=np.array([VISCOSITY]), film=1e-6
    )
    state = np.stack([function(*at) for function, at in zip((level, across, along), where, strict=True)], axis=1)
    rates = residual(problem, np.ascontiguousarray(state[..., None]))[..., 0]
    exact = (continuity, operator(across, 1), operator(along, 0))
    inner = (slice(4, -4), slice(4, -4))
    return [float(np.abs(rates[:, n] - exact[n](*where[n]))[inner].max()) for n in (LEVEL, ACROSS, ALONG)]


def winding(cells):
    """A grid of the same size along a line that turns left and right, radius 11 m at least."""
    s = np.linspace(0.0, REACH[0], 2401)
    heading = 0.3 * np.sin(0.3 * s)
    on_line = [cumulative_simpson(of(heading), x=s, initial=0.0) for of in (np.cos, np.sin)]
    dx, dy = REACH[0] / cells[0], REACH[1] / cells[1]
    x, y = (np.arange(cells[0]) + 0.5) * dx, (np.arange(cells[1]) + 0.5) * dy - 0.5 * REACH[1]
    return Grid(x, y, dx, dy, Centreline(s, *on_line, heading))


def bent_channel(grid):
    """Places on the map of levels, v and u, the direction of the line there, and the problem."""
    where = [(x, y - 0.5 * REACH[1]) for x, y in places((grid.x.size, grid.y.size))]
    on = [on_map(grid.centreline, *at) for at in where]
    problem = make_problem(
        bed(*on[LEVEL]), (grid.dx, grid.dy), 1.0, 1.2, (bed_laws.CHEZY, CHEZY), viscosity=np.array([VISCOSITY]),
        film=1e-6, bend=bend_of(grid),
    )  # fmt: skip
    return on, [heading_at(grid.centreline, x) for x, _ in where], problem


def to_the_line(on, turned, of_u, of_v):
    """A vector of the map across the line at the places of v, and along it at those of u."""
    side = -np.sin(turned[ACROSS]) * of_u(*on[ACROSS]) + np.cos(turned[ACROSS]) * of_v(*on[ACROSS])
    ahead = np.cos(turned[ALONG]) * of_u(*on[ALONG]) + np.sin(turned[ALONG]) * of_v(*on[ALONG])
    return side, ahead


def bent_errors(cells):
    """Largest difference of each residual on the winding grid from the operators of the map, which know no bend."""
    grid = winding(cells)
    on, turned, problem = bent_channel(grid)
    state = np.stack([level(*on[LEVEL]), *to_the_line(on, turned, along, across)], axis=1)
    rates = residual(problem, np.ascontiguousarray(state[..., None]))[..., 0]
    exact = (continuity(*on[LEVEL]), *to_the_line(on, turned, operator(along, 0), operator(across, 1)))
    inner = (slice(4, -4), slice(4, -4))
    return [float(np.abs(rates[:, n] - exact[n])[inner].max()) for n in (LEVEL, ACROSS, ALONG)]


@pytest.mark.parametrize(("errors_of", "least"), [(operator_errors, 6e-5), (bent_errors, 3e-4)])
def test_residual_converges_to_the_operator(errors_of, least):
    """Measured orders 2.0 for all three equations, with cells from 0.5 x 0.375 m down to 0.0625 x 0.047 m; on a bent
    grid 1.8 to 2.0 to the operator of the map: every metric term, those of viscosity too.
    """
    errors = np.array([errors_of((24 * n, 24 * n)) for n in (1, 2, 4, 8)])
    for number, name in ((LEVEL, "continuity"), (ACROSS, "momentum across"), (ALONG, "momentum along")):
        print(f"{name}: {shown(list(errors[:, number]))}")
        assert order(list(errors[:, number])) > 1.8
    assert (errors[-1] < least).all()


def flux_errors(cells):
    """The same of the divergence of momentum fluxes h U U per depth, which effects may add."""
    grid = winding(cells)
    on, turned, problem = bent_channel(grid)
    theta, (x, y) = turned[LEVEL], on[LEVEL]
    u = np.cos(theta) * along(x, y) + np.sin(theta) * across(x, y)
    v = np.cos(theta) * across(x, y) - np.sin(theta) * along(x, y)
    h = np.ascontiguousarray(depth(x, y)[..., None])
    momentum = {"xx": h[..., 0] * u * u, "xy": h[..., 0] * u * v, "yy": h[..., 0] * v * v}
    out = np.zeros((cells[0], 3, cells[1], 1))
    push_momentum(out, {name: np.ascontiguousarray(flux[..., None]) for name, flux in momentum.items()}, h, problem)

    def spread(velocity):
        def flux(other):
            return lambda x, y: depth(x, y) * velocity(x, y) * other(x, y)

        return lambda x, y: (slope(flux(along), 0)(x, y) + slope(flux(across), 1)(x, y)) / depth(x, y)

    exact = to_the_line(on, turned, spread(along), spread(across))
    inner = (slice(4, -4), slice(4, -4))
    return [float(np.abs(out[:, n, :, 0] - exact[n - 1])[inner].max()) for n in (ACROSS, ALONG)]


def test_momentum_fluxes_on_a_bent_grid_converge_to_those_of_the_map():
    errors = np.array([flux_errors((24 * n, 24 * n)) for n in (1, 2, 4, 8)])
    for number, name in ((0, "across"), (1, "along")):
        print(f"fluxes {name}: {shown(list(errors[:, number]))}")
        assert order(list(errors[:, number])) > 1.8


@pytest.mark.parametrize(("mean", "part", "least", "most"), [(5.0, 1e-3, 2.8, 3.2), (-1.0, 0.1, 0.9, 1.2)])
def test_advection_is_upwind(mean, part, least, most):
    """Without depth to vary: u du/dx of a fine sine, to third order, measured 2.99; of water that flows back, whose
    upwind value is the one downstream, to first order and without instability.
    """
    errors = []
    for cells in (40, 80, 160):
        dx = 10.0 / cells
        problem = make_problem(np.zeros((cells, 4)), (dx, 1.0), 1.0, 1.0, (bed_laws.CHEZY, 1e9), film=1e-9)
        state = filled(problem, 1.0)
        x = (np.arange(cells) + 1.0) * dx
        u, rise = mean + part * np.sin(2.0 * x), 2.0 * part * np.cos(2.0 * x)
        state[:, ALONG] = u[:, None, None]
        errors.append(float(np.abs(residual(problem, state)[4:-4, ALONG, 1, 0] - (u * rise)[4:-4]).max()))
    print(f"advection of a sine: {shown(errors)}")
    assert least < order(errors) < most


WIGGLES = [("along", 0), ("along", 1), ("across", 0), ("across", 1)]


@pytest.mark.parametrize("drift", [0.5, -0.5], ids=["northward", "southward"])
@pytest.mark.parametrize(("velocity", "axis"), WIGGLES)
def test_advection_damps_wiggles(velocity, axis, drift):
    """From the right side: a wiggle from cell to cell loses energy, whichever way it is carried."""
    problem = make_problem(np.zeros((20, 18)), (1.0, 1.0), 1.0, 1.0, (bed_laws.CHEZY, 1e9), film=1e-9)
    calm = filled(problem, 1.0)
    calm[:, ALONG], calm[:, ACROSS, 1:] = 1.0, drift
    wiggle = np.zeros_like(calm)
    wiggle[:, ALONG if velocity == "along" else ACROSS] = 1e-3 * (-1.0) ** np.indices((20, 18))[axis][..., None]
    wiggle[:, ACROSS, 0] = 0.0
    growth = wiggle * (residual(problem, calm) - residual(problem, calm + wiggle))
    assert growth[5:-5, :, 5:-5].sum() < -1e-6


def film_depth(above, film):
    """The depth that the model gives, over an even bed, to a level so far above (or below) it."""
    problem = make_problem(np.zeros((6, 4)), (1.0, 1.0), 0.0, above, film=film)
    now = faces(problem, filled(problem, above))
    assert all(part == pytest.approx(now.cell.flat[0], rel=1e-14) for part in (now.cell, now.face_x, now.face_y))
    assert now.corner[1:-1, 1:-1] == pytest.approx(max(above, 0.0), rel=1e-12, abs=0.25 * film * (abs(above) < film))
    return float(now.cell.flat[0])


def test_film_adds_nothing_to_water_and_stays_on_land():
    """h = d in water, f / 10 on dry land, where the cell wets from 4 f below its level to 4 f above."""
    film = 0.002
    for above in (0.009, 0.1, 1.0):
        assert film_depth(above, film) == pytest.approx(above, rel=1e-12)
    for below in (-0.008, -0.1, -10.0):
        assert film_depth(below, film) == pytest.approx(0.1 * film, rel=1e-12)
    bumps = np.linspace(-4.0 * film, 4.0 * film, 100001)
    for above in (-0.006, -0.001, 0.0, 0.0002, 0.003, 0.007):
        water = np.maximum(above - 0.1 * film - bumps, 0.0).mean()
        assert film_depth(above, film) == pytest.approx(0.1 * film + water, abs=1e-7)


def test_film_never_shrinks_as_the_level_rises():
    depths = np.array([film_depth(above, 0.002) for above in np.linspace(-0.1, 0.1, 81)])
    assert (np.diff(depths) >= 0.0).all()
    assert (np.diff(depths)[40:] > 0.0).all()
    assert depths.min() > 0.0


@pytest.mark.parametrize("slopes", [(0.0, 0.5), (0.3, 0.0), (0.2, -0.2)])
def test_a_cell_on_a_slope_holds_the_water_on_its_slope(slopes):
    """Cells that the waterline crosses: h is the mean depth over a bed that rises across the flow, even along it."""
    x, y = np.meshgrid(np.arange(12) + 0.5, np.arange(10) + 0.5, indexing="ij")
    bed = slopes[0] * x + slopes[1] * y
    inside = slopes[1] * ((np.arange(2000) + 0.5) / 2000 - 0.5)
    for level in bed.mean() + np.array([-0.08, 0.0, 0.03, 0.11]):
        problem = make_problem(bed, (1.0, 1.0), 0.0, float(level), film=1e-7)
        exact = np.maximum(level - bed[..., None] - inside, 0.0).mean(axis=2)
        assert faces(problem, filled(problem, float(level))).cell[..., 0] == pytest.approx(exact, abs=1e-6)


def test_storage_is_the_derivative_of_depth():
    """dh/dz_s is the share of a cell that is wet: 0 on land, 1 in water, between them where the waterline crosses."""
    bed = 0.3 * np.random.default_rng(8).standard_normal((20, 16))
    problem = make_problem(bed, (1.0, 1.0), 0.0, 0.1, film=0.002)
    lower, upper = (faces(problem, filled(problem, 0.1 + step)).cell for step in (-1e-6, 1e-6))
    share = storage(problem, np.full((20, 16, 1), 0.1))
    assert share == pytest.approx((upper - lower) / 2e-6, abs=1e-4)
    assert share.min() == 0.0
    assert share.max() == 1.0
    assert ((share > 0.05) & (share < 0.95)).any()


@pytest.mark.parametrize(("above", "share"), [(0.2, 1.0), (0.0195, 1.0), (0.0015, None), (-0.5, 0.0)])
def test_film_is_not_carried(above, share):
    """Of u du/dx the film keeps nothing and water everything: h^4 / (h^4 + (2 f)^4), 1e-4 off at 20 f."""
    film = 0.001
    problem = make_problem(np.zeros((12, 4)), (1.0, 1.0), 0.0, above, (bed_laws.CHEZY, 1e9), film=film)
    problem = changed(problem, inflows=())
    state = filled(problem, above)
    state[:, ALONG] = (1.0 + 0.1 * np.arange(12))[:, None, None]
    kept = residual(problem, state)[3:-3, ALONG] / (0.1 * state[3:-3, ALONG])
    h = film_depth(above, film)
    assert kept == pytest.approx(h**4 / (h**4 + (2.0 * film) ** 4), abs=1e-6)
    if share is not None:
        assert kept == pytest.approx(share, abs=2e-4)
