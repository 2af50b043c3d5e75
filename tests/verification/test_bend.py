"""Flow in circular bends against closed forms: a free vortex without friction, and developed flow with it."""

from dataclasses import replace

import numpy as np
import pytest
from channels import GRAVITY, changed, discharge, even_geometry, make_problem, shown, solved
from scipy.optimize import brentq

from vegglue.arrays import Array
from vegglue.case.grid import Grid, cell_stretch, centreline_of, curvature_of
from vegglue.case.site_schema import CentrelineShape, Stretch
from vegglue.effects.active_effect import ActiveEffect
from vegglue.effects.bed_laws import CHEZY
from vegglue.effects.exchange import curvature
from vegglue.effects.library import library
from vegglue.effects.surroundings import Cells
from vegglue.flow.equations import faces
from vegglue.flow.march import march
from vegglue.flow.problem import ACROSS, ALONG, InflowSegment, Problem
from vegglue.flow.problem_setup import bend_of

WIDTH, RADIUS, LEVEL_OUT, FLOW = 4.0, 16.0, 0.5, 1.6


def bent_grid(length: float, cells: tuple[int, int], parts: tuple[Stretch, ...], width: float = WIDTH) -> Grid:
    dx, dy = length / cells[0], width / cells[1]
    x, y = (np.arange(cells[0]) + 0.5) * dx, (np.arange(cells[1]) + 0.5) * dy - 0.5 * width
    return Grid(x, y, dx, dy, centreline_of(CentrelineShape(parts=parts)))


def quarter(rows: int, turn: float = 90.0) -> tuple[Grid, Problem]:
    """A level flume: 12 m straight, a bend of 90 degrees with a radius of 16 m, 12 m straight; next to no friction."""
    arc = Stretch(radius=RADIUS, angle=turn)
    length = 24.0 + arc.run
    grid = bent_grid(length, (12 * rows, rows), (Stretch(length=12.0), arc, Stretch(length=12.0)))
    flat = np.zeros((12 * rows, rows))
    return grid, make_problem(flat, (grid.dx, grid.dy), FLOW, LEVEL_OUT, (CHEZY, 1e4), film=1e-6, bend=bend_of(grid))


def free_vortex(stretch: Array) -> tuple[Array, Array]:
    """u = c / J and z_s = H - u^2 / 2g, H that of the outlet and c by Q = sum of u h dy over many parts."""
    head = LEVEL_OUT + (FLOW / (WIDTH * LEVEL_OUT)) ** 2 / (2.0 * GRAVITY)
    fine = 1.0 - ((np.arange(4000) + 0.5) / 4000 - 0.5) * WIDTH / RADIUS

    def missing(c: float) -> float:
        return float((c / fine * (head - (c / fine) ** 2 / (2.0 * GRAVITY))).mean() * WIDTH - FLOW)

    u = brentq(missing, 0.1, 1.5, xtol=1e-14) / stretch
    return u, head - u**2 / (2.0 * GRAVITY)


def vortex_errors(rows: int) -> tuple[float, float]:
    """Largest errors of u [m/s] and of the level [m] across the middle of the bend."""
    grid, problem = quarter(rows)
    state = solved(problem)
    now, i = faces(problem, state), grid.x.size // 2
    assert discharge(problem, state) == pytest.approx(FLOW, rel=1e-9)
    u, level = free_vortex(0.5 * (cell_stretch(grid)[i - 1] + cell_stretch(grid)[i]))
    return float(np.abs(now.u[i, :, 0] - u).max()), float(
        np.abs(0.5 * (now.level[i - 1, :, 0] + now.level[i, :, 0]) - level).max()
    )


@pytest.mark.slow
def test_a_bend_of_90_degrees_holds_a_free_vortex() -> None:
    """u from 0.70 to 0.92 m/s. First order at the walls, where values upwind are held, and small."""
    errors = np.array([vortex_errors(rows) for rows in (6, 12, 24)])
    print(f"u: {shown(list(errors[:, 0]))}; level: {shown(list(errors[:, 1]))}")
    assert (errors[:, 0] < [3.3e-4, 1.6e-4, 8e-5]).all()
    assert (errors[:, 1] < [1e-5, 2e-6, 1e-6]).all()


def test_a_bend_to_the_right_is_the_mirror_of_one_to_the_left() -> None:
    (_, left), (_, right) = quarter(6), quarter(6, -90.0)
    state, mirrored = solved(left), solved(right)
    assert mirrored[:, ALONG] == pytest.approx(state[:, ALONG, ::-1], abs=1e-9)
    assert mirrored[:, ACROSS, 1:] == pytest.approx(-state[:, ACROSS, :0:-1], abs=1e-9)


