"""How each kind of observation is read off a computed flow, and how its reading answers to the state.

`READERS` has one entry for each kind of `measurements/kinds.py`.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.grid import Grid
from vegglue.effects.physical_constants import FILM_ON_LAND
from vegglue.effects.surroundings import across
from vegglue.flow.equations import Faces, faces
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem


@dataclass(frozen=True)
class GriddedFlow:
    """The flow of m members on a grid: their problem and state (nx, 3, ny, m), and what follows from these."""

    problem: Problem
    state: Array
    grid: Grid

    @cached_property
    def at_faces(self) -> Faces:
        return faces(self.problem, self.state)

    @cached_property
    def level(self) -> Array:
        """At cell centres (nx, ny, m) [m]."""
        return self.at_faces.level

    @cached_property
    def u(self) -> Array:
        """At cell centres (nx, ny, m) [m/s], the mean of the west and east face."""
        return 0.5 * (self.at_faces.u[1:] + self.at_faces.u[:-1])

    @cached_property
    def v(self) -> Array:
        """At cell centres (nx, ny, m) [m/s], the mean of the south and north face."""
        return 0.5 * (self.at_faces.v[:, 1:] + self.at_faces.v[:, :-1])

    @cached_property
    def discharge(self) -> Array:
        """Through every west-east face across the channel (nx + 1, m) [m3/s]: Q = dy sum_j h_j u_j."""
        return self.at_faces.flux_x.sum(axis=1) * self.problem.dy


OfStations = Callable[[GriddedFlow, Array, Array], Array]


@dataclass(frozen=True)
class Reader:
    """How stations at x, y (station,) [m] of one kind are read off a flow of m members.

    read: the readings (station, m) [unit of the kind]; slope_across: d reading/dy (station, m) [that per m], what a
    station beside its place would change; weights: d reading / d state (nx, 3, ny, station) of the first member.
    """

    read: OfStations
    slope_across: OfStations
    weights: OfStations


def bilinear(field: Array, grid: Grid, x: Array, y: Array) -> Array:
    """field (nx, ny, m) at points, (points, m); beyond the outermost centres the value of the outermost."""
    i, along = between(x, grid.x[0], grid.dx, grid.x.size)
    j, beside = between(y, grid.y[0], grid.dy, grid.y.size)
    south = (1.0 - along)[:, None] * field[i, j] + along[:, None] * field[i + 1, j]
    north = (1.0 - along)[:, None] * field[i, j + 1] + along[:, None] * field[i + 1, j + 1]
    return (1.0 - beside)[:, None] * south + beside[:, None] * north


def between(points: Array, first: float, step: float, size: int) -> tuple[NDArray[np.int64], Array]:
    """Of `size` centres a step apart: the one below each point, and the share of the next one in what it reads [-]."""
    steps = np.clip((points - first) / step, 0.0, size - 1.0)
    lower = np.minimum(steps.astype(np.int64), size - 2)
    return lower, steps - lower


def nearest_face(grid: Grid, x: float) -> int:
    """The west-east face nearest to x [m], 0 .. nx."""
    edges = np.append(grid.x - 0.5 * grid.dx, grid.x[-1] + 0.5 * grid.dx)
    return int(np.argmin(np.abs(edges - x)))


def _corners(grid: Grid, x: Array, y: Array) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], Array]]:
    """The four cell centres around each point: column, row and share of each in what it reads (points,)."""
    i, along = between(x, grid.x[0], grid.dx, grid.x.size)
    j, beside = between(y, grid.y[0], grid.dy, grid.y.size)
    for column, of_column in ((i, 1.0 - along), (i + 1, along)):
        for row, of_row in ((j, 1.0 - beside), (j + 1, beside)):
            yield column, row, of_column * of_row


def _no_weights(flow: GriddedFlow, stations: int) -> Array:
    return np.zeros((*flow.state.shape[:3], stations))


def _level_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    weights = _no_weights(flow, x.size)
    for column, row, share in _corners(flow.grid, x, y):
        weights[column, LEVEL, row, np.arange(x.size)] += share
    return weights


def _u_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    """The face in the west, where the inflow sets u, counts as given."""
    weights = _no_weights(flow, x.size)
    for column, row, share in _corners(flow.grid, x, y):
        for face, inside in ((column, column >= 0), (np.maximum(column - 1, 0), column > 0)):
            weights[face, ALONG, row, np.arange(x.size)] += np.where(inside, 0.5 * share, 0.0)
    return weights


def _v_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    """The faces on the sides of the grid, where walls and inflows set v, count as given."""
    weights, last = _no_weights(flow, x.size), flow.grid.y.size - 1
    for column, row, share in _corners(flow.grid, x, y):
        for face, inside in ((row, row > 0), (np.minimum(row + 1, last), row < last)):
            weights[column, ACROSS, face, np.arange(x.size)] += np.where(inside, 0.5 * share, 0.0)
    return weights


def _of_field(field: Callable[[GriddedFlow], Array], weights: OfStations) -> Reader:
    """Of what is interpolated between cell centres."""
    return Reader(
        read=lambda flow, x, y: bilinear(field(flow), flow.grid, x, y),
        slope_across=lambda flow, x, y: bilinear(across(field(flow), flow.grid.dy), flow.grid, x, y),
        weights=weights,
    )


ALONG_X = _of_field(lambda flow: flow.u, _u_weights)
ACROSS_X = _of_field(lambda flow: flow.v, _v_weights)
# Slower than this [m/s] a speed has no direction to answer in.
LEAST_SPEED = 1e-12


def _speed(flow: GriddedFlow, x: Array, y: Array) -> Array:
    """(u^2 + v^2)^(1/2) of u and v at the point, so that three readings of one probe agree with each other."""
    return np.hypot(ALONG_X.read(flow, x, y), ACROSS_X.read(flow, x, y))


def _of_both(of_u: Array, of_v: Array, u: Array, v: Array) -> Array:
    """d speed = (u du + v dv) / speed, 0 at rest."""
    return (u * of_u + v * of_v) / np.maximum(np.hypot(u, v), LEAST_SPEED)


def _speed_slope(flow: GriddedFlow, x: Array, y: Array) -> Array:
    of_u, of_v = (one.slope_across(flow, x, y) for one in (ALONG_X, ACROSS_X))
    return _of_both(of_u, of_v, ALONG_X.read(flow, x, y), ACROSS_X.read(flow, x, y))


def _speed_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    u, v = (one.read(flow, x, y)[:, 0] for one in (ALONG_X, ACROSS_X))
    return _of_both(_u_weights(flow, x, y), _v_weights(flow, x, y), u, v)


def _through(flow: GriddedFlow, x: Array, y: Array) -> Array:
    """Discharge through the face nearest to each x; y means nothing."""
    return flow.discharge[[nearest_face(flow.grid, one) for one in x]]


def _discharge_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    """dQ/du = h dy and dQ/dz = u dy (dh/dz) / 2 in the cells on both sides of a face, whose depth h is that of the mean
    of level minus bed. In the west the inflow sets Q, at the outlet its level sets h: these do not answer.
    """
    weights, now, dy = _no_weights(flow, x.size), flow.at_faces, flow.problem.dy
    for n, x_n in enumerate(x):
        face = nearest_face(flow.grid, x_n)
        if face > 0:
            weights[face - 1, ALONG, :, n] = now.face_x[face, :, 0] * dy
        if 0 < face < flow.grid.x.size:
            each = 0.5 * now.u[face, :, 0] * _wet_share(flow, face) * dy
            weights[[face - 1, face], LEVEL, :, n] = each
    return weights


def _wet_share(flow: GriddedFlow, face: int) -> Array:
    """dh/da of a face between two columns (ny,) [-], a the mean of level minus bed: that of `wet_depth`, exactly."""
    problem, sides = flow.problem, [face - 1, face]
    above = flow.level[sides, :, 0] - problem.bed[sides]
    if problem.bed_rise.size:
        above = above - problem.bed_rise[sides, :, 0]
    half_range = problem.bed_half_range[sides].mean(axis=0)
    return np.clip(0.5 * (above.mean(axis=0) - FILM_ON_LAND * problem.film) / half_range + 0.5, 0.0, 1.0)


def _no_slope(flow: GriddedFlow, x: Array, y: Array) -> Array:
    return np.zeros((x.size, flow.state.shape[3]))


READERS: Mapping[str, Reader] = {
    "velocity": ALONG_X,
    "velocity_across": ACROSS_X,
    "speed": Reader(_speed, _speed_slope, _speed_weights),
    "level": _of_field(lambda flow: flow.level, _level_weights),
    "discharge": Reader(_through, _no_slope, _discharge_weights),
}
