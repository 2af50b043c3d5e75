"""Members that lie far apart, solved on ever finer cells: each starts from its own flow on coarser ones.

    x = P x_c + d

P x_c is the flow on coarser cells put on finer ones (`lifted_flows`), and d what finer cells change: it varies little
from member to member and is drawn from those solved before. A nested iteration as in Briggs, Henson and McCormick
(2000), A Multigrid Tutorial, doi:10.1137/1.9780898719505; not checked against it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.batch import SPLINE_MEMBERS, STRIDE_TOLERANCE, SolvedMembers, blend, none_solved, solve_members
from vegglue.flow.chord import SIDE_BY_SIDE, ChordSolution, IterationLimits, stream
from vegglue.flow.march import FallBack
from vegglue.flow.newton import CLOSE
from vegglue.flow.parameter_metric import metric_of_flows, nearest_members, spline_weights, squared_distances
from vegglue.flow.problem import Problem, crop, take
from vegglue.flow.reference_member import ProblemOf, solve_alone
from vegglue.flow.starts import lifted_flows
from vegglue.flow.status import FAILED, SOLVED_BY_NEWTON
from vegglue.flow.wet_band import overflows, rows_inside, widen

# Steps after which a member waits for a nearer reference: of 15, 20, 30 and 40 the last was the fastest for 64 members
# of a site of 9,600 cells whose priors span three decades.
MOST_NESTED_STEPS = 40
# By how much a correction shrinks in each step [-] of a member that converges: on that site, 256 members in chunks of
# 64, 20 of the 730 that converged were behind this when they did, and of 200 that did not 118, which took another 2,200
# steps.
PACE = 0.75
# Members solved side by side: 32 and 40 are alike, and a tenth less time than 24 if few share a reference.
NESTED_SLOTS = 32


@dataclass(frozen=True)
class GridProblem:
    """The problem of all members on one grid, and that of members at any points."""

    problem: Problem
    problem_of: ProblemOf


@dataclass(frozen=True)
class _Level:
    """Members (m,) on one grid: where they are, in coordinates as far apart as their flows (m, d); their flows on
    coarser cells (nx, 3, ny, m), and which have one; what finer cells changed (m, nx, 3, ny), the members solved, and
    where others stalled near their flow (nx, 3, ny).

    The last three are filled in place while members are solved.
    """

    problem: Problem
    coordinates: Array
    lifted: Array
    known: np.ndarray
    changed: Array
    solved: SolvedMembers
    stalled: dict[int, Array] = field(default_factory=dict)

    def keep(self, members: np.ndarray, states: Array) -> None:
        self.solved.status[members] = SOLVED_BY_NEWTON
        self.solved.state[..., members] = states
        self.changed[members] = np.moveaxis(states - self.lifted[..., members], -1, 0)

    def starts(self, members: np.ndarray) -> Array:
        """States that members begin from (nx, 3, ny, n): where they stalled with the factors of another reference, else
        P x_c + d, d from splines through the solved members nearest to them, if any.
        """
        start, coordinates = np.ascontiguousarray(self.lifted[..., members]), self.coordinates
        done = np.flatnonzero((self.solved.status == SOLVED_BY_NEWTON) & self.known)
        if done.size:
            near = nearest_members(coordinates, done, coordinates[members].mean(axis=0), SPLINE_MEMBERS)
            kernel, degree = ("cubic", 1) if near.size >= 3 * (coordinates.shape[1] + 1) else ("linear", 0)
            weights = spline_weights(coordinates[near], coordinates[members], kernel, degree)
            start = start if weights is None else start + blend(self.changed, near, weights, 0, start.shape[2])
        for slot, member in enumerate(members):
            if int(member) in self.stalled:
                start[..., slot] = self.stalled[int(member)]
        return start


def solve_nested(grids: Sequence[GridProblem], points: Array, tolerance: float, how: FallBack) -> SolvedMembers:
    """x = P x_c + d, grid by grid: steady states of all members on the last grid.

    On each grid the central member of those left is solved by itself, then all that its factors lead to.

    Parameters
    ----------
    grids
        From the coarsest to the finest, each of twice as many cells as the one before along one axis or both.
    points
        Where the members are in the unit cube of prior probabilities (m, d).
    tolerance
        Of corrections [m, m/s] on the finest grid.
    how
        How members are marched if Newton fails.

    Returns
    -------
    SolvedMembers
        NaN for members that have no steady state.
    """
    loose = max(tolerance, STRIDE_TOLERANCE)
    coarsest = grids[0]
    first = tolerance if coarsest is grids[-1] else loose
    solved = solve_members(coarsest.problem, points, coarsest.problem_of, first, how=how)
    coordinates = metric_of_flows(points, solved.state).coordinates
    for coarse, grid in pairwise(grids):
        lifted = lifted_flows(coarse.problem, solved.state, grid.problem)
        known = np.asarray(np.isfinite(lifted).all(axis=(0, 1, 2)))
        solved = none_solved(grid.problem)
        changed = np.empty((len(points), *lifted.shape[:3]))
        level = _Level(grid.problem, coordinates, lifted, known, changed, solved)
        pending = np.arange(len(points))
        while pending.size:
            member = int(nearest_members(coordinates, pending, coordinates[pending].mean(axis=0), 1)[0])
            _solve_around(level, member, pending[pending != member], tolerance if grid is grids[-1] else loose, how)
            pending = pending[(solved.status[pending] == FAILED) & (pending != member)]
        solved.state[..., solved.status == FAILED] = np.nan
    return solved


def _solve_around(level: _Level, member: int, pending: np.ndarray, tolerance: float, how: FallBack) -> None:
    """A member by itself, and those pending that its factors lead to, the nearest first."""
    solved, alone, rows = level.solved, np.array([member]), level.problem.shape[1]
    warm = level.starts(alone) if level.known[member] else None
    reference = solve_alone(take(level.problem, alone), warm, tolerance, how)
    solved.iterations[member] += reference.iterations
    if reference.factors is None:
        solved.status[member], solved.reason[member] = reference.status, reference.reason
        solved.state[..., member] = reference.state[..., 0]
        return
    level.keep(alone, reference.state)
    near, band = squared_distances(level.coordinates[pending], level.coordinates[member]), reference.band
    queue = pending[np.argsort(near, kind="stable")]
    queue, part = queue[level.known[queue]], crop(level.problem, *band)

    def keep(members: np.ndarray, ended: ChordSolution) -> None:
        """Members that converged within the band."""
        solved.iterations[members] += ended.iterations
        good = ended.converged & ~overflows(take(part, members), ended.state, band, rows)
        if good.any():
            level.keep(members[good], widen(ended.state[..., good], rows, band))
        for slot in np.flatnonzero(~good & (ended.correction < CLOSE)):
            level.stalled[int(members[slot])] = widen(ended.state[..., slot : slot + 1], rows, band)[..., 0]

    def starts_of(members: np.ndarray) -> Array:
        return rows_inside(level.starts(members), band)

    limits = IterationLimits(MOST_NESTED_STEPS, PACE, SIDE_BY_SIDE)
    stream(part, queue, starts_of, reference.factors, tolerance, limits, NESTED_SLOTS, keep)
