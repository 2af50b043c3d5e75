"""Chord steps x <- x - M^-1 R(x) of many members with the factors M of one, accelerated by Anderson's mixing.

Members pass through a few batch slots that are computed side by side; as soon as some are done, others enter theirs.
Thin water is eased, see `thin_water`. A member has converged when the corrections [m, m/s] that may follow the step
just made are together below the tolerance, see `is_near_enough`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.flow.anderson import Memory, kept
from vegglue.flow.jacobian import Factors
from vegglue.flow.problem import Problem, take
from vegglue.flow.thin_water import carry_thin, eased, largest_correction, weigh_thin, where_thin

# So many slots are free before other members enter them [-]: chosen, not measured. One would rebuild the problem of all
# slots for each member, more leave slots idle.
ENTER = 2
# A step this long [m, m/s] leaves the range where the linearisation means anything: chosen, not measured, about a
# fourth of the depth and of the speed of the channels in `configs`.
LONGEST_CORRECTION = 0.25
# Numbers that the processor computes at once [-]. On 200 x 38 cells a step of 7 slots takes 12.5 ms, one of 8 takes
# 9.1; of 23 and 24 18.9 and 15.7; of 3 and 4 7.8 and 8.7.
SIDE_BY_SIDE = 8
# By how much corrections are taken to shrink in each step that comes [-], at most and at least: one that is ten times
# smaller may have been lucky, and slower shrinking is rare. Chosen, not measured one by one. Of 96 members of a
# wide prior solved to 1e-6 the worst five are off by 1e-6 to 4e-6 m/s, and by 8e-6 to 1.4e-5 where a correction below
# the tolerance was enough; of 256 of another prior one is off by 1.3e-5, and the worst was by 4e-6.
FASTEST_SHRINKING, SLOWEST_SHRINKING = 0.2, 0.9


@dataclass(frozen=True)
class IterationLimits:
    """When members that have not converged are left to another reference."""

    most: int  # steps of a member at most
    pace: float = 1.0  # its correction [m, m/s] in step n stays below 4 LONGEST_CORRECTION pace^n
    few: int = 0  # all end once so many or less are at work, if at least half as many need another reference anyway


@dataclass(frozen=True)
class ChordSolution:
    """Where members ended."""

    state: Array  # (nx, 3, ny, m)
    correction: Array  # least correction of each (m,) [m, m/s], infinite if it strayed
    iterations: np.ndarray  # steps of each (m,)
    converged: np.ndarray  # whether it did (m,)


StartsOf = Callable[[np.ndarray], Array]
Deliver = Callable[[np.ndarray, ChordSolution], None]


@dataclass
class _Slots:
    """Members side by side, each in its slot (m,) until it ends: which, the part of the problem that is theirs, their
    states (nx, 3, ny, m), where these were thin when any of them began, their steps, their least correction, the last
    one and the one before, and which slots are at work. What grows thin later counts in full, which is stricter.
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

    def step(self, tolerance: float, limits: IterationLimits) -> tuple[np.ndarray, ChordSolution]:
        """A chord step of all, the members that end with it, and how. They stay in their slots until others enter."""
        part, shared = self.part, self.shared
        rates = eased(part, self.state, shared.slope, part.boundaries.outlet)
        weigh_thin(part, rates, self.state, self.thin, shared.thick)
        step = shared.step(rates)
        size = largest_correction(part, step, self.state, self.thin, shared.thick)
        self.age[self.running] += 1
        self.best[self.running] = np.minimum(self.best, size)[self.running]
        strayed = self.running & ~(size < 4.0 * LONGEST_CORRECTION)
        self.best[strayed] = np.inf
        there = self.running & is_near_enough(size, self.last, self.before, tolerance)
        late = (self.age >= limits.most) | (size >= 4.0 * LONGEST_CORRECTION * limits.pace**self.age)
        ended = strayed | there | self.running & late
        # Those that strayed or ended before must not spoil the arithmetic of others, nor the memory of their slots.
        step[..., ~self.running | strayed], self.state[..., strayed] = 0.0, 0.0
        carry_thin(part, self.state, self.state, self.thin, shared.thick)
        self.memory.next_state(self.state, step)
        carry_thin(part, self.state, self.state, self.thin, shared.thick, back=True)
        self.running &= ~ended
        self.last, self.before = size, self.last
        return self._ended(np.flatnonzero(ended), there[ended])

    def give_up(self) -> tuple[np.ndarray, ChordSolution]:
        """Those at work, as they are."""
        rest = np.flatnonzero(self.running)
        return self._ended(rest, np.zeros(rest.size, dtype=bool))

    def _ended(self, slots: np.ndarray, converged: np.ndarray) -> tuple[np.ndarray, ChordSolution]:
        return self.member[slots], ChordSolution(kept(self.state, slots), self.best[slots], self.age[slots], converged)

    def enter(self, free: np.ndarray, entering: np.ndarray, start: Array) -> None:
        """Members begin in free slots."""
        self.member[free], self.age[free], self.running[free] = entering, 0, True
        self.best[free], self.last[free], self.before[free] = np.inf, np.inf, np.inf
        self.part = take(self.problem, self.member)
        self.state[..., free] = start
        # What slots remember of faces that become thin only now is slightly off: it only guides steps.
        self.thin |= where_thin(take(self.problem, entering), start, self.shared.thick)
        self.memory.forget(free)

    def narrow(self) -> None:
        """Slots at work, and idle ones up to a width that is computed well."""
        keep = np.argsort(~self.running, kind="stable")[: _fitting_width(int(self.running.sum()))]
        self.member, self.age = self.member[keep], self.age[keep]
        self.best, self.last, self.before = self.best[keep], self.last[keep], self.before[keep]
        self.running = self.running[keep]
        self.state, self.part = kept(self.state, keep), take(self.problem, self.member)
        self.memory.keep(keep)


