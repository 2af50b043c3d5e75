"""Batch solver: members are cut into clusters of neighbours, each with a reference member whose factors serve all.

Members are points s (m, d) of the unit cube (prior probabilities); how near they are, `parameter_metric` says.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.compilation import compiled
from vegglue.flow.chord import ChordSolution, IterationLimits, stream
from vegglue.flow.march import USUAL_FALL_BACK, FallBack
from vegglue.flow.parameter_metric import (
    ParameterMetric,
    clusters,
    farthest_first,
    nearest_members,
    parameter_metric,
    spline_weights,
    squared_distances,
)
from vegglue.flow.problem import Problem, crop, take
from vegglue.flow.reference_member import (
    LinearisedMember,
    ProblemOf,
    ReferenceMember,
    reference_at,
    reference_beside,
    solve_reference,
)
from vegglue.flow.status import FAILED, SOLVED_BY_NEWTON
from vegglue.flow.wet_band import overflows, rows_inside, walled

# Members that one factorisation serves at most: chosen, not measured; in a sketch of the solver one served 16 in 3 to 8
# steps each. Fewer cost more factorisations, more take more steps.
CLUSTER_SIZE = 64
# Members solved side by side: 3 to 5 % more of them a second than with 16; with 32 no more.
MEMBER_SLOTS = 24
# Steps after which a member waits for a nearer reference: of an ensemble of 5,000 members 42 take more.
MOST_CHORD_STEPS = 30
# How far tangents reach, in coordinates [-]: on the way to four chunks Newton had to help twice with 0.3, once with
# 0.2, and not with 0.14, which takes more strides.
STRIDE = 0.2
# The correction [m, m/s] to which members on the way are solved: chosen, not measured. They only lead on.
STRIDE_TOLERANCE = 1e-3
# Solved members that a start is drawn from: chosen, not measured. Splines through more cost more than they help.
SPLINE_MEMBERS = 48


@compiled
def blend(states: Array, some: NDArray[np.int64], weights: Array, south: int, north: int) -> Array:
    """sum_n w_bn x_n: states in the rows south .. north - 1, (nx, 3, rows, b).

    Parameters
    ----------
    states : (m, nx, 3, ny)
    some : (n,)
        Members whose states x_n are.
    weights : (b, n)
    """
    nx, rows, members = states.shape[1], north - south, weights.shape[0]
    blended, column = np.empty((nx, 3, rows, members)), np.empty((members, 3, rows))
    for i in range(nx):
        column[:] = 0.0
        for n in range(some.size):
            for e in range(3):
                source = states[some[n], i, e, south:north]
                for b in range(members):
                    target, weight = column[b, e], weights[b, n]
                    for j in range(rows):
                        target[j] += weight * source[j]
        for e in range(3):
            for j in range(rows):
                for b in range(members):
                    blended[i, e, j, b] = column[b, e, j]
    return blended


@compiled
def put_rows(
    states: Array, some: NDArray[np.int64], good: NDArray[np.bool_], found: Array, south: int, north: int
) -> None:
    """States found in the rows south..north-1 (nx, 3, rows, b), those that are good, put into those of all members (m,
    nx, 3, ny) at some[b] as `widen` does, but member by member in memory that lies together.
    """
    nx, ny, rows = states.shape[1], states.shape[3], north - south
    for i in range(nx):
        for b in range(some.size):
            if not good[b]:
                continue
            for e in range(3):
                target = states[some[b], i, e]
                for j in range(rows):
                    target[south + j] = found[i, e, j, b]
                first, last = (target[south], target[north - 1]) if e == 0 else (0.0, 0.0)
                for j in range(south):
                    target[j] = first
                for j in range(north, ny):
                    target[j] = last


@dataclass(frozen=True)
class SolvedMembers:
    """Members in the order of their problem, filled in place while they are solved."""

    state: Array  # (nx, 3, ny, m), each member in one piece of memory
    # status, reason: how each ended (m,), see `status`, and why if it failed
    status: np.ndarray
    reason: list[str]
    iterations: np.ndarray  # Newton and chord steps of each (m,)


@dataclass(frozen=True)
class _Batch:
    """What members are solved with: their problem, that of members at any points, how near they are, the largest
    correction [m, m/s] a solved one may still need, and how they are marched if Newton fails.
    """

    problem: Problem
    problem_of: ProblemOf
    metric: ParameterMetric
    tolerance: float
    fall_back: FallBack


def solve_members(
    problem: Problem,
    points: Array,
    problem_of: ProblemOf,
    tolerance: float,
    start_from: LinearisedMember | None = None,
    how: FallBack = USUAL_FALL_BACK,
) -> SolvedMembers:
    """Steady states of all members: R(x) = 0 for each, cluster by cluster.

    A member is solved with the factors of the central member of its cluster, and where these fail with those of another
    member; its state does not depend on the others beyond `tolerance`.

    Parameters
    ----------
    problem
        Of all m members.
    points
        Where they are in the unit cube of prior probabilities (m, d).
    problem_of
        The problem of members at other points (n, d).
    tolerance
        Largest correction [m, m/s] of a solved member, see `chord`.
    start_from
        A member to begin from; a rough estimate if None.
    how
        How members are marched if Newton fails.

    Returns
    -------
    SolvedMembers
        NaN for members that have no steady state.
    """
    solved = none_solved(problem)
    linearised = [] if start_from is None else [start_from]
    metric = parameter_metric(points, [one.slopes for one in linearised])
    batch = _Batch(problem, problem_of, metric, tolerance, how)
    coordinates = metric.coordinates
    found = clusters(coordinates, CLUSTER_SIZE)
    central = [int(nearest_members(coordinates, cluster, coordinates[cluster].mean(axis=0), 1)[0]) for cluster in found]
    for cluster, first, next_central in zip(found, central, [*central[1:], None], strict=True):
        pending, member, following = cluster, first, next_central
        while True:
            reference = _reference_for(batch, member, solved, linearised)
            pending = pending[pending != member]
            if reference.linearised is not None:
                linearised.append(reference.linearised)
                queue = farthest_first(coordinates, pending, coordinates[member])
                if following is not None:  # last, when the members that its start is drawn from are solved
                    queue = np.insert(queue, max(queue.size - MEMBER_SLOTS, 0), following)
                _solve_queue(batch, queue, reference, solved)
                pending, following = pending[solved.status[pending] == FAILED], None
            if not pending.size:
                break
            reached, member = np.flatnonzero(solved.status != FAILED), int(pending[0])
            if reached.size:  # the one nearest to a solved one
                apart = coordinates[pending][:, None] - coordinates[reached][None]
                member = int(pending[np.argmin((apart**2).sum(axis=2).min(axis=1))])
    solved.state[..., solved.status == FAILED] = np.nan
    return solved


def none_solved(problem: Problem) -> SolvedMembers:
    """All members of a problem before any is solved."""
    (nx, ny), m = problem.shape, problem.members
    state = np.moveaxis(np.empty((m, nx, 3, ny)), 0, -1)
    return SolvedMembers(state, np.full(m, FAILED), [""] * m, np.zeros(m, dtype=np.int64))


def _reference_for(
    batch: _Batch, member: int, solved: SolvedMembers, linearised: list[LinearisedMember]
) -> ReferenceMember:
    """A member as reference, kept in `solved`: its factors if the cluster before solved it, else reached from those
    linearised so far, in strides if they are far, or from the nearest solved member along the nearest tangents.
    """
    metric, point, problem = batch.metric, batch.metric.points[member], take(batch.problem, np.array([member]))
    if solved.status[member] == SOLVED_BY_NEWTON:
        return reference_at(batch.problem_of, problem, point, solved.state[..., member : member + 1])
    reference, spent = _reached_by_strides(batch, problem, point, linearised)
    if reference is None:
        warm = None
        if linearised:
            tangents, reached = _nearest_linearised(metric, point, linearised), np.flatnonzero(solved.status != FAILED)
            if reached.size:
                start = int(nearest_members(metric.coordinates, reached, metric.coordinates[member], 1)[0])
                state = solved.state[..., start : start + 1]
                tangents = replace(tangents, point=metric.points[start], state=state)
            warm = tangents.predict(point[None])
        reference = solve_reference(batch.problem_of, problem, point, warm, batch.tolerance, batch.fall_back)
        spent += reference.iterations
    solved.iterations[member] += spent
    solved.status[member], solved.reason[member] = reference.status, reference.reason
    solved.state[..., member] = reference.state[..., 0]
    return reference


def _solve_queue(batch: _Batch, queue: np.ndarray, reference: ReferenceMember, solved: SolvedMembers) -> None:
    """Solve a queue of members with the factors of a reference; those that converge within its band stand in `solved`.

    A member starts from cubic splines through the solved ones nearest to the reference; from its tangents while these
    are too few, or lie in a plane.
    """
    linearised, band, metric = reference.linearised, reference.band, batch.metric
    assert reference.factors is not None
    assert linearised is not None
    part, ny, coordinates = crop(batch.problem, *band), solved.state.shape[2], metric.coordinates

    def keep(members: np.ndarray, ended: ChordSolution) -> None:
        solved.iterations[members] += ended.iterations
        good = ended.converged & ~overflows(take(part, members), ended.state, band, ny)
        solved.status[members[good]] = SOLVED_BY_NEWTON
        put_rows(np.moveaxis(solved.state, -1, 0), members, good, ended.state, *band)

    def starts_of(members: np.ndarray) -> Array:
        by_newton = np.flatnonzero(solved.status == SOLVED_BY_NEWTON)
        near = nearest_members(coordinates, by_newton, linearised.point @ metric.axes, SPLINE_MEMBERS)
        weights = None
        if near.size >= 3 * (coordinates.shape[1] + 1):
            weights = spline_weights(coordinates[near], coordinates[members], "cubic", 1)
        if weights is None:
            return rows_inside(linearised.predict(metric.points[members]), band)
        return walled(blend(np.moveaxis(solved.state, -1, 0), near, weights, *band))

    limits = IterationLimits(MOST_CHORD_STEPS)
    stream(part, queue, starts_of, reference.factors, batch.tolerance, limits, MEMBER_SLOTS, keep)


def _reached_by_strides(
    batch: _Batch, problem: Problem, target: Array, linearised: list[LinearisedMember]
) -> tuple[ReferenceMember | None, int]:
    """The reference at a point far from all linearised so far, in strides that tangents reach, each with the factors of
    the last and added to `linearised`, and iterations spent; none if it is near, or could not be reached.
    """
    metric, spent = batch.metric, 0

    def distance_from(other: LinearisedMember) -> float:
        return float(np.sqrt(squared_distances(target[None] @ metric.axes, other.point @ metric.axes)[0]))

    origin = _nearest_linearised(metric, target, linearised) if linearised else None
    if origin is None or distance_from(origin) <= STRIDE:
        return None, spent
    reference = reference_at(batch.problem_of, batch.problem_of(origin.point[None]), origin.point, origin.state)
    while reference.linearised is not None:
        here, distance = reference.linearised, distance_from(reference.linearised)
        last = distance <= STRIDE
        point = target if last else here.point + (target - here.point) * (STRIDE / distance)
        tolerance = batch.tolerance if last else max(batch.tolerance, STRIDE_TOLERANCE)
        there = problem if last else batch.problem_of(point[None])
        reference = reference_beside(batch.problem_of, there, point, reference, tolerance, batch.fall_back)
        spent += reference.iterations
        if reference.linearised is not None:
            if last:
                return reference, spent
            linearised.append(reference.linearised)
    return None, spent


def _nearest_linearised(metric: ParameterMetric, point: Array, linearised: list[LinearisedMember]) -> LinearisedMember:
    coordinates = np.array([one.point for one in linearised]) @ metric.axes
    return linearised[int(np.argmin(squared_distances(coordinates, point @ metric.axes)))]
