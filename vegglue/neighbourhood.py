"""Members solved together: cut into neighbourhoods of the prior, each led by a centre whose factors serve the others.

Places s (m, d) are those of the members in the unit cube (prior probabilities); who is near whom, `nearness` says.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import RBFInterpolator

from vegglue.chord import Solution, chord, stream
from vegglue.ensemble import FAILED, SOLVED_BY_MARCHING, SOLVED_BY_NEWTON
from vegglue.flow import ACROSS, LEVEL, Array, Problem, crop, residual
from vegglue.jacobian import Factors, factors
from vegglue.march import settle
from vegglue.nearness import Crowd, crowd, leaves, nearest, spread, squared
from vegglue.start import backwater, blend
from vegglue.steady import CLOSE, finish, newton

# Neighbours that one factorisation serves, and how many are solved at once.
SIZE, LANES = 64, 16
# Who is not there after so many steps waits for a centre of its own.
MOST = 30
# How far tangents reach, in spots: from 0.3 on, Newton had to help. On the way a correction of ROUGHLY [m, m/s]
# will do.
STRIDE, ROUGHLY = 0.2, 1e-3
# Solved members that a start is drawn from.
NEAREST = 48
TANGENT_STEP = 1e-4
# Rows whose bed lies further than this [m] above the water are left out of the band that is solved.
MARGIN = 0.1

ProblemOf = Callable[[Array], Problem]


@dataclass(frozen=True)
class Solved:
    """Members in the order asked for: states (nx, 3, ny, m), each in one piece of memory, and how each was reached."""

    state: Array
    status: np.ndarray
    reason: list[str]
    iterations: np.ndarray


@dataclass(frozen=True)
class Known:
    """A state (nx, 3, ny, 1) solved at one place of the unit cube, and d state / d s_p there."""

    place: Array
    state: Array
    slopes: tuple[Array, ...]

    def predict(self, places: Array) -> Array:
        """state + sum_p slope_p (s_p - place_p), (nx, 3, ny, m)."""
        predicted = np.repeat(self.state, len(places), axis=3)
        for p, slope in enumerate(self.slopes):
            predicted += slope * (places[:, p] - self.place[p])
        return predicted


def known_middle(problem_of: ProblemOf, parameters: int, tolerance: float) -> Known | None:
    """The member in the middle of the prior, for all others to begin from; None if it has to be marched."""
    middle = np.full(parameters, 0.5)
    return _solve_centre(problem_of, middle, None, tolerance).known


def solve_members(problem_of: ProblemOf, places: Array, tolerance: float, begin: Known | None = None) -> Solved:
    """Steady states of all places; a member's does not depend on who else is asked for, beyond `tolerance`.

    begin: where to come from; from a rough estimate if not given.
    """
    whole = problem_of(places)
    (nx, ny), m = whole.shape, len(places)
    state = np.moveaxis(np.full((m, nx, 3, ny), np.nan), 0, -1)
    solved = Solved(state, np.full(m, FAILED), [""] * m, np.zeros(m, dtype=np.int64))
    known = [] if begin is None else [begin]
    everyone = crowd(places, [one.slopes for one in known])
    cuts = leaves(everyone.spots, SIZE)
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
                pending = pending[solved.status[pending] == FAILED]
            if not pending.size:
                break
            centre = _nearest_to_solved(everyone.spots, pending, _there(solved))
    return solved


def _middle(spots: Array, leaf: np.ndarray) -> int:
    return int(nearest(spots, leaf, spots[leaf].mean(axis=0), 1)[0])


def _nearest_to_solved(spots: Array, pending: np.ndarray, solved: np.ndarray) -> int:
    """Which of those pending is the next centre: the one nearest to a solved one, if there is any."""
    if not solved.size:
        return int(pending[0])
    distance = ((spots[pending][:, None] - spots[solved][None]) ** 2).sum(axis=2).min(axis=1)
    return int(pending[np.argmin(distance)])


def _lead_to(
    problem_of: ProblemOf, everyone: Crowd, centre: int, solved: Solved, known: list[Known], tolerance: float
) -> "_Lead":
    """A centre, noted in `solved`: its factors if it came with the leaf before, else on the way from what is known."""
    place = everyone.places[centre]
    if solved.status[centre] == SOLVED_BY_NEWTON:
        return _lead_at(problem_of, place, solved.state[..., centre : centre + 1])
    on_the_way = _approach(problem_of, everyone, centre, known, tolerance)
    lead = _solve_centre(problem_of, place, _warm_start(everyone, centre, solved, known), tolerance)
    solved.iterations[centre] += on_the_way + lead.iterations
    solved.status[centre], solved.reason[centre] = lead.status, lead.reason
    solved.state[..., centre] = lead.state[..., 0]
    return lead


def _queue(everyone: Crowd, pending: np.ndarray, centre: int, next_head: int | None) -> np.ndarray:
    """Those pending around a centre, with the last of them the head of the next leaf: what starts lean on is then
    solved.
    """
    queue = spread(everyone.spots, pending, everyone.spots[centre])
    return queue if next_head is None else np.insert(queue, max(queue.size - LANES, 0), next_head)


def _there(solved: Solved) -> np.ndarray:
    return np.flatnonzero(solved.status != FAILED)


def _follow(
    whole: Problem, everyone: Crowd, queue: np.ndarray, lead: "_Lead", solved: Solved, tolerance: float
) -> None:
    """Solve a queue of members with the factors of a centre and note those in `solved` that neither fail nor outgrow
    its band.
    """
    assert lead.factors is not None
    part, band, ny = crop(whole, *lead.band), lead.band, solved.state.shape[2]

    def note(members: np.ndarray, ended: Solution) -> None:
        solved.iterations[members] += ended.iterations
        good = ended.converged & ~overflows(part, ended.state, band, ny)
        solved.status[members[good]] = SOLVED_BY_NEWTON
        solved.state[..., members[good]] = widen(ended.state[..., good], ny, band)

    def starts_of(members: np.ndarray) -> Array:
        return _starts(everyone, lead, solved, members)

    stream(part, queue, starts_of, lead.factors, tolerance, MOST, LANES, note)


def _starts(everyone: Crowd, lead: "_Lead", solved: Solved, batch: np.ndarray) -> Array:
    """Cubic splines through the solved members nearest to the centre, its tangents while there are too few; in its
    band.
    """
    assert lead.known is not None
    spots = everyone.spots
    there = np.flatnonzero(solved.status == SOLVED_BY_NEWTON)
    near = nearest(spots, there, lead.known.place @ everyone.axes, NEAREST)
    if near.size < 3 * (spots.shape[1] + 1):
        return inside(lead.known.predict(everyone.places[batch]), lead.band)
    spline = RBFInterpolator(spots[near], np.eye(near.size), kernel="cubic", degree=1)
    states = np.moveaxis(solved.state, -1, 0)
    blended = blend(states.reshape(len(states), -1), near, spline(spots[batch])).reshape(batch.size, *states.shape[1:])
    return inside(np.moveaxis(blended, 0, -1), lead.band)


def _approach(problem_of: ProblemOf, everyone: Crowd, centre: int, known: list[Known], tolerance: float) -> int:
    """Go from what is known towards a member in strides its tangents reach, each noted in `known`; iterations spent."""
    spent, target = 0, everyone.places[centre]
    while known:
        origin = _nearest_known(everyone, target, known)
        distance = np.sqrt(squared(target[None] @ everyone.axes, origin.place @ everyone.axes)[0])
        if distance <= STRIDE:
            break
        place = origin.place + (target - origin.place) * (STRIDE / distance)
        lead = _solve_centre(problem_of, place, origin.predict(place[None]), max(tolerance, ROUGHLY))
        spent += lead.iterations
        if lead.known is None:
            break
        known.append(lead.known)
    return spent


def _nearest_known(everyone: Crowd, place: Array, known: list[Known]) -> Known:
    spots = np.array([one.place for one in known]) @ everyone.axes
    return known[int(np.argmin(squared(spots, place @ everyone.axes)))]


def _warm_start(everyone: Crowd, centre: int, solved: Solved, known: list[Known]) -> Array | None:
    """From the nearest solved member, along the nearest tangents."""
    if not known:
        return None
    here, place = everyone.spots[centre], everyone.places[centre]
    tangents = _nearest_known(everyone, place, known)
    there = _there(solved)
    if there.size == 0:
        return tangents.predict(place[None])
    start = int(nearest(everyone.spots, there, here, 1)[0])
    return replace(tangents, place=everyone.places[start], state=solved.state[..., start : start + 1]).predict(
        place[None]
    )


@dataclass(frozen=True)
class _Lead:
    """A centre: its state (nx, 3, ny, 1) and, unless it had to be marched, what its neighbours need of it."""

    state: Array
    status: int
    reason: str
    iterations: int
    known: Known | None
    factors: Factors | None
    band: tuple[int, int]


def _solve_centre(problem_of: ProblemOf, place: Array, warm: Array | None, tolerance: float) -> _Lead:
    """From a warm start by one factorisation, then by Newton; then by Newton from cold; then by marching."""
    problem = problem_of(place[None])
    spent = 0
    for start in [warm, None] if warm is not None else [None]:
        solution, shared, band = settled(problem, start, tolerance)
        spent += int(solution.iterations[0])
        if shared is None:
            continue
        return _lead(problem_of, place, crop(problem, *band), band, solution.state, shared, spent)
    return _marched(problem, spent, tolerance)


Attempt = tuple[Solution, Factors | None, tuple[int, int]]


def settled(problem: Problem, warm: Array | None, tolerance: float) -> Attempt:
    """One member: its state in the band of rows that may be wet, the factors there, and that band.

    warm (nx, 3, ny, 1): a state nearby to begin from, else a rough estimate is. Without factors, it has not converged.
    """
    attempts: list[Callable[[], Attempt]] = [lambda: _from_cold(problem, tolerance)]
    if warm is not None:
        attempts = [lambda: _quick(problem, warm, tolerance), lambda: _by_newton(problem, warm, tolerance)]
    spent = 0
    for attempt in attempts:
        solution, shared, band = attempt()
        spent += int(solution.iterations[0])
        solution = replace(solution, iterations=np.array([spent]))
        if solution.converged[0] and shared is not None:
            return solution, shared, band
    return solution, None, band


def _quick(problem: Problem, warm: Array, tolerance: float) -> Attempt:
    band = _band(problem, warm)
    solution, shared = finish(crop(problem, *band), inside(warm, band), tolerance)
    return _checked(problem, solution, shared, band, tolerance)


def _by_newton(problem: Problem, warm: Array, tolerance: float, most: int = 12, time_step: float = 200.0) -> Attempt:
    band = _band(problem, warm)
    part = crop(problem, *band)
    near = newton(part, inside(warm, band), CLOSE, most, time_step)
    if not near.converged[0]:
        return near, None, band
    solution, shared = finish(part, near.state, tolerance)
    solution = replace(solution, iterations=solution.iterations + near.iterations)
    return _checked(problem, solution, shared, band, tolerance)


def _from_cold(problem: Problem, tolerance: float) -> Attempt:
    return _by_newton(problem, backwater(problem), tolerance, most=60, time_step=10.0)


def _checked(
    problem: Problem, solution: Solution, shared: Factors | None, band: tuple[int, int], tolerance: float
) -> Attempt:
    """Solved again in a wider band if water came to stand at the edge of this one."""
    part = crop(problem, *band)
    if not (solution.converged[0] and overflows(part, solution.state, band, problem.shape[1])[0]):
        return solution, shared, band
    wider = widen(solution.state, problem.shape[1], band)
    band = _band(problem, wider)
    solution, shared = finish(crop(problem, *band), inside(wider, band), tolerance)
    return solution, shared, band


def _lead_at(problem_of: ProblemOf, place: Array, state: Array) -> _Lead:
    """What neighbours need of a solved state (nx, 3, ny, 1)."""
    problem = problem_of(place[None])
    band = _band(problem, state)
    part, near = crop(problem, *band), inside(state, band)
    return _lead(problem_of, place, part, band, near, factors(part, near), 0)


def _lead(
    problem_of: ProblemOf,
    place: Array,
    part: Problem,
    band: tuple[int, int],
    state: Array,
    shared: Factors,
    spent: int,
) -> _Lead:
    ny = problem_of(place[None]).shape[1]
    slopes = tuple(widen(slope, ny, band) for slope in _tangents(problem_of, place, part, band, state, shared))
    wide = widen(state, ny, band)
    return _Lead(wide, SOLVED_BY_NEWTON, "", spent, Known(place, wide, slopes), shared, band)


def _tangents(
    problem_of: ProblemOf, place: Array, part: Problem, band: tuple[int, int], state: Array, shared: Factors
) -> list[Array]:
    """-J^-1 dR/ds_p by one-sided differences of the residual in s, good enough to start from."""
    base = residual(part, state)
    steps = np.where(place < 0.5, TANGENT_STEP, -TANGENT_STEP)
    moved = crop(problem_of(place + np.diag(steps)), *band)
    rates = residual(moved, np.repeat(state, place.size, axis=3))
    tangents = -shared.solve((rates - base) / steps)
    return [np.ascontiguousarray(tangents[..., p : p + 1]) for p in range(place.size)]


def _marched(problem: Problem, spent: int, tolerance: float) -> _Lead:
    """The fall-back: march from a cold start; a member that does not come to rest has failed, and says so."""
    start = backwater(problem)
    marched = settle(problem, start, tolerance)
    status = SOLVED_BY_MARCHING if marched.steady else FAILED
    reason = "" if marched.steady else f"no steady state: {marched.sentence}"
    state = marched.state if marched.steady else np.full_like(start, np.nan)
    return _Lead(state, status, reason, spent + marched.steps, None, None, (0, problem.shape[1]))


def chord_in_band(
    problem: Problem, start: Array, shared: Factors, band: tuple[int, int], tolerance: float, most: int = 25
) -> Solution:
    """Members from their starts (nx, 3, rows, m) in the band of a centre, with its factors; one that outgrows the band
    counts as not converged.
    """
    part = crop(problem, *band)
    solution = chord(part, start, shared, tolerance, most)
    overflowing = overflows(part, solution.state, band, problem.shape[1])
    correction = np.where(overflowing, np.inf, solution.correction)
    return replace(solution, converged=solution.converged & ~overflowing, correction=correction)


def _band(problem: Problem, start: Array) -> tuple[int, int]:
    """Rows start..stop-1 to solve: those that may be wet, with a margin; whole sides through which water enters."""
    above = (start[:, LEVEL] - problem.bed[:, :, None]).max(axis=(0, 2))
    wet = np.flatnonzero(above > -MARGIN)
    if not wet.size:
        return 0, problem.shape[1]
    sides = {inflow.side for inflow in problem.inflows}
    south = 0 if "south" in sides else max(int(wet[0]) - 1, 0)
    north = problem.shape[1] if "north" in sides else min(int(wet[-1]) + 2, problem.shape[1])
    return south, north


def overflows(part: Problem, state: Array, band: tuple[int, int], ny: int) -> np.ndarray:
    """Whether water stands in an outermost row of the band, where a wall is that the problem does not have (m,)."""
    above = state[:, LEVEL] - part.bed[:, :, None]
    south = (above[:, 0].max(axis=0) > 0.0) & (band[0] > 0)
    north = (above[:, -1].max(axis=0) > 0.0) & (band[1] < ny)
    return south | north


def inside(state: Array, band: tuple[int, int]) -> Array:
    """The rows of a band, (nx, 3, rows, m)."""
    rows = np.array(state[:, :, band[0] : band[1]], order="C")
    rows[:, ACROSS, 0] = 0.0
    return rows


def widen(part: Array, rows: int, band: tuple[int, int]) -> Array:
    """The band put back into all rows; beyond it the level runs on flat and nothing moves."""
    nx, _, _, m = part.shape
    wide = np.zeros((nx, 3, rows, m))
    wide[:, :, band[0] : band[1]] = part
    wide[:, LEVEL, : band[0]] = part[:, LEVEL, :1]
    wide[:, LEVEL, band[1] :] = part[:, LEVEL, -1:]
    return wide
