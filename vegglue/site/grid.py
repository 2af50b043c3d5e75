"""The regular grid of a site: centres of its cells."""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.case.schema import Case


@dataclass(frozen=True)
class Grid:
    """Centres of the cells along x (nx,) and y (ny,), and their size [m]."""

    x: Array
    y: Array
    dx: float
    dy: float


def build_grid(case: Case) -> Grid:
    """Cell centres x_i = x_0 + (i + 1/2) dx and y_j = y_0 + (j + 1/2) dy of a case [m]."""
    (west, east), (south, north), (dx, dy) = case.grid.x, case.grid.y, case.grid.cell
    nx, ny = round((east - west) / dx), round((north - south) / dy)
    return Grid(centres(west, dx, nx), centres(south, dy, ny), dx, dy)


def centres(edge: float, size: float, count: int) -> Array:
    """x_i = edge + (i + 1/2) size, shape (count,) [m]."""
    return np.asarray(edge + (np.arange(count) + 0.5) * size, dtype=np.float64)
