"""The Jacobian of one member by coloured differences of its residual, and its factors, which serve neighbours too.

Where an inflow shares its discharge over cells by depth, each cell reaches all others of that inflow:

    q_c = Q w_c / W,    W = sum_c w_c b_c,    dR = (dR at fixed Q / W) - dR/d ln Q  d ln W

w_c is the weight of a cell, b_c its width, see `equations.side_fluxes`. All else reaches a few cells of a residual R;
this is a product of two vectors for each inflow.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Single
from vegglue.flow import block_elimination
from vegglue.flow.block_elimination import ACROSS_PERIOD, ALONG_PERIOD
from vegglue.flow.equations import cell_depths, inflow_parts, residual
from vegglue.flow.problem import LEVEL, InflowSegment, Problem, take
from vegglue.flow.thin_water import slope_of_friction, thickness, tilt

# Step [m, m/s] of the coloured differences: chosen, not measured; larger ones lose the slope near a waterline, smaller
# ones digits of the residual. Factors only lead to the root, so that no result hangs on it.
COLOUR_STEP = 1e-6
# Colours disturbed together [-]: 15, as many as there are colours in a quarter, take a quarter longer than 16.
COLOUR_SLOTS = 16
# Step of ln Q in a central difference [-]: chosen, not measured; small against 1 and large against rounding.
DISCHARGE_STEP = 1e-5
# Step of levels [m] in the difference of ln W: chosen, as that of the Jacobian.
RAISE = 1e-6


@dataclass(frozen=True)
class Sharing:
    """How levels act through W, -(dR/d ln Q) (d ln W/dz)': column and row of each cell of the inflow (cell,), slopes d
    ln W/dz of their levels (cell,) [1/m], and answer dR/d ln Q (nx, 3, ny) [m/s, m/s2].
    """

    column: NDArray[np.int64]
    row: NDArray[np.int64]
    slope: Array
    answer: Array


def sharing_at(problem: Problem, state: Array, inflow: InflowSegment) -> Sharing:
    """Of one inflow at a state (nx, 3, ny, 1) of one member."""
    raised = state.copy()
    raised[:, LEVEL] += RAISE
    before, after = cell_depths(problem, state), cell_depths(problem, raised)
    slope = changes_of_whole(problem, inflow, before, after)[:, 0] / RAISE
    return Sharing(*cells_of(problem, inflow), slope, answer_to_discharge(problem, state, inflow))


def shared_inflows(problem: Problem) -> tuple[InflowSegment, ...]:
    """Those that share their discharge by depth."""
    return tuple(inflow for inflow in problem.boundaries.inflows if inflow.by_conveyance)


def cells_of(problem: Problem, inflow: InflowSegment) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Column and row of each cell that an inflow enters by, (cell,) each."""
    along, none = np.arange(inflow.start, inflow.stop), np.zeros(inflow.stop - inflow.start, dtype=np.int64)
    if inflow.side == "west":
        return none, along
    return along, none if inflow.side == "south" else none + problem.shape[1] - 1


def changes_of_whole(problem: Problem, inflow: InflowSegment, before: Array, after: Array) -> Array:
    """By how much ln W changes through each cell of an inflow, (cell, m), from depths (nx, ny, 1) to (nx, ny, m) [m];
    to first order.
    """
    at = cells_of(problem, inflow)
    parts = inflow_parts(problem, inflow, before[at])
    return np.asarray((inflow_parts(problem, inflow, after[at]) - parts) / parts.sum(axis=0))


def with_kept_shares(problem: Problem, before: Array, after: Array) -> Problem:
    """A problem at depths `after` (nx, ny, m) [m] with discharges Q W_after / W_before: Q / W is that at `before`
    (nx, ny, 1).
    """

    def kept(inflow: InflowSegment) -> InflowSegment:
        at = cells_of(problem, inflow)
        grown = [inflow_parts(problem, inflow, depth[at]).sum(axis=0) for depth in (before, after)]
        return replace(inflow, discharge=inflow.discharge * grown[1] / grown[0])

    inflows = tuple(kept(inflow) if inflow.by_conveyance else inflow for inflow in problem.boundaries.inflows)
    return replace(problem, boundaries=replace(problem.boundaries, inflows=inflows))


