"""What instruments would read in a computed flow, and how these readings change with the state.

`READERS` has one entry for each kind of `measurements/kinds.py`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array, Single
from vegglue.case.grid import Grid, edges
from vegglue.effects.active_effect import ActiveEffect, applied
from vegglue.effects.physical_constants import FILM_ON_LAND
from vegglue.effects.surroundings import Reading, across
from vegglue.flow.closures import bent_plants, closures
from vegglue.flow.equations import Faces, faces, side_discharges
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem, above_bed, stretch_of_cells
from vegglue.measurements.kinds import Kind, kind_of

# Slower than this [m/s] a speed has no direction.
LEAST_SPEED = 1e-12
# Stations whose weights are made together [-]: all at once take ten times the memory of what is kept.
WEIGHED_TOGETHER = 8


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
    """How stations of one kind are read off a flow of m members; functions take the flow and x, y (station,) [m]."""

    read: OfStations  # readings (station, m) [unit of the kind]
    slope_across: OfStations  # d reading/dy (station, m) [that per m]: the change of a station beside its place
    weights: OfStations  # d reading / d state (nx, 3, ny, station) of the first member


def _bilinear(field: Array, grid: Grid, x: Array, y: Array) -> Array:
    """field (nx, ny, m) at points, (points, m); beyond the outermost centres the value of the outermost."""
    i, along = between(x, grid.x[0], grid.dx, grid.x.size)
    j, beside = between(y, grid.y[0], grid.dy, grid.y.size)
    south = (1.0 - along)[:, None] * field[i, j] + along[:, None] * field[i + 1, j]
    north = (1.0 - along)[:, None] * field[i, j + 1] + along[:, None] * field[i + 1, j + 1]
    return (1.0 - beside)[:, None] * south + beside[:, None] * north


def between(points: Array, first: float, step: float, size: int) -> tuple[NDArray[np.int64], Array]:
    """Of centres a step apart the one below each point, and the weight of the next one, 0 or 1 beyond the ends.

    Parameters
    ----------
    points : (n,) [m]
    first, step : [m]
        Place of the first centre, and the distance of two.
    size : int
        How many there are.

    Returns
    -------
    (n,), (n,) [-]
    """
    steps = np.clip((points - first) / step, 0.0, size - 1.0)
    lower = np.minimum(steps.astype(np.int64), size - 2)
    return lower, steps - lower


def nearest_face(grid: Grid, x: float) -> int:
    """The west-east face nearest to x [m], 0 .. nx."""
    return int(np.argmin(np.abs(edges(grid.x, grid.dx) - x)))


def _surrounding_centres(
    grid: Grid, x: Array, y: Array
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], Array]]:
    """The four cell centres around each point: column, row and weight of each (points,)."""
    i, along = between(x, grid.x[0], grid.dx, grid.x.size)
    j, beside = between(y, grid.y[0], grid.dy, grid.y.size)
    for column, of_column in ((i, 1.0 - along), (i + 1, along)):
        for row, of_row in ((j, 1.0 - beside), (j + 1, beside)):
            yield column, row, of_column * of_row


def _no_weights(flow: GriddedFlow, stations: int) -> Array:
    return np.zeros((*flow.state.shape[:3], stations))


def _level_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    weights = _no_weights(flow, x.size)
    for column, row, share in _surrounding_centres(flow.grid, x, y):
        weights[column, LEVEL, row, np.arange(x.size)] += share
    return weights


def _u_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    """The face in the west, at which the inflow sets u, counts as given."""
    weights = _no_weights(flow, x.size)
    for column, row, share in _surrounding_centres(flow.grid, x, y):
        for face, inside in ((column, column >= 0), (np.maximum(column - 1, 0), column > 0)):
            weights[face, ALONG, row, np.arange(x.size)] += np.where(inside, 0.5 * share, 0.0)
    return weights


def _v_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    """The faces on the sides of the grid, at which walls and inflows set v, count as given."""
    weights, last = _no_weights(flow, x.size), flow.grid.y.size - 1
    for column, row, share in _surrounding_centres(flow.grid, x, y):
        for face, inside in ((row, row > 0), (np.minimum(row + 1, last), row < last)):
            weights[column, ACROSS, face, np.arange(x.size)] += np.where(inside, 0.5 * share, 0.0)
    return weights


def _of_field(field: Callable[[GriddedFlow], Array], weights: OfStations) -> Reader:
    """Of what is interpolated between cell centres."""
    return Reader(
        read=lambda flow, x, y: _bilinear(field(flow), flow.grid, x, y),
        slope_across=lambda flow, x, y: _bilinear(across(field(flow), flow.grid.dy), flow.grid, x, y),
        weights=weights,
    )


ALONG_X = _of_field(lambda flow: flow.u, _u_weights)
ACROSS_X = _of_field(lambda flow: flow.v, _v_weights)


def _of_speed(of_u: Array, of_v: Array, u: Array, v: Array) -> Array:
    """d speed = (u du + v dv) / speed, 0 at rest."""
    return (u * of_u + v * of_v) / np.maximum(np.hypot(u, v), LEAST_SPEED)


def _speed_slope(flow: GriddedFlow, x: Array, y: Array) -> Array:
    of_u, of_v = (one.slope_across(flow, x, y) for one in (ALONG_X, ACROSS_X))
    return _of_speed(of_u, of_v, ALONG_X.read(flow, x, y), ACROSS_X.read(flow, x, y))


def _speed_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    u, v = (one.read(flow, x, y)[:, 0] for one in (ALONG_X, ACROSS_X))
    return _of_speed(_u_weights(flow, x, y), _v_weights(flow, x, y), u, v)


def _discharge_weights(flow: GriddedFlow, x: Array, y: Array) -> Array:
    """dQ/du = h dy and dQ/dz = u dy (dh/dz) / 2 in the cells on both sides of a face, whose depth h is that of the mean
    of level minus bed. In the west the inflow sets Q, at the outlet its level sets h: these are given.
    """
    weights, now, problem = _no_weights(flow, x.size), flow.at_faces, flow.problem
    for n, x_n in enumerate(x):
        face = nearest_face(flow.grid, x_n)
        if face > 0:
            weights[face - 1, ALONG, :, n] = now.face_x[face, :, 0] * problem.dy
        if 0 < face < flow.grid.x.size:
            sides = [face - 1, face]
            above = flow.level[sides, :, 0] - problem.bed[sides]
            if problem.bed_rise.size:
                above = above - problem.bed_rise[sides, :, 0]
            half_range = problem.bed_half_range[sides].mean(axis=0)
            lifted = above.mean(axis=0) - FILM_ON_LAND * problem.film
            wet = np.clip(0.5 * lifted / half_range + 0.5, 0.0, 1.0)  # dh/dz of `wet_depth`, exactly
            weights[sides, LEVEL, :, n] = 0.5 * now.u[face, :, 0] * wet * problem.dy
    return weights


READERS: Mapping[str, Reader] = {
    "velocity": ALONG_X,
    "velocity_across": ACROSS_X,
    "speed": Reader(  # of u and v at the point, so that three readings of one probe agree with each other
        read=lambda flow, x, y: np.hypot(ALONG_X.read(flow, x, y), ACROSS_X.read(flow, x, y)),
        slope_across=_speed_slope,
        weights=_speed_weights,
    ),
    "level": _of_field(lambda flow: flow.level, _level_weights),
    "discharge": Reader(  # through the face nearest to each x, whatever y is
        read=lambda flow, x, y: flow.discharge[[nearest_face(flow.grid, one) for one in x]],
        slope_across=lambda flow, x, y: np.zeros((x.size, flow.state.shape[3])),
        weights=_discharge_weights,
    ),
}


@dataclass(frozen=True)
class FlowFields:
    """One member at cell centres, NaN where dry.

    Attributes
    ----------
    x, y
        Of the centres (nx,), (ny,) [m].
    bed, depth, level
        (nx, ny) [m]; the bed everywhere.
    u, v
        (nx, ny) [m/s].
    """

    x: Array
    y: Array
    bed: Array
    depth: Array
    level: Array
    u: Array
    v: Array


@dataclass(frozen=True)
class Readings:
    """What m members show.

    Attributes
    ----------
    prediction
        (m, station) [unit of its kind].
    section_flow
        (m, section) [m3/s].
    mass_error
        Largest |Q - Q_in| over all that enters (m,) [-].
    fields
        Level [m], u and v [m/s] of the columns kept (m, 3, columns, ny), NaN where no part of a cell is wet.
    """

    prediction: Array
    section_flow: Array
    mass_error: Array
    fields: NDArray[np.float32]


def predictions_at_sensors(problem: Problem, state: Array, grid: Grid, station: pd.DataFrame) -> Array:
    """What each station shows, effects on instruments included.

    Parameters
    ----------
    problem, state, grid
        Of m members; state (nx, 3, ny, m).
    station
        Table of stations with the columns kind, x, y [m], section and device.

    Returns
    -------
    array
        (m, station) [unit of its kind].

    Raises
    ------
    InputError
        If a kind of observation is unknown.
    """
    return _predictions(GriddedFlow(problem, state, grid), station)


def predictions_under_effects(
    problem: Problem, state: Array, grid: Grid, station: pd.DataFrame, effects: Sequence[tuple[ActiveEffect, ...]]
) -> Array:
    """`predictions_at_sensors` under sets of effects that differ on instruments alone.

    Parameters
    ----------
    problem, state, grid, station
        As `predictions_at_sensors`.
    effects : sequence of tuples
        Their effects on instruments take the place of those of the problem.

    Returns
    -------
    (m, set, station) [unit of its kind]
    """
    flow = GriddedFlow(problem, state, grid)
    value = _without_effects(flow, station)
    around = _around_stations(flow, value, station)
    return np.array([_after_effects(one, value, around, station) for one in effects]).transpose(2, 0, 1)


def _predictions(flow: GriddedFlow, station: pd.DataFrame) -> Array:
    value, effects = _without_effects(flow, station), flow.problem.effects
    if any(active.effect.stage == "sensor" for active in effects):
        value = _after_effects(effects, value, _around_stations(flow, value, station), station)
    return value.T


def _without_effects(flow: GriddedFlow, station: pd.DataFrame) -> Array:
    """Readings (station, m) of instruments without effects."""
    value = np.empty((len(station), flow.problem.members))
    for kind, rows, x, y in _by_kind(station):
        value[rows] = READERS[kind.name].read(flow, x, y)
    return value


def read_sensors(
    problem: Problem,
    state: Array,
    grid: Grid,
    station: pd.DataFrame,
    sections: tuple[tuple[str, float], ...],
    kept: slice = slice(0, 0),
) -> Readings:
    """What each station shows, and what an ensemble keeps beside it.

    Parameters
    ----------
    problem, state, grid, station
        As in `predictions_at_sensors`.
    sections
        Name and x [m] of sections; their discharge is that through the nearest face.
    kept
        Columns whose fields are kept.

    Raises
    ------
    InputError
        If a kind of observation is unknown.
    """
    flow = GriddedFlow(problem, state, grid)
    now, prediction = flow.at_faces, _predictions(flow, station)
    through = flow.discharge
    entered = np.zeros((problem.shape[0] + 1, problem.members))  # upstream of each west-east face
    entered[1:] = side_discharges(problem, now.cell).cumsum(axis=0)
    if problem.boundaries.lateral_inflow.size:
        entering = problem.boundaries.lateral_inflow * stretch_of_cells(problem)
        entered[1:] += entering.sum(axis=1).cumsum(axis=0) * problem.dx * problem.dy
    for inflow in problem.boundaries.inflows:
        if inflow.side == "west":
            entered += inflow.discharge
    error = (np.abs(through - entered) / entered[-1]).max(axis=0)
    wet = now.cell[kept] > FILM_ON_LAND * problem.film
    fields = np.where(wet, _at_centres(now, kept), np.nan).astype(np.float32)
    nearest = [nearest_face(grid, x) for _, x in sections]
    return Readings(prediction, through[nearest].T, error, np.moveaxis(fields, -1, 0))


def _by_kind(station: pd.DataFrame) -> Iterator[tuple[Kind, NDArray[np.intp], Array, Array]]:
    """Of each kind its rows, x and y. Raises InputError for an unknown kind."""
    names, x, y = station["kind"].to_numpy(), station["x"].to_numpy(float), station["y"].to_numpy(float)
    for name in dict.fromkeys(names):
        rows = np.flatnonzero(names == name)
        yield kind_of(str(name)), rows, x[rows], y[rows]


def _around_stations(flow: GriddedFlow, value: Array, station: pd.DataFrame) -> dict[str, Array]:
    """What an effect on instruments sees at each station beside its reading: the rest of a `Reading`."""
    problem, now = flow.problem, flow.at_faces
    plants, among = problem.plants, np.zeros_like(now.cell)
    depth = now.cell[plants.column, plants.row]
    reaching = np.minimum(bent_plants(problem, flow.state, now.cell)[1] / depth, 1.0)
    among[plants.column, plants.row] = plants.share[:, None] * reaching
    fields = {"depth": now.cell, "u": flow.u, "rate": closures(problem, flow.state, now.cell).rate}
    fields["canopy_share"] = among
    x, y = station["x"].to_numpy(float), station["y"].to_numpy(float)
    there = {name: _bilinear(field, flow.grid, x, y) for name, field in fields.items()}
    velocity, level = np.zeros((2, len(station), 1))
    component, component_y = np.zeros((2, *value.shape))
    for kind, rows, of_x, of_y in _by_kind(station):
        level[rows] = float(kind.instrument == "gauge")
        if kind.velocity:
            velocity[rows], component[rows] = 1.0, value[rows]
            component_y[rows] = READERS[kind.name].slope_across(flow, of_x, of_y)
    there |= {"velocity": velocity, "level": level, "component": component, "component_y": component_y}
    return there | {"x": x[:, None], "y": y[:, None]}


def _after_effects(
    effects: Sequence[ActiveEffect], value: Array, around: Mapping[str, Array], station: pd.DataFrame
) -> Array:
    """Readings (station, m) after the effects of the stage sensor, each where it acts."""
    for active in effects:
        at = np.ones(len(station), dtype=bool)
        if active.sections:
            at &= station["section"].isin(active.sections).to_numpy()
        if active.devices:
            at &= station["device"].isin(active.devices).to_numpy()
        reading = Reading(value=value, **around)
        value = np.where(at[:, None], applied((active,), "sensor", reading, {"value": value})["value"], value)
    return value


def reading_weights(
    problem: Problem, state: Array, grid: Grid, station: pd.DataFrame, rows: slice = slice(None)
) -> Single:
    """d prediction / d state (nx, 3, rows, n) of one member, without effects on instruments.

    Parameters
    ----------
    problem, grid, station
        As `predictions_at_sensors`.
    state : (nx, 3, ny, 1)
    rows : slice
        Of the grid, all by default.

    Raises
    ------
    InputError
        If a kind of observation is unknown.
    """
    flow = GriddedFlow(problem, state, grid)
    weights = np.empty((*state[:, :, rows, 0].shape, len(station)), np.float32)
    for kind, numbers, x, y in _by_kind(station):
        for first in range(0, numbers.size, WEIGHED_TOGETHER):
            some = slice(first, first + WEIGHED_TOGETHER)
            weights[..., numbers[some]] = READERS[kind.name].weights(flow, x[some], y[some])[:, :, rows]
    return weights


def flow_fields(problem: Problem, state: Array, grid: Grid) -> FlowFields:
    """The first member at cell centres, over its own bed; NaN where shallower than the film.

    Parameters
    ----------
    state : (nx, 3, ny, m)
    """
    now = faces(problem, state)
    centres = _at_centres(now, slice(0, grid.x.size))[..., 0]
    above = above_bed(problem, now.level)[..., 0]
    level, u, v = np.where(above > problem.film, centres, np.nan)
    depth = np.where(np.isnan(level), np.nan, now.cell[..., 0])
    bed = problem.bed + problem.bed_rise[..., 0] if problem.bed_rise.size else problem.bed
    return FlowFields(grid.x, grid.y, bed, depth, level, u, v)


def _at_centres(now: Faces, columns: slice) -> Array:
    """Level, u and v of some columns, (3, columns, ny, m)."""
    u = 0.5 * (now.u[columns] + now.u[columns.start + 1 : columns.stop + 1])
    v = 0.5 * (now.v[columns, 1:] + now.v[columns, :-1])
    return np.stack([now.level[columns], u, v])
