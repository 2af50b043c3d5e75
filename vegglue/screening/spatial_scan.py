"""Where something stands that no list names: the trace of a rough spot at every place, by adjoints of the flow.

    S(x_0, y_0) = - sum_cells  lambda |U| u exp(-((x - x_0)^2 + (y - y_0)^2) / r^2)

with lambda = d prediction / d f_x: the answer of all stations to a spot of drag, [m/s or m] per [1/m].
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.engine.interface import Model, Point, flow_at_centres, force_response

# Radius of the spot over the half width of the floor, and spacing of places over the radius.
SPOT_RADIUS, SPOT_SPACING = 0.3, 1.0


@dataclass(frozen=True)
class Spots:
    """Traces S (station, place) of drag spots of a radius [m] at x, y (place,) [m]."""

    x: Array
    y: Array
    radius: float
    traces: Array


def spots_of(model: Model, point: Point, half_width: float) -> Spots:
    """Spots all over the water, one trace of all experiments together: an object stays where it is."""
    grid = model.site.grid
    radius = max(SPOT_RADIUS * half_width, 1.5 * max(grid.dx, grid.dy))
    wet = np.zeros(model.site.bed.shape, dtype=bool)
    x, y = _raster(grid.x, SPOT_SPACING * radius), _raster(grid.y, SPOT_SPACING * radius)
    along = np.exp(-(((grid.x[None] - x[:, None]) / radius) ** 2))
    across = np.exp(-(((grid.y[None] - y[:, None]) / radius) ** 2))
    traces = np.zeros((len(model.station), x.size, y.size))
    for experiment in point.flows:
        flow = flow_at_centres(model, point, experiment)
        wet |= flow.depth > 0.05
        pushed = -force_response(model, point, experiment) * (np.hypot(flow.u, flow.v) * flow.u)
        traces[model.rows[experiment]] = np.einsum("ai,nij,bj->nab", along, pushed, across, optimize=True)
    there = along @ wet @ across.T > 0.5 * along.sum(axis=1)[:, None] * across.sum(axis=1)[None]
    a, b = np.nonzero(there)
    return Spots(x[a], y[b], radius, traces[:, a, b])


def _raster(centres: Array, spacing: float) -> Array:
    count = max(round((centres[-1] - centres[0]) / spacing), 1)
    return np.linspace(centres[0], centres[-1], count + 1)