def test_marching_ends_in_the_same_flow() -> None:
    _, problem = quarter(6)
    problem = changed(problem, coefficient=np.array([[15.0]]))
    state = solved(problem)
    disturbed = state.copy()
    disturbed[:, ALONG] *= 1.01
    assert march(problem, disturbed, 1.0, 800) == pytest.approx(state, abs=1e-6)


ROUGHNESS, SLOPE, REACH, BROAD, ROUND = 40.0, 0.001, 2400.0, 8.0, 20.0


def developed(y: Array) -> tuple[Array, Array]:
    """u = C (h S / J)^(1/2) and h = h_0 exp(-(C^2 S / g) (1/J - 1)) of flow that no longer changes along a bend.

    Along: g S / J = g u^2 / (C^2 h). Across: g dh/dy = -(kappa / J) u^2, with d(1/J)/dy = kappa / J^2.
    """
    stretch = 1.0 - y / ROUND
    depth = 0.5 * np.exp(-(ROUGHNESS**2) * SLOPE / GRAVITY * (1.0 / stretch - 1.0))
    return ROUGHNESS * np.sqrt(depth * SLOPE / stretch), depth


def developed_errors(rows: int) -> tuple[float, float]:
    """Largest errors of u [m/s] and depth [m] half way round a bend that goes on and on."""
    turn = Stretch(radius=ROUND, angle=float(np.degrees(REACH / ROUND)))
    grid = bent_grid(REACH, (120, rows), (turn,), BROAD)
    bed = np.repeat(-SLOPE * grid.x[:, None], rows, axis=1)
    u, depth = developed(((np.arange(4000) + 0.5) / 4000 - 0.5) * BROAD)
    problem = make_problem(
        bed, (grid.dx, grid.dy), float((u * depth).mean()) * BROAD, 0.5 - SLOPE * REACH, (CHEZY, ROUGHNESS), film=1e-6,
        bend=bend_of(grid),
    )  # fmt: skip
    now, (u, depth) = faces(problem, solved(problem)), developed(grid.y)
    return float(np.abs(now.u[60, :, 0] - u).max()), float(np.abs(now.cell[60, :, 0] - depth).max())


def test_developed_flow_in_a_bend() -> None:
    """u from 0.83 to 0.97 m/s, depth from 0.513 to 0.482 m."""
    errors = np.array([developed_errors(rows) for rows in (4, 8, 16)])
    print(f"u: {shown(list(errors[:, 0]))}; depth: {shown(list(errors[:, 1]))}")
    assert (errors[:, 0] < [2e-5, 5e-6, 2e-6]).all()
    assert (errors[:, 1] < [2.2e-5, 7e-6, 3e-6]).all()


def test_a_sill_and_water_from_the_side_keep_their_mass() -> None:
    """What enters through the inner or the outer side of a bend leaves at the outlet."""
    for side in ("south", "north"):
        _, problem = quarter(6)
        nx = problem.shape[0]
        bed = 0.05 * np.exp(-((np.arange(nx) - nx / 2.0) ** 2) / 20.0)[:, None] * np.ones(6)
        joins = InflowSegment(side, 30, 36, np.array([0.2]), along=0.5)
        problem = changed(
            problem, bed=bed, coefficient=np.array([[30.0]]), inflows=(*problem.boundaries.inflows, joins)
        )
        through = discharge(problem, solved(problem))[:, 0]
        assert through[:31] == pytest.approx(FLOW, rel=1e-9)
        assert through[36:] == pytest.approx(FLOW + 0.2, rel=1e-9)


def test_effects_feel_the_bend_of_the_grid() -> None:
    """Water that follows the grid turns by kappa / J, so that helical flow carries it outward."""
    grid, problem = quarter(6)
    nx, ny = problem.shape
    turning = curvature_of(grid)[:, None, None] / cell_stretch(grid)[..., None]
    geometry = replace(
        even_geometry(problem.bed, np.zeros((nx, ny)), (grid.dx, grid.dy)), stretch=cell_stretch(grid)[..., None],
        turning=turning,
    )  # fmt: skip
    u, h = np.ones((nx, ny, 1)), 0.5 * np.ones((nx, ny, 1))
    cells = Cells(geometry, h, h, u, 0.0 * u, 0.01 * u, 0.01 * u, np.zeros(1), np.zeros((0, 0, 0)))
    r = h * turning / (1.0 + 0.0025) ** 1.5
    assert curvature(cells) == pytest.approx(r / np.sqrt(1.0 + 4.0 * r**2), abs=1e-12)
    rough = changed(problem, coefficient=np.array([[30.0]]), geometry=geometry)
    spiral = replace(rough, effects=(ActiveEffect(library()["helical_flow"], {"share": np.ones(1)}),))
    before, after = (faces(one, solved(one)).u[nx * 2 // 3, :, 0] for one in (rough, spiral))
    assert (after - before)[:2].mean() > 0.005, "the outer rows of a bend to the left"
    assert (after - before)[-2:].mean() < -0.005
