"""Members solved together: cut into neighbourhoods of the prior, each led by a centre whose factors serve the others.

Coordinates s (m, d) are the members' places in the unit cube (prior probabilities), in which every parameter is alike.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vegglue.ensemble import FAILED, SOLVED_BY_MARCHING, SOLVED_BY_NEWTON
from vegglue.flow import ACROSS, ALONG, LEVEL, Array, Problem, crop, residual, take
from vegglue.march import settle
from vegglue.start import backwater
from vegglue.steady import Factors, Solution, chord, factors, newton

SIZE = 16
TANGENT_STEP = 1e-4
# Factors of a start that took more turns than this are renewed at the solution before others lean on them.
FRESH_AFTER = 8
# Rows whose bed lies further than this [m] above the water are left out of the band that is solved.
MARGIN = 0.3

ProblemOf = Callable[[Array], Problem]


@dataclass(frozen=True)
class Solved:
    """Members in the order asked for: states (nx, 3, ny, m) and how each was reached."""

    state: Array
    status: np.ndarray
    reason: list[str]
    iterations: np.ndarray


@dataclass(frozen=True)
class _Anchor:
    """A solved member others may start from: its place, state (nx, 3, ny, 1) and tangents d state / d s_p."""

    place: Array
    state: Array
    tangents: tuple[Array, ...]

    def predict(self, places: Array) -> Array:
        """state + sum_p tangent_p (s_p - place_p), (nx, 3, ny, m)."""
        predicted = np.repeat(self.state, len(places), axis=3)
        for p, tangent in enumerate(self.tangents):
            predicted += tangent * (places[:, p] - self.place[p])
        return predicted


def leaves(places: Array, size: int) -> list[np.ndarray]:
    """Index sets of at most `size` neighbours: halved across the longest side, in an order that walks the cube."""

    def halve(index: np.ndarray) -> list[np.ndarray]:
        if index.size <= size:
            return [index]
        longest = int(np.argmax(np.ptp(places[index], axis=0)))
        ordered = index[np.argsort(places[index, longest], kind="stable")]
        return halve(ordered[: index.size // 2]) + halve(ordered[index.size // 2 :])

    return halve(np.arange(len(places)))


def solve_members(problem_of: ProblemOf, places: Array, tolerance: float) -> Solved:
    """Steady states of all places; the result of a member does not depend on who else is asked for beyond `tolerance`."""
    whole = problem_of(places)
    (nx, ny), m = whole.shape, len(places)
    state = np.full((nx, 3, ny, m), np.nan)
    status, reason, iterations = np.full(m, FAILED), [""] * m, np.zeros(m, dtype=np.int64)
    anchors: list[_Anchor] = []
    for leaf in leaves(places, SIZE):
        pending = leaf
        while pending.size:
            centre = _next_centre(places, pending, leaf, anchors)
            lead = _solve_centre(problem_of, whole, centre, places, anchors, tolerance)
            iterations[centre] += lead.iterations
            status[centre], reason[centre], state[..., centre] = lead.status, lead.reason, lead.anchor.state[..., 0]
            pending = pending[pending != centre]
            if lead.status == FAILED:
                continue
            anchors.append(lead.anchor)
            if lead.factors is None or pending.size == 0:
                continue
            start = lead.anchor.predict(places[pending])
            followers, band = _chord_in_band(take(whole, pending), start, lead, tolerance)
            iterations[pending] += followers.iterations
            there = pending[followers.converged]
            status[there] = SOLVED_BY_NEWTON
            state[..., there] = _widen(followers.state[..., followers.converged], start[..., followers.converged], band)
            pending = pending[~followers.converged]
    return Solved(state, status, reason, iterations)


@dataclass(frozen=True)
class _Lead:
    anchor: _Anchor
    status: int
    reason: str
    iterations: int
    factors: Factors | None
    band: tuple[int, int]


def _next_centre(places: Array, pending: np.ndarray, leaf: np.ndarray, anchors: list[_Anchor]) -> int:
    """The middle of a fresh leaf; afterwards the pending member nearest to a solved one."""
    if pending.size == leaf.size:
        distance = ((places[pending] - places[leaf].mean(axis=0)) ** 2).sum(axis=1)
    else:
        known = np.array([anchor.place for anchor in anchors[-SIZE:]]).reshape(-1, places.shape[1])
        gaps = ((places[pending][:, None] - known[None]) ** 2).sum(axis=2)
        distance = gaps.min(axis=1) if known.size else gaps.sum(axis=1)
    return int(pending[np.argmin(distance)])


def _solve_centre(
    problem_of: ProblemOf, whole: Problem, centre: int, places: Array, anchors: list[_Anchor], tolerance: float
) -> _Lead:
    """Start from the nearest anchor, else cold; chord, then Newton, then Newton from cold, then marching."""
    place, problem = places[centre], take(whole, np.array([centre]))
    warm = None
    if anchors:
        nearest = min(anchors, key=lambda anchor: float(((anchor.place - place) ** 2).sum()))
        warm = nearest.predict(place[None])
    spent = 0
    for start, quick in ((warm, True), (warm, False), (backwater(problem), False)):
        if start is None:
            continue
        band = _band(problem, start)
        part, inside = crop(problem, *band), _inside(start, band)
        shared = factors(part, inside, precision=np.float32) if quick else None
        solution = newton(part, inside, tolerance) if shared is None else chord(part, inside, shared, tolerance, 20)
        spent += int(solution.iterations[0])
        if solution.converged[0] and _overflows(part, solution.state, band, problem.shape[1])[0]:
            start = _widen(solution.state, start, band)
            band = _band(problem, start)
            part, shared = crop(problem, *band), None
            solution = newton(part, _inside(start, band), tolerance)
        if solution.converged[0]:
            return _lead(problem_of, place, part, band, start, solution, shared, spent)
    return _marched(problem, place, spent, tolerance)


def _lead(
    problem_of: ProblemOf,
    place: Array,
    part: Problem,
    band: tuple[int, int],
    start: Array,
    solution: Solution,
    shared: Factors | None,
    spent: int,
) -> _Lead:
    if shared is None or solution.iterations[0] > FRESH_AFTER:
        shared = factors(part, solution.state, precision=np.float32)
    tangents = _tangents(problem_of, place, part, band, solution.state, shared)
    full = _widen(solution.state, start, band)
    wide = tuple(_widen(tangent, np.zeros_like(full), band) for tangent in tangents)
    return _Lead(_Anchor(place, full, wide), SOLVED_BY_NEWTON, "", spent, shared, band)


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


def _marched(problem: Problem, place: Array, spent: int, tolerance: float) -> _Lead:
    """The fall-back: march from a cold start; a member that does not come to rest has failed, and says so."""
    start = backwater(problem)
    marched = settle(problem, start, tolerance)
    status = SOLVED_BY_MARCHING if marched.steady else FAILED
    reason = "" if marched.steady else f"no steady state: {marched.sentence}"
    state = marched.state if marched.steady else np.full_like(start, np.nan)
    anchor = _Anchor(place, state, ())
    return _Lead(anchor, status, reason, spent + marched.steps, None, (0, problem.shape[1]))


def _chord_in_band(
    problem: Problem, start: Array, lead: _Lead, tolerance: float
) -> tuple[Solution, tuple[int, int]]:
    """Followers in the band of their centre; one that outgrows it counts as not converged."""
    assert lead.factors is not None
    part = crop(problem, *lead.band)
    solution = chord(part, _inside(start, lead.band), lead.factors, tolerance)
    overflowing = _overflows(part, solution.state, lead.band, problem.shape[1])
    kept = Solution(
        solution.state, solution.correction, solution.iterations, solution.converged & ~overflowing
    )
    return kept, lead.band


def _band(problem: Problem, start: Array) -> tuple[int, int]:
    """Rows start..stop-1 to solve: those that may be wet, with a margin; whole sides through which water enters."""
    above = (start[:, LEVEL] - problem.bed[:, :, None]).max(axis=(0, 2))
    wet = np.flatnonzero(above > -MARGIN)
    sides = {inflow.side for inflow in problem.inflows}
    south = 0 if "south" in sides else max(int(wet[0]) - 1, 0)
    north = problem.shape[1] if "north" in sides else min(int(wet[-1]) + 2, problem.shape[1])
    return south, north


def _overflows(part: Problem, state: Array, band: tuple[int, int], ny: int) -> np.ndarray:
    """Whether water stands in an outermost row of the band, where a wall is that the problem does not have."""
    above = state[:, LEVEL] - part.bed[:, :, None]
    south = (above[:, 0].max(axis=0) > 0.0) & (band[0] > 0)
    north = (above[:, -1].max(axis=0) > 0.0) & (band[1] < ny)
    return south | north


def _inside(state: Array, band: tuple[int, int]) -> Array:
    inside = np.ascontiguousarray(state[:, :, band[0] : band[1]])
    inside[:, ACROSS, 0] = 0.0
    return inside


def _widen(inside: Array, outside: Array, band: tuple[int, int]) -> Array:
    """The band put back; beyond it the level runs on flat and nothing moves."""
    wide = np.zeros_like(outside)
    wide[:, :, band[0] : band[1]] = inside
    wide[:, LEVEL, : band[0]] = inside[:, LEVEL, :1]
    wide[:, LEVEL, band[1] :] = inside[:, LEVEL, -1:]
    wide[:, ALONG, : band[0]] = 0.0
    return wide
