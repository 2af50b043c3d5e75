"""The Jacobian as blocks of one column each, filled from differences of the residual, factored and solved along the
channel.

Row block i couples to the columns i - 2 (diagonally: upwinding along x), i - 1, i and i + 1. Levels are held from
downstream, so eliminating from upstream downwards leaves, at each column, the well-posed problem of the channel above
it under a given level: no exchange of rows between blocks is needed.
"""

import numpy as np

from vegglue.compilation import compiled_exactly

# An unknown moves the residuals of the columns from one upstream to two downstream of it, and two rows to either side;
# unknowns this far apart may be disturbed together.
ALONG_PERIOD, ROWS_REACH = 4, 2
ACROSS_PERIOD = 2 * ROWS_REACH + 1


@compiled_exactly
def collect(blocks, far, base, rates, colours, step):
    """J = (R(x + e) - R(x)) / e of coloured unknowns, each difference put to the entry it belongs to, in place.

    Parameters
    ----------
    blocks, far : (nx, 3, n, n), (nx, n), n = 3 ny
        Columns i - 1, i, i + 1 of row block i, and the diagonal coupling to i - 2.
    base, rates : (nx, 3, ny), (nx, 3, ny, slot)
        R(x), and R where the unknowns of the colour of each slot are disturbed.
    colours : (slot, 3)
        Kind, first column and first row of the unknowns of each.
    step : e [m, m/s]
    """
    nx, _, ny = base.shape
    for i in range(nx):
        for lane in range(colours.shape[0]):
            kind, first_column, first_row = colours[lane]
            # The one column of this colour among those that move this block: i - 2 .. i + 1.
            column = i + 1 - (i + 1 - first_column) % ALONG_PERIOD
            if column < 0 or column >= nx:
                continue
            for row in range(first_row, ny, ACROSS_PERIOD):
                source = kind * ny + row
                if column == i - 2:
                    far[i, source] = (rates[i, kind, row, lane] - base[i, kind, row]) / step
                    continue
                lowest, highest = max(row - ROWS_REACH, 0), min(row + ROWS_REACH + 1, ny)
                for e in range(3):
                    for j in range(lowest, highest):
                        change = (rates[i, e, j, lane] - base[i, e, j]) / step
                        blocks[i, column - i + 1, e * ny + j, source] = change


@compiled_exactly
def _put(into, values):
    """into = values, entry by entry: to assign arrays takes seconds to compile, for the words of its error."""
    for r in range(values.shape[0]):
        for c in range(values.shape[1]):
            into[r, c] = values[r, c]


@compiled_exactly
def _take_away(of, values):
    """of -= values, entry by entry, as `_put`."""
    for r in range(values.shape[0]):
        for c in range(values.shape[1]):
            of[r, c] -= values[r, c]


@compiled_exactly
def factor(blocks, far):
    """D_i = J_ii - L_i G_(i-1), G_i = D_i^-1 U_i: block elimination from upstream, in place.

    Parameters
    ----------
    blocks, far : (nx, 3, n, n), (nx, n)
        See `collect`; blocks[i] becomes (L_i, D_i^-1, G_i): a solution is three products a column.

    Raises
    ------
    numpy.linalg.LinAlgError
        If a D_i has no inverse.
    """
    nx, _, n, _ = blocks.shape
    for i in range(nx):
        if i > 1:
            for r in range(n):
                weight = far[i, r]
                if weight != 0.0:
                    for c in range(n):
                        blocks[i, 0, r, c] -= weight * blocks[i - 2, 2, r, c]
        if i > 0:
            _take_away(blocks[i, 1], np.dot(blocks[i, 0], blocks[i - 1, 2]))
        _put(blocks[i, 1], np.linalg.inv(blocks[i, 1]))
        if i < nx - 1:
            _put(blocks[i, 2], np.dot(blocks[i, 1], blocks[i, 2]))


@compiled_exactly
def solve(blocks, far, right):
    """x with J x = right, in place.

    Parameters
    ----------
    blocks, far
        As `factor` leaves them.
    right : (nx, n, m)
        m right-hand sides at once.
    """
    nx, n, m = right.shape
    product = np.empty_like(right[0])  # one for all: memory for each took a tenth of the time of few right-hand sides
    for i in range(nx):
        part = right[i]
        if i > 1:
            for r in range(n):
                for k in range(m):
                    part[r, k] -= far[i, r] * right[i - 2, r, k]
        if i > 0:
            np.dot(blocks[i, 0], right[i - 1], product)
            _take_away(part, product)
        np.dot(blocks[i, 1], part, product)
        _put(part, product)
    for i in range(nx - 2, -1, -1):
        np.dot(blocks[i, 2], right[i + 1], product)
        _take_away(right[i], product)


@compiled_exactly
def solve_transposed(blocks, far, right):
    """x with J' x = right, in place: the products of `solve`, transposed and in the opposite order.

    Parameters
    ----------
    blocks, far, right
        As `solve`.
    """
    nx, n, m = right.shape
    product = np.empty_like(right[0])
    for i in range(1, nx):
        np.dot(blocks[i - 1, 2].T, right[i - 1], product)
        _take_away(right[i], product)
    for i in range(nx - 1, -1, -1):
        part = right[i]
        if i < nx - 1:
            np.dot(blocks[i + 1, 0].T, right[i + 1], product)
            _take_away(part, product)
        if i < nx - 2:
            for r in range(n):
                for k in range(m):
                    part[r, k] -= far[i + 2, r] * right[i + 2, r, k]
        np.dot(blocks[i, 1].T, part, product)
        _put(part, product)