def is_near_enough(size: Array, last: Array, before: Array, tolerance: float) -> NDArray[np.bool_]:
    """size (q + q^2 + ..) = size q / (1 - q) < tolerance,    q = max(size / last, (size / before)^(1/2))

    Whether all corrections of each member (m,) after this one would be small if they shrank as they did. The last step
    alone may have been a lucky one of the mixing. last, before: corrections of the steps before, infinite if none.
    """
    once = np.divide(size, last, out=np.full(size.size, SLOWEST_SHRINKING), where=np.isfinite(last))
    twice = np.divide(size, before, out=np.zeros(size.size), where=np.isfinite(before)) ** 0.5
    rate = np.clip(np.maximum(once, twice), FASTEST_SHRINKING, SLOWEST_SHRINKING)
    return np.asarray(size * rate / (1.0 - rate) < tolerance)


def _fitting_width(members: int) -> int:
    """Slots [-] for so many members: the next multiple of SIDE_BY_SIDE, or as many if they are few."""
    return members if members <= SIDE_BY_SIDE // 2 else -(-members // SIDE_BY_SIDE) * SIDE_BY_SIDE


def stream(
    problem: Problem,
    queue: np.ndarray,
    starts_of: StartsOf,
    shared: Factors,
    tolerance: float,
    limits: IterationLimits,
    width: int,
    deliver: Deliver,
) -> None:
    """x <- x - M^-1 R(x) of a queue of members through `width` batch slots, with one factorisation M.

    A member ends when it has converged, strayed, or reached a limit.

    Parameters
    ----------
    problem
        Of all members.
    queue
        Indices of the members, in the order in which they enter.
    starts_of
        States (nx, 3, ny, n) of members that enter, called when they do.
    shared
        Factors of a reference member.
    tolerance
        Of corrections [m, m/s].
    limits
        When members end that have not converged.
    width
        Batch slots.
    deliver
        Called with members that end, and how.
    """
    if not queue.size:
        return
    first, waiting, left = queue[:width], queue[width:], 0
    count = _fitting_width(first.size)  # idle slots behind, up to a width that is computed well
    slot = np.minimum(np.arange(count), first.size - 1)
    start = starts_of(first)[..., slot]
    part = take(problem, first[slot])
    slots = _Slots(
        problem=problem,
        shared=shared,
        member=first[slot],
        part=part,
        state=np.ascontiguousarray(start),
        thin=where_thin(part, start, shared.thick),
        memory=Memory(start.shape),
        age=np.zeros(count, dtype=np.int64),
        best=np.full(count, np.inf),
        last=np.full(count, np.inf),
        before=np.full(count, np.inf),
        running=np.arange(count) < first.size,
    )
    while True:
        members, ended = slots.step(tolerance, limits)
        if members.size:
            deliver(members, ended)
            left += int((~ended.converged).sum())
        working = int(slots.running.sum())
        if not working and not waiting.size:
            return
        if not waiting.size and working <= limits.few <= 2 * left:
            deliver(*slots.give_up())
            return
        free = np.flatnonzero(~slots.running)
        if waiting.size and (free.size >= ENTER or not working):
            free, entering, waiting = free[: waiting.size], waiting[: free.size], waiting[free.size :]
            slots.enter(free, entering, starts_of(entering))
        elif not waiting.size and _fitting_width(working) < slots.running.size:
            slots.narrow()


def chord(problem: Problem, start: Array, shared: Factors, tolerance: float, most: int = 25) -> ChordSolution:
    """x <- x - M^-1 R(x) of all members at once, see `stream`; those that stall are left as they are.

    Parameters
    ----------
    start : (nx, 3, ny, m)
    shared : Factors
        M, of a reference member.
    tolerance : [m, m/s]
    most : int
        Steps of each member at most.
    """
    members = np.arange(problem.members)
    end = ChordSolution(
        np.empty_like(start), np.empty(members.size), members.copy(), np.zeros(members.size, dtype=bool)
    )

    def keep(some: np.ndarray, ended: ChordSolution) -> None:
        end.state[..., some], end.correction[some] = ended.state, ended.correction
        end.iterations[some], end.converged[some] = ended.iterations, ended.converged

    limits = IterationLimits(most)
    stream(problem, members, lambda some: start[..., some], shared, tolerance, limits, members.size, keep)
    return end
