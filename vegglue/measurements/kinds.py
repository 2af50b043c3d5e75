"""Kinds of observation: what a station measures, in which unit, and what that means for its error.

A new kind is one entry here and its reader in `flow/readers.py`; `adv` in a case is a way of reading that yields
velocities, no kind of its own.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.errors import InputError


@dataclass(frozen=True)
class Kind:
    """One kind of observation.

    name: as in a case and in tables of stations; words: the same in prose; unit: of a value and of its error;
    column: of the value in a CSV file; file: what a file of them is called in a folder of measurements;
    instrument: `probe`, a velocity at a point of a named section; `gauge`, a level at a point; `section`, through a
    whole cross-section, so that y means nothing; correlated: whether errors of neighbours along a section are;
    usual_error: standard error of a measurement to come, where none of this kind is at hand.
    """

    name: str
    words: str
    unit: str
    column: str
    file: str
    instrument: Literal["probe", "gauge", "section"]
    correlated: bool
    usual_error: float

    @property
    def error_column(self) -> str:
        """Of the standard error in a CSV file."""
        return f"{self.column}_se"

    @property
    def at_point(self) -> bool:
        """Whether y says where it was measured."""
        return self.instrument != "section"

    @property
    def velocity(self) -> bool:
        return self.instrument == "probe"


# What velocities along x and levels are called: the two that errors in m/s and in m are told of.
STREAMWISE, WATER_LEVEL = "velocity", "level"
# Usual errors: 0.015 m/s is that of a vertical of ADV points, 3 mm that of a gauge read by eye; the mean of a velocity
# across a slender stream has that of the one along it; 5 % of 2 m3/s is what a gauging by verticals reaches.
KINDS = {
    kind.name: kind
    for kind in (
        Kind(STREAMWISE, "velocity", "m/s", "u", "velocities.csv", "probe", True, 0.015),
        Kind("velocity_across", "velocity across", "m/s", "v", "velocities_across.csv", "probe", True, 0.015),
        Kind("speed", "speed", "m/s", "speed", "speeds.csv", "probe", True, 0.015),
        Kind(WATER_LEVEL, "level", "m", "level", "levels.csv", "gauge", False, 0.003),
        Kind("discharge", "discharge", "m3/s", "discharge", "discharges.csv", "section", False, 0.1),
    )
}


def kind_of(name: str, where: str = "observations") -> Kind:
    """The kind of that name. Errors: InputError naming those known; where: how its sentence begins."""
    if name not in KINDS:
        raise InputError(f"{where}: expected a kind among {', '.join(KINDS)}, got {name!r}; correct it.")
    return KINDS[name]


def velocity_rows(station: pd.DataFrame) -> NDArray[np.bool_]:
    """Which stations measure a velocity, in whatever direction (station,). Errors: InputError for an unknown kind."""
    return np.array([kind_of(str(name)).velocity for name in station["kind"]], dtype=bool)
