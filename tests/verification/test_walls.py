"""Friction of side walls: uniform flow between them against the balance of momentum, row by row and over all rows.

g h S - k h u^2 - (c_w / dy) h u^2 beside a wall + nu h d2u/dy2 = 0,    du/dy = 0 at the walls.
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
from vegglue.flow.problem import ALONG, LEVEL, Problem, SideWalls, crop, take

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
