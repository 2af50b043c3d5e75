"""What instruments would read in a computed flow: velocities and levels at stations, discharge through sections."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.flow import Array, FlowFields, Problem, faces
from vegglue.site import Grid


@dataclass(frozen=True)
class Readings:
    """Of m members: prediction (m, station) [m/s, m], flow (m, section) [m3/s], largest |Q/Q_in - 1| (m,) [-]."""

    prediction: Array
    section_flow: Array
    mass_error: Array


def read_sensors(
    problem: Problem, state: Array, grid: Grid, station: pd.DataFrame, sections: tuple[tuple[str, float], ...]
) -> Readings:
    """Depth-averaged u or level, bilinear between cell centres; discharge through the face nearest to each section."""
    now = faces(problem, state)
    u = 0.5 * (now.u[1:] + now.u[:-1])
    prediction = np.empty((len(station), problem.members))
    velocity = (station["kind"] == "velocity").to_numpy()
    for field, rows in ((u, velocity), (now.level, ~velocity)):
        prediction[rows] = _bilinear(field, grid, station["x"].to_numpy()[rows], station["y"].to_numpy()[rows])
    flow = now.flux_x.sum(axis=1) * problem.dy
    edges = np.append(grid.x - 0.5 * grid.dx, grid.x[-1] + 0.5 * grid.dx)
    nearest = [int(np.argmin(np.abs(edges - x))) for _, x in sections]
    error = np.abs(flow / _entered(problem) - 1.0).max(axis=0)
    return Readings(prediction.T, flow[nearest].T, error)


def flow_fields(problem: Problem, state: Array, grid: Grid) -> FlowFields:
    """The first member at cell centres, NaN where shallower than the film."""
    now = faces(problem, state)
    depth = now.level[..., 0] - problem.bed
    wet = lambda values: np.where(depth > problem.film, values[..., 0], np.nan)  # noqa: E731
    u, v = 0.5 * (now.u[1:] + now.u[:-1]), 0.5 * (now.v[:, 1:] + now.v[:, :-1])
    return FlowFields(grid.x, grid.y, problem.bed, wet(now.cell), wet(now.level), wet(u), wet(v))


def _entered(problem: Problem) -> Array:
    """Discharge that has entered upstream of each west-east face, (nx + 1, m) [m3/s]."""
    nx = problem.shape[0]
    entered = np.zeros((nx + 1, problem.members))
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
    i, along = _between(x, grid.x[0], grid.dx, grid.x.size)
    j, across = _between(y, grid.y[0], grid.dy, grid.y.size)
    south = (1.0 - along)[:, None] * field[i, j] + along[:, None] * field[i + 1, j]
    north = (1.0 - along)[:, None] * field[i, j + 1] + along[:, None] * field[i + 1, j + 1]
    return (1.0 - across)[:, None] * south + across[:, None] * north


def _between(points: Array, first: float, step: float, size: int) -> tuple[np.ndarray, Array]:
    place = np.clip((points - first) / step, 0.0, size - 1.0)
    lower = np.minimum(place.astype(np.int64), size - 2)
    return lower, place - lower
