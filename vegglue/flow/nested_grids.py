"""Members that lie far apart, solved on ever finer cells: each starts from its own flow on coarser ones.

    x = P x_c + d

P x_c is the flow on coarser cells put on finer ones (`lifted_flows`), and d what finer cells change: it varies little
from member to member and is drawn from those solved before. A nested iteration as in Briggs, Henson and McCormick
(2000), A Multigrid Tutorial, doi:10.1137/1.9780898719505; not checked against it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.batch import (
    SPLINE_MEMBERS,
    STRIDE_TOLERANCE,
    SolvedMembers,
    blend,
    none_solved,
    solve_members,
)
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
# By how much a correction shrinks in each step [-] where a member gets there: there, 256 members in chunks of 64,
# 20 of the 730 that did were behind this when they did, and of 200 that did not 118, which took another 2,200 steps.
PACE = 0.75
# Members solved side by side: 32 and 40 are alike, and a tenth less time than 24, where few share a reference.
NESTED_LANES = 32


@dataclass(frozen=True)
class GridProblem:
    """The problem of all members on one grid, and that of members at any points."""

    problem: Problem
    problem_of: ProblemOf


@dataclass(frozen=True)
class _Level:
    """Members (m,) on one grid: where they are, in coordinates as far apart as their flows (m, d); their flows on
    coarser cells (nx, 3, ny, m), and who has one; what finer cells changed (m, nx, 3, ny), the members solved, and
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


def solve_nested(grids: Sequence[GridProblem], points: Array, tolerance: float, how: FallBack) -> SolvedMembers:
    """Steady states of all members on the last grid, the finest, each of twice as many cells as the one before along
    one axis or both; points (m, d): where they are in the unit cube.
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
        _solve_level(level, tolerance if grid is grids[-1] else loose, how)
    return solved


def _solve_level(level: _Level, tolerance: float, how: FallBack) -> None:
    """One reference after the other, the central one of those left, each for all that its factors lead to."""
    pending = np.arange(len(level.coordinates))
    while pending.size:
        centre = level.coordinates[pending].mean(axis=0)
        member = int(nearest_members(level.coordinates, pending, centre, 1)[0])
        _solve_around(level, member, pending[pending != member], tolerance, how)
        pending = pending[(level.solved.status[pending] == FAILED) & (pending != member)]
    level.solved.state[..., level.solved.status == FAILED] = np.nan


def _solve_around(level: _Level, member: int, pending: np.ndarray, tolerance: float, how: FallBack) -> None:
    """A member by itself, and those pending that its factors lead to, the nearest first."""
    solved, alone = level.solved, np.array([member])
    warm = _starts(level, alone) if level.known[member] else None
    reference = solve_alone(take(level.problem, alone), warm, tolerance, how)
    solved.iterations[member] += reference.iterations
    if reference.factors is None:
        solved.status[member], solved.reason[member] = reference.status, reference.reason
        solved.state[..., member] = reference.state[..., 0]
        return
    level.keep(alone, reference.state)
    near = squared_distances(level.coordinates[pending], level.coordinates[member])
    queue = pending[np.argsort(near, kind="stable")]
    queue, part = queue[level.known[queue]], crop(level.problem, *reference.band)

    def starts_of(members: np.ndarray) -> Array:
        return rows_inside(_starts(level, members), reference.band)

    deliver = partial(_delivered, level, part, reference.band)
    patience = IterationLimits(MOST_NESTED_STEPS, PACE, SIDE_BY_SIDE)
    stream(part, queue, starts_of, reference.factors, tolerance, patience, NESTED_LANES, deliver)


def _delivered(level: _Level, part: Problem, band: tuple[int, int], members: np.ndarray, ended: ChordSolution) -> None:
    """Members kept that converged within the band."""
    level.solved.iterations[members] += ended.iterations
    rows = level.problem.shape[1]
    good = ended.converged & ~overflows(take(part, members), ended.state, band, rows)
    if good.any():
        level.keep(members[good], widen(ended.state[..., good], rows, band))
    for lane in np.flatnonzero(~good & (ended.correction < CLOSE)):
        level.stalled[int(members[lane])] = widen(ended.state[..., lane : lane + 1], rows, band)[..., 0]


def _estimates(level: _Level, members: np.ndarray) -> Array:
    """P x_c + d of some members (nx, 3, ny, n), d from splines through the solved members nearest to them, if any."""
    start = np.ascontiguousarray(level.lifted[..., members])
    done = np.flatnonzero((level.solved.status == SOLVED_BY_NEWTON) & level.known)
    if not done.size:
        return start
    coordinates = level.coordinates
    near = nearest_members(coordinates, done, coordinates[members].mean(axis=0), SPLINE_MEMBERS)
    kernel, degree = ("cubic", 1) if near.size >= 3 * (coordinates.shape[1] + 1) else ("linear", 0)
    weights = spline_weights(coordinates[near], coordinates[members], kernel, degree)
    return start if weights is None else start + blend(level.changed, near, weights, 0, start.shape[2])


def _starts(level: _Level, members: np.ndarray) -> Array:
    """Where members begin, (nx, 3, ny, n): where they stalled with the factors of another reference, else estimates."""
    start = _estimates(level, members)
    for lane, member in enumerate(members):
        if int(member) in level.stalled:
            start[..., lane] = level.stalled[int(member)]
    return start
