"""The regular grid of a site, and the centreline that it may follow, to and from which places on the map are mapped.

    x = X(s) - n sin(theta), y = Y(s) + n cos(theta)

(X, Y) a point of the centreline s from its beginning, theta the direction it heads in there, n positive to its left.
Before its beginning and beyond its end the centreline runs on straight.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vegglue.arrays import Array
from vegglue.case.schema import Case
from vegglue.case.site_schema import CentrelineShape
from vegglue.errors import InputError, shown_path

# An arc is held by nodes so far apart [radians]: cubics between them miss it by 4e-9 of its radius.
NODE_STEP = np.radians(2.0)
# Nodes of a centreline of straight parts and arcs at least [-], so that the nearest node is on the right part of it.
FEWEST_NODES = 500
# Nodes for each pair of points of a centreline through points: chosen, not measured; lengths are then right to 1e-6.
NODES_PER_PAIR = 50
# Steps of Newton from the nearest node [-]: two are enough where nodes are as near as these.
STEPS = 6
# Distances from places to nodes held at once [-]: 80 MB, where a survey of a long reach has many of both.
DISTANCES_AT_ONCE = 10_000_000


@dataclass(frozen=True)
class Centreline:
    """Nodes of a centreline (nodes,).

    Attributes
    ----------
    s, x, y
        s from its beginning, X and Y on the map [m].
    heading
        theta from the x axis of the map, counterclockwise [radians].
    """

    s: Array
    x: Array
    y: Array
    heading: Array


def centreline_of(shape: CentrelineShape) -> Centreline:
    """The centreline a case describes: through points, or of straight parts and arcs.

    Through points it is a natural cubic spline, its parameter the length of the polygon. Straight parts and arcs follow
    each other, in pieces whose chords are ds sin(dtheta/2) / (dtheta/2) long.
    """
    if shape.points is not None:
        from scipy.interpolate import CubicSpline  # late: a straight grid need not wait for it

        points = np.array(shape.points, dtype=np.float64)
        at = _summed(0.0, np.hypot(*np.diff(points, axis=0).T))
        curve = CubicSpline(at, points, bc_type="natural")
        t = np.concatenate([*(np.linspace(*pair, NODES_PER_PAIR, endpoint=False) for pair in pairwise(at)), at[-1:]])
        speed, middle = (np.hypot(*curve(places, 1).T) for places in (t, 0.5 * (t[1:] + t[:-1])))
        run = np.diff(t) * (speed[:-1] + 4.0 * middle + speed[1:]) / 6.0  # Simpson's rule
        x, y = curve(t).T
        return Centreline(_summed(0.0, run), x, y, np.unwrap(np.arctan2(*curve(t, 1).T[::-1])))
    parts = shape.parts or ()
    lengths, turns = np.array([part.run for part in parts]), np.radians([part.angle or 0.0 for part in parts])
    pieces = np.ceil(np.maximum(np.abs(turns) / NODE_STEP, lengths / lengths.sum() * FEWEST_NODES)).astype(int)
    length, turn = np.repeat(lengths / pieces, pieces), np.repeat(turns / pieces, pieces)
    theta = _summed(np.radians(shape.heading), turn)
    chord, towards = length * np.sinc(turn / (2.0 * np.pi)), theta[:-1] + 0.5 * turn
    x, y = (_summed(first, chord * part(towards)) for first, part in zip(shape.start, (np.cos, np.sin), strict=True))
    return Centreline(_summed(0.0, length), x, y, theta)


def heading_at(line: Centreline, s: Array) -> Array:
    """theta(s) [radians]."""
    return np.interp(s, line.s, line.heading)


def on_map(line: Centreline, s: Array, n: Array) -> tuple[Array, Array]:
    """x = X(s) - n sin(theta), y = Y(s) + n cos(theta).

    Parameters
    ----------
    s, n : [m]
        Places along it and to its left, of shapes that broadcast.

    Returns
    -------
    x, y [m]
    """
    x, y, theta = *_position(line, s), heading_at(line, s)
    return x - n * np.sin(theta), y + n * np.cos(theta)


def along_and_across(line: Centreline, x: Array, y: Array) -> tuple[Array, Array]:
    """s and n [m] of places on the map: those of the nearest point of the centreline, where p - (X, Y) is normal to it.

    Newton's steps ds = (p - (X, Y)) . t / (1 - n kappa), from the nearest node.

    Parameters
    ----------
    x, y : (n,) [m]
    """
    size = max(DISTANCES_AT_ONCE // line.x.size, 1)
    nearest = [
        np.hypot(x[i : i + size, None] - line.x, y[i : i + size, None] - line.y).argmin(axis=1)
        for i in range(0, x.size, size)
    ]
    s, n = line.s[np.concatenate([np.empty(0, np.int64), *nearest])], np.zeros_like(x)
    curvature = np.gradient(line.heading, line.s)
    for _ in range(STEPS):
        centre_x, centre_y = _position(line, s)
        theta = heading_at(line, s)
        ahead = (x - centre_x) * np.cos(theta) + (y - centre_y) * np.sin(theta)
        n = (y - centre_y) * np.cos(theta) - (x - centre_x) * np.sin(theta)
        turning = np.interp(s, line.s, curvature, left=0.0, right=0.0)
        s = s + ahead / np.maximum(1.0 - n * turning, 0.5)
    return s, n


def _position(line: Centreline, s: Array) -> tuple[Array, Array]:
    """X(s) and Y(s): cubics between the nodes, which keep their directions."""
    from scipy.interpolate import CubicHermiteSpline  # late: a straight grid need not wait for it

    inside = np.clip(s, line.s[0], line.s[-1])
    beyond, theta = s - inside, heading_at(line, s)
    x = CubicHermiteSpline(line.s, line.x, np.cos(line.heading))(inside)
    y = CubicHermiteSpline(line.s, line.y, np.sin(line.heading))(inside)
    return x + beyond * np.cos(theta), y + beyond * np.sin(theta)


def _summed(first: float, steps: Array) -> Array:
    return np.concatenate([[first], first + np.cumsum(steps)])


# Length of a cell over that on the centreline below which a grid is refused [-]: the centre of the bend is then near,
# where cells end in a point. Chosen, not measured.
LEAST_STRETCH = 0.2


@dataclass(frozen=True)
class Grid:
    """The regular grid of a case.

    Attributes
    ----------
    x, y : ndarray (nx,), (ny,)
        Centres of the cells [m]. With a centreline, x runs along it and y across, positive to its left.
    dx, dy : float
        Size of a cell [m], with a centreline on it.
    """

    x: Array
    y: Array
    dx: float
    dy: float
    centreline: Centreline | None = None


def build_grid(case: Case) -> Grid:
    """x_i = x_0 + (i + 1/2) dx and y_j = y_0 + (j + 1/2) dy: the grid of a case.

    Raises
    ------
    InputError
        If the centreline turns so sharply that cells would end in a point.
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
    """Delta = (dx dy)^(1/2) of the cells of a case [m], if it names no other: below it eddies are not resolved.

    References
    ----------
    Deardorff (1970), doi:10.1017/S0022112070000691, in two dimensions; not checked against it.
    """
    dx, dy = case.grid.cell
    return float(case.grid.filter_width or np.sqrt(dx * dy))


def on_cells(case: Case, cell: tuple[float, float]) -> Case:
    """The case on cells of another size; eddies are unresolved below the same width as on its own.

    Parameters
    ----------
    cell : (dx, dy) [m]
    """
    grid = case.grid.model_copy(update={"cell": cell, "filter_width": filter_width_of(case)})
    other: Case = case.model_copy(update={"grid": grid})
    return other


def centreline_in(case: Case) -> Centreline | None:
    """The centreline the grid of a case follows; None of a straight one."""
    return None if case.grid.centreline is None else centreline_of(case.grid.centreline)


def curvature_of(grid: Grid) -> Array:
    """kappa = dtheta/ds of the centreline in each column of cells, (nx,) [1/m], positive where it turns left."""
    if grid.centreline is None:
        return np.zeros(grid.x.size)
    return np.asarray(np.diff(heading_at(grid.centreline, edges(grid.x, grid.dx))) / grid.dx)


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


def edges(middles: Array, size: float) -> Array:
    """The edges (n + 1,) of n cells side by side, from their centres and their size [m]: the inverse of `centres`."""
    return np.append(middles - 0.5 * size, middles[-1] + 0.5 * size)
