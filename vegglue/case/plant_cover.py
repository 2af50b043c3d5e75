"""How much of each cell plants cover: the share of its area that lies in a patch.

Sides of patches seldom lie between cells. Were cells planted whose centre lies in a patch, and others bare, a patch
would be up to half a cell too wide or too long on each side.
"""

import numpy as np

from vegglue.arrays import Array
from vegglue.case.grid import Grid
from vegglue.case.parts import Interval
from vegglue.case.polygons import corners_of
from vegglue.case.schema import Case
from vegglue.case.site_schema import Patch

# Lines in each row of cells along which a polygon is measured [-]: of a side along the channel a cell is then known to
# a thirty-second, far better than such sides are surveyed. Ranges are exact.
LINES_IN_ROW = 16
# Digits kept of a share [-]: what rounding leaves of a cell that is whole or bare is neither.
SHARE_DIGITS = 6


def share_in_patch(case: Case, patch: Patch, grid: Grid) -> Array:
    """Share of each cell (nx, ny) [-] that lies in a patch; along a bend in the coordinates of the grid."""
    if patch.polygon is not None:
        return np.round(_share_in_polygon(corners_of(case, patch), grid), SHARE_DIGITS)
    along, across = _share_in_range(patch.x, grid.x, grid.dx), _share_in_range(patch.y, grid.y, grid.dy)
    return np.round(np.outer(along, across), SHARE_DIGITS)


def _share_in_range(held: Interval | None, centres: Array, step: float) -> Array:
    """Share of each cell (n,) in a range [m]; all of it where none is given."""
    if held is None:
        return np.ones(centres.size)
    low, high = np.maximum(held[0], centres - 0.5 * step), np.minimum(held[1], centres + 0.5 * step)
    return np.maximum(high - low, 0.0) / step


def _share_in_polygon(corners: Array, grid: Grid) -> Array:
    """The same of a polygon with these corners (k, 2) [m]: lengths within it along LINES_IN_ROW lines of each row.

    A line enters it where it crosses the outline for the first, third .. time, and leaves it in between.
    """
    columns, rows = _met(corners[:, 0], grid.x, grid.dx), _met(corners[:, 1], grid.y, grid.dy)
    in_row = grid.dy * ((np.arange(LINES_IN_ROW) + 0.5) / LINES_IN_ROW - 0.5)
    x, y = grid.x[columns], grid.y[rows]
    lines = (y[:, None] + in_row).ravel()
    edges = np.append(x - 0.5 * grid.dx, x[-1:] + 0.5 * grid.dx)
    length = np.zeros((lines.size, edges.size))
    for turn, crossing in enumerate(_crossings(corners, lines)):
        length += (-1.0) ** turn * np.maximum(edges - crossing[:, None], 0.0)
    along = np.diff(length, axis=1).reshape(y.size, LINES_IN_ROW, x.size) / grid.dx
    share = np.zeros((grid.x.size, grid.y.size))
    share[columns, rows] = along.mean(axis=1).T
    return share


def _met(values: Array, centres: Array, step: float) -> slice:
    """The cells (n,) between the least and the largest of some places [m]."""
    first = int(np.searchsorted(centres + 0.5 * step, values.min(), "right"))
    last = int(np.searchsorted(centres - 0.5 * step, values.max(), "left"))
    return slice(min(first, last), last)


def _crossings(corners: Array, lines: Array) -> Array:
    """x where lines of these y (n,) cross the outline (k, 2), in order (k, n) [m]; infinite beyond the last."""
    found = np.full((len(corners), lines.size), np.inf)
    for side, ((x0, y0), (x1, y1)) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        meets = (y0 <= lines) != (y1 <= lines)
        found[side, meets] = x0 + (lines[meets] - y0) * (x1 - x0) / (y1 - y0) if meets.any() else np.inf
    return np.sort(found, axis=0)
