"""What a physical effect is: a small pure function of the flow at cell centres, declared beside its parameters.

Each effect acts at one stage. Its function takes what is visible there (`surroundings`) and its parameters, (m,) each,
and returns what it changes, by name:

    site        act(geometry, ...)  -> {"bed", "inflow"}                            added
    boundary    act(boundary, ...)  -> {"discharge", "level", "spread", "lateral"}  takes their place
    plants      act(plants, ...)    -> {"phi", "canopy_height"}                     takes their place
    resistance  act(cells, ...)     -> {"rate"}                                     takes its place
    exchange    act(cells, ...)     -> {"viscosity", "xx", "xy", "yy"}              added
    force       act(cells, ...)     -> {"x", "y"}                                   added
    sensor      act(reading, ...)   -> {"value"}                                    takes its place

{"xx", "xy", "yy"} are momentum fluxes h T, so that the force on the water is -(1/h) div(h T).
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vegglue.arrays import Array

# Surroundings of its stage and parameters -> what the effect changes, by name.
Act = Callable[..., Mapping[str, Array]]
Stage = Literal["site", "boundary", "plants", "resistance", "exchange", "force", "sensor"]
Each = Literal["case", "experiment", "section", "device", "patch"]
EACH: tuple[Each, ...] = ("case", "experiment", "section", "device", "patch")
# What a site has to have for an effect to act there: wind, and water that seeps in, need a channel without walls of a
# laboratory; partial sampling needs verticals that were sampled at too few heights; a layer that grows from the inflow
# needs two streams side by side: an inflow of two speeds, which an effect that distributes it gives, or `SiteScales`.
Need = Literal["open air", "open ground", "banks", "plants", "gauges", "few heights", "one surface", "two streams"]
STAGES: tuple[Stage, ...] = ("site", "boundary", "plants", "resistance", "exchange", "force", "sensor")
# What each stage returns, and whether an effect adds to it or takes its place.
ADDED = {
    "site": {"bed": "(nx, ny, m) [m]", "inflow": "(nx, ny, m) [m/s]"},
    "exchange": {"viscosity": "(nx, ny, m) [m2/s]", **dict.fromkeys(("xx", "xy", "yy"), "(nx, ny, m) [m3/s2]")},
    "force": {"x": "(nx, ny, m) [m/s2]", "y": "(nx, ny, m) [m/s2]"},
}
REPLACED = {
    "boundary": {
        "discharge": "(inflow, m) [m3/s]", "level": "(m,) [m]", "spread": "(inflow, cell, m) [-]",
        "lateral": "(m,) [m3/s]",
    },
    "plants": {"phi": "(cell, m) [-]", "canopy_height": "(cell, m) [m]"},
    "resistance": {"rate": "(nx, ny, m) [1/m]"},
    "sensor": {"value": "(station, m) [unit of the reading]"},
}  # fmt: skip


@dataclass(frozen=True)
class Amplitude:
    """The one parameter that switches an effect on.

        g = |value - off|^power sign(value - off)

    Predictions change in proportion to the gain g, to first order; nothing happens at `off`.

    Parameters
    ----------
    name, unit, meaning
        Name by which the function takes it, unit ("-" if none), and what it is in words.
    scale
        A plausible size [unit], the standard deviation of its prior around `off`.
    low, high
        Its support [unit].
    off
        The value [unit] at which the effect does nothing.
    power
        Exponent of the gain [-].
    of
        Scale of the site, see `scales.SiteScales.of`, of which scale, low, high and off are multiples; "": they are in
        the unit.
    low_of
        Scale of which `low` is a multiple, if it is another.
    basis
        The relation of the literature that the plausible size comes from; "": it is chosen, see docs/sensitivity.md.
    """

    name: str
    unit: str
    meaning: str
    scale: float
    low: float
    high: float
    off: float = 0.0
    power: int = 1
    of: str = ""
    low_of: str = ""
    basis: str = ""

    @property
    def only_sign(self) -> int:
        """The only sign that the gain may have, 0 if it may have both."""
        return int(self.low >= self.off) - int(self.high <= self.off)

    @property
    def furthest(self) -> float:
        """The largest |value - off| in the support."""
        return max(self.high - self.off, self.off - self.low)

    def gain(self, value: float) -> float:
        """g of a value."""
        return float(np.sign(value - self.off) * np.abs(value - self.off) ** self.power)

    def size(self, gain: float) -> float:
        """value - off = |g|^(1/power) sign(g)."""
        return float(np.sign(gain) * np.abs(gain) ** (1.0 / self.power))

    def at(self, gain: float) -> float:
        """The value that has this gain, or the nearest one in the support."""
        return float(np.clip(self.off + self.size(gain), self.low, self.high))

    def allows(self, gain: float, largest: float) -> bool:
        """Whether the value of that gain lies in the support and within `largest` times scale of off."""
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
    """A parameter that means nothing while the effect is off: a place, a width, an exponent.

    Parameters
    ----------
    name, unit, meaning
        As of an amplitude.
    default
        Its value unless a config gives one.
    low, high
        Its support.
    grid
        Values that a search tries; empty: the default alone.
    of
        Scale of the site of which all of these are multiples; "": they are in the unit.
    sd
        Standard deviation of its prior around `default` if it is calibrated together with the amplitude; 0: a number.
    """

    name: str
    unit: str
    meaning: str
    default: float
    low: float
    high: float
    grid: tuple[float, ...] = ()
    of: str = ""
    sd: float = 0.0


@dataclass(frozen=True)
class SeenRange:
    """The range of a quantity, `low` to `high` [unit], in the data from which an effect was discovered.

    symbol: of the quantity in an equation; of: the quantity as a function of the surroundings of its stage.
    """

    symbol: str
    unit: str
    of: Callable[..., Array]
    low: float
    high: float


@dataclass(frozen=True)
class Effect:
    """A physical effect as the library lists it.

    Parameters
    ----------
    name
        Letters, digits and underscores.
    stage
        Where it acts, see the head of this module.
    title
        What it is, in a few words.
    equation
        What it changes, in one line of text.
    act
        The function: surroundings and parameters by name in, changes by name out.
    amplitude, shapes
        Its parameters.
    source, doi
        Where the equation stands.
    checked
        Whether the equation was read in `source`.
    read_in
        The program in whose code it was read, if the source was not at hand.
    each
        "case" if it is one cause for the whole case, else "experiment", "section", "device" or "patch" for a cause of
        its own in each; "patch" needs a shape `patch`, the number of the patch from 1.
    mirrored
        Whether a mirrored flow feels the mirrored effect; if not, `equation` contains what breaks the mirror.
    tags
        "search": something at a place; "law": of the grammar; "negative control"; "common": an omission that is common;
        "inflow": how the discharge is distributed where it enters.
    seen
        Where a discovered effect was found to hold; elsewhere it is an extrapolation, of which commands warn.
    needs
        What a site has to have, else the effect is not offered there.
    from_file
        Whether it was read from a user's file, so that what it returns is checked. Set by `library.effects_of`.
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
    needs: tuple[Need, ...] = ()
    from_file: bool = False

    @property
    def parameters(self) -> tuple[Amplitude | Shape, ...]:
        """The amplitude first, then the shapes; `act` takes them by name."""
        return (self.amplitude, *self.shapes)

    @property
    def docstring(self) -> str:
        """That of `act`, with the parameters and what the stage returns, for `help`."""
        surroundings = next(iter(inspect.signature(self.act).parameters.values()))
        returned = (ADDED | REPLACED)[self.stage].items()
        return "\n".join(
            (
                inspect.cleandoc(self.act.__doc__ or ""), "",
                "Parameters", "----------", f"{surroundings.name} : {surroundings.annotation.__name__}",
                *(f"{one.name} : (m,) [{one.unit}]\n    {one.meaning}" for one in self.parameters), "",
                "Returns", "-------", "dict", "    " + " or ".join(f"`{name}` {kind}" for name, kind in returned),
            )
        )  # fmt: skip
