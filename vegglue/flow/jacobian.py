"""The Jacobian of one member by coloured differences of its residual, and its factors, which serve neighbours too.

Where an inflow shares its discharge over cells by depth, each cell reaches all others of that inflow:

    q_c = Q w_c / W,    W = sum_c w_c b_c,    dR = (dR at fixed Q / W) - dR/d ln Q  d ln W

w_c is the weight of a cell, b_c its width, see `equations.side_fluxes`. All else reaches a few cells of a residual R;
this is a product of two vectors for each inflow.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Single
from vegglue.case.size_limits import WIDE_FROM
from vegglue.flow import block_elimination
from vegglue.flow.block_elimination import ACROSS_PERIOD, ALONG_PERIOD
from vegglue.flow.equations import cell_depths, inflow_parts, residual
from vegglue.flow.nested_dissection import SparseFactors, collect_stencil, sparse_factors
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
    """How levels act through W, -(dR/d ln Q) (d ln W/dz)', of one inflow.

    Attributes
    ----------
    column, row
        Of each of its cells (cell,).
    slope
        d ln W/dz of their levels (cell,) [1/m].
    answer
        dR/d ln Q (nx, 3, ny) [m/s, m/s2].
    """

    column: NDArray[np.int64]
    row: NDArray[np.int64]
    slope: Array
    answer: Array


def sharing_at(problem: Problem, state: Array, inflow: InflowSegment) -> Sharing:
    """-(dR/d ln Q) (d ln W/dz)' of one inflow at a state of one member.

    Parameters
    ----------
    state : (nx, 3, ny, 1)
    """
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
    """d ln W through each cell of an inflow, (cell, m), to first order.

    Parameters
    ----------
    before, after : (nx, ny, 1), (nx, ny, m) [m]
        Depths.
    """
    at = cells_of(problem, inflow)
    parts = inflow_parts(problem, inflow, before[at])
    return np.asarray((inflow_parts(problem, inflow, after[at]) - parts) / parts.sum(axis=0))


def with_kept_shares(problem: Problem, before: Array, after: Array) -> Problem:
    """Q -> Q W_after / W_before in inflows that share by depth, so that Q / W stays that of the depths before.

    Parameters
    ----------
    problem : Problem
        Of m members.
    before, after : (nx, ny, 1), (nx, ny, m) [m]
        Depths.
    """

    def kept(inflow: InflowSegment) -> InflowSegment:
        at = cells_of(problem, inflow)
        grown = [inflow_parts(problem, inflow, depth[at]).sum(axis=0) for depth in (before, after)]
        return replace(inflow, discharge=inflow.discharge * grown[1] / grown[0])

    inflows = tuple(kept(inflow) if inflow.by_conveyance else inflow for inflow in problem.boundaries.inflows)
    return replace(problem, boundaries=replace(problem.boundaries, inflows=inflows))


def answer_to_discharge(problem: Problem, state: Array, inflow: InflowSegment) -> Array:
    """dR/d ln Q of one member (nx, 3, ny) [m/s, m/s2], by a central difference.

    Parameters
    ----------
    state : (nx, 3, ny, 1)
    inflow : InflowSegment
        Of the problem; Q is its discharge.
    """
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
class BlockFactors:
    """J^-1 as `block_elimination.factor` leaves it: three products a column."""

    columns: Single
    far: Single

    def solve(self, right: Single, transposed: bool = False) -> None:
        """J x = right, or J' x = right, in place; right (nx, 3 ny, n)."""
        loop = block_elimination.solve_transposed if transposed else block_elimination.solve
        loop(self.columns, self.far, right)


