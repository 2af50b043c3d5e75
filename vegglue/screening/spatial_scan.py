"""Fingerprints of a drag spot anywhere in the water, for drag that no effect of the library names, by adjoints.

    S(x_0, y_0) = - sum_cells  lambda |U| u exp(-((x - x_0)^2 + (y - y_0)^2) / r^2)

S is d prediction / d drag at the middle of the spot, [m/s or m] per [1/m], with lambda = d prediction / d f_x.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.engine.interface import Model, Point, flow_at_centres, force_response

# Radius of a spot over the half width of the floor [-], and spacing of spots over the radius [-]. Chosen, not measured:
# smaller spots find where drag is more closely, and are more tests; neighbours a radius apart share 61 % of their drag.
SPOT_RADIUS, SPOT_SPACING = 0.3, 1.0


@dataclass(frozen=True)
class DragSpots:
    """Fingerprints S (station, spot) of drag spots of a radius [m] around x, y (spot,) [m]."""

    x: Array
    y: Array
    radius: float
    fingerprints: Array


def drag_spots(model: Model, point: Point, half_width: float) -> DragSpots:
    """Drag spots all over the water, with one fingerprint for all experiments: an object stays where it is."""
    grid = model.site.grid
    radius = max(SPOT_RADIUS * half_width, 1.5 * max(grid.dx, grid.dy))
    wet = np.zeros(model.site.bed.shape, dtype=bool)
    x, y = _raster(grid.x, SPOT_SPACING * radius), _raster(grid.y, SPOT_SPACING * radius)
    along = np.exp(-(((grid.x[None] - x[:, None]) / radius) ** 2))
    across = np.exp(-(((grid.y[None] - y[:, None]) / radius) ** 2))
    fingerprints = np.zeros((len(model.station), x.size, y.size))
    for experiment in point.flows:
        flow = flow_at_centres(model, point, experiment)
        wet |= flow.depth > 0.05
        drag_response = -force_response(model, point, experiment) * (np.hypot(flow.u, flow.v) * flow.u)
        fingerprints[model.rows[experiment]] = np.einsum("ai,nij,bj->nab", along, drag_response, across, optimize=True)
    within_water = along @ wet @ across.T > 0.5 * along.sum(axis=1)[:, None] * across.sum(axis=1)[None]
    a, b = np.nonzero(within_water)
    return DragSpots(x[a], y[b], radius, fingerprints[:, a, b])


def _raster(centres: Array, spacing: float) -> Array:
    count = max(round((centres[-1] - centres[0]) / spacing), 1)
    return np.linspace(centres[0], centres[-1], count + 1)
