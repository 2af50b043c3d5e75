"""Which cells a patch of plants, a zone of friction, an inflow or the outlet holds: those whose centre lies in it."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array, Mask
from vegglue.case.grid import Grid, cell_stretch, places_on_map
from vegglue.case.parts import Interval
from vegglue.case.polygons import in_polygon
from vegglue.case.schema import Case
from vegglue.case.site_schema import Inflow, Patch, Zone
from vegglue.case.terrain import nearest_at, read_raster
from vegglue.errors import InputError, shown_path

# Slope of a cross-section beyond which cells are taken for bank where nothing else is said [-]. Chosen, not measured:
# floors are flatter and banks of streams mostly steeper.
BANK_SLOPE = 0.2


def cells_of_patch(patch: Patch, grid: Grid) -> Mask:
    """Cells (nx, ny) whose centre lies in the patch."""
    if patch.polygon is not None:
        return in_polygon(patch.polygon, grid)
    return _in_range(patch.x, patch.y, grid)


def slope(bed: Array, grid: Grid) -> Array:
    """|grad z_b| by central differences, shape (nx, ny) [-]."""
    along, across = np.gradient(bed, grid.dx, grid.dy)
    return np.hypot(along / cell_stretch(grid), across)


def friction_classes(case: Case, grid: Grid, bed: Array) -> NDArray[np.int64]:
    """Index of the friction class of each cell (nx, ny): that of the last zone it lies in, else the default.

    bed: levels (nx, ny) [m]. Errors: InputError for a raster that cannot be read or holds a number without a class.
    """
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
    number = nearest_at(read_raster(path), *places_on_map(grid))
    strange = number[~np.isnan(number) & ~np.isin(number, list(values))]
    if strange.size:
        known = ", ".join(map(str, values))
        raise InputError(f"{path}: expected the numbers {known}, got {strange[0]:g}: add it to `values` of this zone.")
    return number


def _zone_cells(zone: Zone, grid: Grid, bed: Array) -> Mask:
    if zone.steeper_than is not None:
        return slope(bed, grid) > zone.steeper_than
    if zone.beyond_slope_break is not None:
        return beyond_slope_break(slope(bed, grid) > zone.beyond_slope_break, bed)
    if zone.polygon is not None:
        return in_polygon(zone.polygon, grid)
    return _in_range(zone.x, zone.y, grid)


def beyond_slope_break(steep: Mask, bed: Array) -> Mask:
    """Cells (nx, ny) from the first steep one outward, on both sides of the lowest cell of each cross-section.

    steep (nx, ny); bed: levels (nx, ny) [m]. The lowest cell is sought among those that are not steep: of an even
    floor, the first one may be at the toe of a bank.
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
    """Errors: InputError when no cell centre lies in the range of an inflow or of the outlet."""
    for key in ranges_without_cells(case, grid):
        raise InputError(
            f"{shown_path(case.source)}: `{key}` expected a range with the centre of a cell in it, got one between "
            f"those of cells of {grid.dx:g} m x {grid.dy:g} m: widen it."
        )
