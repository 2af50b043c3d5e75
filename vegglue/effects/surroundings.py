"""What an effect gets to see at its stage: the channel, the flow at cell centres, plants, boundaries, readings."""

from dataclasses import dataclass, field

import numpy as np

from vegglue.arrays import Array

# Square of 1 mm/s [m2/s2], below which friction is linear in the solver, too (`flow/kernels`).
AT_REST_SQUARED = 1e-6


def speed_of(u: Array, v: Array) -> Array:
    """|U| = (u^2 + v^2 + 0.001^2)^(1/2) [m/s], never zero, so that it has a derivative at rest."""
    return np.sqrt(u**2 + v**2 + AT_REST_SQUARED)


@dataclass(frozen=True)
class ChannelGeometry:
    """What does not move, at cell centres, (nx, ny, 1) [m] where not said otherwise.

    share_along: (x - x_m) / L, x_m the middle of the grid and L its length, -1/2 .. 1/2 (nx, 1, 1) [-];
    offset: distance from the channel axis over the half width of the floor, positive towards larger y [-]; half_width:
    that half width; side_slope: |dz/dy| [-]; bank: 1 beyond the toe of the banks, else 0; planted: share of a cell that
    plants cover in this experiment; front: distance from the upstream end of the patch a cell is in, else infinite;
    edge: distance across from the nearest side of a patch, positive outside it and negative inside, infinite in columns
    without one; relative_stems: of the patch over the mean of all patches, 1 where none stands [-];
    wake: distance downstream from the end of the nearest patch upstream that spans this row, else infinite; on a grid
    along a centreline, stretch: length of a cell over dx [-], and turning: curvature of the line along its row [1/m].
    """

    x: Array
    y: Array
    share_along: Array
    dx: float
    dy: float
    filter_width: float  # below which eddies are not resolved, the same on every grid of a case
    bed: Array
    offset: Array
    half_width: Array
    side_slope: Array
    bank: Array
    planted: Array
    front: Array
    edge: Array
    wake: Array
    patch: Array  # index of the patch, -1 without
    relative_stems: Array = field(default_factory=lambda: np.ones((1, 1, 1)))  # as if all patches were as dense
    stretch: Array = field(default_factory=lambda: np.ones((1, 1, 1)))  # of a straight grid
    turning: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))  # empty on a straight grid


@dataclass(frozen=True)
class Cells:
    """The flow at cell centres, (nx, ny, m): depth h and level [m], u and v [m/s], friction rate k [1/m], the
    part of it that is the bed's, and viscosity [m2/s]; gradients [1/s]. shear_depth: by which du/dy weighs what is on
    either side, (nx, ny - 1, m) [m], the smaller depth of the two cells, or empty.
    """

    geometry: ChannelGeometry
    depth: Array
    level: Array
    u: Array
    v: Array
    rate: Array
    bed_rate: Array
    viscosity: Array
    shear_depth: Array

    @property
    def speed(self) -> Array:
        """|U| [m/s], never zero; see `speed_of`."""
        return speed_of(self.u, self.v)

    @property
    def shear_velocity(self) -> Array:
        """u* = (k_bed h)^(1/2) |U| [m/s], of the bed alone."""
        return np.sqrt(self.bed_rate * self.depth) * self.speed

    @property
    def u_x(self) -> Array:
        """du/dx (nx, ny, m) [1/s]; (du/dx - kappa v) / J where x follows a centreline of curvature kappa."""
        return self._along(self.u, -self.v)

    @property
    def u_y(self) -> Array:
        """du/dy (nx, ny, m) [1/s], weighed by the shear depth where there is one."""
        if self.shear_depth.size:
            return weighted_across(self.u, self.shear_depth, self.geometry.dy)
        return across(self.u, self.geometry.dy)

    @property
    def v_x(self) -> Array:
        """dv/dx (nx, ny, m) [1/s]; (dv/dx + kappa u) / J where x follows a centreline of curvature kappa."""
        return self._along(self.v, self.u)

    @property
    def v_y(self) -> Array:
        """dv/dy (nx, ny, m) [1/s]."""
        return across(self.v, self.geometry.dy)

    def _along(self, values: Array, turned: Array) -> Array:
        """Slope along x of a component of the velocity, and what the turn of x itself makes of the other."""
        slope = along(values, self.geometry.dx)
        if not self.geometry.turning.size:
            return slope
        return slope / self.geometry.stretch + self.geometry.turning * turned


@dataclass(frozen=True)
class PlantCells:
    """Plants of each vegetated cell, (cell, m): phi [-], canopy height h_d [m], depth [m], speed [m/s]; and, (cell, 1),
    front: distance from the upstream end of the patch, edge: from its nearest side, x, y [m]; patch: its index.
    """

    phi: Array
    canopy_height: Array
    depth: Array
    speed: Array
    front: Array
    edge: Array
    x: Array
    y: Array
    patch: Array


@dataclass(frozen=True)
class BoundaryValues:
    """What enters and leaves: discharge of each inflow and member (inflow, m) [m3/s], outlet level (m,) [m], relative
    spread across the inflows (inflow, cell, m) [-], lateral inflow along the channel (m,) [m3/s]; position:
    -1 .. 1 across each inflow (inflow, cell, 1).
    """

    discharge: Array
    level: Array
    spread: Array
    lateral: Array
    position: Array


@dataclass(frozen=True)
class Reading:
    """What instruments show: value (station, m) [m/s, m or m3/s]; which of them measure a velocity or a level, 1 or 0
    (station, 1), neither for a discharge; component: the velocity that a probe measures, along x, across, or the speed
    [m/s], component_y its d/dy [1/s] (station, m), 0 for what is no velocity; and of the flow at each station depth
    [m], u [m/s], friction rate k [1/m] (station, m), canopy height over depth (station, m), 0 outside plants; x, y [m]
    (station, 1).
    """

    value: Array
    velocity: Array
    level: Array
    component: Array
    component_y: Array
    depth: Array
    u: Array
    rate: Array
    canopy_share: Array
    x: Array
    y: Array


def along(values: Array, dx: float) -> Array:
    """d/dx by central differences, one-sided at the ends; values (nx, ny, m), the same shape comes back [unit/m]."""
    return _slope(values, dx) if values.shape[0] > 1 else np.zeros_like(values)


def across(values: Array, dy: float) -> Array:
    """d/dy by central differences, one-sided at the ends; values (nx, ny, m), the same shape comes back [unit/m]."""
    if values.shape[1] < 2:
        return np.zeros_like(values)
    return _slope(values.swapaxes(0, 1), dy).swapaxes(0, 1)


def weighted_across(values: Array, weight: Array, dy: float) -> Array:
    """d/dy, the mean of the differences on either side by their weight (nx, ny - 1, m) [unit/m].

    Land has no weight, so that beside it the difference on the wet side counts alone.
    """
    step, whole = np.zeros_like(values), np.zeros_like(values)
    weighted = weight * np.diff(values, axis=1)
    for total, side in ((step, weighted), (whole, weight)):
        total[:, :-1] += side
        total[:, 1:] += side
    return step / (whole * dy)


def _slope(values: Array, step: float) -> Array:
    """What numpy.gradient gives along the first axis, in fewer passes: effects ask for it in every residual."""
    slope = np.empty_like(values)
    np.subtract(values[2:], values[:-2], out=slope[1:-1])
    slope[1:-1] *= 0.5 / step
    slope[0], slope[-1] = (values[1] - values[0]) / step, (values[-1] - values[-2]) / step
    return slope
