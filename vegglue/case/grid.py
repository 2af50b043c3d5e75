"""The regular grid of a site: centres of its cells, and where these lie on the map."""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.case.centreline import Centreline, centreline_of, heading_at, on_map
from vegglue.case.schema import Case
from vegglue.errors import InputError, shown_path

# Length of a cell over that on the centreline below which a grid is refused [-]: the centre of the bend is then near,
# where cells end in a point. Chosen, not measured.
LEAST_STRETCH = 0.2


@dataclass(frozen=True)
class Grid:
    """Centres of the cells along x (nx,) and y (ny,), and their size [m].

    With a centreline, x runs along it and y across, positive to its left; cells have their size on it.
    """

    x: Array
    y: Array
    dx: float
    dy: float
    centreline: Centreline | None = None


def build_grid(case: Case) -> Grid:
    """Cell centres x_i = x_0 + (i + 1/2) dx and y_j = y_0 + (j + 1/2) dy of a case [m].

    Errors: InputError where the centreline turns so sharply that cells would end in a point.
    """
    (west, east), (south, north), (dx, dy) = case.grid.x, case.grid.y, case.grid.cell
    nx, ny = round((east - west) / dx), round((north - south) / dy)
    grid = Grid(centres(west, dx, nx), centres(south, dy, ny), dx, dy, centreline_in(case))
    curvature = curvature_of(grid)[:, None]
    shortest = (1.0 - curvature * np.array(case.grid.y)).min(axis=1)
    if shortest.min() < LEAST_STRETCH:
        i = int(shortest.argmin())
        raise InputError(
            f"{shown_path(case.source)}: `grid.centreline` turns with a radius of {1.0 / abs(curvature[i, 0]):.3g} m "
            f"at x = {grid.x[i]:g} m, so that cells between y = {south:g} and {north:g} m end in a point there: narrow "
            f"the grid, or draw the line through fewer points."
        )
    return grid


def filter_width_of(case: Case) -> float:
    """Delta = (dx dy)^(1/2) of the cells of a case, where it names no other [m]: below it eddies are not resolved.

    Source: Deardorff (1970), doi:10.1017/S0022112070000691, in two dimensions; not checked against it.
    """
    dx, dy = case.grid.cell
    return float(case.grid.filter_width or np.sqrt(dx * dy))


def centreline_in(case: Case) -> Centreline | None:
    """The centreline the grid of a case follows; None of a straight one."""
    return None if case.grid.centreline is None else centreline_of(case.grid.centreline)


def curvature_of(grid: Grid) -> Array:
    """kappa = dtheta/ds of the centreline in each column of cells, (nx,) [1/m], positive where it turns left."""
    if grid.centreline is None:
        return np.zeros(grid.x.size)
    edges = np.append(grid.x - 0.5 * grid.dx, grid.x[-1] + 0.5 * grid.dx)
    return np.asarray(np.diff(heading_at(grid.centreline, edges)) / grid.dx)


def cell_stretch(grid: Grid) -> Array:
    """J = 1 - y kappa, the length of a cell over that on the centreline, (nx, ny) [-]; (1, 1) on a straight grid."""
    if grid.centreline is None:
        return np.ones((1, 1))
    return np.asarray(1.0 - curvature_of(grid)[:, None] * grid.y)


def places_on_map(grid: Grid) -> tuple[Array, Array]:
    """x and y of cell centres on the map, (nx, ny) [m]; (nx, 1) and (1, ny) of a straight grid, its own."""
    if grid.centreline is None:
        return grid.x[:, None], grid.y[None, :]
    return on_map(grid.centreline, grid.x[:, None], grid.y[None, :])


def centres(edge: float, size: float, count: int) -> Array:
    """x_i = edge + (i + 1/2) size, shape (count,) [m]."""
    return np.asarray(edge + (np.arange(count) + 0.5) * size, dtype=np.float64)
