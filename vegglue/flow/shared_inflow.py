"""Discharge that is shared over the cells of an inflow by depth: what of it is a matter of each cell, and what of all.

    q_c = Q w_c / W,    W = sum_c w_c b_c,    dR = (dR at fixed Q / W) - dR/d ln Q  d ln W

w_c is the weight of a cell, b_c its width, see `equations.side_fluxes`. All else reaches a few cells of a residual R,
but through W each cell of an inflow reaches all others: a product of two vectors for each inflow.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.flow.equations import cell_depths, inflow_parts, residual
from vegglue.flow.problem import LEVEL, InflowSegment, Problem, take

# Step of ln Q in a central difference [-]: chosen, not measured; small against 1 and large against rounding.
DISCHARGE_STEP = 1e-5
# Step of levels [m] in the difference of ln W: chosen, not measured, as that of the Jacobian.
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
