"""Cells that a patch of plants, a zone of friction, an inflow or the outlet holds, and how much of each plants cover.

Zones hold cells whose centre lies in them. Sides of patches seldom lie between cells: were cells planted whose centre
lies in a patch, a patch would be up to half a cell too wide or too long on each side.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Mask
from vegglue.case.bed import nearest_at, read_raster
from vegglue.case.grid import Grid, along_and_across, cell_stretch, centreline_in, places_on_map
from vegglue.case.schema import Case
from vegglue.case.site_schema import Inflow, Interval, Patch, Polygon
from vegglue.errors import InputError, shown_path

# Pieces of each side of a polygon along a bend: chosen, not measured; drawings need no more.
SIDE_PIECES = 16


def corners_of(case: Case, patch: Patch) -> Array:
    """Corners (x, y) of a patch in order around it in the coordinates of the grid, (corners, 2) [m].

    A polygon is given on the map: along a centreline its sides bend, so that they are cut into short ones.
    """
    line = centreline_in(case)
    if patch.polygon is not None and line is not None:
        corners, share = np.array(patch.polygon), np.arange(SIDE_PIECES)[None, :, None] / SIDE_PIECES
        pieces = (1.0 - share) * corners[:, None] + share * np.roll(corners, -1, axis=0)[:, None]
        return np.stack(along_and_across(line, *pieces.reshape(-1, 2).T), axis=1)
    if patch.polygon is not None:
        return np.array(patch.polygon)
    (west, east), (south, north) = patch.x or (0.0, 0.0), patch.y or (0.0, 0.0)
    return np.array([[west, south], [east, south], [east, north], [west, north]])


def distance_to_outline(outline: Array, x: float, y: float) -> float:
    """d = min |p - (a + t (b - a))| over all sides a, b and t in [0, 1], the distance of p = (x, y) [m].

    Parameters
    ----------
    outline : (corners, 2) [m]
    x, y : [m]
    """
    start, side = outline, np.roll(outline, -1, axis=0) - outline
    from_start = np.array([x, y]) - start
    squared = (side**2).sum(axis=1)
    # A side of no length, where two corners are one place, is its own nearest point.
    along = np.clip((from_start * side).sum(axis=1) / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
    return float(np.hypot(*(from_start - along[:, None] * side).T).min())


def in_polygon(corners: Polygon, grid: Grid) -> Mask:
    """Cells (nx, ny) whose centre lies within the polygon on the map: a ray from it crosses the outline an odd number
    of times.
    """
    inside = np.full((grid.x.size, grid.y.size), False)
    x, y = places_on_map(grid)
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0]), strict=True):
        if y0 == y1:
            continue
        crossing = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
        inside ^= ((y0 <= y) != (y1 <= y)) & (x < crossing)
    return inside


def signed_area(outline: Array) -> float:
    """A = sum(x_i y_(i+1) - x_(i+1) y_i) / 2 [m2], above 0 counterclockwise.

    Parameters
    ----------
    outline : (corners, 2) [m]
    """
    x, y = outline.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


# Lines in each row of cells along which a polygon is measured [-]: of a side along the channel a cell is then known to
# a thirty-second, far better than such sides are surveyed. Ranges are exact.
LINES_IN_ROW = 16
# Digits kept of a share [-]: what rounding leaves of a cell that is whole or bare is neither.
SHARE_DIGITS = 6


def share_in_patch(case: Case, patch: Patch, grid: Grid) -> Array:
    """Share of each cell (nx, ny) [-] that lies in a patch; along a bend in the coordinates of the grid.

    Of a polygon: lengths within it along LINES_IN_ROW lines of each row. A line enters it where it crosses the outline
    for the first, third .. time, and leaves it in between.
    """
    if patch.polygon is None:
        along, across = _share_in_range(patch.x, grid.x, grid.dx), _share_in_range(patch.y, grid.y, grid.dy)
        return np.round(np.outer(along, across), SHARE_DIGITS)
    corners = corners_of(case, patch)
    columns, rows = _met(corners[:, 0], grid.x, grid.dx), _met(corners[:, 1], grid.y, grid.dy)
    in_row = grid.dy * ((np.arange(LINES_IN_ROW) + 0.5) / LINES_IN_ROW - 0.5)
    x, y = grid.x[columns], grid.y[rows]
    lines = (y[:, None] + in_row).ravel()
    # x where the lines cross each side, in order; infinite beyond the last.
    crossings = np.full((len(corners), lines.size), np.inf)
    for side, ((x0, y0), (x1, y1)) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        meets = (y0 <= lines) != (y1 <= lines)
        crossings[side, meets] = x0 + (lines[meets] - y0) * (x1 - x0) / (y1 - y0) if meets.any() else np.inf
    edges = np.append(x - 0.5 * grid.dx, x[-1:] + 0.5 * grid.dx)
    length = np.zeros((lines.size, edges.size))
    for turn, crossing in enumerate(np.sort(crossings, axis=0)):
        length += (-1.0) ** turn * np.maximum(edges - crossing[:, None], 0.0)
    within = np.diff(length, axis=1).reshape(y.size, LINES_IN_ROW, x.size) / grid.dx
    share = np.zeros((grid.x.size, grid.y.size))
    share[columns, rows] = within.mean(axis=1).T
    return np.round(share, SHARE_DIGITS)


def _share_in_range(held: Interval | None, centres: Array, step: float) -> Array:
    """Share of each cell (n,) in a range [m]; all of it where none is given."""
    if held is None:
        return np.ones(centres.size)
    low, high = np.maximum(held[0], centres - 0.5 * step), np.minimum(held[1], centres + 0.5 * step)
    return np.maximum(high - low, 0.0) / step


def _met(values: Array, centres: Array, step: float) -> slice:
    """The cells (n,) between the least and the largest of some places [m]."""
    first = int(np.searchsorted(centres + 0.5 * step, values.min(), "right"))
    last = int(np.searchsorted(centres - 0.5 * step, values.max(), "left"))
    return slice(min(first, last), last)


# Slope of a cross-section beyond which cells are bank unless stated otherwise [-]. Chosen, not measured:
# floors are flatter and banks of streams mostly steeper.
BANK_SLOPE = 0.2


def cells_of_patch(patch: Patch, grid: Grid) -> Mask:
    """Cells (nx, ny) whose centre lies in the patch."""
    if patch.polygon is not None:
        return in_polygon(patch.polygon, grid)
    return _in_range(patch.x, patch.y, grid)


def slope(bed: Array, grid: Grid) -> Array:
    """|grad z_b| by central differences, (nx, ny) [-].

    Parameters
    ----------
    bed : (nx, ny) [m]
    """
    along, across = np.gradient(bed, grid.dx, grid.dy)
    return np.hypot(along / cell_stretch(grid), across)


def friction_classes(case: Case, grid: Grid, bed: Array) -> NDArray[np.int64]:
    """Index of the friction class of each cell (nx, ny): that of the last zone it lies in, else the default.

    Parameters
    ----------
    bed : (nx, ny) [m]

    Raises
    ------
    InputError
        For a raster that cannot be read or holds a number without a class.
    """
    names = list(case.friction.classes)
    index = np.full(bed.shape, names.index(case.friction.default), dtype=np.int64)
    for zone in case.friction.zones:
        if zone.raster is not None and zone.values is not None:
            number = nearest_at(read_raster(zone.raster), *places_on_map(grid))
            strange = number[~np.isnan(number) & ~np.isin(number, list(zone.values))]
            if strange.size:
                known = ", ".join(map(str, zone.values))
                raise InputError(
                    f"{zone.raster}: expected the numbers {known}, got {strange[0]:g}: add it to `values` of this zone."
                )
            for value, name in zone.values.items():
                index[number == value] = names.index(name)
        elif zone.friction_class is not None:
            if zone.steeper_than is not None:
                held = slope(bed, grid) > zone.steeper_than
            elif zone.beyond_slope_break is not None:
                held = beyond_slope_break(slope(bed, grid) > zone.beyond_slope_break, bed)
            else:
                held = in_polygon(zone.polygon, grid) if zone.polygon is not None else _in_range(zone.x, zone.y, grid)
            index[held] = names.index(zone.friction_class)
    return index


def beyond_slope_break(steep: Mask, bed: Array) -> Mask:
    """Cells (nx, ny) from the first steep one outward, on both sides of the lowest cell of each cross-section.

    The lowest cell is sought among those that are not steep: of an even floor, the first one may be at the toe of a
    bank.

    Parameters
    ----------
    steep, bed : (nx, ny), (nx, ny) [m]
    """
    even = np.where(steep & ~steep.all(axis=1, keepdims=True), np.inf, bed)
    columns, rows = np.arange(bed.shape[1])[None, :], even.argmin(axis=1)[:, None]
    left = np.logical_or.accumulate((steep & (columns <= rows))[:, ::-1], axis=1)[:, ::-1]
    right = np.logical_or.accumulate(steep & (columns >= rows), axis=1)
    return np.where(columns < rows, left, right)


def _in_range(x: Interval | None, y: Interval | None, grid: Grid) -> Mask:
    return centres_within(x, grid.x)[:, None] & centres_within(y, grid.y)[None, :]


def centres_within(interval: Interval | None, centres: Array) -> Mask:
    """Whether low <= c < high for cell centres c (n,) [m]; all of them do without an interval."""
    # Half-open, so that a cell centre on a shared edge belongs to one of two neighbours.
    if interval is None:
        return np.ones(centres.size, dtype=bool)
    return (centres >= interval[0]) & (centres < interval[1])


def inflow_cells(inflow: Inflow, grid: Grid) -> NDArray[np.int64]:
    """Cells of its side that an inflow enters by: rows of the west side, columns of the south or north side."""
    return np.flatnonzero(centres_within(inflow.range, grid.y if inflow.side == "west" else grid.x))


def ranges_without_cells(case: Case, grid: Grid) -> Iterator[str]:
    """Keys of those ranges of inflows and outlet in which no cell centre of the grid lies."""
    for name, inflow in case.inflows.items():
        if not inflow_cells(inflow, grid).size:
            yield f"inflows.{name}.range"
    if not centres_within(case.outlet.range, grid.y).any():
        yield "outlet.range"


def refuse_ranges_without_cells(case: Case, grid: Grid) -> None:
    """Refuse a grid on which an inflow or the outlet has no cell.

    Raises
    ------
    InputError
        If no cell centre lies in the range of one.
    """
    for key in ranges_without_cells(case, grid):
        raise InputError(
            f"{shown_path(case.source)}: `{key}` expected a range with the centre of a cell in it, got one between "
            f"those of cells of {grid.dx:g} m x {grid.dy:g} m: widen it."
        )
