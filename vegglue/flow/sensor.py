"""What instruments would read in a computed flow: velocities and levels at stations, discharge through sections."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.effects.active_effect import applied
from vegglue.effects.surroundings import Reading, across
from vegglue.flow.closures import closed
from vegglue.flow.equations import Faces, faces
from vegglue.flow.problem import ALONG, LEVEL, Problem
from vegglue.site.grid import Grid


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
    """Of m members: prediction (m, station) [m/s, m], flow (m, section) [m3/s], largest |Q/Q_in - 1| (m,) [-], and
    level [m], u and v [m/s] of the columns kept, (m, 3, columns, ny), NaN where no part of a cell is wet.
    """

    prediction: Array
    section_flow: Array
    mass_error: Array
    fields: NDArray[np.float32]


def read_sensors(
    problem: Problem,
    state: Array,
    grid: Grid,
    station: pd.DataFrame,
    sections: tuple[tuple[str, float], ...],
    kept: slice = slice(0, 0),
) -> Readings:
    """Depth-averaged u or level, bilinear between cell centres; discharge through the face nearest to each section."""
    now = faces(problem, state)
    u = 0.5 * (now.u[1:] + now.u[:-1])
    prediction = np.empty((len(station), problem.members))
    velocity = (station["kind"] == "velocity").to_numpy()
    for field, rows in ((u, velocity), (now.level, ~velocity)):
        prediction[rows] = _bilinear(field, grid, station["x"].to_numpy()[rows], station["y"].to_numpy()[rows])
    if any(one.effect.stage == "sensor" for one in problem.acting):
        prediction = _shown(problem, state, now, u, prediction, grid, station)
    flow = now.flux_x.sum(axis=1) * problem.dy
    edges = np.append(grid.x - 0.5 * grid.dx, grid.x[-1] + 0.5 * grid.dx)
    nearest = [int(np.argmin(np.abs(edges - x))) for _, x in sections]
    error = np.abs(flow / _entered(problem) - 1.0).max(axis=0)
    wet = now.cell[kept] > 0.1 * problem.film
    fields = np.where(wet, _at_centres(now, kept), np.nan).astype(np.float32)
    return Readings(prediction.T, flow[nearest].T, error, np.moveaxis(fields, -1, 0))


def _shown(
    problem: Problem, state: Array, now: Faces, u: Array, value: Array, grid: Grid, station: pd.DataFrame
) -> Array:
    """What instruments make of it: the effects of the stage sensor, each where it acts."""
    x, y = station["x"].to_numpy(float), station["y"].to_numpy(float)
    canopy = np.zeros_like(now.cell)
    canopy[problem.plants.column, problem.plants.row] = problem.plants.canopy_height
    fields = {"depth": now.cell, "u": u, "rate": closed(problem, state, now.cell)[0], "u_y": across(u, grid.dy)}
    fields["canopy_share"] = np.minimum(canopy / now.cell, 1.0)
    there = {name: _bilinear(field, grid, x, y) for name, field in fields.items()}
    velocity = (station["kind"] == "velocity").to_numpy(float)[:, None]
    for one in problem.acting:
        rows = np.ones(len(station), dtype=bool)
        if one.sections:
            rows &= station["section"].isin(one.sections).to_numpy()
        if one.devices:
            rows &= station["device"].isin(one.devices).to_numpy()
        reading = Reading(value=value, velocity=velocity, x=x[:, None], y=y[:, None], **there)
        value = np.where(rows[:, None], applied((one,), "sensor", reading, {"value": value})["value"], value)
    return value


def flow_fields(problem: Problem, state: Array, grid: Grid) -> FlowFields:
    """The first member at cell centres, NaN where shallower than the film."""
    now = faces(problem, state)
    centres = _at_centres(now, slice(0, grid.x.size))[..., 0]
    level, u, v = np.where(centres[0] - problem.bed > problem.film, centres, np.nan)
    depth = np.where(np.isnan(level), np.nan, now.cell[..., 0])
    return FlowFields(grid.x, grid.y, problem.bed, depth, level, u, v)


def _at_centres(now: Faces, columns: slice) -> Array:
    """Level, u and v of some columns, (3, columns, ny, m)."""
    u = 0.5 * (now.u[columns] + now.u[columns.start + 1 : columns.stop + 1])
    v = 0.5 * (now.v[columns, 1:] + now.v[columns, :-1])
    return np.stack([now.level[columns], u, v])


def _entered(problem: Problem) -> Array:
    """Discharge that has entered upstream of each west-east face, (nx + 1, m) [m3/s]."""
    nx = problem.shape[0]
    entered = np.zeros((nx + 1, problem.members))
    if problem.source.size:
        entered[1:] += problem.source.sum(axis=1).cumsum(axis=0) * problem.dx * problem.dy
    for inflow in problem.inflows:
        if inflow.side == "west":
            entered += inflow.discharge
    return entered + _from_sides(problem, nx)


def _from_sides(problem: Problem, nx: int) -> Array:
    """The part that enters through the sides, counted by its even share; exact beyond the segment."""
    entered = np.zeros((nx + 1, problem.members))
    for inflow in problem.inflows:
        if inflow.side != "west":
            share = np.clip((np.arange(nx + 1) - inflow.start) / (inflow.stop - inflow.start), 0.0, 1.0)
            entered += share[:, None] * inflow.discharge
    return entered


def _bilinear(field: Array, grid: Grid, x: Array, y: Array) -> Array:
    """field (nx, ny, m) at points, (points, m); beyond the outermost centres the value of the outermost."""
    i, along = between(x, grid.x[0], grid.dx, grid.x.size)
    j, across = between(y, grid.y[0], grid.dy, grid.y.size)
    south = (1.0 - along)[:, None] * field[i, j] + along[:, None] * field[i + 1, j]
    north = (1.0 - along)[:, None] * field[i, j + 1] + along[:, None] * field[i + 1, j + 1]
    return (1.0 - across)[:, None] * south + across[:, None] * north


def reading_weights(station: pd.DataFrame, grid: Grid) -> Array:
    """d prediction / d state (nx, 3, ny, n) of the flow itself, whatever instruments make of it."""
    weights = np.zeros((grid.x.size, 3, grid.y.size, len(station)))
    i, along = between(station["x"].to_numpy(), grid.x[0], grid.dx, grid.x.size)
    j, across = between(station["y"].to_numpy(), grid.y[0], grid.dy, grid.y.size)
    velocity, n = (station["kind"] == "velocity").to_numpy(), np.arange(len(station))
    for column, of_column in ((i, 1.0 - along), (i + 1, along)):
        for row, of_row in ((j, 1.0 - across), (j + 1, across)):
            share = of_column * of_row
            weights[column, LEVEL, row, n] += np.where(velocity, 0.0, share)
            for face in (column, np.maximum(column - 1, 0)):  # u of a cell is the mean of its faces
                weights[face, ALONG, row, n] += np.where(velocity, 0.5 * share, 0.0)
    return weights


def between(points: Array, first: float, step: float, size: int) -> tuple[np.ndarray, Array]:
    """Of `size` centres a step apart: the one below each point, and the share of the next one in what it reads [-]."""
    place = np.clip((points - first) / step, 0.0, size - 1.0)
    lower = np.minimum(place.astype(np.int64), size - 2)
    return lower, place - lower
