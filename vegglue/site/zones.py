"""Which cells a patch of plants or a zone of friction holds."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Mask
from vegglue.case.schema import Case
from vegglue.case.site_schema import Patch, Zone
from vegglue.errors import InputError
from vegglue.site.grid import Grid
from vegglue.site.polygons import in_polygon
from vegglue.site.terrain import nearest_at, read_raster


def cells_of_patch(patch: Patch, grid: Grid) -> Mask:
    """Cells (nx, ny) whose centre lies in a patch."""
    if patch.polygon is not None:
        return in_polygon(patch.polygon, grid)
    return _in_range(patch.x, patch.y, grid)


def slope(bed: Array, grid: Grid) -> Array:
    """|grad z_b| by central differences, shape (nx, ny) [-]."""
    along, across = np.gradient(bed, grid.dx, grid.dy)
    return np.hypot(along, across)


def friction_classes(case: Case, grid: Grid, bed: Array) -> NDArray[np.int64]:
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


def _class_numbers(path: Path, values: Mapping[int, str], grid: Grid) -> Array:
    number = nearest_at(read_raster(path), grid.x, grid.y)
    strange = number[~np.isnan(number) & ~np.isin(number, list(values))]
    if strange.size:
        known = ", ".join(map(str, values))
        raise InputError(f"{path}: expected the numbers {known}, got {strange[0]:g}: add it to `values` of this zone.")
    return number


def _zone_cells(zone: Zone, grid: Grid, bed: Array) -> Mask:
    if zone.steeper_than is not None:
        return slope(bed, grid) > zone.steeper_than
    if zone.beyond_slope_break is not None:
        return beyond(slope(bed, grid) > zone.beyond_slope_break, bed)
    if zone.polygon is not None:
        return in_polygon(zone.polygon, grid)
    return _in_range(zone.x, zone.y, grid)


def beyond(steep: Mask, bed: Array) -> Mask:
    """From the lowest cell of each cross-section towards both sides: the first steep cell and all behind it.

    The lowest cell that is not steep: of an even floor, the first one may be at the toe of a bank.
    """
    even = np.where(steep & ~steep.all(axis=1, keepdims=True), np.inf, bed)
    columns, rows = np.arange(bed.shape[1])[None, :], even.argmin(axis=1)[:, None]
    left = np.logical_or.accumulate((steep & (columns <= rows))[:, ::-1], axis=1)[:, ::-1]
    right = np.logical_or.accumulate(steep & (columns >= rows), axis=1)
    return np.where(columns < rows, left, right)


def _in_range(x: tuple[float, float] | None, y: tuple[float, float] | None, grid: Grid) -> Mask:
    # Half-open, so that a cell centre on a shared edge belongs to one of two neighbours.
    along = (grid.x >= x[0]) & (grid.x < x[1]) if x else np.full(grid.x.size, True)
    across = (grid.y >= y[0]) & (grid.y < y[1]) if y else np.full(grid.y.size, True)
    return along[:, None] & across[None, :]
