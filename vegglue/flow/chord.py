"""Chord steps x <- x - M^-1 R(x) of many members with the factors M of one, accelerated by Anderson's mixing.

Members pass through a few lanes that are computed side by side; as soon as some are done, others enter their lanes.
Thin water is eased, see `thin_water`. A member is there when all corrections, in m and m/s, that may come after the
step that is made are below the tolerance together, see `is_near_enough`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Single
from vegglue.flow.anderson import Memory, kept
from vegglue.flow.jacobian import Factors
from vegglue.flow.problem import Problem, take
from vegglue.flow.thin_water import carry_thin, eased, largest_correction, weigh_thin, where_thin

# So many lanes are free before other members enter them [-]: chosen, not measured. One would rebuild the problem of all
# lanes for each member, more leave lanes idle.
ENTER = 2
# A step this long [m, m/s] leaves the range where the linearisation means anything: chosen, not measured, about a
# fourth of the depth and of the speed of the channels in `configs`.
LONGEST_CORRECTION = 0.25
# Numbers that the processor computes at once [-]. On 200 x 38 cells a step of 7 lanes takes 12.5 ms, one of 8 takes
# 9.1; of 23 and 24 18.9 and 15.7; of 3 and 4 7.8 and 8.7.
SIDE_BY_SIDE = 8
# By how much corrections are taken to shrink in each step that comes [-], at most and at least: one that is ten times
# smaller may have been lucky, and who shrinks more slowly is rare. Chosen, not measured one by one. Of 96 members of a
# wide prior solved to 1e-6 the worst five are off by 1e-6 to 4e-6 m/s, and by 8e-6 to 1.4e-5 where a correction below
# the tolerance was enough; of 256 of another prior one is off by 1.3e-5, and the worst was by 4e-6.
FASTEST_SHRINKING, SLOWEST_SHRINKING = 0.2, 0.9


@dataclass(frozen=True)
class Patience:
    """Who is waited for: a member of at most `most` steps, whose correction [m, m/s] in step n is below
    4 LONGEST_CORRECTION pace^n; nobody once `few` or less are at work and half as many need another reference anyway.
    Who is not waited for is left to another reference.
    """

    most: int
    pace: float = 1.0
    few: int = 0

    def is_over(self, working: int, left: int) -> bool:
        """Whether the last ones at work are left to another reference, after others were."""
        return working <= self.few <= 2 * left


@dataclass(frozen=True)
class ChordSolution:
    """States (nx, 3, ny, m), the least correction of each member [m/s, m], infinite if it strayed, iterations, and
    who converged.
    """

    state: Array
    correction: Array
    iterations: np.ndarray
    converged: np.ndarray


StartsOf = Callable[[np.ndarray], Array]
Deliver = Callable[[np.ndarray, ChordSolution], None]


@dataclass
class _Lanes:
    """Members side by side, each in its lane (m,) until it ends: who they are, the part of the problem that is theirs,
    their states (nx, 3, ny, m), where these were thin when any of them began, their steps, their least correction, the
    last one and the one before, and which lanes are at work. What grows thin later counts in full, which is stricter.
    """

    problem: Problem
    shared: Factors
    member: NDArray[np.int64]
    part: Problem
    state: Array
    thin: NDArray[np.bool_]
    memory: Memory
    age: np.ndarray
    best: Array
    last: Array
    before: Array
    running: np.ndarray

    def step(self, tolerance: float, patience: Patience) -> tuple[np.ndarray, ChordSolution]:
        """A chord step of all, the members that end with it, and how. They stay in their lanes until others enter."""
        step = _step(self.part, self.state, self.thin, self.shared)
        size = largest_correction(self.part, step, self.state, self.thin, self.shared.thick)
        self.age[self.running] += 1
        self.best[self.running] = np.minimum(self.best, size)[self.running]
        strayed = self.running & ~(size < 4.0 * LONGEST_CORRECTION)
        self.best[strayed] = np.inf
        there = self.running & is_near_enough(size, self.last, self.before, tolerance)
        late = (self.age >= patience.most) | (size >= 4.0 * LONGEST_CORRECTION * patience.pace**self.age)
        ended = strayed | there | self.running & late
        # Those that strayed or ended before must not spoil the arithmetic of others, nor what the lane remembers.
        step[..., ~self.running | strayed], self.state[..., strayed] = 0.0, 0.0
        self._move(step)
        self.running &= ~ended
        self.last, self.before = size, self.last
        solution = ChordSolution(
            kept(self.state, np.flatnonzero(ended)), self.best[ended], self.age[ended], there[ended]
        )
        return self.member[ended], solution

    def give_up(self) -> tuple[np.ndarray, ChordSolution]:
        """Those at work, where they are."""
        rest = np.flatnonzero(self.running)
        nobody = np.zeros(rest.size, dtype=bool)
        return self.member[rest], ChordSolution(kept(self.state, rest), self.best[rest], self.age[rest], nobody)

    def _move(self, step: Single) -> None:
        """To the states that the step leads to, mixed."""
        carry_thin(self.part, self.state, self.state, self.thin, self.shared.thick)
        self.memory.next_state(self.state, step)
        carry_thin(self.part, self.state, self.state, self.thin, self.shared.thick, back=True)

    def enter(self, free: np.ndarray, entering: np.ndarray, start: Array) -> None:
        """Members begin in free lanes."""
        self.member[free], self.age[free], self.running[free] = entering, 0, True
        self.best[free], self.last[free], self.before[free] = np.inf, np.inf, np.inf
        self.part = take(self.problem, self.member)
        self.state[..., free] = start
        # What lanes remember of faces that become thin only now is slightly off: it only guides steps.
        self.thin |= where_thin(take(self.problem, entering), start, self.shared.thick)
        self.memory.forget(free)

    def narrow(self) -> None:
        """Lanes at work, and idle ones up to a width that is computed well."""
        keep = np.argsort(~self.running, kind="stable")[: fitting_width(int(self.running.sum()))]
        self.member, self.age = self.member[keep], self.age[keep]
        self.best, self.last, self.before = self.best[keep], self.last[keep], self.before[keep]
        self.running = self.running[keep]
        self.state, self.part = kept(self.state, keep), take(self.problem, self.member)
        self.memory.keep(keep)


def is_near_enough(size: Array, last: Array, before: Array, tolerance: float) -> NDArray[np.bool_]:
    """Of each member (m,), whether all corrections after this one would be small, were they to shrink as they did:

        size (q + q^2 + ..) = size q / (1 - q) < tolerance,    q = max(size / last, (size / before)^(1/2))

    The last step alone may have been a lucky one of the mixing. last, before: infinite where there was none.
    """
    once = np.divide(size, last, out=np.full(size.size, SLOWEST_SHRINKING), where=np.isfinite(last))
    twice = np.divide(size, before, out=np.zeros(size.size), where=np.isfinite(before)) ** 0.5
    rate = np.clip(np.maximum(once, twice), FASTEST_SHRINKING, SLOWEST_SHRINKING)
    return np.asarray(size * rate / (1.0 - rate) < tolerance)


def fitting_width(members: int) -> int:
    """Lanes [-] for so many members: the next multiple of SIDE_BY_SIDE, or as many where they are few."""
    return members if members <= SIDE_BY_SIDE // 2 else -(-members // SIDE_BY_SIDE) * SIDE_BY_SIDE


def _begun(problem: Problem, members: np.ndarray, start: Array, shared: Factors) -> _Lanes:
    """Lanes with the members in them, and idle ones behind up to a width that is computed well."""
    count = fitting_width(members.size)
    lane = np.minimum(np.arange(count), members.size - 1)
    running = np.arange(count) < members.size
    members, start = members[lane], start[..., lane]
    part = take(problem, members)
    return _Lanes(
        problem=problem,
        shared=shared,
        member=members,
        part=part,
        state=np.ascontiguousarray(start),
        thin=where_thin(part, start, shared.thick),
        memory=Memory(start.shape),
        age=np.zeros(count, dtype=np.int64),
        best=np.full(count, np.inf),
        last=np.full(count, np.inf),
        before=np.full(count, np.inf),
        running=running,
    )


def stream(
    problem: Problem,
    queue: np.ndarray,
    starts_of: StartsOf,
    shared: Factors,
    tolerance: float,
    patience: Patience,
    width: int,
    deliver: Deliver,
) -> None:
    """Members of a queue through `width` lanes with one factorisation, each handed over as it ends.

    starts_of: states (nx, 3, ny, m) that members enter with, asked for when they do. A member ends when it converged,
    strayed, or is no longer waited for.
    """
    if not queue.size:
        return
    lanes, waiting = _begun(problem, queue[:width], starts_of(queue[:width]), shared), queue[width:]
    left = 0
    while True:
        members, ended = lanes.step(tolerance, patience)
        if members.size:
            deliver(members, ended)
            left += int((~ended.converged).sum())
        if not lanes.running.any() and not waiting.size:
            return
        if not waiting.size and patience.is_over(int(lanes.running.sum()), left):
            deliver(*lanes.give_up())
            return
        free = np.flatnonzero(~lanes.running)
        if waiting.size and (free.size >= ENTER or not lanes.running.any()):
            free, entering, waiting = free[: waiting.size], waiting[: free.size], waiting[free.size :]
            lanes.enter(free, entering, starts_of(entering))
        elif not waiting.size and fitting_width(int(lanes.running.sum())) < lanes.running.size:
            lanes.narrow()


def _step(part: Problem, state: Array, thin: NDArray[np.bool_], shared: Factors) -> Single:
    """The correction in the unknowns of chord steps."""
    rates = eased(part, state, shared.slope, part.boundaries.outlet)
    weigh_thin(part, rates, state, thin, shared.thick)
    return shared.step(rates)


def chord(problem: Problem, start: Array, shared: Factors, tolerance: float, most: int = 25) -> ChordSolution:
    """All members at once from their starts; those that stall are left where they got to."""
    members = np.arange(problem.members)
    end = ChordSolution(
        np.empty_like(start), np.empty(members.size), members.copy(), np.zeros(members.size, dtype=bool)
    )

    def keep(some: np.ndarray, ended: ChordSolution) -> None:
        end.state[..., some], end.correction[some] = ended.state, ended.correction
        end.iterations[some], end.converged[some] = ended.iterations, ended.converged

    stream(problem, members, lambda some: start[..., some], shared, tolerance, Patience(most), members.size, keep)
    return end
