"""Chord steps x <- x - M^-1 R(x) of many members with the factors M of one, accelerated by Anderson's mixing.

Walker and Ni 2011, doi:10.1137/10078356X.

Members pass through a few lanes that are computed side by side; as soon as some are done, others enter their lanes.
Thin water is eased, see `easing`. A member is there when its correction, in m and m/s, is below the tolerance.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue import blocks
from vegglue.flow import Array, Problem, carry, correction, eased, take, thin_faces
from vegglue.jacobian import Factors, Single

DEPTH = 6
# So many lanes are free before other members enter them.
ENTER = 2
# A step this long [m, m/s] leaves the range where the linearisation means anything.
LONGEST = 0.25


@dataclass(frozen=True)
class Solution:
    """States (nx, 3, ny, m), the least correction of each member [m/s, m], infinite if it strayed, iterations, and
    who converged.
    """

    state: Array
    correction: Array
    iterations: np.ndarray
    converged: np.ndarray


StartsOf = Callable[[np.ndarray], Array]
Deliver = Callable[[np.ndarray, Solution], None]


class _Memory:
    """The last DEPTH changes of every lane's correction, for Anderson's mixing; filled in place, slot by slot."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.turns: Single = np.zeros((DEPTH, *shape), np.float32)
        self.sums: Single = np.zeros((DEPTH, *shape), np.float32)
        self.gram = np.zeros((DEPTH, DEPTH, shape[-1]))
        self.last: tuple[Array, Single] | None = None
        # When each slot was filled and since when each lane has had its member, counted in steps.
        self.filled, self.since, self.count = np.zeros(DEPTH, dtype=np.int64), np.zeros(shape[-1], dtype=np.int64), 0

    def keep(self, lanes: np.ndarray) -> None:
        """Some lanes only."""
        self.turns, self.sums, self.gram = (_lanes(values, lanes) for values in (self.turns, self.sums, self.gram))
        self.since = self.since[lanes]
        if self.last is not None:
            self.last = _lanes(self.last[0], lanes), _lanes(self.last[1], lanes)

    def forget(self, lanes: np.ndarray) -> None:
        """Lanes in which other members begin."""
        self.gram[..., lanes], self.since[lanes] = 0.0, self.count

    def next_state(self, state: Array, step: Single) -> Array:
        """x + f, less what the memory knows to overshoot."""
        mixed = state + step if self.last is None else self._mixed(state, step, *self.last)
        self.last, self.count = (state, step), self.count + 1
        return mixed

    def _mixed(self, state: Array, step: Single, last_state: Array, last_step: Single) -> Array:
        slot, known = (self.count - 1) % DEPTH, min(self.count, DEPTH)
        row, right = blocks.remember(self.turns[:known], self.sums, slot, state, step, last_state, last_step)
        self.filled[slot] = self.count
        own = self.filled[:known, None] > self.since
        row, right = np.where(own & own[slot], row, 0.0), np.where(own, right, 0.0)
        self.gram[slot, :known], self.gram[:known, slot] = row, row
        weights = blocks.minimise(np.ascontiguousarray(self.gram[:known, :known]), right)
        return blocks.mix(state, step, self.sums[:known], weights)


def _lanes(values: Any, lanes: np.ndarray) -> Any:
    return np.ascontiguousarray(values[..., lanes])


def stream(
    problem: Problem,
    queue: np.ndarray,
    starts_of: StartsOf,
    shared: Factors,
    tolerance: float,
    most: int,
    lanes: int,
    deliver: Deliver,
) -> None:
    """Members of a queue through so many lanes with one factorisation, each handed over as it ends.

    starts_of: states (nx, 3, ny, m) that members enter with, asked for when they do, written over. A member ends when
    it converged, strayed, or took `most` steps.
    """
    if not queue.size:
        return
    here, waiting = queue[:lanes].copy(), queue[lanes:]
    part, state = take(problem, here), starts_of(here)
    thin = thin_faces(part, state, shared.thick)
    carried = _carried(part, state, thin, shared)
    age, best, running = np.zeros(here.size, dtype=np.int64), np.full(here.size, np.inf), np.ones(here.size, dtype=bool)
    memory, after = _Memory(state.shape), np.empty_like(state)
    while True:
        step = _step(part, state, thin, shared)
        np.add(carried, step, out=after)
        carry(part, after, after, thin, shared.thick, back=True)
        size = correction(part, after, state)
        age[running] += 1
        best[running] = np.minimum(best, size)[running]
        strayed = running & ~(size < 4.0 * LONGEST)
        best[strayed] = np.inf
        ended = strayed | running & ((size < tolerance) | (age >= most))
        if ended.any():
            deliver(here[ended], Solution(after[..., ended], best[ended], age[ended], size[ended] < tolerance))
            running = running & ~ended
        if not running.any() and not waiting.size:
            return
        # Members that ended stay in their lane until another enters: they must not spoil the arithmetic of others, nor
        # those that strayed what the lane remembers.
        step[..., ~running], carried[..., strayed] = 0.0, 0.0
        carried = memory.next_state(carried, step)
        np.copyto(state, carried)
        carry(part, state, state, thin, shared.thick, back=True)
        free = np.flatnonzero(~running)
        if waiting.size and free.size >= ENTER:
            free, entering, waiting = free[: waiting.size], waiting[: free.size], waiting[free.size :]
            here[free], age[free], best[free], running[free] = entering, 0, np.inf, True
            part, start = take(problem, here), starts_of(entering)
            state[..., free] = start
            thin |= thin_faces(take(problem, entering), start, shared.thick)
            # What lanes remember of faces that become thin only now is slightly off: it only guides steps.
            carried = _carried(part, state, thin, shared)
            memory.forget(free)
        elif not waiting.size and 2 * running.sum() <= running.size:
            keep = np.flatnonzero(running)
            here, age, best, running = here[keep], age[keep], best[keep], running[keep]
            part, state, carried = take(problem, here), _lanes(state, keep), _lanes(carried, keep)
            memory.keep(keep)
            after = np.empty_like(state)


def _carried(part: Problem, state: Array, thin: NDArray[np.bool_], shared: Factors) -> Array:
    """The unknowns of chord steps for a state."""
    carried = state.copy()
    carry(part, carried, state, thin, shared.thick)
    return carried


def _step(part: Problem, state: Array, thin: NDArray[np.bool_], shared: Factors) -> Single:
    """The correction in the unknowns of chord steps."""
    rates = eased(part, state, shared.slope)
    carry(part, rates, state, thin, shared.thick)
    return shared.step(rates)


def chord(problem: Problem, start: Array, shared: Factors, tolerance: float, most: int = 25) -> Solution:
    """All members at once from their starts; those that stall are left where they got to."""
    members = np.arange(problem.members)
    end = Solution(np.empty_like(start), np.empty(members.size), members.copy(), np.zeros(members.size, dtype=bool))

    def note(some: np.ndarray, ended: Solution) -> None:
        end.state[..., some], end.correction[some] = ended.state, ended.correction
        end.iterations[some], end.converged[some] = ended.iterations, ended.converged

    stream(problem, members, lambda some: start[..., some], shared, tolerance, most, members.size, note)
    return end
