"""Chord steps x <- x - M^-1 R(x) of many members with the factors M of one, accelerated by Anderson's mixing.

Walker and Ni 2011, doi:10.1137/10078356X.

Members pass through a few lanes that are computed side by side; as soon as half of the lanes are done, others enter.
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
        self.new = np.zeros(shape[-1], dtype=bool)
        self.count = 0

    def keep(self, lanes: np.ndarray, entering: int) -> None:
        """Some lanes, and behind them new ones with nothing to remember."""
        self.turns, self.sums = _lanes(self.turns, lanes, entering), _lanes(self.sums, lanes, entering)
        self.gram = _lanes(self.gram, lanes, entering)
        self.new = np.arange(lanes.size + entering) >= lanes.size
        if self.last is not None:
            self.last = _lanes(self.last[0], lanes, entering), _lanes(self.last[1], lanes, entering)

    def next_state(self, state: Array, step: Single) -> Array:
        """x + f, less what the memory knows to overshoot."""
        if self.last is not None:
            last_state, last_step = self.last
            last_state[..., self.new], last_step[..., self.new] = state[..., self.new], step[..., self.new]
            slot, known = self.count % DEPTH, min(self.count + 1, DEPTH)
            row, right = blocks.remember(self.turns[:known], self.sums, slot, state, step, last_state, last_step)
            self.count += 1
            self.gram[slot, :known], self.gram[:known, slot] = row, row
            weights = blocks.minimise(np.ascontiguousarray(self.gram[:known, :known]), right)
            mixed = blocks.mix(state, step, self.sums[:known], weights)
        else:
            mixed = state + step
        self.last = state, step
        self.new[:] = False
        return mixed


def _lanes(values: Any, lanes: np.ndarray, entering: int) -> Any:
    """Some lanes, and behind them as many of zeros as enter."""
    wanted = np.zeros((*values.shape[:-1], lanes.size + entering), values.dtype)
    wanted[..., : lanes.size] = values[..., lanes]
    return wanted


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

    starts_of: states (nx, 3, ny, m) that members enter with, asked for when they do. A member ends when it converged,
    strayed, or took `most` steps.
    """
    if not queue.size:
        return
    here, waiting = queue[:lanes], queue[lanes:]
    part, state = take(problem, here), starts_of(here)
    carried, thin = _carried(part, state, shared)
    age, best, running = np.zeros(here.size, dtype=np.int64), np.full(here.size, np.inf), np.ones(here.size, dtype=bool)
    memory = _Memory(state.shape)
    while True:
        step, after = _step(part, state, carried, thin, shared)
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
        # Members that ended stay in their lane until the next cut: they must not spoil the arithmetic of others.
        step[..., ~running] = 0.0
        carried = memory.next_state(carried, step)
        state = carried.copy()
        carry(part, state, state, thin, shared.thick, back=True)
        if 2 * running.sum() <= running.size:
            keep = np.flatnonzero(running)
            entering, waiting = np.split(waiting, [lanes - keep.size])
            here = np.concatenate([here[keep], entering])
            part, state = take(problem, here), _lanes(state, keep, entering.size)
            if entering.size:
                state[..., keep.size :] = starts_of(entering)
            # What lanes remember of faces that become thin only now is slightly off: it only guides steps.
            carried, thin = _carried(part, state, shared)
            memory.keep(keep, entering.size)
            age = np.concatenate([age[keep], np.zeros(entering.size, dtype=np.int64)])
            best = np.concatenate([best[keep], np.full(entering.size, np.inf)])
            running = np.ones(here.size, dtype=bool)


def _carried(part: Problem, state: Array, shared: Factors) -> tuple[Array, NDArray[np.int64]]:
    """The unknowns of chord steps for a state, and the faces where they are other than it."""
    thin = thin_faces(part, state, shared.thick)
    carried = state.copy()
    carry(part, carried, state, thin, shared.thick)
    return carried, thin


def _step(
    part: Problem, state: Array, carried: Array, thin: NDArray[np.int64], shared: Factors
) -> tuple[Single, Array]:
    """The correction in the unknowns of chord steps, and the state after it."""
    rates = eased(part, state, shared.slope)
    carry(part, rates, state, thin, shared.thick)
    step = shared.step(rates)
    after = carried + step
    carry(part, after, after, thin, shared.thick, back=True)
    return step, after


def chord(problem: Problem, start: Array, shared: Factors, tolerance: float, most: int = 25) -> Solution:
    """All members at once from their starts; those that stall are left where they got to."""
    members = np.arange(problem.members)
    end = Solution(np.empty_like(start), np.empty(members.size), members.copy(), np.zeros(members.size, dtype=bool))

    def note(some: np.ndarray, ended: Solution) -> None:
        end.state[..., some], end.correction[some] = ended.state, ended.correction
        end.iterations[some], end.converged[some] = ended.iterations, ended.converged

    stream(problem, members, lambda some: start[..., some], shared, tolerance, most, members.size, note)
    return end
