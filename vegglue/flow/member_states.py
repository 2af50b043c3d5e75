"""States of members blended from those of others, and put among them: loops over memory that lies together."""

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.compilation import compiled


@compiled
def blend(states: Array, some: NDArray[np.int64], weights: Array, south: int, north: int) -> Array:
    """sum_n w_bn x_n in the rows south..north-1, (nx, 3, rows, b), x_n the state of member some[n]; states (m, nx, 3,
    ny), weights (b, n).
    """
    nx, rows, members = states.shape[1], north - south, weights.shape[0]
    blended, column = np.empty((nx, 3, rows, members)), np.empty((members, 3, rows))
    for i in range(nx):
        column[:] = 0.0
        for n in range(some.size):
            for e in range(3):
                source = states[some[n], i, e, south:north]
                for b in range(members):
                    target, weight = column[b, e], weights[b, n]
                    for j in range(rows):
                        target[j] += weight * source[j]
        for e in range(3):
            for j in range(rows):
                for b in range(members):
                    blended[i, e, j, b] = column[b, e, j]
    return blended


@compiled
def put_rows(
    states: Array, some: NDArray[np.int64], good: NDArray[np.bool_], found: Array, south: int, north: int
) -> None:
    """States found in the rows south..north-1 (nx, 3, rows, b), those that are good, put into those of all members (m,
    nx, 3, ny) at some[b] as `widen` does, but member by member in memory that lies together.
    """
    nx, ny, rows = states.shape[1], states.shape[3], north - south
    for i in range(nx):
        for b in range(some.size):
            if not good[b]:
                continue
            for e in range(3):
                target = states[some[b], i, e]
                for j in range(rows):
                    target[south + j] = found[i, e, j, b]
                first, last = (target[south], target[north - 1]) if e == 0 else (0.0, 0.0)
                for j in range(south):
                    target[j] = first
                for j in range(north, ny):
                    target[j] = last
