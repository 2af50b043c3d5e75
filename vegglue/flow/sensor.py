"""What instruments would read in a computed flow, and how these readings answer to the state."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.grid import Grid
from vegglue.effects.active_effect import applied
from vegglue.effects.physical_constants import FILM_ON_LAND
from vegglue.effects.surroundings import Reading
from vegglue.flow.closures import bent_plants, closures
from vegglue.flow.equations import Faces, faces, side_discharges
from vegglue.flow.problem import Problem, above_bed, stretch_of_cells
from vegglue.flow.readers import READERS, GriddedFlow, bilinear, nearest_face
from vegglue.measurements.kinds import Kind, kind_of


@dataclass(frozen=True)
class FlowFields:
    """One member at cell centres, (nx, ny): bed and level [m], depth [m], u and v [m/s]; NaN where dry."""

    x: Array
    y: Array
    bed: Array
    depth: Array
    level: Array
    u: Array
    v: Array


@dataclass(frozen=True)
class Readings:
    """Of m members: prediction (m, station) [unit of its kind], flow (m, section) [m3/s], largest |Q - Q_in| over all
    that enters (m,) [-], and level [m], u and v [m/s] of the columns kept, (m, 3, columns, ny), NaN where no part of a
    cell is wet.
    """

    prediction: Array
    section_flow: Array
    mass_error: Array
    fields: NDArray[np.float32]


def predictions_at_sensors(problem: Problem, state: Array, grid: Grid, station: pd.DataFrame) -> Array:
    """What each station shows, (m, station) [unit of its kind], by the reader of its kind.

    Errors: InputError for a kind of observation that nothing knows.
    """
    return _predictions(GriddedFlow(problem, state, grid), station)


def _predictions(flow: GriddedFlow, station: pd.DataFrame) -> Array:
    prediction = np.empty((len(station), flow.problem.members))
    for kind, rows, x, y in _by_kind(station):
        prediction[rows] = READERS[kind.name].read(flow, x, y)
    if any(active.effect.stage == "sensor" for active in flow.problem.effects):
        prediction = _shown(flow, prediction, station)
    return prediction.T


def read_sensors(
    problem: Problem,
    state: Array,
    grid: Grid,
    station: pd.DataFrame,
    sections: tuple[tuple[str, float], ...],
    kept: slice = slice(0, 0),
) -> Readings:
    """What each station shows, by the reader of its kind; discharge through the face nearest to each section.

    Errors: InputError for a kind of observation that nothing knows.
    """
    flow = GriddedFlow(problem, state, grid)
    now, prediction = flow.at_faces, _predictions(flow, station)
    through = flow.discharge
    entered = _entered(problem, now.cell)
    error = (np.abs(through - entered) / entered[-1]).max(axis=0)
    wet = now.cell[kept] > FILM_ON_LAND * problem.film
    fields = np.where(wet, _at_centres(now, kept), np.nan).astype(np.float32)
    nearest = [nearest_face(grid, x) for _, x in sections]
    return Readings(prediction, through[nearest].T, error, np.moveaxis(fields, -1, 0))


def _by_kind(station: pd.DataFrame) -> Iterator[tuple[Kind, NDArray[np.intp], Array, Array]]:
    """Of each kind its rows, x and y. Errors: InputError for an unknown kind."""
    names, x, y = station["kind"].to_numpy(), station["x"].to_numpy(float), station["y"].to_numpy(float)
    for name in dict.fromkeys(names):
        rows = np.flatnonzero(names == name)
        yield kind_of(str(name)), rows, x[rows], y[rows]


def _shown(flow: GriddedFlow, value: Array, station: pd.DataFrame) -> Array:
    """What instruments make of it: the effects of the stage sensor, each where it acts."""
    problem, now = flow.problem, flow.at_faces
    plants, among = problem.plants, np.zeros_like(now.cell)
    depth = now.cell[plants.column, plants.row]
    reaching = np.minimum(bent_plants(problem, flow.state, now.cell)[1] / depth, 1.0)
    among[plants.column, plants.row] = plants.share[:, None] * reaching
    fields = {"depth": now.cell, "u": flow.u, "rate": closures(problem, flow.state, now.cell).rate}
    fields["canopy_share"] = among
    x, y = station["x"].to_numpy(float), station["y"].to_numpy(float)
    there = {name: bilinear(field, flow.grid, x, y) for name, field in fields.items()}
    there |= _measured_by_probes(flow, value, station) | {"x": x[:, None], "y": y[:, None]}
    for active in problem.effects:
        rows = np.ones(len(station), dtype=bool)
        if active.sections:
            rows &= station["section"].isin(active.sections).to_numpy()
        if active.devices:
            rows &= station["device"].isin(active.devices).to_numpy()
        reading = Reading(value=value, **there)
        value = np.where(rows[:, None], applied((active,), "sensor", reading, {"value": value})["value"], value)
    return value


def _measured_by_probes(flow: GriddedFlow, value: Array, station: pd.DataFrame) -> dict[str, Array]:
    """Which stations are probes and gauges, and the velocity that probes measure with its slope, 0 at all others."""
    velocity, level = np.zeros((2, len(station), 1))
    component, component_y = np.zeros((2, *value.shape))
    for kind, rows, x, y in _by_kind(station):
        level[rows] = float(kind.instrument == "gauge")
        if kind.velocity:
            velocity[rows], component[rows] = 1.0, value[rows]
            component_y[rows] = READERS[kind.name].slope_across(flow, x, y)
    return {"velocity": velocity, "level": level, "component": component, "component_y": component_y}


def reading_weights(problem: Problem, state: Array, grid: Grid, station: pd.DataFrame) -> Array:
    """d prediction / d state (nx, 3, ny, n) at a state (nx, 3, ny, 1), whatever instruments make of it.

    Errors: InputError for a kind of observation that nothing knows.
    """
    flow = GriddedFlow(problem, state, grid)
    weights = np.zeros((*state.shape[:3], len(station)))
    for kind, rows, x, y in _by_kind(station):
        weights[..., rows] = READERS[kind.name].weights(flow, x, y)
    return weights


def flow_fields(problem: Problem, state: Array, grid: Grid) -> FlowFields:
    """The first member at cell centres, over its own bed; NaN where shallower than the film."""
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


def _entered(problem: Problem, depth: Array) -> Array:
    """Discharge that has entered upstream of each west-east face, (nx + 1, m) [m3/s], at depths (nx, ny, m)."""
    entered = np.zeros((problem.shape[0] + 1, problem.members))
    entered[1:] = side_discharges(problem, depth).cumsum(axis=0)
    if problem.boundaries.lateral_inflow.size:
        entering = problem.boundaries.lateral_inflow * stretch_of_cells(problem)
        entered[1:] += entering.sum(axis=1).cumsum(axis=0) * problem.dx * problem.dy
    for inflow in problem.boundaries.inflows:
        if inflow.side == "west":
            entered += inflow.discharge
    return entered
