"""Depths of cells, faces and corners, with a derivative everywhere where water meets land."""

import numpy as np

from vegglue.compilation import compiled, compiled_inside
from vegglue.effects.physical_constants import FILM_ON_LAND


@compiled_inside
def wet_depth(above: float, half_range: float, film: float) -> float:
    """h = f/10 + mean of max(a - s, 0) over s in (-w, w), a = above - f/10: depth over a bed even between -w and +w.

    A cell wets from its lowest corner (the idea of Defina 2000, doi:10.1029/2000WR900167), and h has a derivative
    everywhere. The f/10 that stays on dry land lets the water table run on below it.

    Parameters
    ----------
    above, half_range, film
        Level over the mean bed, w and f [m].

    Returns
    -------
    h >= f/10 [m]
    """
    dry = FILM_ON_LAND * film
    lifted = above - dry
    share = min(max(0.5 * lifted * (1.0 / half_range) + 0.5, 0.0), 1.0)
    return dry + half_range * share * share + max(lifted - half_range, 0.0)


@compiled_inside
def _sheared(above: float, film: float) -> float:
    """max(a, 0) [m], rounded off within a film: the depth of the point itself, for land drags at no water beside it."""
    share = min(max(0.5 * above * (1.0 / film) + 0.5, 0.0), 1.0)
    return film * share * share + max(above - film, 0.0)


@compiled
def afloat(depth: float, half_per_film: float) -> float:
    """Share of advection kept, 1 - O((2 f / h)^4): none in the film on dry land, where friction rules alone."""
    ratio = (depth * half_per_film) ** 2
    ratio *= ratio
    return ratio / (1.0 + ratio)


@compiled
def depths(level, bed, rise, half_range, film, smallest, outlet_level):
    """h of the level over the bed: of cells, on faces of the mean of both sides, see `wet_depth`, and of corners alone.

    Parameters
    ----------
    level, bed, half_range : (nx, ny, m), (nx, ny), (nx, ny) [m]
        Water and bed levels, and half the range of the bed within a cell.
    rise : (nx, ny, m) [m]
        By how much members' beds lie higher, or empty.
    film : [m]
    smallest : bool
        Whether at a corner the smallest of the four cells around it counts, not their mean.
    outlet_level : (m,) [m]
        On the east face of the last column; the bed goes on to there as between the last two.

    Returns
    -------
    cells, west-east faces, south-north faces, corners
        (nx, ny, m), (nx + 1, ny, m), (nx, ny + 1, m), (nx + 1, ny + 1, m) [m]
    """
    nx, ny, m = level.shape
    if rise.size:
        level = level.copy()
        for i in range(nx):
            for j in range(ny):
                for k in range(m):
                    level[i, j, k] -= rise[i, j, k]
    cell = np.empty((nx, ny, m))
    face_x = np.empty((nx + 1, ny, m))
    face_y = np.empty((nx, ny + 1, m))
    corner = np.zeros((nx + 1, ny + 1, m))
    for i in range(nx):
        w = max(i - 1, 0)
        for j in range(ny):
            s = max(j - 1, 0)
            half_range_x = 0.5 * (half_range[i, j] + half_range[w, j])
            half_range_y = 0.5 * (half_range[i, j] + half_range[i, s])
            for k in range(m):
                here = level[i, j, k] - bed[i, j]
                west = level[w, j, k] - bed[w, j]
                south = level[i, s, k] - bed[i, s]
                diagonal = level[w, s, k] - bed[w, s]
                cell[i, j, k] = wet_depth(here, half_range[i, j], film)
                face_x[i, j, k] = wet_depth(0.5 * (here + west), half_range_x, film)
                face_y[i, j, k] = wet_depth(0.5 * (here + south), half_range_y, film)
                at_point = min(here, west, south, diagonal) if smallest else 0.25 * (here + west + south + diagonal)
                corner[i, j, k] = _sheared(at_point, film)
        for k in range(m):
            face_y[i, ny, k] = cell[i, ny - 1, k]
            corner[i, 0, k] = 0.0
    corner[0] = 0.0
    last, before = nx - 1, max(nx - 2, 0)
    for j in range(ny):
        for k in range(m):
            edge = bed[last, j] + 0.5 * (bed[last, j] - bed[before, j])
            above = outlet_level[k] - edge - (rise[last, j, k] if rise.size else 0.0)
            face_x[nx, j, k] = wet_depth(above, half_range[last, j], film)
    return cell, face_x, face_y, corner


@compiled
def cell_depth(state, bed, rise, half_range, film):
    """h (nx, ny, m) at cell centres [m] of a state (nx, 3, ny, m)."""
    nx, _, ny, m = state.shape
    depth = np.empty((nx, ny, m))
    for i in range(nx):
        for j in range(ny):
            if rise.size:
                for k in range(m):
                    depth[i, j, k] = wet_depth(state[i, 0, j, k] - bed[i, j] - rise[i, j, k], half_range[i, j], film)
                continue
            for k in range(m):
                depth[i, j, k] = wet_depth(state[i, 0, j, k] - bed[i, j], half_range[i, j], film)
    return depth
