"""What was measured: ADV points, and stations of every kind that can be read as they are, as one table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.grid import along_and_across, centreline_in
from vegglue.case.schema import Case, Observation
from vegglue.case.size_limits import MOST_STATIONS
from vegglue.errors import InputError, shown_path
from vegglue.measurements.adv_section import Section, across_averages, average_of, read_section
from vegglue.measurements.csv_table import read_table, refuse_repeated, refuse_rows
from vegglue.measurements.kinds import (
    KINDS,
    STREAMWISE,
    TRANSVERSE,
    WATER_LEVEL,
    Kind,
    Unused,
    correlated_rows,
    kind_of,
    point_rows,
    velocity_rows,
)
from vegglue.measurements.section_discharge import Discharge
from vegglue.measurements.vertical_profile import CanopyHeight, ProfileFit
from vegglue.wording.numbers import nearest

# Columns of every table of stations, of ADV points and of verticals, with their types; points may have more, as in
# their file (v, u_se, ...).
STATION_TYPES: dict[str, type] = {
    "experiment": str, "kind": str, "section": str, "x": float, "y": float, "value": float, "standard_error": float,
    "used": bool, "reason": str, "depth": float, "device": str,
}  # fmt: skip
STATION_COLUMNS = tuple(STATION_TYPES)
POINT_TYPES: dict[str, type] = {
    "experiment": str, "section": str, "device": str, "x": float, "y": float, "z": float, "bed": float, "depth": float,
    "height": float, "plants": bool, "u": float, "u_std": float, "standard_error": float, "used": bool, "reason": str,
}  # fmt: skip
PROFILE_TYPES: dict[str, type] = {
    "experiment": str, "section": str, "x": float, "y": float, "bed": float, "depth": float, "plants": bool,
    "device": str, "points": int, "used": bool, "reason": str, "law": str, "linear": float, "linear_error": float,
    "fitted": float, "fitted_error": float, "within": float, "slope": float, "top": float, "scatter": float,
}  # fmt: skip
# Readings and their errors, in the SI unit of whatever kind: beyond them lies nothing that is measured in a stream, and
# the squares of such numbers leave no digits of the others.
SMALLEST_STATED_ERROR, LARGEST_READING = 1e-9, 1e9
# Distance from a side wall over the width of a cell [-] below which a velocity is no reading of the cell: its middle,
# but for rounding.
NEAR_WALL = 0.499
Key = tuple[str, str]  # names of experiment and section


@dataclass(frozen=True)
class Observations:
    """All measurements of a case. x, y in the coordinates of the model grid [m]; SI throughout.

    Attributes
    ----------
    table : DataFrame
        One row for each station, columns STATION_COLUMNS with their STATION_TYPES, see `station_table`: code that reads
        it converts no types. value and standard_error are in the unit of their kind (see kinds.py), standard_error and
        depth NaN if unknown. A discharge has no y of its own, and is drawn at the one given. A station with
        used = False is not calibrated to, has a `reason`, and may have the value NaN.
    points : DataFrame
        Every ADV point, POINT_TYPES: z and bed in the datum of the file, height above the bed, plants (inside a patch),
        u_std NaN if unknown.
    profiles : DataFrame
        Every vertical, PROFILE_TYPES: points (how many), linear and linear_error (the rule `paper`), fitted and
        fitted_error (profile fit), law of the fit, within, slope, top and scatter (see vertical_profile.ProfileFit; NaN
        without a fit).
    discharge : dict
        By (experiment, section), then by rule, `paper` and `profile`.
    neighbour_error : dict
        By (experiment, section), the error of one vertical estimated from its neighbours [m/s]. If it is larger than
        the error from the points of the vertical, it contains what these do not show (position, stems). It is part of
        standard_error in table.
    canopy_height : dict
        By (experiment, section), if verticals stand inside plants.
    """

    table: pd.DataFrame
    points: pd.DataFrame
    profiles: pd.DataFrame
    discharge: dict[Key, dict[str, Discharge]]
    neighbour_error: dict[Key, float]
    canopy_height: dict[Key, CanopyHeight]


def station_table(*parts: pd.DataFrame) -> pd.DataFrame:
    """One table of stations of several: the only maker of tables that are calibrated to, predicted or read from a file.

    Parameters
    ----------
    *parts : DataFrame
        Rows with the columns STATION_COLUMNS; none for an empty table.

    Returns
    -------
    DataFrame
        Columns STATION_COLUMNS in their order, with the dtypes STATION_TYPES: text is str and never missing, `used` is
        bool, numbers are float64 and NaN if unknown. Rows are numbered from 0.

    Raises
    ------
    KeyError
        If a column is missing.
    """
    return _with_types(parts, STATION_TYPES)[list(STATION_COLUMNS)]


def _with_types(parts: Sequence[pd.DataFrame], types: Mapping[str, type]) -> pd.DataFrame:
    if not parts:
        return pd.DataFrame({name: pd.Series(dtype=one) for name, one in types.items()})
    return pd.concat(parts, ignore_index=True).astype(types)


def section_places(station: pd.DataFrame) -> pd.Series:
    """The x of the section of each station (station,) [m]: the median of those of its name in its experiment.

    A boat does not keep its line. Stations without such a name, or that lie along the channel rather than across it,
    have their own x.

    Parameters
    ----------
    station : table of stations
    """
    group = station.groupby(["experiment", "section"])
    along = group["x"].transform("max") - group["x"].transform("min")
    across = group["y"].transform("max") - group["y"].transform("min")
    together = (station["section"] != "") & (along <= across)
    return group["x"].transform("median").where(together, station["x"])


def section_place(station: pd.DataFrame, experiment: str, section: str) -> float:
    """The x of a section of one experiment [m]: the median of its stations; NaN without any.

    Parameters
    ----------
    station : table of stations
    """
    own = (station["experiment"] == experiment) & (station["section"] == section)
    return float(station.loc[own, "x"].median())


def read_observations(case: Case) -> Observations:
    """Read every file of measurements that a case names, judge their quality, and average verticals over the depth.

    Returns
    -------
    Observations
        A point or vertical that cannot be trusted stays, with used = False and the reason.

    Raises
    ------
    InputError
        Naming file and row, for what cannot be read, is missing, repeated or no number, and for an unknown kind,
        experiment, section or device.
    """
    sections: dict[Key, Section] = {}
    stations = []
    levels = [one for one in case.observations if one.kind == WATER_LEVEL]
    gauges = station_table(*(_read_stations(case, one, kind_of(WATER_LEVEL)) for one in levels))
    for one in case.observations:
        if one.kind == "adv":
            key = (str(one.experiment), str(one.section))
            if key in sections:
                raise InputError(
                    f"{shown_path(one.file)}: expected section {key[1]} of experiment {key[0]} once, got two "
                    f"observations of it; take one out of the case."
                )
            sections[key] = read_section(case, one, gauges)
            stations += _averaged(sections[key], one)
        elif one.kind in KINDS:
            stations.append(_read_stations(case, one, kind_of(one.kind)))
        else:
            raise InputError(
                f"{shown_path(case.source)}: the observation in {one.file.name} expected a `kind` among adv, "
                f"{', '.join(KINDS)}, got {one.kind!r}: {nearest(one.kind, ['adv', *KINDS])}"
            )
    if (number := sum(map(len, stations))) > MOST_STATIONS:
        raise InputError(
            f"{shown_path(case.source)}: expected at most {MOST_STATIONS:,} stations, got {number:,}: average "
            "those that lie close together, or leave some out."
        )
    table = station_table(*stations)
    # Outside the grid the model has no flow. A discharge has no y of its own.
    inside = table["x"].between(*case.grid.x) & (table["y"].between(*case.grid.y) | ~point_rows(table))
    reason = table["reason"].mask(table["used"] & ~inside, Unused.OUTSIDE)
    table = table.assign(used=table["used"] & inside, reason=reason)
    if case.friction.walls is not None:
        (south, north), half_cell = case.grid.y, NEAR_WALL * case.grid.cell[1]
        beside = np.minimum(table["y"] - south, north - table["y"]) < half_cell
        beside &= velocity_rows(table) & table["used"]
        table = table.assign(used=table["used"] & ~beside, reason=table["reason"].mask(beside, Unused.AT_WALL))
    # Errors of two stations at one place of a section would count as one error.
    twice = table.duplicated(["experiment", "section", "kind", "x", "y"]) & correlated_rows(table)
    if twice.any():
        one = table.loc[twice.idxmax()]
        raise InputError(
            f"{shown_path(case.source)}: `observations` expected each station once, got {kind_of(one['kind']).words} "
            f"at x = {one['x']:g}, y = {one['y']:g} m of section {one['section']!r} of experiment {one['experiment']} "
            "in two files: take one of the two out, or give it a section of its own."
        )
    refuse_unknown_limits(case, table)
    return Observations(
        table=table,
        points=_with_types([section.points for section in sections.values()], POINT_TYPES),
        profiles=_with_types([section.profiles for section in sections.values()], PROFILE_TYPES),
        discharge={key: section.discharge for key, section in sections.items()},
        neighbour_error={key: section.neighbour_error for key, section in sections.items()},
        canopy_height={key: section.canopy_height for key, section in sections.items() if section.canopy_height},
    )


def refuse_unknown_limits(case: Case, table: pd.DataFrame) -> None:
    """Refuse an effect that is limited to what no measurement comes from.

    Parameters
    ----------
    table : table of stations

    Raises
    ------
    InputError
        For a section or device without a station.
    """
    for name, entry in case.effects.items():
        for column, words in (("section", entry.sections), ("device", entry.devices)):
            known = [str(word) for word in table[column].unique() if word]
            for word in words:
                if word not in known:
                    raise InputError(
                        f"{shown_path(case.source)}: `effects.{name}.{column}s` names the {column} `{word}`, of which "
                        f"there are no measurements: {nearest(word, known)}"
                    )


def fitted_curve(profile: "pd.Series[float]") -> ProfileFit | None:
    """u(z) of a vertical, for drawing; its covariance is NaN.

    Parameters
    ----------
    profile : Series
        A row of Observations.profiles.

    Returns
    -------
    ProfileFit or None
        None without a fit.
    """
    if not np.isfinite(profile["top"]):
        return None
    return ProfileFit(profile["within"], profile["slope"], profile["top"], np.full((3, 3), np.nan), profile["scatter"])


def _averaged(section: Section, observation: Observation) -> list[pd.DataFrame]:
    """Stations from the verticals of a section: along by the rule of the case, and across on request.

    standard_error^2 = own^2 + max(s^2 - mean(own^2), 0), own from the points of the vertical, s the `neighbour_error`:
    points cannot show that their vertical stands beside a stem, or 0.1 m off. An error given in the case replaces this.
    Across none if no point of a vertical has v. Errors: InputError without a column v.
    """
    profiles, stated = section.profiles, observation.standard_error
    value, own = average_of(profiles, str(observation.average))
    hidden = np.nan_to_num(section.neighbour_error**2 - (own[profiles["used"]] ** 2).mean())
    error = np.hypot(own, np.sqrt(max(hidden, 0.0))) if stated is None else stated
    along = profiles.assign(kind=STREAMWISE, value=value, standard_error=error)[list(STATION_COLUMNS)]
    if not observation.across:
        return [along]
    if "v" not in section.points:
        raise InputError(
            f"{shown_path(observation.file)}, row 1: expected a column v for `across`, got none; add it, or take "
            "`across` out of the observation."
        )
    averages = across_averages(section.points)
    error = averages["standard_error"] if stated is None else stated
    across = profiles.reset_index(drop=True).assign(kind=TRANSVERSE, value=averages["value"], standard_error=error)
    return [along, across.loc[across["value"].notna() | ~across["used"], list(STATION_COLUMNS)]]


def _read_stations(case: Case, observation: Observation, kind: Kind) -> pd.DataFrame:
    """Stations from a file of x, y, the column of the kind and, if there is one, that of its standard errors.

    A standard error of 0 means unknown. A discharge needs no y: it is drawn in the middle of the grid. `experiment` and
    `section` of the observation choose rows if the file has such a column, and else name all rows; only velocities
    need a section. Places of the map become places of the grid if that follows a centreline.
    """
    path = observation.file
    given = {"experiment": observation.experiment, "section": observation.section}
    if not kind.velocity and observation.section is None:
        given["section"] = ""
    needed = [name for name, text in given.items() if text is None]
    place = ["x", "y"] if kind.at_point else ["x"]
    labels = [name for name in given if name not in needed]
    rows = read_table(path, needed, (*place, kind.column), (kind.error_column, "y"), labels)
    for name, text in given.items():
        if name not in rows:
            rows = rows.assign(**{name: text})
        elif text:
            chosen = rows[rows[name] == text]
            if chosen.empty:
                raise InputError(
                    f"{shown_path(path)}: expected rows with {name} {text!r}, got only "
                    f"{', '.join(rows[name].unique())}; correct `{name}` in the observation."
                )
            rows = chosen
    unknown = ~rows["experiment"].isin(list(case.experiments))
    refuse_rows(path, unknown, "unknown_name", rows["experiment"], known=list(case.experiments))
    refuse_repeated(path, rows, ("experiment", "section", *place))
    unstated = pd.Series(observation.standard_error or 0.0, index=rows.index, name=kind.error_column)
    error = rows.get(kind.error_column, unstated)
    odd = (error != 0.0) & ~error.between(SMALLEST_STATED_ERROR, LARGEST_READING)
    refuse_rows(path, odd, "odd_error", error, least=SMALLEST_STATED_ERROR, most=LARGEST_READING)
    for column in (*place, kind.column):
        far = rows[column].abs() > LARGEST_READING
        refuse_rows(path, far, "out_of_bounds", rows[column], most=LARGEST_READING)
    stations = rows.rename(columns={kind.column: "value"}).assign(
        kind=kind.name,
        x=rows["x"] + observation.offset.x,
        y=rows["y"] + observation.offset.y if "y" in rows else 0.5 * sum(case.grid.y),
        standard_error=error.mask(error == 0.0),
        used=True,
        reason="",
        depth=np.nan,
        device="",
    )[list(STATION_COLUMNS)]
    line = centreline_in(case) if kind.at_point else None
    if line is not None:
        x, y = along_and_across(line, stations["x"].to_numpy(float), stations["y"].to_numpy(float))
        stations = stations.assign(x=x, y=y)
    return stations
