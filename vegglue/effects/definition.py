"""What a physical effect is: a small pure function of the flow at cell centres, declared beside its parameters.

Each effect acts at one stage. Its function gets what is to be seen there (`surroundings`) and its parameters, (m,)
each, and returns what it changes, by name:

    site        act(geometry, ...)  -> {"bed"} [m], {"inflow"} [m/s]                      added
    boundary    act(boundary, ...)  -> {"discharge", "level", "spread", "lateral"}        takes their place
    plants      act(plants, ...)    -> {"phi", "canopy_height"}                           takes their place
    resistance  act(cells, ...)     -> {"rate"}                                           takes its place [1/m]
    exchange    act(cells, ...)     -> {"viscosity"} [m2/s], {"xx", "xy", "yy"} [m3/s2]   added
    force       act(cells, ...)     -> {"x", "y"}                                         added [m/s2]
    sensor      act(reading, ...)   -> {"value"}                                          takes its place

In {"xx", "xy", "yy"} are momentum fluxes h T, so that the force on the water is -(1/h) div(h T).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vegglue.arrays import Array

# What an effect does: what is to be seen at its stage and its parameters -> what it changes, by name.
Act = Callable[..., Mapping[str, Array]]
Stage = Literal["site", "boundary", "plants", "resistance", "exchange", "force", "sensor"]
Each = Literal["case", "experiment", "section", "device", "patch"]
EACH: tuple[Each, ...] = ("case", "experiment", "section", "device", "patch")
STAGES: tuple[Stage, ...] = ("site", "boundary", "plants", "resistance", "exchange", "force", "sensor")
# What each stage hands on, and whether an effect adds to it or takes its place.
ADDED = {"site": ("bed", "inflow"), "exchange": ("viscosity", "xx", "xy", "yy"), "force": ("x", "y")}
REPLACED = {
    "boundary": ("discharge", "level", "spread", "lateral"),
    "plants": ("phi", "canopy_height"),
    "resistance": ("rate",),
    "sensor": ("value",),
}


@dataclass(frozen=True)
class Amplitude:
    """The one parameter that switches an effect on: nothing happens at `off`.

    scale: a plausible size, the standard deviation of its prior around `off`; low, high: its support, within which it
    must lie; power: to first order, predictions change in proportion to (amplitude - off)^power, the gain.
    """

    name: str
    unit: str
    meaning: str
    scale: float
    low: float
    high: float
    off: float = 0.0
    power: int = 1

    @property
    def only_sign(self) -> int:
        """The only sign that its gain may have, 0 where it may have both."""
        return int(self.low >= self.off) - int(self.high <= self.off)

    @property
    def furthest(self) -> float:
        """The largest |value - off| in the support."""
        return max(self.high - self.off, self.off - self.low)

    def gain(self, value: float) -> float:
        """g = |value - off|^power with the sign of value - off, to which predictions change in proportion."""
        return float(np.sign(value - self.off) * np.abs(value - self.off) ** self.power)

    def size(self, gain: float) -> float:
        """value - off = |g|^(1/power) with the sign of the gain g."""
        return float(np.sign(gain) * np.abs(gain) ** (1.0 / self.power))

    def at(self, gain: float) -> float:
        """The value that has this gain, or the nearest one in the support."""
        return float(np.clip(self.off + self.size(gain), self.low, self.high))

    def allows(self, gain: float, largest: float) -> bool:
        """Whether the value of that gain lies within the support and no further from off than `largest` times scale."""
        value = self.off + self.size(gain)
        return self.low <= value <= self.high and abs(value - self.off) <= largest * self.scale

    @property
    def small(self) -> float:
        """A step from off into the support for differences: small, and its power still large against rounding."""
        step = (0.02 if self.power == 1 else 0.2) * self.scale
        return step if self.off + step <= self.high else -step

    @property
    def plausible_gain(self) -> float:
        """scale^power, the gain of a plausible size."""
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
class SeenRange:
    """Where an effect was found to hold: its quantity as it is written, and the values that the data have seen of it
    [unit]. of: the quantity of cells, or what else its stage gets to see.
    """

    symbol: str
    unit: str
    of: Callable[..., Array]
    low: float
    high: float


@dataclass(frozen=True)
class Effect:
    """An effect as the library lists it. equation: one line of text; checked: whether the formula was read in `source`;
    read_in: the program in whose code it was read, where the source was not at hand.

    each: whether it is one cause for the whole case, or a cause of its own in each experiment, section, device
    or patch (a shape `patch` is then its number).
    mirrored: whether a mirrored flow feels the mirrored effect; if not, `equation` says what breaks the mirror.
    seen: where it was found to hold, of a law that was discovered; elsewhere it is a guess, and commands say so.
    """

    name: str
    stage: Stage
    title: str
    equation: str
    act: Act
    amplitude: Amplitude
    shapes: tuple[Shape, ...] = ()
    source: str = ""
    doi: str = ""
    checked: bool = False
    read_in: str = ""
    each: Each = "case"
    mirrored: bool = True
    tags: tuple[str, ...] = ()
    seen: SeenRange | None = None

    @property
    def parameters(self) -> tuple[Amplitude | Shape, ...]:
        """The amplitude first, then the shapes; `act` takes them by name."""
        return (self.amplitude, *self.shapes)
