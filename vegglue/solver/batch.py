"""Members solved together: cut into neighbourhoods of the prior, each led by a centre whose factors serve the others.

Places s (m, d) are those of the members in the unit cube (prior probabilities); who is near whom, `nearness` says.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator

from vegglue.arrays import Array
from vegglue.compilation import compiled
from vegglue.flow.problem import Problem, crop
from vegglue.solver.chord import ChordSolution, stream
from vegglue.solver.parameter_metric import ParameterMetric, leaves, nearest_members, parameter_metric, spread, squared
from vegglue.solver.reference_member import ProblemOf, ReferenceMember, SolvedMember, lead_at, lead_beside, solve_centre
from vegglue.solver.status import FAILED, SOLVED_BY_NEWTON
from vegglue.solver.wet_band import overflows, rows_inside, walled, widen

# Neighbours that one factorisation serves, and how many are solved at once.
NEIGHBOURHOOD, MEMBER_LANES = 64, 24
# Who is not there after so many steps waits for a centre of its own.
MOST_CHORD_STEPS = 30
# How far tangents reach, in spots: on the way to four chunks Newton had to help twice with 0.3, once with 0.2, and not
# with 0.14, which takes more strides. A correction of ROUGHLY [m, m/s] will do there.
STRIDE, ROUGHLY = 0.2, 1e-3
# Solved members that a start is drawn from.
NEAREST = 48


@dataclass(frozen=True)
class SolvedMembers:
    """Members in the order asked for: states (nx, 3, ny, m), each in one piece of memory, and how each was reached."""

    state: Array
    status: np.ndarray
    reason: list[str]
    iterations: np.ndarray


def solve_members(
    problem_of: ProblemOf, places: Array, tolerance: float, begin: SolvedMember | None = None
) -> SolvedMembers:
    """Steady states of all places; a member's does not depend on who else is asked for, beyond `tolerance`.

    begin: where to come from; from a rough estimate if not given.
    """
    whole = problem_of(places)
    (nx, ny), m = whole.shape, len(places)
    state = np.moveaxis(np.empty((m, nx, 3, ny)), 0, -1)
    solved = SolvedMembers(state, np.full(m, FAILED), [""] * m, np.zeros(m, dtype=np.int64))
    known = [] if begin is None else [begin]
    everyone = parameter_metric(places, [one.slopes for one in known])
    cuts = leaves(everyone.spots, NEIGHBOURHOOD)
    heads = [_middle(everyone.spots, leaf) for leaf in cuts]
    for leaf, head, next_head in zip(cuts, heads, [*heads[1:], None], strict=True):
        pending, centre = leaf, head
        while True:
            lead = _lead_to(problem_of, everyone, centre, solved, known, tolerance)
            pending = pending[pending != centre]
            if lead.known is not None:
                known.append(lead.known)
                queue = _queue(everyone, pending, centre, next_head)
                _follow(whole, everyone, queue, lead, solved, tolerance)
                pending, next_head = pending[solved.status[pending] == FAILED], None
            if not pending.size:
                break
            centre = _nearest_to_solved(everyone.spots, pending, _there(solved))
    solved.state[..., solved.status == FAILED] = np.nan
    return solved


def _middle(spots: Array, leaf: np.ndarray) -> int:
    return int(nearest_members(spots, leaf, spots[leaf].mean(axis=0), 1)[0])


def _nearest_to_solved(spots: Array, pending: np.ndarray, solved: np.ndarray) -> int:
    """Which of those pending is the next centre: the one nearest to a solved one, if there is any."""
    if not solved.size:
        return int(pending[0])
    distance = ((spots[pending][:, None] - spots[solved][None]) ** 2).sum(axis=2).min(axis=1)
    return int(pending[np.argmin(distance)])


def _lead_to(
    problem_of: ProblemOf,
    everyone: ParameterMetric,
    centre: int,
    solved: SolvedMembers,
    known: list[SolvedMember],
    tolerance: float,
) -> ReferenceMember:
    """A centre, noted in `solved`: its factors if it came with the leaf before, else on the way from what is known."""
    place = everyone.places[centre]
    if solved.status[centre] == SOLVED_BY_NEWTON:
        return lead_at(problem_of, place, solved.state[..., centre : centre + 1])
    lead, spent = _approached(problem_of, everyone, centre, known, tolerance)
    if lead is None:
        lead = solve_centre(problem_of, place, _warm_start(everyone, centre, solved, known), tolerance)
        spent += lead.iterations
    solved.iterations[centre] += spent
    solved.status[centre], solved.reason[centre] = lead.status, lead.reason
    solved.state[..., centre] = lead.state[..., 0]
    return lead


def _queue(everyone: ParameterMetric, pending: np.ndarray, centre: int, next_head: int | None) -> np.ndarray:
    """Those pending around a centre, with the last of them the head of the next leaf: what starts lean on is then
    solved.
    """
    queue = spread(everyone.spots, pending, everyone.spots[centre])
    return queue if next_head is None else np.insert(queue, max(queue.size - MEMBER_LANES, 0), next_head)


def _there(solved: SolvedMembers) -> np.ndarray:
    return np.flatnonzero(solved.status != FAILED)


def _follow(
    whole: Problem,
    everyone: ParameterMetric,
    queue: np.ndarray,
    lead: ReferenceMember,
    solved: SolvedMembers,
    tolerance: float,
) -> None:
    """Solve a queue of members with the factors of a centre and note those in `solved` that neither fail nor outgrow
    its band.
    """
    assert lead.factors is not None
    part, band, ny = crop(whole, *lead.band), lead.band, solved.state.shape[2]

    def note(members: np.ndarray, ended: ChordSolution) -> None:
        solved.iterations[members] += ended.iterations
        good = ended.converged & ~overflows(part, ended.state, band, ny)
        solved.status[members[good]] = SOLVED_BY_NEWTON
        solved.state[..., members[good]] = widen(ended.state[..., good], ny, band)

    def starts_of(members: np.ndarray) -> Array:
        return _starts(everyone, lead, solved, members)

    stream(part, queue, starts_of, lead.factors, tolerance, MOST_CHORD_STEPS, MEMBER_LANES, note)


def _starts(everyone: ParameterMetric, lead: ReferenceMember, solved: SolvedMembers, batch: np.ndarray) -> Array:
    """Cubic splines through the solved members nearest to the centre, its tangents while there are too few; in its
    band.
    """
    assert lead.known is not None
    spots = everyone.spots
    there = np.flatnonzero(solved.status == SOLVED_BY_NEWTON)
    near = nearest_members(spots, there, lead.known.place @ everyone.axes, NEAREST)
    if near.size < 3 * (spots.shape[1] + 1):
        return rows_inside(lead.known.predict(everyone.places[batch]), lead.band)
    spline = RBFInterpolator(spots[near], np.eye(near.size), kernel="cubic", degree=1)
    blended = blend(np.moveaxis(solved.state, -1, 0), near, spline(spots[batch]), *lead.band)
    return walled(blended)


def _approached(
    problem_of: ProblemOf, everyone: ParameterMetric, centre: int, known: list[SolvedMember], tolerance: float
) -> tuple[ReferenceMember | None, int]:
    """A centre far from what is known, in strides that tangents reach, each with the factors of the last and noted in
    `known`, and iterations spent; no centre if it is near, or could not be reached.
    """
    target, spent = everyone.places[centre], 0
    origin = _nearest_known(everyone, target, known) if known else None
    if origin is None or _apart(everyone, target, origin) <= STRIDE:
        return None, spent
    lead = lead_at(problem_of, origin.place, origin.state)
    while lead.known is not None:
        here, distance = lead.known, _apart(everyone, target, lead.known)
        last = distance <= STRIDE
        place = target if last else here.place + (target - here.place) * (STRIDE / distance)
        lead = lead_beside(problem_of, place, lead, tolerance if last else max(tolerance, ROUGHLY))
        spent += lead.iterations
        if lead.known is not None:
            if last:
                return lead, spent
            known.append(lead.known)
    return None, spent


def _apart(everyone: ParameterMetric, place: Array, known: SolvedMember) -> float:
    return float(np.sqrt(squared(place[None] @ everyone.axes, known.place @ everyone.axes)[0]))


def _nearest_known(everyone: ParameterMetric, place: Array, known: list[SolvedMember]) -> SolvedMember:
    spots = np.array([one.place for one in known]) @ everyone.axes
    return known[int(np.argmin(squared(spots, place @ everyone.axes)))]


def _warm_start(
    everyone: ParameterMetric, centre: int, solved: SolvedMembers, known: list[SolvedMember]
) -> Array | None:
    """From the nearest solved member, along the nearest tangents."""
    if not known:
        return None
    here, place = everyone.spots[centre], everyone.places[centre]
    tangents = _nearest_known(everyone, place, known)
    there = _there(solved)
    if there.size == 0:
        return tangents.predict(place[None])
    start = int(nearest_members(everyone.spots, there, here, 1)[0])
    return replace(tangents, place=everyone.places[start], state=solved.state[..., start : start + 1]).predict(
        place[None]
    )


@compiled
def blend(states: Array, some: NDArray[np.int64], weights: Array, south: int, north: int) -> Array:
    """sum_n w_bn x_n in the rows south..north-1, (nx, 3, rows, b), x_n the state of member some[n]; states (m, nx, 3,
    ny), weights (b, n).
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
