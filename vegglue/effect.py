"""What a physical effect is: a small pure function of the flow at cell centres, declared beside its parameters.

Each effect acts at one stage. Its function gets what stands there and its parameters, (m,) each, and returns what it
changes, by name:

    site        act(ground, ...)    -> {"bed"}                                   added to the bed level [m]
    boundary    act(boundary, ...)  -> {"discharge", "level", "spread", "lateral"}        takes their place
    plants      act(stand, ...)     -> {"phi", "canopy_height"}                           takes their place
    resistance  act(cells, ...)     -> {"rate"}                                           takes its place [1/m]
    exchange    act(cells, ...)     -> {"viscosity"} [m2/s], {"xx", "xy", "yy"} [m3/s2]   added
    force       act(cells, ...)     -> {"x", "y"}                                         added [m/s2]
    sensor      act(reading, ...)   -> {"value"}                                          takes its place

In {"xx", "xy", "yy"} are momentum fluxes h T, so that the force on the water is -(1/h) div(h T).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Stage = Literal["site", "boundary", "plants", "resistance", "exchange", "force", "sensor"]
STAGES: tuple[Stage, ...] = ("site", "boundary", "plants", "resistance", "exchange", "force", "sensor")
# What each stage hands on, and whether an effect adds to it or takes its place.
ADDED = {"site": ("bed",), "exchange": ("viscosity", "xx", "xy", "yy"), "force": ("x", "y")}
REPLACED = {
    "boundary": ("discharge", "level", "spread", "lateral"),
    "plants": ("phi", "canopy_height"),
    "resistance": ("rate",),
    "sensor": ("value",),
}


@dataclass(frozen=True)
class Amplitude:
    """The one parameter that switches an effect: nothing happens at `off`.

    scale: a plausible size, the standard deviation of its prior around `off`; low, high: where it must lie. power: the
    predictions answer to (amplitude - off)^power, to first order.
    """

    name: str
    unit: str
    meaning: str
    scale: float
    low: float
    high: float
    off: float = 0.0
    power: int = 1

    def gain(self, value: float) -> float:
        """What predictions answer to: (value - off)^power, of the sign of the difference."""
        return float(np.sign(value - self.off) * np.abs(value - self.off) ** self.power)

    def size(self, gain: float) -> float:
        """How far from off the value of that gain lies."""
        return float(np.sign(gain) * np.abs(gain) ** (1.0 / self.power))

    def at(self, gain: float) -> float:
        """The value of that gain, kept within the support."""
        return float(np.clip(self.off + self.size(gain), self.low, self.high))

    def may_be(self, gain: float, most: float) -> bool:
        """Whether the value of a gain lies within the support, and within `most` times scale of off."""
        value = self.off + self.size(gain)
        return self.low <= value <= self.high and abs(value - self.off) <= most * self.scale

    @property
    def small(self) -> float:
        """A step from off into the support, small but large against rounding in its power."""
        step = (0.02 if self.power == 1 else 0.2) * self.scale
        return step if self.off + step <= self.high else -step

    @property
    def plausible(self) -> float:
        """Gain of a plausible size."""
        return self.scale**self.power


@dataclass(frozen=True)
class Shape:
    """A parameter that means nothing while the effect is off: where, how wide, which exponent.

    default: its value unless told; grid: the values a search tries; low, high: where it must lie.
    """

    name: str
    unit: str
    meaning: str
    default: float
    low: float
    high: float
    grid: tuple[float, ...] = ()


@dataclass(frozen=True)
class Effect:
    """An effect as the library lists it. equation: one line of text; checked: whether the formula was read in `source`.

    each: whether it is one cause for the whole case, or a cause of its own in each experiment, section or device.
    mirrored: whether a mirrored flow feels the mirrored effect; if not, `equation` says what breaks the mirror.
    """

    name: str
    stage: Stage
    title: str
    equation: str
    act: Callable[..., Mapping[str, Array]]
    amplitude: Amplitude
    shapes: tuple[Shape, ...] = ()
    source: str = ""
    doi: str = ""
    checked: bool = False
    each: Literal["case", "experiment", "section", "device"] = "case"
    mirrored: bool = True
    tags: tuple[str, ...] = ()

    @property
    def parameters(self) -> tuple[Amplitude | Shape, ...]:
        return (self.amplitude, *self.shapes)


@dataclass(frozen=True)
class Acting:
    """An effect at work: values (m,) of its parameters by name, and where it acts when not everywhere.

    sections, devices: what a sensor effect is limited to; empty for all.
    """

    effect: Effect
    values: Mapping[str, Array]
    sections: tuple[str, ...] = ()
    devices: tuple[str, ...] = ()

    @property
    def on(self) -> NDArray[np.bool_]:
        return np.asarray(self.values[self.effect.amplitude.name] != self.effect.amplitude.off)


@dataclass(frozen=True)
class Ground:
    """What does not move, at cell centres, (nx, ny, 1) [m] where not said otherwise.

    offset: distance from the channel axis over the half width of the floor, positive towards larger y [-]; half_width:
    that half width; side_slope: |dz/dy| [-]; bank: 1 beyond the toe of the banks, else 0; planted: 1 where plants stand
    in this experiment; front: distance from the upstream end of the patch a cell is in, else infinite; edge: distance
    across from the nearest side of a patch, positive outside it and negative inside, infinite in columns without one;
    wake: distance downstream from the end of the nearest patch upstream that spans this row, else infinite.
    """

    x: Array
    y: Array
    dx: float
    dy: float
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


@dataclass(frozen=True)
class Cells:
    """The flow at cell centres, (nx, ny, m): depth h and level [m], u and v [m/s], friction rate k [1/m], the
    part of it that is the bed's, and viscosity [m2/s]; gradients [1/s]. shear_depth: by which du/dy weighs what is on
    either side, (nx, ny - 1, m) [m], the smaller depth of the two cells, or empty.
    """

    ground: Ground
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
        """|U| = (u^2 + v^2 + 0.001^2)^(1/2) [m/s], never zero, so that it has a derivative at rest."""
        return np.sqrt(self.u**2 + self.v**2 + 1e-6)

    @property
    def shear_velocity(self) -> Array:
        """u* = (k_bed h)^(1/2) |U| [m/s], of the bed alone."""
        return np.sqrt(self.bed_rate * self.depth) * self.speed

    @property
    def u_x(self) -> Array:
        return along(self.u, self.ground.dx)

    @property
    def u_y(self) -> Array:
        if self.shear_depth.size:
            return weighted_across(self.u, self.shear_depth, self.ground.dy)
        return across(self.u, self.ground.dy)

    @property
    def v_x(self) -> Array:
        return along(self.v, self.ground.dx)

    @property
    def v_y(self) -> Array:
        return across(self.v, self.ground.dy)


@dataclass(frozen=True)
class Stand:
    """Plants of each vegetated cell, (cell, m): phi [-], canopy height h_d [m], depth [m], speed [m/s]; and, (cell, 1),
    front: distance from the upstream end of the patch, edge: from its nearest side, x, y [m].
    """

    phi: Array
    canopy_height: Array
    depth: Array
    speed: Array
    front: Array
    edge: Array
    x: Array
    y: Array


@dataclass(frozen=True)
class Boundary:
    """What enters and leaves: discharge of each inflow and member (inflow, m) [m3/s], outlet level (m,) [m], relative
    spread across the inflows (inflow, cell, m) [-], lateral inflow along the reach (m,) [m3/s]; place: -1 .. 1 across
    each inflow (inflow, cell, 1).
    """

    discharge: Array
    level: Array
    spread: Array
    lateral: Array
    place: Array


@dataclass(frozen=True)
class Reading:
    """What instruments show: value (station, m) [m/s or m]; velocity: (station, 1) 1 for velocities, 0 for levels;
    and of the flow at each station depth [m], u [m/s], friction rate k [1/m], du/dy [1/s] (station, m), canopy height
    over depth (station, m), 0 outside plants; x, y [m] (station, 1).
    """

    value: Array
    velocity: Array
    depth: Array
    u: Array
    rate: Array
    u_y: Array
    canopy_share: Array
    x: Array
    y: Array


def along(values: Array, dx: float) -> Array:
    """d/dx by central differences, one-sided at the ends."""
    return _slope(values, dx) if values.shape[0] > 1 else np.zeros_like(values)


def across(values: Array, dy: float) -> Array:
    """d/dy by central differences, one-sided at the ends."""
    if values.shape[1] < 2:
        return np.zeros_like(values)
    return _slope(values.swapaxes(0, 1), dy).swapaxes(0, 1)


def weighted_across(values: Array, weight: Array, dy: float) -> Array:
    """d/dy, the mean of what is on either side by its weight (nx, ny - 1, m): beside land what is on the wet one."""
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


def applied(acting: tuple[Acting, ...], stage: Stage, stand: Any, neutral: Mapping[str, Array]) -> dict[str, Array]:
    """What a stage hands on after all effects that act there, in the order of the case.

    Where the amplitude of a member is at its off value, nothing of the effect reaches it, not even a rounding.
    """
    added = ADDED.get(stage, ())
    now = dict(neutral)
    for one in acting:
        on = one.on
        if one.effect.stage != stage or not on.any():
            continue
        change = one.effect.act(stand, **one.values)
        for name, value in change.items():
            if name in added:
                now[name] = now[name] + _chosen(on, value, np.zeros(1))
            else:
                now[name] = _chosen(on, value, now[name])
        if not added:
            stand = replace(stand, **{name: now[name] for name in change})
    return now


def _chosen(on: NDArray[np.bool_], value: Array, otherwise: Array) -> Array:
    """np.where, without a copy when all members are on."""
    if on.all():
        return np.broadcast_to(value, np.broadcast_shapes(np.shape(value), np.shape(otherwise)))
    return np.where(on, value, otherwise)