@dataclass(frozen=True)
class SharedFactors:
    """J^-1 = (A - a s')^-1 = A^-1 + A^-1 a (1 - s' A^-1 a)^-1 s' A^-1 with sparse factors of A (Woodbury).

    Attributes
    ----------
    sparse
        None if A has no inverse.
    answers, slopes
        a and s, answers to the discharge of inflows shared by depth and slopes of ln W (nx, 3 ny, inflow).
    """

    sparse: SparseFactors | None
    answers: Single
    slopes: Single

    def solve(self, right: Single, transposed: bool = False) -> None:
        """As `BlockFactors.solve`; NaN if there is no inverse."""
        if self.sparse is None:
            right.fill(np.nan)
            return
        self.sparse.solve(right, transposed)
        if not self.answers.shape[2]:
            return
        spread, by, core = self._spread_back if transposed else self._spread
        right += (spread @ np.linalg.solve(core, np.einsum("inp,inm->pm", by, right))).astype(np.float32)

    @cached_property
    def _spread(self) -> tuple[Single, Single, Array]:
        """A^-1 a, s and 1 - s' A^-1 a."""
        return self._spread_of(self.answers, self.slopes, False)

    @cached_property
    def _spread_back(self) -> tuple[Single, Single, Array]:
        """A'^-1 s, a and 1 - a' A'^-1 s."""
        return self._spread_of(self.slopes, self.answers, True)

    def _spread_of(self, of: Single, by: Single, transposed: bool) -> tuple[Single, Single, Array]:
        assert self.sparse is not None
        spread = of.copy()
        self.sparse.solve(spread, transposed)
        return spread, by, np.eye(of.shape[2]) - np.einsum("inp,inq->pq", by, spread)


@dataclass(frozen=True)
class BlockJacobian:
    """J as blocks of columns i - 1, i and i + 1 of row block i (nx, 3, n, n), n = 3 ny, and the diagonal of i - 2 (nx,
    n).
    """

    columns: Single
    far: Single

    def inverse(self, shift: Single | None = None) -> BlockFactors:
        """Factors of J + shift, a diagonal (nx, 3, ny); NaN if there is no inverse."""
        columns = self.columns
        if shift is not None:
            columns, diagonal = columns.copy(), np.arange(self.far.shape[1])
            columns[:, 1, diagonal, diagonal] += shift.reshape(self.far.shape)
        eliminate(columns, self.far)
        return BlockFactors(columns, self.far)


@dataclass(frozen=True)
class SparseJacobian:
    """J = A - a s', A by its entries, see `nested_dissection`; a, s: see `SharedFactors`."""

    values: Single
    far: Single
    answers: Single
    slopes: Single

    def inverse(self, shift: Single | None = None) -> SharedFactors:
        """As `BlockJacobian.inverse`."""
        values = self.values
        if shift is not None:
            values = values.copy()
            for e in range(3):
                values[:, :, 1, 2, e, e] += shift[:, e]
        try:
            found = sparse_factors(values, self.far)
        except np.linalg.LinAlgError:  # see `eliminate`
            found = None
        return SharedFactors(found, self.answers, self.slopes)


@dataclass(frozen=True)
class Factors:
    """J^-1 of one member, and what chord steps need of the state it was made at."""

    inverse: BlockFactors | SharedFactors  # of J, in single precision
    # slope, thick, answer: slopes of friction (nx, 3, ny, 1) [1/s], depths of faces [m] and changes of velocities with
    # levels [1/s] there (nx, 3, ny), see `thin_water`
    slope: Array
    thick: Array
    answer: Array

    def solve(self, right: Array) -> Array:
        """J^-1 right, (nx, 3, ny, m)."""
        return solved(self.inverse, right).astype(np.float64)

    def step(self, rates: Array) -> Single:
        """-J^-1 R in the unknowns of chord steps (nx, 3, ny, m): levels, velocities times rho where water is thin."""
        nx, _, ny, m = rates.shape
        with np.errstate(over="ignore"):  # of a member that runs away, known by its correction
            work = np.multiply(rates, -1.0, dtype=np.float32, casting="same_kind")
        self.inverse.solve(work.reshape(nx, 3 * ny, m))
        tilt(work, self.answer)
        return work


