"""The Jacobian of one member by coloured differences of its residual, and its factors, which serve neighbours too."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Single
from vegglue.flow import block_elimination, thin_water
from vegglue.flow.chord_equations import slope_of_friction, thickness
from vegglue.flow.equations import cell_depths, residual
from vegglue.flow.problem import Problem, take
from vegglue.flow.shared_inflow import shared_inflows, sharing_at, with_kept_shares

# Step [m, m/s] of the coloured differences: chosen, not measured; larger ones lose the slope near a waterline, smaller
# ones digits of the residual. Factors only lead to the root, so that no result hangs on it.
COLOUR_STEP = 1e-6
# Colours disturbed together [-]: 15, as many as there are colours in a quarter, take a quarter longer than 16.
COLOUR_LANES = 16


@dataclass(frozen=True)
class Factors:
    """The eliminated Jacobian of one member: J^-1 costs three products a column.

    Beside it what chord steps need of the state it was made at, see `thin_water`: slopes of friction [1/s], depths of
    faces [m] and how velocities answer to levels there [1/s].
    """

    columns: Single
    far: Single
    slope: Array
    thick: Array
    answer: Array

    def solve(self, right: Array) -> Array:
        """J^-1 right, (nx, 3, ny, m)."""
        return solved(self.columns, self.far, right)

    def step(self, rates: Array) -> Single:
        """-J^-1 R in the unknowns of chord steps (nx, 3, ny, m): levels, velocities times rho where water is thin."""
        nx, _, ny, m = rates.shape
        with np.errstate(over="ignore"):  # of a member that runs away, told by its correction
            work = np.multiply(rates, -1.0, dtype=np.float32, casting="same_kind")
        block_elimination.solve(self.columns, self.far, work.reshape(nx, 3 * ny, m))
        thin_water.tilt(work, self.answer)
        return work


def eliminate(columns: Single, far: Single) -> None:
    """Factors in place; of a Jacobian without an inverse no numbers, and no correction by them is taken for one."""
    try:
        block_elimination.factor(columns, far)
    except np.linalg.LinAlgError:  # compiled loops raise; one member fails by it, not all that are solved beside it
        columns.fill(np.nan)


def solved(columns: Single, far: Single, right: Array) -> Array:
    """J^-1 right, (nx, 3, ny, m), of factors."""
    nx, _, ny, m = right.shape
    with np.errstate(over="ignore"):  # of a member that runs away, told by its correction
        work = right.astype(np.float32).reshape(nx, 3 * ny, m)
    block_elimination.solve(columns, far, work)
    return work.reshape(right.shape).astype(np.float64)


def jacobian(problem: Problem, state: Array) -> tuple[Single, Single]:
    """J = dR/dstate of one member by coloured differences: blocks (nx, 3, n, n) and far diagonal (nx, n), n = 3 ny.

    Single precision is enough: the factors only lead to the root, the residual in double precision says where it is.
    """
    nx, _, ny, _ = state.shape
    base, depth = residual(problem, state)[..., 0], cell_depths(problem, state)
    columns, far = np.zeros((nx, 3, 3 * ny, 3 * ny), np.float32), np.zeros((nx, 3 * ny), np.float32)
    colours = np.array(list(np.ndindex(3, block_elimination.ALONG_PERIOD, block_elimination.ACROSS_PERIOD)))
    many = take(problem, np.zeros(COLOUR_LANES, dtype=np.int64))
    lanes = np.empty((nx, 3, ny, COLOUR_LANES))
    for group in np.split(colours, range(COLOUR_LANES, len(colours), COLOUR_LANES)):
        lanes[...] = state
        for lane, (kind, column, row) in enumerate(group):
            lanes[column :: block_elimination.ALONG_PERIOD, kind, row :: block_elimination.ACROSS_PERIOD, lane] += (
                COLOUR_STEP
            )
        rates = residual(with_kept_shares(many, depth, cell_depths(many, lanes)), lanes)
        block_elimination.collect(columns, far, base, rates, group, COLOUR_STEP)
    _add_sharing(columns, problem, state)
    return columns, far


def _add_sharing(columns: Single, problem: Problem, state: Array) -> None:
    """- dR/d ln Q (d ln W/dx)' of inflows shared by depth, see `shared_inflow`, in the blocks (nx, 3, n, n).

    All of it is there for an inflow from the west. Through a side, what blocks cannot hold is put down to levels that
    they can, see `column_held`.
    """
    ny = state.shape[2]
    for inflow in shared_inflows(problem):
        one = sharing_at(problem, state, inflow)
        for i in np.flatnonzero(one.answer.any(axis=(1, 2))):
            of_levels = np.zeros((3, ny))
            np.add.at(of_levels, (column_held(one.column, int(i)) - i + 1, one.row), one.slope)
            columns[i, :, :, :ny] -= one.answer[i].reshape(-1)[:, None] * of_levels[:, None]


def column_held(column: NDArray[np.int64], block: int) -> NDArray[np.int64]:
    """The nearest to a column among those that a row block is coupled to."""
    return np.clip(column, block - 1, block + 1)


def factors(problem: Problem, state: Array) -> Factors:
    """Factors of J at one state."""
    columns, far = jacobian(problem, state)
    eliminate(columns, far)
    return Factors(columns, far, slope_of_friction(problem, state), *thickness(problem, state))
