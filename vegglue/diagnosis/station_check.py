"""Checks of the places and values of stations: in the water, in the grid, in which unit.

Each check yields remarks, frozen values whose words stand in `wording/templates/checks.j2` and `measurements.j2`.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.schema import Case
from vegglue.case.zones import corners_of, distance_to_outline
from vegglue.diagnosis.flow_check import dry_outlets, exchanged_components
from vegglue.measurements.kinds import kind_of, velocity_rows
from vegglue.measurements.observations import OUTSIDE, Observations
from vegglue.measurements.plausibility import ImplausibleOutlet, ImplausibleValues, implausible_values

# Nearer to a patch edge than this share of a cell [-], a station is on it.
ON_THE_EDGE = 0.02
# Units that places may be in if metres are expected, and one of each in m; of two that fit the larger.
SMALLER_UNITS = {"ft": 0.3048, "cm": 0.01, "mm": 0.001}
KILOMETRE = 1000.0
# Places over less than this share of the grid may be in km [-]: a thousandth of the grid is what all of it would be.
HUDDLED = 1.0 / 300.0

Place = tuple[float, float]  # x and y [m]


@dataclass(frozen=True)
class StationsOutsideGrid:
    """Places outside the grid, which are not used."""

    experiment: str
    places: int
    first: Place


@dataclass(frozen=True)
class StationsOnLand:
    """Places outside the wet channel, the first so high above the expected water [m]; most: most velocities are."""

    experiment: str
    places: int
    first: Place
    above: float
    most: bool


@dataclass(frozen=True)
class SharedPlaces:
    """Stations in use at the place of another of their quantity and experiment; sections of the first place."""

    quantity: str
    experiment: str
    stations: int
    first: Place
    sections: tuple[str, ...]


@dataclass(frozen=True)
class AxesExchanged:
    """Velocities outside the grid that would all lie inside with x and y exchanged."""

    stations: int
    first: Place


@dataclass(frozen=True)
class StationsOnMap:
    """Velocities all farther from the grid than its length, in a case without a frame."""

    first: Place


@dataclass(frozen=True)
class PlacesInOtherUnit:
    """Velocities outside the grid, of all, which would lie inside in a unit."""

    outside: int
    stations: int
    first: Place
    unit: str


@dataclass(frozen=True)
class PlacesInKilometres:
    """Velocities within a short piece [m] of a grid of a length [m]."""

    spread: float
    length: float
    first: Place


@dataclass(frozen=True)
class StationsOnPatchEdge:
    """Velocities of a section on the edge of a patch, between plants and open water; y [m]."""

    section: str
    patch: str
    y: tuple[float, ...]


@dataclass(frozen=True)
class StationsNearWall:
    """Velocities of a section within a cell of a side wall, in its boundary layer; y and width of a cell [m]."""

    section: str
    y: tuple[float, ...]
    cell: float


def remarks_on_stations(case: Case, site: Site, observations: Observations) -> Iterator[object]:
    """Stations outside the grid or above the expected water; one remark of each experiment."""
    table = observations.table
    for experiment, rows in table[table["reason"] == OUTSIDE].groupby("experiment", sort=False):
        places = rows.drop_duplicates(["x", "y"])
        yield StationsOutsideGrid(str(experiment), len(places), _first(places))
    yield from remarks_on_land(case, site, observations)


def remarks_on_land(case: Case, site: Site, observations: Observations) -> Iterator[StationsOnLand]:
    """Of each experiment the stations above the expected water; none if its outlet is dry, a remark of its own."""
    table, dry_ones = observations.table, dry_outlets(case, site)
    inside = table[(table["reason"] != OUTSIDE) & _at_point(table) & ~table["experiment"].isin(list(dry_ones))]
    for experiment, rows in inside.groupby("experiment", sort=False):
        depth = expected_depth(case, in_experiment(site, str(experiment)), case.experiments[str(experiment)])
        i, j = (np.abs(np.subtract.outer(rows[name].to_numpy(), at)).argmin(axis=1)
                for name, at in (("x", site.grid.x), ("y", site.grid.y)))  # fmt: skip
        dry = rows.assign(above=-depth[i, j])[(depth[i, j] <= 0) & ~(rows["depth"].to_numpy() > 0)]
        if len(dry):
            most = 2 * int(velocity_rows(dry).sum()) > int(velocity_rows(rows).sum())
            places = dry.drop_duplicates(["x", "y"])
            yield StationsOnLand(str(experiment), len(places), _first(places), float(dry["above"].iloc[0]), most)


def remarks_on_shared_places(observations: Observations) -> Iterator[SharedPlaces]:
    """Stations in use where another of their kind and experiment stands: a file may be a copy, or a place wrong."""
    table = observations.table[observations.table["used"] & _at_point(observations.table)]
    shared = table[table.duplicated(["experiment", "kind", "x", "y"], keep=False)]
    for (experiment, kind), rows in shared.groupby(["experiment", "kind"], sort=False):
        x, y = _first(rows)
        sections = rows.loc[(rows["x"] == x) & (rows["y"] == y), "section"].unique()
        yield SharedPlaces(kind_of(str(kind)).words, str(experiment), len(rows), (x, y), tuple(map(str, sections)))


def remarks_on_frames(case: Case, observations: Observations) -> Iterator[object]:
    """Velocities of which most are outside the grid, and would all lie inside with x and y exchanged or in a smaller
    unit; all outside by more than its length, as if on a map; all within a short piece of it, as if in km. Places on a
    map are in its own unit.
    """
    table = observations.table[velocity_rows(observations.table)]
    if table.empty:
        return
    lost = table[table["reason"] == OUTSIDE]
    (west, east), (south, north) = case.grid.x, case.grid.y

    def all_inside(x_size: float, y_size: float) -> bool:
        x, y = x_size * table["x"], y_size * table["y"]
        return bool(x.between(west, east).all() and y.between(south, north).all())

    unit = next((name for name, size in SMALLER_UNITS.items() if all_inside(size, size)), None)
    most = 2 * len(lost) > len(table)
    if most and (lost["y"].between(west, east) & lost["x"].between(south, north)).all():
        yield AxesExchanged(len(lost), _first(lost))
    beyond = np.maximum(west - table["x"], table["x"] - east) > east - west
    if case.frame is None and unit is None and len(lost) == len(table) and beyond.all():
        yield StationsOnMap(_first(table))
    if case.frame is not None or case.grid.centreline is not None:
        return
    if most and unit is not None:
        yield PlacesInOtherUnit(len(lost), len(table), _first(lost), unit)
    spread = float(table["x"].max() - table["x"].min())
    if 0.0 < spread < HUDDLED * (east - west) and all_inside(KILOMETRE, 1.0):
        yield PlacesInKilometres(spread, east - west, _first(table))


def remarks_on_patch_edges(case: Case, observations: Observations) -> Iterator[StationsOnPatchEdge]:
    """Stations of velocity so near to the edge of a patch that the model interpolates across it."""
    table = observations.table[velocity_rows(observations.table)]
    limit = ON_THE_EDGE * min(case.grid.cell)
    for patch in case.plants.patches:
        outline = corners_of(case, patch)
        near = [distance_to_outline(outline, x, y) < limit for x, y in zip(table["x"], table["y"], strict=True)]
        for section, rows in table[np.array(near, dtype=bool)].groupby("section"):
            yield StationsOnPatchEdge(str(section), patch.name, tuple(sorted({float(y) for y in rows["y"]})))


def remarks_on_walls(case: Case, observations: Observations) -> Iterator[StationsNearWall]:
    """Stations of velocity within a cell of a side wall, of whose boundary layer the model has the mean alone."""
    table = observations.table[velocity_rows(observations.table) & observations.table["used"]]
    if case.friction.walls is None:
        return
    (south, north), cell = case.grid.y, case.grid.cell[1]
    for section, rows in table[np.minimum(table["y"] - south, north - table["y"]) < cell].groupby("section"):
        yield StationsNearWall(str(section), tuple(sorted({float(y) for y in rows["y"]})), cell)


def remarks_on_implausible_values(
    case: Case, site: Site, observations: Observations
) -> list[ImplausibleOutlet | ImplausibleValues]:
    """Marks of missing values, wrong units, another datum, and standard errors without sense; of no velocities whose
    components are exchanged, as those along are too slow for that reason.
    """
    table, exchanged = observations.table, exchanged_components(case, observations)
    excused = velocity_rows(table) & table["experiment"].isin(exchanged)
    return implausible_values(case, site, table.assign(used=table["used"] & ~excused))


def _at_point(table: pd.DataFrame) -> np.ndarray:
    return np.array([kind_of(str(kind)).at_point for kind in table["kind"]], dtype=bool)


def _first(table: pd.DataFrame) -> Place:
    return float(table["x"].iloc[0]), float(table["y"].iloc[0])