def eliminate(columns: Single, far: Single) -> None:
    """Factors in place; NaN if there is no inverse, so that no correction by them is accepted."""
    try:
        block_elimination.factor(columns, far)
    except np.linalg.LinAlgError:  # compiled loops raise; one member fails by it, not all that are solved beside it
        columns.fill(np.nan)


def solved(inverse: BlockFactors | SharedFactors, right: Array | Single, transposed: bool = False) -> Single:
    """J^-1 right, or J'^-1 right, (nx, 3, ny, m) in single precision.

    Parameters
    ----------
    right : (nx, 3, ny, m)
    """
    nx, _, ny, m = right.shape
    with np.errstate(over="ignore"):  # of a member that runs away, known by its correction
        work = right.astype(np.float32).reshape(nx, 3 * ny, m)
    inverse.solve(work, transposed)
    return work.reshape(right.shape)


def jacobian(problem: Problem, state: Array) -> BlockJacobian | SparseJacobian:
    """J = dR/dstate of one member by coloured differences; sparse on grids of WIDE_FROM rows or more.

    Single precision is enough: the factors only lead to the root; the residual in double precision decides what it is.

    Parameters
    ----------
    state : (nx, 3, ny, 1)
    """
    nx, _, ny, _ = state.shape
    wide = ny >= WIDE_FROM
    base, depth = residual(problem, state)[..., 0], cell_depths(problem, state)
    colours = np.array(list(np.ndindex(3, ALONG_PERIOD, ACROSS_PERIOD)))
    many = take(problem, np.zeros(COLOUR_SLOTS, dtype=np.int64))
    slots = np.empty((nx, 3, ny, COLOUR_SLOTS))
    if wide:
        values, far = np.zeros((nx, ny, 3, 5, 3, 3), np.float32), np.zeros((nx, ny, 3), np.float32)
    else:
        values, far = np.zeros((nx, 3, 3 * ny, 3 * ny), np.float32), np.zeros((nx, 3 * ny), np.float32)
    collect = collect_stencil if wide else block_elimination.collect
    for group in np.split(colours, range(COLOUR_SLOTS, len(colours), COLOUR_SLOTS)):
        slots[...] = state
        for slot, (kind, column, row) in enumerate(group):
            slots[column::ALONG_PERIOD, kind, row::ACROSS_PERIOD, slot] += COLOUR_STEP
        rates = residual(with_kept_shares(many, depth, cell_depths(many, slots)), slots)
        collect(values, far, base, rates, group, COLOUR_STEP)
    sharings = [sharing_at(problem, state, inflow) for inflow in shared_inflows(problem)]
    if wide:
        answers, slopes = np.zeros((2, nx, 3, ny, len(sharings)), np.float32)
        for n, one in enumerate(sharings):
            answers[..., n] = one.answer
            slopes[one.column, LEVEL, one.row, n] = one.slope
        shape = (nx, 3 * ny, len(sharings))
        return SparseJacobian(values, far, answers.reshape(shape), slopes.reshape(shape))
    # - dR/d ln Q (d ln W/dx)' of inflows shared by depth. All of it is there for an inflow from the west; through a
    # side, what blocks cannot hold is put down to levels that they can.
    for one in sharings:
        for i in np.flatnonzero(one.answer.any(axis=(1, 2))):
            of_levels = np.zeros((3, ny))
            np.add.at(of_levels, (column_held(one.column, int(i)) - i + 1, one.row), one.slope)
            values[i, :, :, :ny] -= one.answer[i].reshape(-1)[:, None] * of_levels[:, None]
    return BlockJacobian(values, far)


def column_held(column: NDArray[np.int64], block: int) -> NDArray[np.int64]:
    """The nearest to a column among those that a row block is coupled to."""
    return np.clip(column, block - 1, block + 1)


def factors(problem: Problem, state: Array) -> Factors:
    """J^-1 of one member, and what chord steps of its neighbours need of its state.

    Parameters
    ----------
    state : (nx, 3, ny, 1)
    """
    inverse = jacobian(problem, state).inverse()
    return Factors(inverse, slope_of_friction(problem, state), *thickness(problem, state))
