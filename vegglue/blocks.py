"""The Jacobian as blocks of one column each, filled from differences of the residual, factored and solved along the channel.

Row block i couples to the columns i - 2 (diagonally: upwinding along x), i - 1, i and i + 1. Levels are held from downstream, so
eliminating from upstream downwards leaves, at each column, the well-posed problem of the reach above it under a given level:
no exchange of rows between blocks is needed.
"""

import numpy as np
from numba import njit

compiled = njit(cache=True, error_model="numpy")

# Residuals reach two cells to either side; unknowns this far apart may be disturbed together.
REACH = 2
PERIOD = 2 * REACH + 1


@compiled
def disturb(state, kind, first_column, first_row, step, lanes, lane):
    """Copy `state` (nx, 3, ny) into lane `lane` of `lanes`, adding `step` to one colour of one kind of unknown."""
    nx, _, ny = state.shape
    for i in range(nx):
        for e in range(3):
            for j in range(ny):
                value = state[i, e, j]
                if e == kind and i % PERIOD == first_column and j % PERIOD == first_row:
                    value += step
                lanes[i, e, j, lane] = value


@compiled
def collect(blocks, far, base, rates, kind, first_column, first_row, step, lane):
    """Spread the change of one colour's lane over the entries of the Jacobian it belongs to.

    blocks (nx, 3, n, n): columns i - 1, i, i + 1 of row block i; far (nx, n): the diagonal coupling to i - 2.
    """
    nx, _, ny = base.shape
    for column in range(first_column, nx, PERIOD):
        for i in range(max(column - 1, 0), min(column + 3, nx)):
            for row in range(first_row, ny, PERIOD):
                source = kind * ny + row
                for e in range(3):
                    for j in range(max(row - REACH, 0), min(row + REACH + 1, ny)):
                        change = (rates[i, e, j, lane] - base[i, e, j]) / step
                        if column == i - 2:
                            if e == kind and j == row:
                                far[i, source] = change
                        else:
                            blocks[i, column - i + 1, e * ny + j, source] = change


@compiled
def factor(blocks, far):
    """Eliminate in place: blocks[i] becomes (L_i, D_i^-1, G_i = D_i^-1 U_i), so that solving is three products a column."""
    nx, _, n, _ = blocks.shape
    for i in range(nx):
        if i > 1:
            for r in range(n):
                weight = far[i, r]
                if weight != 0.0:
                    for c in range(n):
                        blocks[i, 0, r, c] -= weight * blocks[i - 2, 2, r, c]
        if i > 0:
            blocks[i, 1] -= np.dot(blocks[i, 0], blocks[i - 1, 2])
        blocks[i, 1] = np.linalg.inv(blocks[i, 1])
        if i < nx - 1:
            blocks[i, 2] = np.dot(blocks[i, 1], blocks[i, 2])


@compiled
def solve(blocks, far, right):
    """x with J x = right, in place; right (nx, n, m), m right-hand sides at once."""
    nx, n, m = right.shape
    for i in range(nx):
        part = right[i]
        if i > 1:
            for r in range(n):
                for k in range(m):
                    part[r, k] -= far[i, r] * right[i - 2, r, k]
        if i > 0:
            part -= np.dot(blocks[i, 0], right[i - 1])
        right[i] = np.dot(blocks[i, 1], part)
    for i in range(nx - 2, -1, -1):
        right[i] -= np.dot(blocks[i, 2], right[i + 1])


@compiled
def mixing_weights(turns, step):
    """g (depth, m): least squares of `step` (nx, 3, ny, m) by `turns` (depth, nx, 3, ny, m), member by member."""
    depth, nx, _, ny, m = turns.shape
    gram, right = np.zeros((m, depth, depth)), np.zeros((m, depth))
    for i in range(nx):
        for e in range(3):
            for j in range(ny):
                for a in range(depth):
                    for k in range(m):
                        right[k, a] += turns[a, i, e, j, k] * step[i, e, j, k]
                    for b in range(a + 1):
                        for k in range(m):
                            gram[k, a, b] += turns[a, i, e, j, k] * turns[b, i, e, j, k]
    weights = np.empty((depth, m))
    for k in range(m):
        for a in range(depth):
            for b in range(a):
                gram[k, b, a] = gram[k, a, b]
            gram[k, a, a] = gram[k, a, a] * (1.0 + 1e-12) + 1e-300
        weights[:, k] = np.linalg.solve(gram[k], right[k])
    return weights


@compiled
def mix(state, step, turns, sums):
    """Anderson: x + f - sum_d g_d s_d with g the weights of f in the turns t_d, s_d the change of x + f."""
    if turns.shape[0] == 0:
        return state + step
    weights = mixing_weights(turns, step)
    depth, nx, _, ny, m = turns.shape
    mixed = np.empty_like(state)
    for i in range(nx):
        for e in range(3):
            for j in range(ny):
                for k in range(m):
                    value = state[i, e, j, k] + step[i, e, j, k]
                    for d in range(depth):
                        value -= weights[d, k] * sums[d, i, e, j, k]
                    mixed[i, e, j, k] = value
    return mixed