def answer_to_discharge(problem: Problem, state: Array, inflow: InflowSegment) -> Array:
    """dR/d ln Q of one member (nx, 3, ny) [m/s, m/s2], Q the discharge of one of its inflows."""
    step = DISCHARGE_STEP * np.array([1.0, -1.0])
    both = take(problem, np.zeros(2, dtype=np.int64))
    inflows = tuple(
        replace(now, discharge=now.discharge * (1.0 + step)) if one is inflow else now
        for one, now in zip(problem.boundaries.inflows, both.boundaries.inflows, strict=True)
    )
    both = replace(both, boundaries=replace(both.boundaries, inflows=inflows))
    ends = residual(both, np.repeat(state, 2, axis=3))
    return np.asarray((ends[..., 0] - ends[..., 1]) / (2.0 * DISCHARGE_STEP))


@dataclass(frozen=True)
class Factors:
    """The eliminated Jacobian of one member, and what chord steps need of the state it was made at.

    Parameters
    ----------
    columns, far
        As `block_elimination.factor` leaves them: J^-1 costs three products a column.
    slope, thick, answer
        Slopes of friction (nx, 3, ny, 1) [1/s], depths of faces [m] and changes of velocities with levels [1/s] there
        (nx, 3, ny), see `thin_water`.
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
        with np.errstate(over="ignore"):  # of a member that runs away, known by its correction
            work = np.multiply(rates, -1.0, dtype=np.float32, casting="same_kind")
        block_elimination.solve(self.columns, self.far, work.reshape(nx, 3 * ny, m))
        tilt(work, self.answer)
        return work


def eliminate(columns: Single, far: Single) -> None:
    """Factors in place; NaN if there is no inverse, so that no correction by them is accepted."""
    try:
        block_elimination.factor(columns, far)
    except np.linalg.LinAlgError:  # compiled loops raise; one member fails by it, not all that are solved beside it
        columns.fill(np.nan)


def solved(columns: Single, far: Single, right: Array) -> Array:
    """J^-1 right, (nx, 3, ny, m), of factors."""
    nx, _, ny, m = right.shape
    with np.errstate(over="ignore"):  # of a member that runs away, known by its correction
        work = right.astype(np.float32).reshape(nx, 3 * ny, m)
    block_elimination.solve(columns, far, work)
    return work.reshape(right.shape).astype(np.float64)


def jacobian(problem: Problem, state: Array) -> tuple[Single, Single]:
    """J = dR/dstate of one member by coloured differences.

    Single precision is enough: the factors only lead to the root; the residual in double precision decides what it is.

    Parameters
    ----------
    problem, state
        Of one member; state (nx, 3, ny, 1).

    Returns
    -------
    blocks, far
        Columns i - 1, i and i + 1 of row block i (nx, 3, n, n), n = 3 ny, and the diagonal of column i - 2 (nx, n).
    """
    nx, _, ny, _ = state.shape
    base, depth = residual(problem, state)[..., 0], cell_depths(problem, state)
    columns, far = np.zeros((nx, 3, 3 * ny, 3 * ny), np.float32), np.zeros((nx, 3 * ny), np.float32)
    colours = np.array(list(np.ndindex(3, ALONG_PERIOD, ACROSS_PERIOD)))
    many = take(problem, np.zeros(COLOUR_SLOTS, dtype=np.int64))
    slots = np.empty((nx, 3, ny, COLOUR_SLOTS))
    for group in np.split(colours, range(COLOUR_SLOTS, len(colours), COLOUR_SLOTS)):
        slots[...] = state
        for slot, (kind, column, row) in enumerate(group):
            slots[column::ALONG_PERIOD, kind, row::ACROSS_PERIOD, slot] += COLOUR_STEP
        rates = residual(with_kept_shares(many, depth, cell_depths(many, slots)), slots)
        block_elimination.collect(columns, far, base, rates, group, COLOUR_STEP)
    # - dR/d ln Q (d ln W/dx)' of inflows shared by depth. All of it is there for an inflow from the west; through a
    # side, what blocks cannot hold is put down to levels that they can.
    for inflow in shared_inflows(problem):
        one = sharing_at(problem, state, inflow)
        for i in np.flatnonzero(one.answer.any(axis=(1, 2))):
            of_levels = np.zeros((3, ny))
            np.add.at(of_levels, (column_held(one.column, int(i)) - i + 1, one.row), one.slope)
            columns[i, :, :, :ny] -= one.answer[i].reshape(-1)[:, None] * of_levels[:, None]
    return columns, far


def column_held(column: NDArray[np.int64], block: int) -> NDArray[np.int64]:
    """The nearest to a column among those that a row block is coupled to."""
    return np.clip(column, block - 1, block + 1)


def factors(problem: Problem, state: Array) -> Factors:
    """Factors of J at a state (nx, 3, ny, 1) of one member."""
    columns, far = jacobian(problem, state)
    eliminate(columns, far)
    return Factors(columns, far, slope_of_friction(problem, state), *thickness(problem, state))
