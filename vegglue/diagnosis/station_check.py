"""Checks of stations and of ADV verticals: in the water, in the grid, in which unit; heights, columns, and the standard
errors that neighbours give.

Each check yields remarks, frozen values whose words stand in `wording/templates/checks.j2` and `measurements.j2`.
Lengths in m.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import Bounds
from vegglue.case.schema import Case
from vegglue.case.zones import corners_of, distance_to_outline
from vegglue.diagnosis.flow_check import dry_outlets, exchanged_components
from vegglue.measurements.adv_section import average_of, upward_column
from vegglue.measurements.kinds import Unused, kind_of, point_rows, velocity_rows
from vegglue.measurements.observations import Observations
from vegglue.measurements.plausibility import ImplausibleOutlet, ImplausibleValues, implausible_values
from vegglue.measurements.section_discharge import neighbour_error

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
    """Places outside the wet channel.

    Attributes
    ----------
    places : int
        How many.
    first : (float, float)
        x, y of the first [m].
    above : float
        By how much that lies above the expected water [m].
    most : bool
        Whether most velocities do.
    """

    experiment: str
    places: int
    first: Place
    above: float
    most: bool


@dataclass(frozen=True)
class SharedPlaces:
    """Stations in use at the place of another of their quantity and experiment.

    Attributes
    ----------
    stations : int
        How many.
    first : (float, float)
        x, y of the first [m].
    sections : tuple of str
        At the first place.
    """

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
    """Velocities outside the grid which would lie inside in another unit.

    Attributes
    ----------
    outside, stations : int
        How many, of all.
    first : (float, float)
        x, y of the first, as stated.
    """

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
    for experiment, rows in table[table["reason"] == Unused.OUTSIDE].groupby("experiment", sort=False):
        places = rows.drop_duplicates(["x", "y"])
        yield StationsOutsideGrid(str(experiment), len(places), _first(places))
    yield from remarks_on_land(case, site, observations)


def remarks_on_land(case: Case, site: Site, observations: Observations) -> Iterator[StationsOnLand]:
    """Of each experiment the stations above the expected water; none if its outlet is dry, a remark of its own."""
    table, dry_ones = observations.table, dry_outlets(case, site)
    inside = table[(table["reason"] != Unused.OUTSIDE) & point_rows(table) & ~table["experiment"].isin(list(dry_ones))]
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
    table = observations.table[observations.table["used"] & point_rows(observations.table)]
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
    lost = table[table["reason"] == Unused.OUTSIDE]
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
    excused = velocity_rows(table) & table["experiment"].isin(list(exchanged))
    return implausible_values(case, site, table.assign(used=table["used"] & ~excused))


def _first(table: pd.DataFrame) -> Place:
    return float(table["x"].iloc[0]), float(table["y"].iloc[0])


# Verticals that make a rule, and the share of them that run the other way round [-]. A single one may lie in a wake.
FEWEST, MOST_OF_ALL = 3, 0.8
# Fall of the bed [m], and over the scatter of the lowest points [-], from which it is seen whether these follow the
# bed. A probe is set to a height to 1 or 2 mm; points that do follow scatter by 0.3 to 0.4 of the fall itself.
LEAST_FALL, OVER_THE_SCATTER = 0.003, 4.0
# Share of the change of the bed by which lowest points move with it [-]: 1 for levels, 0 for heights above the bed.
HALFWAY = 0.5
# A normal standard deviation over the median deviation [-].
OF_A_NORMAL = 1.4826
# How many times the error that points state [-], and that of neighbours on the same side of the plants, the one of all
# neighbours must be for a remark. Chosen: three times the error is a ninth of the weight; on 20 verticals of a brook
# neighbours give as much on either side as across, and a jump at plants is not why.
OVER_POINTS, OVER_ONE_SIDE = 3.0, 2.0


@dataclass(frozen=True)
class HeightsFromSurface:
    """Verticals outside plants whose velocities fall towards the surface, of all; x, y of the first."""

    falling: int
    verticals: int
    first: tuple[float, float]


@dataclass(frozen=True)
class HeightsExchanged:
    """A file whose heights and velocities look exchanged in some of its verticals.

    Attributes
    ----------
    upward : str
        Column of the heights.
    exchanged, verticals : int
        How many, of all.
    first : (float, float)
        x, y of the first [m].
    """

    file: Path
    upward: str
    exchanged: int
    verticals: int
    first: tuple[float, float]


@dataclass(frozen=True)
class PointsOutsideWater:
    """Points excluded below the bed or above the surface in verticals that others keep in use.

    Attributes
    ----------
    first : (float, float)
        x, y of the first [m].
    height, depth : float
        Of the first above the bed, and of the water there [m].
    levels_doubted : bool
        Whether another remark questions the levels of their experiments.
    """

    points: int
    sections: tuple[str, ...]
    experiments: tuple[str, ...]
    reason: Unused
    first: tuple[float, float]
    height: float
    depth: float
    levels_doubted: bool


@dataclass(frozen=True)
class HeightsTakenForLevels:
    """Verticals of a file that begin at one z while the bed falls.

    Attributes
    ----------
    z : tuple of float
        Middle of the lowest points in each [m].
    first, last : float
        x between which the bed falls in the first experiment [m].
    fall : float
        By how much it does [m].
    heading : str
        Of the column z where it was imported, '' if unknown.
    """

    file: str
    experiments: tuple[str, ...]
    z: tuple[float, ...]
    first: float
    last: float
    fall: float
    heading: str


@dataclass(frozen=True)
class ErrorsAcrossPlants:
    """Sections across the side of a patch whose verticals get errors from the jump of velocities there.

    Attributes
    ----------
    sections : tuple of (str, str)
        Experiment and section.
    neighbours, points, one_side : (float, float)
        Ranges over them of the errors from all neighbours, from the points, and from neighbours on the same side of the
        plants [m/s].
    """

    sections: tuple[tuple[str, str], ...]
    neighbours: Bounds
    points: Bounds
    one_side: Bounds


def remarks_on_heights(observations: Observations) -> Iterator[HeightsFromSurface]:
    """Verticals outside plants whose velocities fall towards the surface, nearly all: heights may count downward."""
    falling = [
        (x, y, float(np.polyfit(some["height"], some["u"], 1)[0]) < 0.0)
        for x, y, some in _open_verticals(observations.points)
    ]
    down = [(x, y) for x, y, falls in falling if falls]
    if len(falling) >= FEWEST and len(down) >= MOST_OF_ALL * len(falling):
        yield HeightsFromSurface(len(down), len(falling), down[0])


def remarks_on_exchanged_heights(case: Case, observations: Observations) -> Iterator[HeightsExchanged]:
    """Tables whose velocities grow from the bed as heights do, and heights as velocities, in nearly all verticals
    outside plants: near the bed water has more of its speed than of its height, u/u_top > z/z_top.
    """
    points = observations.points
    of_file: dict[Path, list[tuple[float, float, bool]]] = {}
    for one in [one for one in case.observations if one.kind == "adv"]:
        for x, y, some in _open_verticals(
            points[(points["experiment"] == one.experiment) & (points["section"] == one.section)]
        ):
            upward = some.sort_values("height")[["height", "u"]].to_numpy(float)
            share = upward[:-1] / upward[-1]
            odd = bool(upward[-1, 1] > 0.0 and (share[:, 1] < share[:, 0]).all())
            of_file.setdefault(one.file, []).append((x, y, odd))
    for file, verticals in of_file.items():
        exchanged = [(x, y) for x, y, odd in verticals if odd]
        if len(verticals) >= FEWEST and len(exchanged) >= MOST_OF_ALL * len(verticals):
            yield HeightsExchanged(file, upward_column(file), len(exchanged), len(verticals), exchanged[0])


def _open_verticals(points: pd.DataFrame) -> Iterator[tuple[float, float, pd.DataFrame]]:
    """x, y and used points of each vertical outside plants with points at two heights or more."""
    open_ones = points[points["used"] & ~points["plants"]]
    for (_, _, x, y), some in open_ones.groupby(["experiment", "section", "x", "y"], sort=False):
        if some["height"].nunique() > 1:
            yield float(x), float(y), some


def remarks_on_lost_points(observations: Observations, doubted: Collection[str] = ()) -> Iterator[PointsOutsideWater]:
    """Points outside the water in verticals that others keep in use, which would be lost unnoticed: those above the
    surface, and those below the bed.

    doubted: experiments whose levels have a remark already.
    """
    points = observations.points
    if points.empty:
        return
    kept = points.groupby(["experiment", "section", "x", "y"])["used"].transform("any")
    lost = points[kept & points["reason"].isin((Unused.BELOW_BED, Unused.ABOVE_SURFACE))]
    for reason, some in lost.groupby("reason", sort=False):
        first, experiments = some.iloc[0], tuple(map(str, some["experiment"].unique()))
        yield PointsOutsideWater(
            points=len(some),
            sections=tuple(map(str, some["section"].unique())),
            experiments=experiments,
            reason=Unused(reason),
            first=(float(first["x"]), float(first["y"])),
            height=float(first["height"]),
            depth=float(first["depth"]),
            levels_doubted=any(name in doubted for name in experiments),
        )


def remarks_on_unmoved_heights(case: Case, observations: Observations) -> Iterator[HeightsTakenForLevels]:
    """Files whose verticals begin at one z while the bed falls: they may count from the bed below each. Sections with a
    `floor` of their own count from there, and are left out.
    """
    points = observations.points
    sections: dict[tuple[Path, str], list[str]] = {}
    for one in case.observations:
        if one.kind == "adv" and one.floor is None and upward_column(one.file) == "z":
            sections.setdefault((one.file, str(one.experiment)), []).append(str(one.section))
    found: dict[Path, list[tuple[str, float, float, float, float]]] = {}
    for (file, experiment), names in sections.items():
        own = points[(points["experiment"] == experiment) & points["section"].isin(names)]
        lowest = own.sort_values("z").groupby(["section", "x", "y"], as_index=False).first()
        middle = lowest.groupby("x")[["z", "bed"]].median()
        if len(lowest) < FEWEST:
            continue
        z, fall = lowest["z"].to_numpy(), float(middle["bed"].iloc[0] - middle["bed"].iloc[-1])
        scatter = OF_A_NORMAL * float(np.median(np.abs(z - np.median(z))))
        if fall < max(LEAST_FALL, OVER_THE_SCATTER * scatter):
            continue
        # The median of dz / dbed between any two sections shows whether z stays or falls with the bed.
        pair = np.array(np.triu_indices(len(middle), 1))
        level, bed = (np.diff(middle[name].to_numpy(float)[pair], axis=0)[0] for name in ("z", "bed"))
        far = np.abs(bed) > HALFWAY * fall
        if float(np.median(level[far] / bed[far])) < HALFWAY:
            first, last = float(middle.index[0]), float(middle.index[-1])
            found.setdefault(file, []).append((experiment, float(lowest["z"].median()), first, last, fall))
    for file, ones in found.items():
        _, _, first, last, fall = ones[0]
        known = [one.columns["z"] for one in case.imported or () if one.name == file.name and "z" in one.columns]
        heading = known[0] if known else ""
        experiments, middles = tuple(one[0] for one in ones), tuple(one[1] for one in ones)
        yield HeightsTakenForLevels(file.name, experiments, middles, first, last, fall, heading)


def remarks_on_errors_across_plants(case: Case, observations: Observations) -> Iterator[ErrorsAcrossPlants]:
    """Sections across the side of a patch whose errors come from the jump of velocities there; in one remark."""
    found: list[tuple[tuple[str, str], float, float, float]] = []
    for one in [one for one in case.observations if one.kind == "adv" and one.standard_error is None]:
        key, profiles = (str(one.experiment), str(one.section)), observations.profiles
        own = profiles[(profiles["experiment"] == key[0]) & (profiles["section"] == key[1])]
        own = own[own["used"]].sort_values("y")
        if own["plants"].nunique() < 2:
            continue
        error, points = observations.neighbour_error[key], float(average_of(own, str(one.average))[1].median())
        changes = own["plants"].ne(own["plants"].shift()).cumsum()
        sides = [neighbour_error(part["y"].to_numpy(), part["fitted"].to_numpy()) for _, part in own.groupby(changes)]
        known = [side for side in sides if np.isfinite(side)]
        if known and error > max(OVER_POINTS * points, OVER_ONE_SIDE * max(known)):
            found.append((key, error, points, max(known)))
    if found:
        keys, *errors = zip(*found, strict=True)
        yield ErrorsAcrossPlants(keys, *((min(one), max(one)) for one in errors))
