"""Bed level of each cell, from the layers of a case: trapezoids, rasters and surveyed points."""

import numpy as np

from vegglue.arrays import Array
from vegglue.case.grid import Grid, places_on_map
from vegglue.case.schema import Case
from vegglue.case.site_schema import BedLayer, Trapezoid
from vegglue.case.terrain import levels_at, read_raster, survey_levels
from vegglue.errors import InputError, shown_path


def bed_levels(case: Case, grid: Grid, experiment: str = "") -> Array:
    """Bed level z_b (nx, ny) [m] at the centres of any grid, of each cell the last layer that has data: those of the
    case, then those of an experiment that is named and has its own.

    Errors: InputError where no layer has data, or a file cannot be read.
    """
    bed = np.full((grid.x.size, grid.y.size), np.nan)
    own = case.experiments[experiment].bed if experiment in case.experiments else None
    for layer in (*case.bed, *(own or ())):
        level = _layer_levels(layer, grid, case.grid.x[0])
        bed = np.where(np.isnan(level), bed, level)
    if np.isnan(bed).any():
        i, j = np.argwhere(np.isnan(bed))[0]
        raise InputError(
            f"{shown_path(case.source)}: `bed` gives no level to {np.isnan(bed).sum()} of {bed.size} cells, the first "
            f"at x = {grid.x[i]:g}, y = {grid.y[j]:g} m: add a layer that covers them, or shrink `grid`."
        )
    return bed


def _layer_levels(layer: BedLayer, grid: Grid, upstream: float) -> Array:
    if layer.trapezoid is not None:
        return _trapezoid(layer.trapezoid, grid, upstream)
    if layer.raster is not None:
        return levels_at(read_raster(layer.raster), *places_on_map(grid))
    if layer.points is not None:
        return survey_levels(layer.points, *places_on_map(grid))
    return np.full((grid.x.size, grid.y.size), np.nan)


def _trapezoid(channel: Trapezoid, grid: Grid, upstream: float) -> Array:
    """z_b = level - S (x - x_0) + s min(max(|y - axis| - b/2, 0), (B - b)/2), with floor b and top B [m]."""
    out = np.abs(grid.y - channel.axis) - 0.5 * channel.bottom_width
    reach = np.inf if channel.top_width is None else 0.5 * (channel.top_width - channel.bottom_width)
    bank = channel.bank_slope * np.clip(out, 0.0, reach)
    floor = channel.level - channel.bed_slope * (grid.x - upstream)
    return floor[:, None] + bank[None, :]
