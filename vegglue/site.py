"""The site on its grid: bed level, friction class and plants of each cell, read off at cell centres."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vegglue.errors import InputError
from vegglue.schema import BedLayer, Case, Patch, Polygon, Trapezoid, Zone
from vegglue.terrain import centres, levels_at, nearest_at, read_raster, survey_levels

Levels = NDArray[np.float64]
Cells = NDArray[np.bool_]


@dataclass(frozen=True)
class Grid:
    """Centres of the cells along x (nx,) and y (ny,), and their size [m]."""

    x: Levels
    y: Levels
    dx: float
    dy: float


@dataclass(frozen=True, eq=False)
class Site:
    """Arrays (nx, ny): bed level [m], index into class_names, index into the patches of the case (-1: no plants).

    Two sites are the same only if they are one, so that what follows from a site can be kept with it.
    """

    grid: Grid
    bed: Levels
    friction_class: NDArray[np.int64]
    class_names: tuple[str, ...]
    patch: NDArray[np.int64]


def build_site(case: Case) -> Site:
    """The site of a case; InputError when a cell has no bed level or a file cannot be read."""
    grid = build_grid(case)
    bed = bed_levels(case, grid)
    patch = np.full(bed.shape, -1, dtype=np.int64)
    for index, area in enumerate(case.plants.patches):
        patch[cells_of_patch(area, grid)] = index
    return Site(grid, bed, _friction_class(case, grid, bed), tuple(case.friction.classes), patch)


def build_grid(case: Case) -> Grid:
    """Cell centres x_i = x_0 + (i + 1/2) dx, and y alike [m]."""
    (west, east), (south, north), (dx, dy) = case.grid.x, case.grid.y, case.grid.cell
    nx, ny = round((east - west) / dx), round((north - south) / dy)
    return Grid(centres(west, dx, nx), centres(south, dy, ny), dx, dy)


def cells_of_patch(patch: Patch, grid: Grid) -> Cells:
    """Cells (nx, ny) whose centre lies in a patch."""
    if patch.polygon is not None:
        return _in_polygon(patch.polygon, grid)
    return _in_range(patch.x, patch.y, grid)


def slope(bed: Levels, grid: Grid) -> Levels:
    """|grad z_b| by central differences, shape (nx, ny) [-]."""
    along, across = np.gradient(bed, grid.dx, grid.dy)
    return np.hypot(along, across)


def bed_levels(case: Case, grid: Grid) -> Levels:
    """Bed level of the case (nx, ny) at the points of any grid [m]; InputError where there is none."""
    bed = np.full((grid.x.size, grid.y.size), np.nan)
    for layer in case.bed:
        level = _layer(layer, grid, case.grid.x[0])
        bed = np.where(np.isnan(level), bed, level)
    if np.isnan(bed).any():
        i, j = np.argwhere(np.isnan(bed))[0]
        raise InputError(
            f"{case.source}: `bed` gives no level to {np.isnan(bed).sum()} of {bed.size} cells, the first at "
            f"x = {grid.x[i]:g}, y = {grid.y[j]:g} m: add a layer that covers them, or shrink `grid`."
        )
    return bed


def _layer(layer: BedLayer, grid: Grid, upstream: float) -> Levels:
    if layer.trapezoid is not None:
        return _trapezoid(layer.trapezoid, grid, upstream)
    if layer.raster is not None:
        return levels_at(read_raster(layer.raster), grid.x, grid.y)
    if layer.points is not None:
        return survey_levels(layer.points, grid.x, grid.y)
    return np.full((grid.x.size, grid.y.size), np.nan)


def _trapezoid(channel: Trapezoid, grid: Grid, upstream: float) -> Levels:
    """z_b = level - S (x - x_0) + s min(max(|y - axis| - b/2, 0), (B - b)/2), with floor b and top B [m]."""
    out = np.abs(grid.y - channel.axis) - 0.5 * channel.bottom_width
    reach = np.inf if channel.top_width is None else 0.5 * (channel.top_width - channel.bottom_width)
    bank = channel.bank_slope * np.clip(out, 0.0, reach)
    floor = channel.level - channel.bed_slope * (grid.x - upstream)
    return floor[:, None] + bank[None, :]


def _friction_class(case: Case, grid: Grid, bed: Levels) -> NDArray[np.int64]:
    names = list(case.friction.classes)
    index = np.full(bed.shape, names.index(case.friction.default), dtype=np.int64)
    for zone in case.friction.zones:
        if zone.raster is not None and zone.values is not None:
            number = _class_numbers(zone.raster, zone.values, grid)
            for value, name in zone.values.items():
                index[number == value] = names.index(name)
        elif zone.friction_class is not None:
            index[_zone_cells(zone, grid, bed)] = names.index(zone.friction_class)
    return index


def _class_numbers(path: Path, values: Mapping[int, str], grid: Grid) -> Levels:
    number = nearest_at(read_raster(path), grid.x, grid.y)
    strange = number[~np.isnan(number) & ~np.isin(number, list(values))]
    if strange.size:
        known = ", ".join(map(str, values))
        raise InputError(f"{path}: expected the numbers {known}, got {strange[0]:g}: add it to `values` of this zone.")
    return number


def _zone_cells(zone: Zone, grid: Grid, bed: Levels) -> Cells:
    if zone.steeper_than is not None:
        return slope(bed, grid) > zone.steeper_than
    if zone.beyond_slope_break is not None:
        return beyond(slope(bed, grid) > zone.beyond_slope_break, bed)
    if zone.polygon is not None:
        return _in_polygon(zone.polygon, grid)
    return _in_range(zone.x, zone.y, grid)


def beyond(steep: Cells, bed: Levels) -> Cells:
    """From the lowest cell of each cross-section towards both sides: the first steep cell and all behind it.

    The lowest cell that is not steep: of an even floor, the first one may be at the toe of a bank.
    """
    even = np.where(steep & ~steep.all(axis=1, keepdims=True), np.inf, bed)
    columns, rows = np.arange(bed.shape[1])[None, :], even.argmin(axis=1)[:, None]
    left = np.logical_or.accumulate((steep & (columns <= rows))[:, ::-1], axis=1)[:, ::-1]
    right = np.logical_or.accumulate(steep & (columns >= rows), axis=1)
    return np.where(columns < rows, left, right)


def _in_range(x: tuple[float, float] | None, y: tuple[float, float] | None, grid: Grid) -> Cells:
    # Half-open, so that a cell centre on a shared edge belongs to one of two neighbours.
    along = (grid.x >= x[0]) & (grid.x < x[1]) if x else np.full(grid.x.size, True)
    across = (grid.y >= y[0]) & (grid.y < y[1]) if y else np.full(grid.y.size, True)
    return along[:, None] & across[None, :]


def _in_polygon(corners: Polygon, grid: Grid) -> Cells:
    """Even-odd rule: a ray from each cell centre crosses the outline an odd number of times."""
    inside = np.full((grid.x.size, grid.y.size), False)
    y = grid.y[None, :]
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0]), strict=True):
        if y0 == y1:
            continue
        crossing = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
        inside ^= ((y0 <= y) != (y1 <= y)) & (grid.x[:, None] < crossing)
    return inside
