"""Kinds of observation: what a station measures, in which unit, and what that means for its error.

A new kind is one entry here, its reader in `flow/sensor.py`, and roles of its columns in `importers/column_names.py`
for files that are imported; `adv` in a case is a way of reading that yields velocities, no kind of its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vegglue.errors import InputError
from vegglue.wording.numbers import so_many


class Unused(StrEnum):
    """Why a station or a point is not used: `reason` in their tables, beside what a dead probe shows."""

    OUTSIDE = "outside the grid"
    AT_WALL = "at a side wall"
    EXCLUDED = "excluded"
    BELOW_BED = "below the bed"
    ABOVE_SURFACE = "above the water surface"


@dataclass(frozen=True)
class Kind:
    """One kind of observation.

    Attributes
    ----------
    name, words : str
        As in a case and in tables of stations, and the same in prose.
    unit : str
        Of a value and of its standard error.
    column, file : str
        Column of the values in a CSV file, and name of such a file in a folder of measurements.
    instrument : {"probe", "gauge", "section"}
        A probe measures a velocity at a point of a named section, a gauge a level at a point, a section what passes
        a whole cross-section, so that y has no meaning.
    correlated : bool
        Whether the errors of neighbours along a section are correlated.
    usual_error : float
        Standard error of a measurement still to be made if none of this kind is at hand [unit].
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
        """Column of the standard errors in a CSV file."""
        return f"{self.column}_se"

    @property
    def at_point(self) -> bool:
        """Whether it was measured at a point (x, y), not through a section at x."""
        return self.instrument != "section"

    @property
    def velocity(self) -> bool:
        """Whether it is a velocity, in whatever direction."""
        return self.instrument == "probe"


@dataclass(frozen=True)
class UnstatedErrors:
    """Used stations without a standard error.

    Attributes
    ----------
    counts
        How many of each kind, in words.
    first
        x, y of the first [m].
    fill, add
        Columns of errors that exist and have gaps, and that do not exist.
    usual
        Error of the first kind, and its unit.
    """

    counts: tuple[tuple[str, int], ...]
    first: tuple[float, float]
    fill: tuple[str, ...]
    add: tuple[str, ...]
    usual: tuple[float, str]


# Kinds that code refers to by name: velocities along x and along y, levels, and discharges through a section.
STREAMWISE, TRANSVERSE, WATER_LEVEL, THROUGH_SECTION = "velocity", "velocity_across", "level", "discharge"
# Usual errors: 0.015 m/s for the mean of a vertical of ADV points, in any direction; 3 mm for a gauge read by eye;
# 0.1 m3/s, 5 % of 2 m3/s, for a gauging by verticals.
KINDS = {
    kind.name: kind
    for kind in (
        Kind(STREAMWISE, "velocity", "m/s", "u", "velocities.csv", "probe", True, 0.015),
        Kind(TRANSVERSE, "velocity across", "m/s", "v", "velocities_across.csv", "probe", True, 0.015),
        Kind("speed", "speed", "m/s", "speed", "speeds.csv", "probe", True, 0.015),
        Kind(WATER_LEVEL, "level", "m", "level", "levels.csv", "gauge", False, 0.003),
        Kind(THROUGH_SECTION, "discharge", "m3/s", "discharge", "discharges.csv", "section", False, 0.1),
    )
}


def kind_of(name: str) -> Kind:
    """The kind of that name.

    Raises
    ------
    InputError
        If it is none of KINDS.
    """
    if name not in KINDS:
        raise InputError(f"observations: expected a kind among {', '.join(KINDS)}, got {name!r}; correct it.")
    return KINDS[name]


def velocity_rows(station: pd.DataFrame) -> NDArray[np.bool_]:
    """Which stations measure a velocity, in whatever direction (station,).

    Parameters
    ----------
    station : table of stations

    Raises
    ------
    InputError
        If a kind is unknown.
    """
    return np.array([kind_of(str(name)).velocity for name in station["kind"]], dtype=bool)


def point_rows(station: pd.DataFrame) -> NDArray[np.bool_]:
    """Which stations measure at a point (x, y), not through a section at x (station,); as `velocity_rows`."""
    return np.array([kind_of(str(name)).at_point for name in station["kind"]], dtype=bool)


def correlated_rows(station: pd.DataFrame) -> NDArray[np.bool_]:
    """Which stations have errors that neighbours of their section share (station,); as `velocity_rows`."""
    return np.array([kind_of(str(name)).correlated for name in station["kind"]], dtype=bool)


def leading_velocities(station: pd.DataFrame) -> NDArray[np.bool_]:
    """Which stations in use measure a velocity along x (station,); in whatever direction if none does.

    Parameters
    ----------
    station : table of stations

    Raises
    ------
    InputError
        If a kind is unknown.
    """
    used = station["used"].to_numpy()
    along = used & (station["kind"] == STREAMWISE).to_numpy()
    return along if along.any() else used & velocity_rows(station)


def errors_in_short(by_kind: Mapping[str, float]) -> str:
    """`velocity 0.0098 m/s, level 0.0021 m`: one error of each kind that is known."""
    known = {kind_of(name): value for name, value in by_kind.items() if np.isfinite(value)}
    return ", ".join(f"{kind.words} {value:.2g} {kind.unit}" for kind, value in known.items())


def stations_in_short(station: pd.DataFrame) -> str:
    """`18 stations, in use 15 of velocity, 2 of level`."""
    used = station[station["used"]]
    counts = [f"{(used['kind'] == name).sum()} of {kind_of(name).words}" for name in dict.fromkeys(station["kind"])]
    return f"{so_many(len(station), 'station')}, in use {', '.join(counts) or 'none'}"


def unstated_errors(station: pd.DataFrame) -> UnstatedErrors | None:
    """Which of the used stations state no standard error; None if all do.

    Parameters
    ----------
    station : table of stations

    Raises
    ------
    InputError
        If a kind is unknown.
    """
    used = station[station["used"]]
    stated = used["standard_error"] > 0
    bare = used[~stated]
    if bare.empty:
        return None
    kinds = [kind_of(str(name)) for name in bare["kind"].unique()]
    known = set(used.loc[stated, "kind"])
    return UnstatedErrors(
        counts=tuple((kind.words, int((bare["kind"] == kind.name).sum())) for kind in kinds),
        first=(float(bare["x"].iloc[0]), float(bare["y"].iloc[0])),
        fill=tuple(kind.error_column for kind in kinds if kind.name in known),
        add=tuple(kind.error_column for kind in kinds if kind.name not in known),
        usual=(kinds[0].usual_error, kinds[0].unit),
    )
