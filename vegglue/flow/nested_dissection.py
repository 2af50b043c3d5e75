"""Sparse factors near the Jacobian by nested dissection of the grid, for wide grids.

Third-order upwinding couples a cell to the second one beside it; these entries are small. M is the Jacobian A with them
put down to the cell between, so that a residual reaches the eight cells around it only, and

    x <- x + M^-1 (r - A x)

shrinks the error by 0.02 to 0.3 in each round. M is factored by parts: the grid is cut in halves by lines of cells,
each half is eliminated before the line between them (George 1973, doi:10.1137/0710032; not checked against it). What is
left of a part is a dense front over the cells around it (multifrontal, Duff and Reid 1983, doi:10.1145/356044.356047;
not checked against it):

    F = [D U; L C],    D^-1,  G = D^-1 U,  L are kept,    C - L G is added to the front of the line above.

A part is a flow with its inflow given in the west and north, and its level in the east and south: D has an inverse.
Beside the south wall its level is given in the east only. On cells of 14 m by 0.09 m, with a film of 0.01 m on the
banks, single precision loses D there; such a Jacobian is factored by blocks.
"""

from dataclasses import dataclass
from functools import lru_cache
from threading import Lock
from weakref import ref

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Single
from vegglue.case.size_limits import block_bytes
from vegglue.compilation import compiled_exactly
from vegglue.flow import block_elimination
from vegglue.flow.block_elimination import ACROSS_PERIOD, ALONG_PERIOD, ROWS_REACH

Indices = NDArray[np.int64]
# Cells of a part that is not cut further [-].
LEAF = 16
# Adjoints are corrected until a correction is below so much of the largest entry [-], in so many rounds at most: after
# three rounds a score was off by 0.16 %, which moved odds of 5.02 below the 5 that decide. Chord steps and tangents
# correct themselves, in 40 steps of a cold flow on 180 x 75 cells without a round of their own and in 45 with one.
ADJOINT_TOLERANCE, MOST_ADJOINT_ROUNDS = 1e-4, 12
# Blocks [bytes] up to which they take the place of parts that do not lead to the inverse: chosen.
LARGEST_BLOCKS = 1_000_000_000
# Factors of all flows [bytes] unless a command allows more or less: a diagnosis holds up to a hundred flows, of which
# it works on few at once. To make the factors of one again takes as long as some ten solutions with them.
MOST_BYTES = 3e8
_LOCK, _USED = Lock(), dict[int, "ref[SparseFactors]"]()
_most_bytes = MOST_BYTES


@dataclass(frozen=True)
class Dissection:
    """Parts of a grid, those below before those above.

    own, around: cells (i ny + j) that each part eliminates, and those it leaves a front on, one part after the other;
    own_start, around_start: where each part begins in them (part + 1,); place, beside: places of all cells and of
    `around` in `own`; above: place of each cell around in the front of the part above, its own cells first;
    child_start, children: parts below each; memory_start: where D^-1, L and G of each part begin in the memory of
    factors (3, part + 1).
    """

    own_start: Indices
    own: Indices
    around_start: Indices
    around: Indices
    place: Indices
    beside: Indices
    above: Indices
    child_start: Indices
    children: Indices
    memory_start: Indices


