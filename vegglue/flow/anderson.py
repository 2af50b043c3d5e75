"""Anderson's mixing of fixed-point steps f, slot by slot:

    x <- x + f - sum_d g_d s_d,    g = argmin |f - sum_d g_d t_d|

t is the change from one step to the next, s that change and the one of x. The least squares see one column in a few
only, which lead to nearly the same weights with a fraction of the memory to read.

References: Walker and Ni 2011, doi:10.1137/10078356X.
"""

from typing import Any

import numpy as np

from vegglue.arrays import Array, Single
from vegglue.compilation import compiled_exactly

# Steps kept [-]: six as in a sketch of the solver, in which all members of five clusters then took 3 to 8 steps. More
# need more memory, by which a step is bound.
MEMORY_DEPTH = 6
# One of so many columns [-] counts in the least squares. With one of four it takes 1 to 4 % more steps
# than with all, each of which reads a third less memory.
SPARSE = 4


@compiled_exactly
def remember(turns, sums, slot, moved, step, last_step):
    """Slot of the memory: t = f - f_last, s = t + (x - x_last), member by member; t of every SPARSE-th column only.

    Returns inner products per member of that turn with every turn, and of every turn with f, (depth, m) each.
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
    """Anderson's next state x + f - sum_d g_d s_d, in place; returns the change (nx, 3, ny, m)."""
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


def minimise(gram: Array, right: Array) -> Array:
    """g (depth, m) with gram g = right, gram (depth, depth, m): the least squares of Anderson's mixing; 0 in a slot
    whose member has run away to numbers that are not finite. In NumPy, as compiling `solve` takes 5 s.
    """
    matrix, each = np.moveaxis(gram, 2, 0).copy(), np.arange(len(gram))
    matrix[:, each, each] = matrix[:, each, each] * (1.0 + 1e-10) + 1e-300
    weights = np.zeros(right.shape)
    finite = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=0)
    weights[:, finite] = np.linalg.solve(matrix[finite], right.T[finite, :, None])[..., 0].T
    return weights


class Memory:
    """x <- x + f - sum_d g_d s_d: the last MEMORY_DEPTH changes of the corrections in each slot, filled in place.

    Parameters
    ----------
    shape : (nx, 3, ny, m)
        Of a state.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.turns: Single = np.zeros((MEMORY_DEPTH, -(-shape[0] // SPARSE), *shape[1:]), np.float32)
        self.sums: Single = np.zeros((MEMORY_DEPTH, *shape), np.float32)
        self.gram = np.zeros((MEMORY_DEPTH, MEMORY_DEPTH, shape[-1]))
        # The last step, and by how much it moved the state once mixed.
        self.last: tuple[Single, Single] | None = None
        # Counted in steps: when each change was stored, since when each slot has had its member, and now.
        self.stored, self.since = np.zeros(MEMORY_DEPTH, dtype=np.int64), np.zeros(shape[-1], dtype=np.int64)
        self.count = 0

    def keep(self, slots: np.ndarray) -> None:
        """Some slots only."""
        self.turns, self.sums, self.gram = (kept(values, slots) for values in (self.turns, self.sums, self.gram))
        self.since = self.since[slots]
        if self.last is not None:
            self.last = kept(self.last[0], slots), kept(self.last[1], slots)

    def forget(self, slots: np.ndarray) -> None:
        """Slots in which other members begin."""
        self.gram[..., slots], self.since[slots] = 0.0, self.count

    def next_state(self, state: Array, step: Single) -> None:
        """x <- x + f - sum_d g_d s_d, in place."""
        depth, weights = min(self.count, MEMORY_DEPTH), np.zeros((0, step.shape[-1]))
        if self.last is not None:
            last_step, moved = self.last
            now = (self.count - 1) % MEMORY_DEPTH
            row, right = remember(self.turns[:depth], self.sums, now, moved, step, last_step)
            self.stored[now] = self.count
            own = self.stored[:depth, None] > self.since
            row, right = np.where(own & own[now], row, 0.0), np.where(own, right, 0.0)
            self.gram[now, :depth], self.gram[:depth, now] = row, row
            weights = minimise(np.ascontiguousarray(self.gram[:depth, :depth]), right)
        self.last = step, mix(state, step, self.sums[:depth], weights)
        self.count += 1


def kept(values: Any, slots: np.ndarray) -> Any:
    """Some slots of an array (.., m), in one piece of memory."""
    return np.ascontiguousarray(values[..., slots])
