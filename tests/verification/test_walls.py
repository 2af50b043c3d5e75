"""Friction of side walls: uniform flow between them against the balance of momentum, row by row and over all rows.

g h S - k h u^2 - (c_w / dy) r u^2 beside a wall wet over a height r + nu h d2u/dy2 = 0,    du/dy = 0 there.
"""

from dataclasses import replace

import numpy as np
import pytest
from channels import GRAVITY, discharge, make_problem, river, sloping, solved
from scipy.optimize import fsolve

from vegglue.arrays import Array
from vegglue.flow.closures import wall_rates
from vegglue.flow.equations import cell_depths, faces, residual
from vegglue.flow.march import march
from vegglue.flow.problem import ALONG, LEVEL, SMOOTH_WALLS, Problem, SideWalls, crop, take

WIDTH, DEPTH, SLOPE, ROWS = 3.0, 0.5, 0.001, 6
DY = WIDTH / ROWS
COLUMNS, SPACING = 60, 25.0
BED, WALL = GRAVITY / (45.0**2 * DEPTH), GRAVITY / 30.0**2  # k of the bed [1/m] and c_w [-]


def flume(flow: float, viscosity: float, south: float = 1.0, north: float = 1.0) -> Problem:
    """A long flume whose outlet stands at the normal depth DEPTH."""
    walls = SideWalls(np.full(COLUMNS, south), np.full(COLUMNS, north), np.array([WALL / DY]))
    return make_problem(
        sloping(COLUMNS * SPACING, COLUMNS, ROWS, SLOPE), (SPACING, DY), flow, DEPTH - SLOPE * COLUMNS * SPACING,
        (2, 45.0), viscosity=np.array([viscosity]), film=1e-5, walls=walls,
    )  # fmt: skip