@lru_cache(16)
def dissection(nx: int, ny: int, leaf: int = LEAF) -> Dissection:
    """The parts of a grid of nx x ny cells."""
    owns: list[NDArray[np.int64]] = []
    arounds: list[NDArray[np.int64]] = []
    children_of: list[list[int]] = []

    def cells(i0: int, i1: int, j0: int, j1: int) -> NDArray[np.int64]:
        return (np.arange(i0, i1)[:, None] * ny + np.arange(j0, j1)[None]).ravel()

    def ring(i0: int, i1: int, j0: int, j1: int) -> NDArray[np.int64]:
        """Cells around a part."""
        i, j = np.arange(max(i0 - 1, 0), min(i1 + 1, nx)), np.arange(max(j0 - 1, 0), min(j1 + 1, ny))
        inside = ((i >= i0) & (i < i1))[:, None] & ((j >= j0) & (j < j1))[None]
        return (i[:, None] * ny + j[None])[~inside]

    def part(i0: int, i1: int, j0: int, j1: int) -> int:
        along, across = i1 - i0, j1 - j0
        if along * across <= leaf or max(along, across) < 3:
            below, own = list[int](), cells(i0, i1, j0, j1)
        elif along >= across:
            cut = (i0 + i1 - 1) // 2
            below, own = [part(i0, cut, j0, j1), part(cut + 1, i1, j0, j1)], cells(cut, cut + 1, j0, j1)
        else:
            cut = (j0 + j1 - 1) // 2
            below, own = [part(i0, i1, j0, cut), part(i0, i1, cut + 1, j1)], cells(i0, i1, cut, cut + 1)
        owns.append(own)
        arounds.append(ring(i0, i1, j0, j1))
        children_of.append(below)
        return len(owns) - 1

    part(0, nx, 0, ny)
    place, above = np.full(nx * ny, -1), [np.zeros(0, np.int64)] * len(owns)
    for node in range(len(owns) - 1, -1, -1):  # cells around a part stand in the order of the front above
        below, front = children_of[node], np.concatenate([owns[node], arounds[node]])
        place[front] = np.arange(front.size)
        for child in below:
            arounds[child] = arounds[child][np.argsort(place[arounds[child]])]
            above[child] = place[arounds[child]]
            assert (above[child] >= 0).all()
        place[front] = -1
    own, around = (np.array([3 * some.size for some in parts]) for parts in (owns, arounds))

    def starts(sizes: NDArray[np.int64]) -> Indices:
        return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)

    place[np.concatenate(owns)] = np.arange(nx * ny)
    return Dissection(
        starts(own // 3), np.concatenate(owns), starts(around // 3), np.concatenate(arounds),
        place, place[np.concatenate(arounds)], np.concatenate(above),
        starts(np.array([len(below) for below in children_of])),
        np.array([child for below in children_of for child in below], dtype=np.int64),
        np.stack([starts(own * own), starts(around * own), starts(own * around)]),
    )  # fmt: skip


@compiled_exactly
def collect_stencil(values, far, base, rates, colours, step):
    """J = (R(x + e) - R(x)) / e of coloured unknowns, each difference put to the entry it belongs to, in place.

    Parameters
    ----------
    values : (nx, ny, 3, 5, 3, 3)
        dR_e in cell i, j by unknown k in the cell di - 1, dj - 2 further.
    far : (nx, ny, 3)
        By its own unknown two columns upstream.
    base, rates, colours, step
        As `block_elimination.collect`.
    """
    nx, _, ny = base.shape
    for i in range(nx):
        for slot in range(colours.shape[0]):
            kind, first_column, first_row = colours[slot]
            column = i + 1 - (i + 1 - first_column) % ALONG_PERIOD
            if column < 0 or column >= nx:
                continue
            for row in range(first_row, ny, ACROSS_PERIOD):
                if column == i - 2:
                    far[i, row, kind] = (rates[i, kind, row, slot] - base[i, kind, row]) / step
                    continue
                for j in range(max(row - ROWS_REACH, 0), min(row + ROWS_REACH + 1, ny)):
                    for e in range(3):
                        change = (rates[i, e, j, slot] - base[i, e, j]) / step
                        values[i, j, column - i + 1, row - j + ROWS_REACH, e, kind] = change


@compiled_exactly
def _compact(values, far):
    """M (nx, ny, 3, 3, 3, 3) of A, see `collect_stencil`: entries of second cells are put down to first ones."""
    nx, ny = values.shape[0], values.shape[1]
    found = np.zeros((nx, ny, 3, 3, 3, 3), np.float32)
    for i in range(nx):
        for j in range(ny):
            for a in range(3):
                for b in range(5):
                    to = min(max(b - 1, 0), 2)
                    for e in range(3):
                        for k in range(3):
                            found[i, j, a, to, e, k] += values[i, j, a, b, e, k]
            for e in range(3):
                found[i, j, 0, 1, e, e] += far[i, j, e]
    return found


@compiled_exactly
def _times(product, values, far, x, place, transposed):
    """product -= A x, or A' x; x (3 cell, n), cells in the order of elimination, in which each has its place."""
    nx, ny, n = values.shape[0], values.shape[1], x.shape[1]
    for i in range(nx):
        for j in range(ny):
            here = 3 * place[i * ny + j]
            for a in range(max(i - 1, 0), min(i + 2, nx)):
                for b in range(max(j - ROWS_REACH, 0), min(j + ROWS_REACH + 1, ny)):
                    there = 3 * place[a * ny + b]
                    for e in range(3):
                        for k in range(3):
                            value = values[i, j, a - i + 1, b - j + ROWS_REACH, e, k]
                            if value == 0.0:
                                continue
                            if transposed:
                                for t in range(n):
                                    product[there + k, t] -= value * x[here + e, t]
                            else:
                                for t in range(n):
                                    product[here + e, t] -= value * x[there + k, t]
            if i > 1:
                there = 3 * place[(i - 2) * ny + j]
                for e in range(3):
                    for t in range(n):
                        if transposed:
                            product[there + e, t] -= far[i, j, e] * x[here + e, t]
                        else:
                            product[here + e, t] -= far[i, j, e] * x[there + e, t]


@compiled_exactly
def _assemble(d, u, low, place, own, near):
    """Entries of M between own cells of a part and all of its front."""
    nx, ny = near.shape[0], near.shape[1]
    for cell in own:
        i, j, r = cell // ny, cell % ny, 3 * place[cell]
        for a in range(max(i - 1, 0), min(i + 2, nx)):
            for b in range(max(j - 1, 0), min(j + 2, ny)):
                p = place[a * ny + b]
                if p < 0:
                    continue
                if p < own.size:
                    for e in range(3):
                        for k in range(3):
                            d[r + e, 3 * p + k] += near[i, j, a - i + 1, b - j + 1, e, k]
                    continue
                c = 3 * (p - own.size)
                for e in range(3):
                    for k in range(3):
                        u[r + e, c + k] += near[i, j, a - i + 1, b - j + 1, e, k]
                        low[c + e, r + k] += near[a, b, i - a + 1, j - b + 1, e, k]


@compiled_exactly
def _add_front(d, u, low, c, to, part):
    """A front left of a part below, into the part above; to: places of its cells there, in rising order."""
    m = d.shape[0]
    at, first = np.empty(3 * to.size, np.int64), 0
    for s in range(to.size):
        for e in range(3):
            at[3 * s + e] = 3 * to[s] + e
    while first < at.size and at[first] < m:
        first += 1
    for s in range(at.size):
        if s < first:
            row, other = d[at[s]], u[at[s]]
        else:
            row, other = low[at[s] - m], c[at[s] - m]
        for t in range(first):
            row[at[t]] += part[s, t]
        for t in range(first, at.size):
            other[at[t] - m] += part[s, t]


@compiled_exactly
def _factor_parts(near, own_start, own, around_start, around, above, child_start, children, starts, memory):
    """D^-1, L and G of all parts, into the memory of each (starts (3, part + 1): where each begins in memory)."""
    inverse, lower, upper = memory
    place = np.full(near.shape[0] * near.shape[1], -1)
    left = [np.zeros((0, 0), np.float32) for _ in range(own_start.size - 1)]
    for node in range(own_start.size - 1):
        mine, beside = own[own_start[node] : own_start[node + 1]], around[around_start[node] : around_start[node + 1]]
        m, b = 3 * mine.size, 3 * beside.size
        for t in range(mine.size):
            place[mine[t]] = t
        for t in range(beside.size):
            place[beside[t]] = mine.size + t
        d, c = np.zeros((m, m), np.float32), np.zeros((b, b), np.float32)
        low = lower[starts[1, node] : starts[1, node + 1]].reshape((b, m))
        u = np.zeros((m, b), np.float32)
        low[:] = 0.0
        _assemble(d, u, low, place, mine, near)
        for n in range(child_start[node], child_start[node + 1]):
            child = children[n]
            _add_front(d, u, low, c, above[around_start[child] : around_start[child + 1]], left[child])
            left[child] = np.zeros((0, 0), np.float32)
        for cell in mine:
            place[cell] = -1
        for cell in beside:
            place[cell] = -1
        found = np.linalg.inv(d)
        inverse[starts[0, node] : starts[0, node + 1]] = found.ravel()
        if b:
            g = upper[starts[2, node] : starts[2, node + 1]].reshape((m, b))
            np.dot(found, u, g)
            product = np.dot(low, g)
            for s in range(b):
                for t in range(b):
                    c[s, t] -= product[s, t]
            left[node] = c


@compiled_exactly
def _solve_parts(right, own_start, around_start, beside, starts, memory, transposed):
    """M x = right, or M' x = right, in place; right (3 cell, n) or (3 cell,), cells in the order of elimination.

    beside: places of the cells around each part in that order.
    """
    inverse, lower, upper = memory
    longest = 0
    for node in range(own_start.size - 1):
        longest = max(longest, own_start[node + 1] - own_start[node], around_start[node + 1] - around_start[node])
    found, far = np.empty_like(right[: 3 * longest]), np.empty_like(right[: 3 * longest])
    for node in range(own_start.size - 1):
        part, around = (
            right[3 * own_start[node] : 3 * own_start[node + 1]],
            beside[around_start[node] : around_start[node + 1]],
        )
        m, b = part.shape[0], 3 * around.size
        if transposed:
            if b:
                g = upper[starts[2, node] : starts[2, node + 1]].reshape((m, b))
                np.dot(g.T, part, far[:b])
        else:
            np.dot(inverse[starts[0, node] : starts[0, node + 1]].reshape((m, m)), part, found[:m])
            part[:] = found[:m]
            if b:
                np.dot(lower[starts[1, node] : starts[1, node + 1]].reshape((b, m)), part, far[:b])
        for t in range(around.size):
            for e in range(3):
                right[3 * around[t] + e] -= far[3 * t + e]
    for node in range(own_start.size - 2, -1, -1):
        part, around = (
            right[3 * own_start[node] : 3 * own_start[node + 1]],
            beside[around_start[node] : around_start[node + 1]],
        )
        m, b = part.shape[0], 3 * around.size
        for t in range(around.size):
            for e in range(3):
                far[3 * t + e] = right[3 * around[t] + e]
        if transposed:
            if b:
                np.dot(lower[starts[1, node] : starts[1, node + 1]].reshape((b, m)).T, far[:b], found[:m])
                part -= found[:m]
            np.dot(inverse[starts[0, node] : starts[0, node + 1]].reshape((m, m)).T, part, found[:m])
            part[:] = found[:m]
        elif b:
            np.dot(upper[starts[2, node] : starts[2, node + 1]].reshape((m, b)), far[:b], found[:m])
            part -= found[:m]


@dataclass(frozen=True, eq=False)
class SparseFactors:
    """A^-1 of one member by factors of a matrix near it, or of A by blocks.

    Attributes
    ----------
    values, far
        Entries of A, see `collect_stencil`.
    kept
        The factors, or nothing if they had to make room.
    """

    values: Single
    far: Single
    by_blocks: bool
    kept: list[tuple[Single, ...]]

    def solve(self, right: Single, transposed: bool = False) -> None:
        """A x = right, or A' x = right, in place and nearly; right (nx, 3 ny, n), contiguous."""
        memory = self._memory()
        if self.by_blocks:
            (block_elimination.solve_transposed if transposed else block_elimination.solve)(*memory, right)
            return
        (nx, ny), rows = self.values.shape[:2], right.reshape(-1, right.shape[2])
        at, place = _rows_in_order(nx, ny), dissection(nx, ny).place
        found = rows[at]
        rows[:] = found
        self._by_parts(memory, found, transposed)
        left, work = np.arange(found.shape[1]), np.empty((2, found.size), np.float32)
        for _ in range(MOST_ADJOINT_ROUNDS if transposed else 0):  # each column ends by itself, whatever is beside it
            some, step = work[:, : len(at) * left.size].reshape(2, len(at), left.size)
            np.take(found, left, 1, some, "clip")
            np.take(rows, left, 1, step, "clip")
            _times(step, self.values, self.far, some, place, transposed)
            self._by_parts(memory, step, transposed)
            some += step
            found[:, left] = some
            left = left[_largest(step) > ADJOINT_TOLERANCE * _largest(some)]
            if not left.size:
                break
        rows[at] = found

    def contracts(self) -> bool:
        """Whether |x - M^-1 A x| is at most 1 for random x in -1..1: 0.2 on common cells, 134 and more if D is lost."""
        nx, ny = self.values.shape[:2]
        x = np.random.default_rng(0).uniform(-1.0, 1.0, (3 * nx * ny, 1)).astype(np.float32)[_rows_in_order(nx, ny)]
        back = np.zeros_like(x)
        _times(back, self.values, self.far, x, dissection(nx, ny).place, False)
        self._by_parts(self._memory(), back, False)
        return float(np.abs(x + back).max()) <= 1.0

    def _by_parts(self, memory: tuple[Single, ...], right: Single, transposed: bool) -> None:
        """M x = right, or M' x = right, in place; right (3 cell, n), cells in the order of elimination."""
        parts = dissection(*self.values.shape[:2])
        one = right[:, 0] if right.shape[1] == 1 else right  # products with one vector need no packing
        _solve_parts(one, parts.own_start, parts.around_start, parts.beside, parts.memory_start, memory, transposed)

    def _memory(self) -> tuple[Single, ...]:
        """The factors, made again to the same bits if need be; those used longest ago make room before."""
        with _LOCK:
            _USED.pop(id(self), None)
            _USED[id(self)] = ref(self)
            whole = 0.0
            for key, one in reversed(list(_USED.items())):
                other = one()
                if other is None:
                    del _USED[key]
                    continue
                whole += other.nbytes
                if whole > _most_bytes and other is not self:
                    other.kept.clear()
                    del _USED[key]
        memory = next(iter(self.kept), None) or _factors_of(self.values, self.far, self.by_blocks)
        with _LOCK:
            if id(self) in _USED:  # else another flow needs the room as soon as this one has used them
                self.kept[:] = [memory]
        return memory

    @property
    def nbytes(self) -> float:
        """Of the factors, kept or not."""
        nx, ny = self.values.shape[:2]
        return block_bytes(nx, ny) if self.by_blocks else 4.0 * float(dissection(nx, ny).memory_start[:, -1].sum())


def keep_factors_within(most: float) -> None:
    """Let factors of wide grids take so many bytes together at most, but for those in use; no result depends on it."""
    global _most_bytes
    _most_bytes = most


def _largest(values: Single) -> Single:
    """The largest |value| of each column."""
    return np.maximum(values.max(axis=0), -values.min(axis=0))


@lru_cache(16)
def _rows_in_order(nx: int, ny: int) -> Indices:
    """Where the unknowns (nx, 3, ny) of the cells stand, in the order of elimination."""
    own = dissection(nx, ny).own
    return np.stack([(own // ny * 3 + kind) * ny + own % ny for kind in range(3)], axis=1).ravel()


def _factors_of(values: Single, far: Single, by_blocks: bool) -> tuple[Single, ...]:
    """Factors of a Jacobian with these entries, see `collect_stencil`."""
    nx, ny = values.shape[:2]
    if by_blocks:
        columns = np.zeros((nx, 3, 3, ny, 3, ny), np.float32)
        for b in range(2 * ROWS_REACH + 1):
            to = np.arange(max(b - ROWS_REACH, 0), min(ny + b - ROWS_REACH, ny))
            row = to - b + ROWS_REACH
            columns[:, :, :, row, :, to] = values[:, row, :, b]
        blocks = columns.reshape(nx, 3, 3 * ny, 3 * ny), far.swapaxes(1, 2).reshape(nx, 3 * ny)
        block_elimination.factor(*blocks)
        return blocks
    parts = dissection(nx, ny)
    inverse, lower, upper = (np.empty(start[-1], np.float32) for start in parts.memory_start)
    _factor_parts(
        _compact(values, far), parts.own_start, parts.own, parts.around_start, parts.around, parts.above,
        parts.child_start, parts.children, parts.memory_start, (inverse, lower, upper),
    )  # fmt: skip
    return inverse, lower, upper


def sparse_factors(values: Single, far: Single) -> SparseFactors:
    """The inverse of a Jacobian with these entries, see `collect_stencil`; by blocks if parts do not lead to it.

    Raises
    ------
    numpy.linalg.LinAlgError
        If there is none.
    """
    by_parts, blocks_fit = SparseFactors(values, far, False, []), block_bytes(*values.shape[:2]) <= LARGEST_BLOCKS
    try:
        if by_parts.contracts() or not blocks_fit:
            return by_parts
    except np.linalg.LinAlgError:
        if not blocks_fit:
            raise
    return SparseFactors(values, far, True, [_factors_of(values, far, True)])
