"""Anderson's mixing of fixed-point steps f, lane by lane: x <- x + f - sum_d g_d s_d, with g the least squares of
f - sum_d g_d t_d; t the change from one step to the next, s that change and the one of x. The least squares see one
column in a few only, which lead to nearly the same weights with a fraction of the memory to read.

Walker and Ni 2011, doi:10.1137/10078356X.
"""

from typing import Any

import numpy as np

from vegglue.arrays import Array, Single
from vegglue.compilation import compiled_exactly
from vegglue.flow.block_elimination import put

# Steps remembered [-]: six as in a sketch of the solver, where all members of five clusters then took 3 to 8 steps;
# not measured since. More need more memory, by which a step is bound.
MEMORY_DEPTH = 6
# Of so many columns [-] one tells Anderson's mixing how steps change. With one of four it takes 1 to 4 % more steps
# than with all, each of which reads a third less memory (DECISIONS).
SPARSE = 4


@compiled_exactly
def remember(turns, sums, slot, moved, step, last_step):
    """Slot of the memory: t = f - f_last, s = t + (x - x_last), member by member; t of every SPARSE-th column only.

    Returned: inner products per member of that turn with every turn, and of every turn with f, two arrays (depth, m).
    """
    depth, m = turns.shape[0], turns.shape[4]
    _, nx, _, ny, _ = sums.shape
    gram, right = np.zeros((depth, m)), np.zeros((depth, m))
    for i in range(nx):
        for e in range(3):
            for j in range(ny):
                for k in range(m):
                    sums[slot, i, e, j, k] = step[i, e, j, k] - last_step[i, e, j, k] + moved[i, e, j, k]
                if i % SPARSE:
                    continue
                c = i // SPARSE
                for k in range(m):
                    turns[slot, c, e, j, k] = step[i, e, j, k] - last_step[i, e, j, k]
                for d in range(depth):
                    for k in range(m):
                        gram[d, k] += turns[slot, c, e, j, k] * turns[d, c, e, j, k]
                        right[d, k] += turns[d, c, e, j, k] * step[i, e, j, k]
    return gram, right


@compiled_exactly
def mix(state, step, sums, weights):
    """Anderson's next state x + f - sum_d g_d s_d, in place; returned: by how much that differs (nx, 3, ny, m)."""
    depth, nx, _, ny, m = sums.shape
    moved = np.empty_like(step)
    for i in range(nx):
        for e in range(3):
            for j in range(ny):
                for k in range(m):
                    moved[i, e, j, k] = step[i, e, j, k]
                for d in range(depth):
                    for k in range(m):
                        moved[i, e, j, k] -= weights[d, k] * sums[d, i, e, j, k]
                for k in range(m):
                    state[i, e, j, k] += moved[i, e, j, k]
    return moved


@compiled_exactly
def minimise(gram, right):
    """g (depth, m) with gram g = right, gram (depth, depth, m): the least squares of Anderson's mixing; 0 for a lane
    that has run away, whose numbers are none.
    """
    depth, _, m = gram.shape
    weights = np.empty((depth, m))
    for k in range(m):
        matrix = np.empty((depth, depth))
        for a in range(depth):
            for b in range(depth):
                matrix[a, b] = gram[a, b, k]
            matrix[a, a] = matrix[a, a] * (1.0 + 1e-10) + 1e-300
        if not (np.isfinite(matrix).all() and np.isfinite(right[:, k]).all()):
            weights[:, k] = 0.0
            continue
        put(weights[:, k : k + 1], np.linalg.solve(matrix, np.ascontiguousarray(right[:, k : k + 1])))
    return weights


class Memory:
    """The last MEMORY_DEPTH changes of every lane's correction, for Anderson's mixing; slots are filled in place."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.turns: Single = np.zeros((MEMORY_DEPTH, -(-shape[0] // SPARSE), *shape[1:]), np.float32)
        self.sums: Single = np.zeros((MEMORY_DEPTH, *shape), np.float32)
        self.gram = np.zeros((MEMORY_DEPTH, MEMORY_DEPTH, shape[-1]))
        # The last step, and by how much it moved the state once mixed.
        self.last: tuple[Single, Single] | None = None
        # When each slot was filled and since when each lane has had its member, counted in steps.
        self.filled, self.since, self.count = (
            np.zeros(MEMORY_DEPTH, dtype=np.int64),
            np.zeros(shape[-1], dtype=np.int64),
            0,
        )

    def keep(self, lanes: np.ndarray) -> None:
        """Some lanes only."""
        self.turns, self.sums, self.gram = (kept(values, lanes) for values in (self.turns, self.sums, self.gram))
        self.since = self.since[lanes]
        if self.last is not None:
            self.last = kept(self.last[0], lanes), kept(self.last[1], lanes)

    def forget(self, lanes: np.ndarray) -> None:
        """Lanes in which other members begin."""
        self.gram[..., lanes], self.since[lanes] = 0.0, self.count

    def next_state(self, state: Array, step: Single) -> None:
        """x <- x + f, less what the steps remembered say is too much, in place."""
        slots = min(self.count, MEMORY_DEPTH)
        weights = np.zeros((0, step.shape[-1])) if self.last is None else self._weights(slots, step, *self.last)
        self.last = step, mix(state, step, self.sums[:slots], weights)
        self.count += 1

    def _weights(self, slots: int, step: Single, last_step: Single, moved: Single) -> Array:
        """g (slots, m) of the slots filled so far, the next one filled before."""
        slot = (self.count - 1) % MEMORY_DEPTH
        row, right = remember(self.turns[:slots], self.sums, slot, moved, step, last_step)
        self.filled[slot] = self.count
        own = self.filled[:slots, None] > self.since
        row, right = np.where(own & own[slot], row, 0.0), np.where(own, right, 0.0)
        self.gram[slot, :slots], self.gram[:slots, slot] = row, row
        return np.asarray(minimise(np.ascontiguousarray(self.gram[:slots, :slots]), right))


def kept(values: Any, lanes: np.ndarray) -> Any:
    """Some lanes of an array (.., m), in one piece of memory."""
    return np.ascontiguousarray(values[..., lanes])
