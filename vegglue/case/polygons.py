"""Polygons: their corners and area, which cells lie within, and how far a point is from the outline."""

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.case.centreline import along_and_across
from vegglue.case.grid import Grid, centreline_in, places_on_map
from vegglue.case.parts import Polygon
from vegglue.case.schema import Case
from vegglue.case.site_schema import Patch

# Pieces of each side of a polygon along a bend: chosen, not measured; drawings need no more.
SIDE_PIECES = 16


def corners_of(case: Case, patch: Patch) -> Array:
    """Corners (x, y) of a patch in order around it in the coordinates of the grid, (corners, 2) [m].

    A polygon is given on the map: along a centreline its sides bend, so that they are cut into short ones.
    """
    line = centreline_in(case)
    if patch.polygon is not None and line is not None:
        return np.stack(along_and_across(line, *_in_pieces(np.array(patch.polygon)).T), axis=1)
    if patch.polygon is not None:
        return np.array(patch.polygon)
    (west, east), (south, north) = patch.x or (0.0, 0.0), patch.y or (0.0, 0.0)
    return np.array([[west, south], [east, south], [east, north], [west, north]])


def _in_pieces(corners: Array) -> Array:
    """The sides of a polygon as SIDE_PIECES short ones each."""
    share = np.arange(SIDE_PIECES)[None, :, None] / SIDE_PIECES
    return ((1.0 - share) * corners[:, None] + share * np.roll(corners, -1, axis=0)[:, None]).reshape(-1, 2)


def distance_to_outline(outline: Array, x: float, y: float) -> float:
    """d = min |p - (a + t (b - a))| over all sides a, b and t in [0, 1], the distance of p = (x, y) [m].

    outline: corners (corners, 2) [m].
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


def area_of(outline: Array) -> float:
    """A = |sum(x_i y_(i+1) - x_(i+1) y_i)| / 2 [m2]; outline: corners (corners, 2) [m]."""
    x, y = outline.T
    return float(0.5 * abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
