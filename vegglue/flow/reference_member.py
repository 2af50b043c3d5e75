"""One member solved alone or beside another, and what makes it the reference of its neighbours: factors, tangents, and
the band of rows they hold for.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.chord import ChordSolution
from vegglue.flow.equations import residual
from vegglue.flow.jacobian import Factors, factors
from vegglue.flow.march import FallBack, march_to_rest
from vegglue.flow.newton import CLOSE, FROM_AFAR, FROM_NEARBY, Beginning, finish, newton
from vegglue.flow.problem import Problem, crop
from vegglue.flow.starts import backwater
from vegglue.flow.status import FAILED, SOLVED_BY_MARCHING, SOLVED_BY_NEWTON
from vegglue.flow.wet_band import chord_in_band, overflows, rows_inside, wet_band, widen

# Step [-] in the unit cube of the one-sided differences of tangents. Chosen, not measured: tangents decide where to
# begin only, and are off by the curvature over such a step.
TANGENT_STEP = 1e-4
# The problem of members at points (m, d) of the unit cube.
ProblemOf = Callable[[Array], Problem]


@dataclass(frozen=True)
class Attempt:
    """One member solved by itself.

    solution: its state in a band of rows that may be wet; factors there, None if it has not converged; moved: by how
    much the state has moved since them, 0 within CLOSE [m, m/s].
    """

    solution: ChordSolution
    factors: Factors | None
    moved: float
    band: tuple[int, int]


@dataclass(frozen=True)
class LinearisedMember:
    """x + sum_p dx/ds_p (s_p - point_p): a state and its tangents at one point of the unit cube.

    Attributes
    ----------
    point
        (d,).
    state
        x (nx, 3, ny, 1), rough if it was only a stride on the way to others.
    slopes
        dx/ds_p, d arrays (nx, 3, ny, 1).
    """

    point: Array
    state: Array
    slopes: tuple[Array, ...]

    def predict(self, points: Array) -> Array:
        """state + sum_p slope_p (s_p - point_p), (nx, 3, ny, m)."""
        predicted = np.repeat(self.state, len(points), axis=3)
        for p, slope in enumerate(self.slopes):
            predicted += slope * (points[:, p] - self.point[p])
        return predicted


@dataclass(frozen=True)
class ReferenceMember:
    """A member whose factors serve its neighbours.

    Attributes
    ----------
    state
        (nx, 3, ny, 1), NaN if there is none.
    status, reason, iterations
        How it ended, see `status`, why if it failed, and after how many steps.
    linearised
        With its tangents, if they are wanted and it has not been marched.
    factors, band
        J^-1 in its band of rows, None if it has been marched or failed, and that band.
    """

    state: Array
    status: int
    reason: str
    iterations: int
    linearised: LinearisedMember | None
    factors: Factors | None
    band: tuple[int, int]


def linearised_median(
    problem_of: ProblemOf, parameters: int, tolerance: float, how: FallBack
) -> LinearisedMember | None:
    """The member at the medians of all priors, for others to begin from.

    Parameters
    ----------
    parameters : int
        d.
    tolerance : [m, m/s]

    Returns
    -------
    LinearisedMember or None
        None if it has to be marched.
    """
    point = np.full(parameters, 0.5)
    return solve_reference(problem_of, problem_of(point[None]), point, None, tolerance, how).linearised


def solve_reference(
    problem_of: ProblemOf, problem: Problem, point: Array, warm: Array | None, tolerance: float, how: FallBack
) -> ReferenceMember:
    """R(x) = 0 of one member, see `solve_alone`, with its tangents.

    Parameters
    ----------
    problem_of : callable
        The problem of members at other points (n, d).
    problem, point : Problem, (d,)
        Of the member.
    warm, tolerance, how
        As `solve_alone`.
    """
    alone = solve_alone(problem, warm, tolerance, how)
    return alone if alone.factors is None else _with_tangents(problem_of, problem, point, alone)


def solve_alone(problem: Problem, warm: Array | None, tolerance: float, how: FallBack) -> ReferenceMember:
    """R(x) = 0 of one member from a warm start, then from a cold one, then by marching; without tangents.

    Parameters
    ----------
    warm : (nx, 3, ny, 1) or None
    tolerance : [m, m/s]
        Largest correction.
    """
    spent = 0
    for start in [warm, None] if warm is not None else [None]:
        tried = settled(problem, start, tolerance)
        spent += int(tried.solution.iterations[0])
        if tried.factors is not None:
            inside, band = tried.solution.state, tried.band
            shared = tried.factors if tried.moved < CLOSE else factors(crop(problem, *band), inside)
            state = widen(inside, problem.shape[1], band)
            return ReferenceMember(state, SOLVED_BY_NEWTON, "", spent, None, shared, band)
    cold, rows = backwater(problem), (0, problem.shape[1])
    marched = march_to_rest(problem, cold, tolerance, how)
    spent += marched.steps
    if marched.steady:
        return ReferenceMember(marched.state, SOLVED_BY_MARCHING, "", spent, None, None, rows)
    reason = f"no steady state: {marched.sentence}"
    return ReferenceMember(np.full_like(cold, np.nan), FAILED, reason, spent, None, None, rows)


def reference_at(problem_of: ProblemOf, problem: Problem, point: Array, state: Array) -> ReferenceMember:
    """A member already solved as a reference, with its factors and tangents.

    Parameters
    ----------
    problem_of, problem, point
        As `solve_reference`.
    state : (nx, 3, ny, 1)
    """
    band = wet_band(problem, state)
    shared = factors(crop(problem, *band), rows_inside(state, band))
    solved = ReferenceMember(state, SOLVED_BY_NEWTON, "", 0, None, shared, band)
    return _with_tangents(problem_of, problem, point, solved)


def reference_beside(
    problem_of: ProblemOf, problem: Problem, point: Array, other: ReferenceMember, tolerance: float, how: FallBack
) -> ReferenceMember:
    """R(x) = 0 of one member with the factors of a reference nearby, else as `solve_reference`.

    Parameters
    ----------
    problem_of, problem, point, tolerance, how
        As `solve_reference`.
    other : ReferenceMember
        With factors and tangents.
    """
    assert other.linearised is not None
    assert other.factors is not None
    start = other.linearised.predict(point[None])
    end = chord_in_band(problem, rows_inside(start, other.band), other.factors, other.band, tolerance)
    spent = int(end.iterations[0])
    if end.converged[0]:
        state = widen(end.state, problem.shape[1], other.band)
        return replace(reference_at(problem_of, problem, point, state), state=state, iterations=spent)
    alone = solve_reference(problem_of, problem, point, start, tolerance, how)
    return replace(alone, iterations=spent + alone.iterations)


def settled(problem: Problem, warm: Array | None, tolerance: float) -> Attempt:
    """R(x) = 0 of one member by one factorisation, then by Newton.

    Parameters
    ----------
    problem
        Of the member.
    warm
        A state nearby to begin from (nx, 3, ny, 1); a rough estimate if None, and then by Newton only.
    tolerance
        Of corrections [m, m/s].
    """
    if warm is None:
        return _by_newton(problem, backwater(problem), tolerance, FROM_AFAR)
    band = wet_band(problem, warm)
    tried = _finished(problem, rows_inside(warm, band), band, tolerance)
    if tried.factors is not None:
        return tried
    return _after(tried.solution, _by_newton(problem, warm, tolerance, FROM_NEARBY))


def _by_newton(problem: Problem, start: Array, tolerance: float, how: Beginning) -> Attempt:
    band = wet_band(problem, start)
    near = newton(crop(problem, *band), rows_inside(start, band), CLOSE, how)
    if not near.converged[0]:
        return Attempt(near, None, np.inf, band)
    return _after(near, _finished(problem, near.state, band, tolerance))


def _finished(problem: Problem, near: Array, band: tuple[int, int], tolerance: float) -> Attempt:
    """`finish` in a band, and again in a wider one if water came to stand at the edge of this one."""
    part = crop(problem, *band)
    tried = Attempt(*finish(part, near, tolerance), band)
    state = tried.solution.state
    if tried.factors is None or not overflows(part, state, band, problem.shape[1])[0]:
        return tried
    wider = widen(state, problem.shape[1], band)
    band = wet_band(problem, wider)
    again = Attempt(*finish(crop(problem, *band), rows_inside(wider, band), tolerance), band)
    return _after(tried.solution, again)


def _after(first: ChordSolution, then: Attempt) -> Attempt:
    """What came in the end, with the iterations of both."""
    return replace(then, solution=replace(then.solution, iterations=first.iterations + then.solution.iterations))


def _with_tangents(problem_of: ProblemOf, problem: Problem, point: Array, solved: ReferenceMember) -> ReferenceMember:
    """A reference with its tangents -J^-1 dR/ds_p, dR by one-sided differences: good enough to start from."""
    assert solved.factors is not None
    band, state = solved.band, rows_inside(solved.state, solved.band)
    base = residual(crop(problem, *band), state)
    steps = np.where(point < 0.5, TANGENT_STEP, -TANGENT_STEP)
    rates = residual(crop(problem_of(point + np.diag(steps)), *band), np.repeat(state, point.size, axis=3))
    tangents = -solved.factors.solve((rates - base) / steps)
    slopes = [np.ascontiguousarray(tangents[..., p : p + 1]) for p in range(point.size)]
    wide = tuple(widen(slope, problem.shape[1], band) for slope in slopes)
    return replace(solved, linearised=LinearisedMember(point, solved.state, wide))