def middle(problem: Problem) -> tuple[Array, Array]:
    """u [m/s] and depth [m] across the middle of the reach."""
    state = solved(problem)
    now = faces(problem, state)
    assert now.cell.max() < 2.0 * DEPTH
    return now.u[COLUMNS // 2, :, 0], now.cell[COLUMNS // 2, :, 0]


def balanced(viscosity: float, south: float = 1.0, north: float = 1.0) -> Array:
    """u (row,) [m/s] of normal flow, by hand."""
    drag = np.full(ROWS, BED)
    drag[0] += south * WALL / DY
    drag[-1] += north * WALL / DY

    def left(u: Array) -> Array:
        shear = np.concatenate([[0.0], viscosity * np.diff(u) / DY, [0.0]])
        return GRAVITY * SLOPE - drag * u**2 + np.diff(shear) / DY

    return np.asarray(fsolve(left, np.sqrt(GRAVITY * SLOPE / drag), xtol=1e-12))


def test_well_mixed_water_has_the_mean_drag_of_bed_and_walls() -> None:
    """k h B u^2 + 2 c_w h u^2 = g S h B: 0.761 m/s, where smooth walls leave 1.006."""
    speed = np.sqrt(GRAVITY * SLOPE * WIDTH / (BED * WIDTH + 2.0 * WALL))
    u, depth = middle(flume(speed * DEPTH * WIDTH, 30.0))
    assert u == pytest.approx(speed, rel=1e-3)
    assert depth == pytest.approx(DEPTH, rel=1e-4)


@pytest.mark.parametrize(("viscosity", "south", "north"), [(0.0, 1.0, 1.0), (0.02, 1.0, 1.0), (0.02, 0.0, 1.0)])
def test_each_row_is_in_balance(viscosity: float, south: float, north: float) -> None:
    exact = balanced(viscosity, south, north)
    problem = flume(exact.sum() * DEPTH * DY, viscosity, south, north)
    u, depth = middle(problem)
    assert u == pytest.approx(exact, abs=1e-4)
    assert depth == pytest.approx(DEPTH, abs=1e-4)
    assert discharge(problem, solved(problem)) == pytest.approx(exact.sum() * DEPTH * DY, rel=1e-9)


LOW, RISE = 3, 0.3


def compound(flow: float, viscosity: float, film: float = 1e-5) -> Problem:
    """A flume with the bed RISE higher from the row LOW on, the step rough, its sides smooth."""
    steps = np.zeros((COLUMNS, ROWS - 1))
    steps[:, LOW - 1] = 1.0
    walls = SideWalls(np.zeros(COLUMNS), np.zeros(COLUMNS), np.array([WALL / DY]), steps)
    bed = sloping(COLUMNS * SPACING, COLUMNS, ROWS, SLOPE)
    bed[:, LOW:] += RISE
    return make_problem(
        bed, (SPACING, DY), flow, DEPTH - SLOPE * COLUMNS * SPACING, (2, 45.0), viscosity=np.array([viscosity]),
        film=film, walls=walls, smallest_shear_depth=True,
    )  # fmt: skip


@pytest.mark.parametrize("viscosity", [0.0, 0.02])
def test_a_step_holds_the_water_beside_its_face(viscosity: float) -> None:
    """g h S - c_f u^2 - c_w RISE u^2 / dy beside the step + nu d(h du/dy)/dy = 0, shear over the depth above it: with
    no viscosity 0.687 m/s beside it, where the bed alone leaves 1.006.
    """
    depth = np.where(np.arange(ROWS) < LOW, DEPTH, DEPTH - RISE)
    friction = np.full(ROWS, GRAVITY / 45.0**2)
    friction[LOW - 1] += WALL * RISE / DY

    def left(u: Array) -> Array:
        sheared = np.minimum(depth[1:], depth[:-1])
        shear = np.concatenate([[0.0], viscosity * sheared * np.diff(u) / DY, [0.0]])
        return GRAVITY * SLOPE * depth - friction * u**2 + np.diff(shear) / DY

    exact = np.asarray(fsolve(left, np.sqrt(GRAVITY * SLOPE * depth / friction), xtol=1e-12))
    u, found = middle(compound(float((exact * depth).sum()) * DY, viscosity))
    assert u == pytest.approx(exact, abs=1e-3)
    assert found == pytest.approx(depth, abs=1e-3)


def test_cells_beside_a_step_are_even() -> None:
    """Half of it was taken for a slope within the cells on both its sides: 0.15 m in 0.2 m of water."""
    problem = compound(0.5, 0.0)
    assert problem.bed_half_range == pytest.approx(4.0 * problem.film)
    smooth = replace(problem, walls=SMOOTH_WALLS)
    assert smooth.bed_half_range[:, LOW].max() == pytest.approx(0.25 * RISE)


def test_a_step_keeps_its_wall_where_rows_are_cut_out_beside_it() -> None:
    problem = compound(0.5, 0.0)
    state = solved(problem)
    part = crop(problem, LOW - 1, ROWS)
    rates = dict(wall_rates(part, cell_depths(part, np.ascontiguousarray(state[:, :, LOW - 1 :]))))
    whole = dict(wall_rates(problem, cell_depths(problem, state)))
    assert rates[0] == pytest.approx(whole[LOW - 1])
    depth = cell_depths(problem, state)[COLUMNS // 2, LOW - 1]
    assert whole[LOW - 1][COLUMNS // 2] == pytest.approx(WALL / DY * RISE / depth, rel=1e-2)


def test_a_step_with_the_higher_bed_to_the_south_is_the_same_turned_round() -> None:
    problem = compound(0.5, 0.02)
    turned = replace(
        problem, bed=problem.bed[:, ::-1].copy(), walls=replace(problem.walls, steps=-problem.walls.steps[:, ::-1])
    )
    assert solved(turned)[:, ALONG] == pytest.approx(solved(problem)[:, ALONG, ::-1], abs=1e-5)


def test_marching_ends_in_the_same_flow() -> None:
    problem = flume(0.5, 0.02)
    state = solved(problem)
    disturbed = state.copy()
    disturbed[:, ALONG] *= 1.01
    assert march(problem, disturbed, 20.0, 600) == pytest.approx(state, abs=1e-6)


def test_members_have_walls_of_their_own() -> None:
    problem = flume(0.5, 0.02)
    state = solved(problem)
    both = take(problem, np.array([0, 0]))
    both = replace(both, walls=replace(both.walls, rate=np.array([0.0, 2.0]) * problem.walls.rate))
    found = residual(both, np.repeat(state, 2, axis=3))
    alone = residual(take(both, np.array([1])), state)
    assert np.array_equal(found[..., 1:], alone)
    assert np.array_equal(found[:, ALONG, 1:-1, 0], found[:, ALONG, 1:-1, 1])
    u = state[:, ALONG, 0, 0]
    held = 2.0 * WALL / DY * np.sqrt(u**2 + 1e-6) * u
    assert found[:, ALONG, 0, 1] - found[:, ALONG, 0, 0] == pytest.approx(held, rel=1e-9)


def test_walls_without_friction_change_nothing() -> None:
    smooth = river()
    state = solved(smooth)
    nx = smooth.shape[0]
    none = replace(smooth, walls=SideWalls(np.ones(nx), np.ones(nx), np.zeros(1)))
    assert np.array_equal(residual(none, state), residual(smooth, state))
    assert wall_rates(smooth, cell_depths(smooth, state)) == ()


def test_dry_banks_at_the_side_and_rows_cut_out_have_no_wall() -> None:
    dry = river()
    nx, ny = dry.shape
    dry = replace(dry, walls=SideWalls(np.ones(nx), np.ones(nx), np.ones(1)))
    state = solved(dry)
    assert all(rate.max() < 1e-4 for _, rate in wall_rates(dry, cell_depths(dry, state)))
    part = crop(dry, 2, ny)
    wet = np.ascontiguousarray(state[:, :, 2:])
    wet[:, LEVEL] = 3.0
    (_, south), (_, north) = wall_rates(part, cell_depths(part, wet))
    assert south.max() == 0.0
    assert north == pytest.approx(1.0, rel=1e-6)
