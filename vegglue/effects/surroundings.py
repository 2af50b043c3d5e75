"""What an effect sees at its stage: the channel, the flow at cell centres, plants, boundaries, readings."""

from dataclasses import dataclass, field

import numpy as np

from vegglue.arrays import Array

# Square of 1 mm/s [m2/s2], below which friction is linear in the solver, too (`flow/kernels`).
AT_REST_SQUARED = 1e-6


def speed_of(u: Array, v: Array) -> Array:
    """|U| = (u^2 + v^2 + 0.001^2)^(1/2) [m/s]: it has a derivative at rest.

    Parameters
    ----------
    u, v : [m/s]
        Of one shape, which comes back.
    """
    return np.sqrt(u**2 + v**2 + AT_REST_SQUARED)


@dataclass(frozen=True)
class ChannelGeometry:
    """What does not move, at cell centres (nx, ny, 1) unless another shape is given; seen by effects on the site.

    Parameters
    ----------
    x, y
        Along and across the channel [m].
    share_along
        (x - x_m) / L, x_m the middle of the grid, -1/2 .. 1/2 (nx, 1, 1) [-].
    length
        L, that of the whole grid [m]: effects on the flow see some columns at a time.
    dx, dy
        Size of a cell [m].
    filter_width
        Width [m] below which eddies are not resolved, the same on every grid of a case.
    bed
        Bed level [m].
    offset
        Distance from the channel axis over the half width of the floor, positive towards larger y [-].
    half_width
        Half width of the floor [m].
    side_slope
        |dz/dy| [-].
    bank
        1 beyond the toe of the banks, else 0 [-].
    planted
        Share of a cell that plants cover in this experiment [-].
    front
        Distance from the upstream end of the patch that a cell is in, else infinite [m].
    edge
        Distance across from the nearest side of a patch, negative inside; infinite in columns without a patch [m].
    wake
        Distance downstream from the end of the nearest patch upstream that spans this row, else infinite [m].
    patch
        Index of the patch, -1 without.
    relative_stems
        Stems of the patch over the mean of all patches, 1 without a patch [-].
    stretch
        Length of a cell over dx on a grid along a centreline [-].
    turning
        Curvature of that line along the row of a cell [1/m]; empty on a straight grid.
    depth_scale, speed_scale
        Depth on the floor [m] and mean speed [m/s] of the site; shares of them are the least depth and speed of some
        laws.
    """

    x: Array
    y: Array
    share_along: Array
    length: float
    dx: float
    dy: float
    filter_width: float
    bed: Array
    offset: Array
    half_width: Array
    side_slope: Array
    bank: Array
    planted: Array
    front: Array
    edge: Array
    wake: Array
    patch: Array
    relative_stems: Array = field(default_factory=lambda: np.ones((1, 1, 1)))
    stretch: Array = field(default_factory=lambda: np.ones((1, 1, 1)))
    turning: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    depth_scale: float = 1.0
    speed_scale: float = 0.5

    @property
    def open_floor(self) -> Array:
        """Share of a cell that is floor without plants (nx, ny, 1) [-]."""
        return (1.0 - self.bank) * (1.0 - self.planted)


@dataclass(frozen=True)
class Cells:
    """The flow at cell centres, (nx, ny, m); seen by effects on resistance, exchange and force.

    Parameters
    ----------
    geometry
        The channel.
    depth, level
        h and z_s [m].
    u, v
        Velocities along x and y [m/s].
    rate, bed_rate
        Friction rate k = g / (C^2 h) and the part of it that is the bed's [1/m].
    viscosity
        Eddy viscosity [m2/s].
    shear_depth
        Smaller depth of two neighbours across (nx, ny - 1, m) [m], by which du/dy weighs its sides, or empty.
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
        """du/dy (nx, ny, m) [1/s], weighted by the shear depth where there is one."""
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
    """Plants of vegetated cells; seen by effects on plants.

    Parameters
    ----------
    phi, canopy_height
        Drag C_D m D h_d [-] and height h_d [m] of the plants (cell, m).
    depth, speed
        h [m] and |U| [m/s] (cell, m).
    front, edge
        Distances from the upstream end of the patch and from its nearest side, (cell, 1) [m].
    x, y, patch
        Place [m] and index of the patch, (cell, 1).
    speed_scale
        Mean speed of the site [m/s].
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
    speed_scale: float = 0.5


@dataclass(frozen=True)
class BoundaryValues:
    """What enters and leaves; seen by effects on boundaries.

    Parameters
    ----------
    discharge
        Of each inflow (inflow, m) [m3/s].
    level
        At the outlet (m,) [m].
    spread
        Relative spread over each inflow (inflow, cell, m) [-].
    lateral
        Inflow along the channel (m,) [m3/s].
    position
        -1 .. 1 across each inflow (inflow, cell, 1) [-].
    """

    discharge: Array
    level: Array
    spread: Array
    lateral: Array
    position: Array


@dataclass(frozen=True)
class Reading:
    """What instruments show; seen by effects on sensors.

    Parameters
    ----------
    value
        The reading (station, m) [m/s, m or m3/s].
    velocity, level
        1 for stations that measure a velocity or a level, else 0; both 0 for a discharge (station, 1).
    component, component_y
        Velocity that a probe measures, along x, across, or the speed [m/s], and its d/dy [1/s] (station, m); else 0.
    depth, u, rate
        Depth [m], u [m/s] and friction rate k [1/m] of the flow at the station (station, m).
    canopy_share
        Canopy height over depth (station, m) [-], 0 outside plants.
    x, y
        Place (station, 1) [m].
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
    """d/dx by central differences, one-sided at the ends, (nx, ny, m) [unit/m]; 0 in a single column.

    Parameters
    ----------
    values : (nx, ny, m)
    dx : [m]
    """
    return _slope(values, dx) if values.shape[0] > 1 else np.zeros_like(values)


def across(values: Array, dy: float) -> Array:
    """d/dy by central differences, one-sided at the ends, (nx, ny, m) [unit/m]; 0 in a single row.

    Parameters
    ----------
    values : (nx, ny, m)
    dy : [m]
    """
    if values.shape[1] < 2:
        return np.zeros_like(values)
    return _slope(values.swapaxes(0, 1), dy).swapaxes(0, 1)


def weighted_across(values: Array, weight: Array, dy: float) -> Array:
    """d/dy, the mean of the differences on either side by their weight, (nx, ny, m) [unit/m].

    Land has no weight, so that beside it the difference on the wet side counts alone.

    Parameters
    ----------
    values, weight : (nx, ny, m), (nx, ny - 1, m)
    dy : [m]
    """
    step, whole = np.zeros_like(values), np.zeros_like(values)
    weighted = weight * np.diff(values, axis=1)
    for total, side in ((step, weighted), (whole, weight)):
        total[:, :-1] += side
        total[:, 1:] += side
    return step / (whole * dy)


def _slope(values: Array, step: float) -> Array:
    """numpy.gradient along the first axis in fewer passes: every residual needs it."""
    slope = np.empty_like(values)
    np.subtract(values[2:], values[:-2], out=slope[1:-1])
    slope[1:-1] *= 0.5 / step
    slope[0], slope[-1] = (values[1] - values[0]) / step, (values[-1] - values[-2]) / step
    return slope
