"""What planned measurements would show, as `vegglue plan` reports and stores it, and the files to take along into the
field: stations in map coordinates as CSV and for a GPS (GPX), and an empty sheet that `vegglue import` reads back.

The words stand in wording/templates/plan.j2.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from vegglue.case.grid import centreline_in, on_map
from vegglue.case.resolved_config import refuse_not_made, write_made
from vegglue.case.safe_yaml import yaml_of
from vegglue.case.schema import Case, Planned
from vegglue.case.text_files import write_text
from vegglue.errors import InputError, path_from
from vegglue.measurements.kinds import KINDS, STREAMWISE, WATER_LEVEL
from vegglue.results.calibration_files import csv_text
from vegglue.wording.numbers import shown_path
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.wording.sentences import lines_of, phrase, tagged


class Work(Enum):
    """Kinds of field work."""

    TRANSECT = "transect"
    POINT = "point"
    GAUGE = "gauge"
    DISCHARGE = "discharge"
    SURVEY_LINE = "survey line"


@dataclass(frozen=True)
class PlannedPiece:
    """A piece of field work.

    Verticals of a transect, a vertical, a gauge or a gauging in one experiment, or a line of bed levels, which is of
    all.

    Attributes
    ----------
    experiment : str
        The flow it is done in, '' for all.
    x : float
        [m]
    y : tuple of float
        Of its stations [m], empty for a gauging.
    hours : float
        Without those of another flow [h].
    new, again : bool
        Whether the experiment is a flow that the case does not have, and whether the same is measured before.
    """

    work: Work
    experiment: str
    x: float
    y: tuple[float, ...]
    hours: float
    new: bool = False
    again: bool = False

    @property
    def place(self) -> tuple[Work, str, float, tuple[float, ...]]:
        """What is planned once only: of transects at one x, however dense their verticals are, one."""
        return self.work, self.experiment, self.x, () if self.work is Work.TRANSECT else self.y[:1]


@dataclass(frozen=True)
class Confusion:
    """Another explanation that leaves a similar trace, and the cosine between both after calibration [-]."""

    name: str
    cosine: float


@dataclass(frozen=True)
class PlannedEffect:
    """An effect as the planned measurements would show it.

    Named means that the first step of a diagnosis has it, alone or as one of a few.

    Attributes
    ----------
    unit : str
        Of its amplitude.
    smallest, best, worst : float
        Distance of the amplitude from off that is named with 90 % [unit], infinite if no size is: averaged over all
        draws of the priors, and in those where it is least and largest.
    plausible, furthest : float
        A plausible distance, and the largest possible one [unit].
    chance_plausible, chance : float
        That the plausible size is named, and one drawn from the prior of the amplitude [-].
    visibility : float
        Share of the trace that calibration cannot mimic [-].
    confused : tuple of Confusion
        Other effects with a similar trace, the most similar first.
    place : Confusion or None
        The term at a place that has one.
    parameter : str
        Whose change is most like it.
    cosine : float
        Between both [-].
    """

    name: str
    title: str
    unit: str
    smallest: float
    best: float
    worst: float
    plausible: float
    furthest: float
    chance_plausible: float
    chance: float
    visibility: float
    confused: tuple[Confusion, ...]
    place: Confusion | None
    parameter: str
    cosine: float

    @property
    def testable(self) -> bool:
        """Whether twice a plausible size is possible and is named with 90 %; a diagnosis requires an alarm in 95 %."""
        return self.smallest < min(2.0 * self.plausible, self.furthest)

    @property
    def seen(self) -> bool:
        """Whether a plausible size is named with 90 %."""
        return self.smallest <= min(self.plausible, self.furthest)

    @property
    def hidden(self) -> bool:
        """Whether a plausible size is named with 10 % at most."""
        return self.chance_plausible <= 0.1


@dataclass(frozen=True)
class PlannedPlaces:
    """Something unlisted at a place that changes a term.

    Attributes
    ----------
    term, unit : str
        The term, and the unit of its sizes.
    plausible : float
        A plausible size [unit].
    places : int
        How many are under water.
    share : float
        Of these, where the plausible size is detected with 90 % [-].
    smallest : float
        Size that is detected with 90 % at half of them [unit].
    """

    term: str
    unit: str
    plausible: float
    places: int
    share: float
    smallest: float


@dataclass(frozen=True)
class PlaceChances:
    """Chance that drag of a plausible size is detected at each place.

    Attributes
    ----------
    x, y : tuple of float
        Places [m].
    chance : tuple of float
        At each [-].
    length, width : float
        Half length and half width of one spot [m].
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    chance: tuple[float, ...]
    length: float
    width: float


@dataclass(frozen=True)
class PlannedInstruments:
    """Instruments of one kind.

    Attributes
    ----------
    instrument : str
        The kind.
    count : int
        How many there are.
    smallest : float
        Offset that is detected with 90 % in half of them, over the standard error of a reading [-].
    plausible : float
        A plausible offset over that error [-].
    """

    instrument: str
    count: int
    smallest: float
    plausible: float


@dataclass(frozen=True)
class PlannedParameter:
    """How well a parameter would be known.

    Attributes
    ----------
    name, unit, meaning : str
        Of the parameter.
    share : float
        Standard error over that of its prior [-].
    before, after : (float, float)
        95 % intervals around the middle of the prior [unit].
    """

    name: str
    unit: str
    meaning: str
    share: float
    before: tuple[float, float]
    after: tuple[float, float]


@dataclass(frozen=True)
class EffectsInGeneral:
    """The question of all effects: how many are expected to be named, of sizes drawn from their priors."""

    count: int


@dataclass(frozen=True)
class OneEffect:
    """The question of one effect of a size [unit of its amplitude]: the chance that it is named."""

    name: str
    size: float
    unit: str


@dataclass(frozen=True)
class TwoEffects:
    """The question which of two effects of plausible size it is: the chance that the true one is likelier."""

    first: str
    second: str


PlanQuestion = EffectsInGeneral | OneEffect | TwoEffects


@dataclass(frozen=True)
class ProposedPieces:
    """Pieces that could be added together, as one more discharge takes more than one.

    Attributes
    ----------
    hours : float
        Field work, with that of another flow [h].
    before, after, least : float
        The answer to the question before and after, the mean over all draws, and the least of them after [-].
    """

    pieces: tuple[PlannedPiece, ...]
    hours: float
    before: float
    after: float
    least: float

    @property
    def per_hour(self) -> float:
        """What it adds in an hour [1/h]."""
        return (self.after - self.before) / self.hours


@dataclass(frozen=True, repr=False)
class FieldPlan:
    """What planned measurements would show, and which ones to add.

    Attributes
    ----------
    case, at_hand
        Name of the case, and stations that are measured.
    pieces, proposed
        Pieces of field work, and whether they are proposed for the budget, as none were planned.
    hours, budget
        Of field work [h].
    draws
        Places of the prior at which all is computed.
    effects, places, instruments, parameters
        PlannedEffect, PlannedPlaces, PlannedInstruments and PlannedParameter of each.
    question, answer
        What is asked, and the answer to it now [-].
    further : tuple of ProposedPieces
        The best single additions, the largest gain per hour first.
    extended : ProposedPieces or None
        The best set for the hours that are left.
    chances_of_places : PlaceChances or None
        Of drag, to be drawn.
    """

    case: str
    pieces: tuple[PlannedPiece, ...]
    at_hand: int
    proposed: bool
    hours: float
    budget: float
    draws: int
    effects: tuple[PlannedEffect, ...]
    places: tuple[PlannedPlaces, ...]
    instruments: tuple[PlannedInstruments, ...]
    parameters: tuple[PlannedParameter, ...]
    question: PlanQuestion
    answer: float
    further: tuple[ProposedPieces, ...]
    extended: ProposedPieces | None
    chances_of_places: PlaceChances | None = None

    def __repr__(self) -> str:
        return "\n".join(lines_of(self))

    @property
    def testable(self) -> tuple[PlannedEffect, ...]:
        """Effects that are named at twice a plausible size."""
        return tuple(one for one in self.effects if one.testable)


def hours_of(pieces: Sequence[PlannedPiece], another_flow: float, present: frozenset[str] = frozenset()) -> float:
    """Hours of some pieces of field work together, with those of each flow beside the first.

    Parameters
    ----------
    another_flow : float
        [h]
    present : frozenset of str
        Flows that are measured in anyhow.

    Returns
    -------
    float
        [h]
    """
    flows = {one.experiment for one in pieces if one.experiment} - present
    free = 0 if present else 1
    return math.fsum(one.hours for one in pieces) + another_flow * max(len(flows) - free, 0)


def plan_json(plan: FieldPlan) -> dict[str, Any]:
    """A plan as the object that `vegglue plan --json` prints and plan.json keeps: docs/plan.md lists its keys.

    Returns
    -------
    dict
        A size that is never named is null.
    """

    def piece(one: PlannedPiece) -> dict[str, Any]:
        return {
            "work": one.work.value, "experiment": one.experiment or None, "x": one.x, "y": list(one.y),
            "hours": one.hours, "new_flow": one.new, "again": one.again,
        }  # fmt: skip

    def proposed(one: ProposedPieces) -> dict[str, Any]:
        return {
            "pieces": list(map(piece, one.pieces)), "hours": one.hours, "before": one.before, "after": one.after,
            "least": one.least, "gain_per_hour": one.per_hour,
        }  # fmt: skip

    def effect(one: PlannedEffect) -> dict[str, Any]:
        return {
            "name": one.name, "unit": one.unit, "smallest": one.smallest, "best": one.best, "worst": one.worst,
            "plausible": one.plausible, "furthest": one.furthest, "chance_plausible": one.chance_plausible,
            "chance": one.chance, "testable": one.testable, "seen": one.seen, "hidden": one.hidden,
            "visibility": one.visibility, "confused": {other.name: other.cosine for other in one.confused},
            "place": None if one.place is None else {one.place.name: one.place.cosine},
            "parameter": one.parameter, "cosine": one.cosine,
        }  # fmt: skip

    return {
        "case": plan.case, "hours": plan.hours, "budget": plan.budget, "proposed": plan.proposed,
        "at_hand": plan.at_hand, "draws": plan.draws, "pieces": list(map(piece, plan.pieces)),
        "effects": list(map(effect, plan.effects)), "places": [vars(one) for one in plan.places],
        "instruments": [vars(one) for one in plan.instruments],
        "parameters": {one.name: {key: value for key, value in vars(one).items() if key != "name"}
                       for one in plan.parameters},
        "question": tagged(plan.question), "answer": plan.answer, "further": list(map(proposed, plan.further)),
        "extended": None if plan.extended is None else proposed(plan.extended),
    }  # fmt: skip


# Letters before the numbers of places, by their work.
LETTERS = {Work.TRANSECT: "T", Work.POINT: "V", Work.GAUGE: "G", Work.DISCHARGE: "Q", Work.SURVEY_LINE: "L"}
KIND_OF_WORK = {Work.TRANSECT: STREAMWISE, Work.POINT: STREAMWISE, Work.GAUGE: WATER_LEVEL, Work.DISCHARGE: "discharge"}
# Folder of the sheet in that of the plan, and key of its site file that names the case.
SHEET, OF_CASE = "sheet", "case"
WGS84 = "EPSG:4326"


@dataclass(frozen=True)
class FieldPlace:
    """A place where work is done, in one flow or in several.

    Attributes
    ----------
    x : float
        [m]
    y : tuple of float
        Of its stations [m], the lowest first.
    """

    name: str
    work: Work
    x: float
    y: tuple[float, ...]
    experiments: tuple[str, ...]


@dataclass(frozen=True)
class FieldStation:
    """A station of field work.

    Attributes
    ----------
    x, y : float
        In the case [m].
    east, north : float
        On the map [m], NaN without a frame or centreline.
    longitude, latitude : float
        [degrees], NaN if unknown.
    experiments : tuple of str
        In which something is measured there.
    """

    name: str
    work: Work
    x: float
    y: float
    east: float
    north: float
    longitude: float
    latitude: float
    experiments: tuple[str, ...]


@dataclass(frozen=True)
class FieldFiles:
    """The files of field work that were written.

    Attributes
    ----------
    without_gpx : {"", "frame", "crs", "pyproj", "system"}
        Why there is no GPX, '' if there is one: `frame` or `crs` of the case is missing, pyproj is not installed, or
        the system is unknown to it.
    """

    folder: Path
    stations: tuple[FieldStation, ...]
    without_gpx: str


def field_places(plan: FieldPlan) -> tuple[FieldPlace, ...]:
    """Places of a plan by kind of work, each kind from downstream, in which order it is best waded."""
    found = []
    for work, letter in LETTERS.items():
        of_work = [one for one in plan.pieces if one.work is work]

        def at(one: PlannedPiece) -> tuple[float, ...]:
            return (one.x, *one.y) if one.work in (Work.POINT, Work.GAUGE) else (one.x,)

        for number, key in enumerate(sorted({at(one) for one in of_work}, key=lambda place: (-place[0], place)), 1):
            here = [one for one in of_work if at(one) == key]
            across = tuple(sorted({y for one in here for y in one.y}))
            flows = tuple(dict.fromkeys(one.experiment for one in here if one.experiment))
            found.append(FieldPlace(f"{letter}{number}", work, key[0], across, flows))
    return tuple(found)


def field_stations(case: Case, plan: FieldPlan) -> tuple[tuple[FieldStation, ...], str]:
    """Stations of all places of a plan with their map coordinates.

    Returns
    -------
    tuple of FieldStation
    str
        Why they have no longitude and latitude, '' if they do; see `FieldFiles`.
    """

    def measured_in(place: FieldPlace, y: float) -> tuple[str, ...]:
        """The flows in which a station is measured: a bank may be dry in another one."""
        here = [one for one in plan.pieces if one.work is place.work and one.x == place.x and (not one.y or y in one.y)]
        return tuple(flow for flow in place.experiments if flow in {one.experiment for one in here})

    places = field_places(plan)
    middle = 0.5 * (case.grid.y[0] + case.grid.y[1])
    rows = [
        (f"{one.name}-{number}" if len(one.y) > 1 else one.name, one, y)
        for one in places
        for number, y in enumerate(one.y or (middle,), 1)
    ]
    x, y = np.array([one.x for _, one, _ in rows]), np.array([y for *_, y in rows])
    line = centreline_in(case)
    east, north = (np.full(x.size, np.nan) for _ in range(2))
    if rows and (line is not None or case.frame is not None):
        east, north = (x, y) if line is None else on_map(line, x, y)
        if case.frame is not None:
            east, north = case.frame.to_map(east, north)
    longitude, latitude, without = np.full(x.size, np.nan), np.full(x.size, np.nan), ""
    if case.frame is None:
        without = "frame"
    elif case.frame.crs is None:
        without = "crs"
    else:
        try:
            import pyproj  # of the extra `field`: late, as it is not always there

            way = pyproj.Transformer.from_crs(case.frame.crs, WGS84, always_xy=True)
            longitude, latitude = way.transform(east, north)
        except ImportError:
            without = "pyproj"
        except pyproj.exceptions.CRSError:
            without = "system"
    stations = [
        FieldStation(name, one.work, one.x, float(y[k]), float(east[k]), float(north[k]), float(longitude[k]),
                     float(latitude[k]), measured_in(one, y[k]))
        for k, (name, one, _) in enumerate(rows)
    ]  # fmt: skip
    return tuple(stations), without


def write_field_files(folder: Path, case: Case, plan: FieldPlan) -> FieldFiles:
    """Write stations.csv, stations.gpx and sheet/ into the folder of a plan.

    Raises
    ------
    InputError
        If `frame` of the case places stations outside its `crs`, or the sheet was filled in.
    StorageError
        If a file cannot be written.
    """
    stations, without = field_stations(case, plan)
    heading = ["station", "work", "x", "y", "east", "north", "longitude", "latitude", "flows"]
    rows = [
        [one.name, one.work.value, f"{one.x:g}", f"{one.y:g}", _digits(one.east, 2), _digits(one.north, 2),
         _digits(one.longitude, 7), _digits(one.latitude, 7), "; ".join(one.experiments)]
        for one in stations
    ]  # fmt: skip
    write_text(folder / "stations.csv", csv_text(heading, rows), MAKE_ROOM)
    gpx = folder / "stations.gpx"
    if not without:  # waypoints after GPX 1.1 (https://www.topografix.com/GPX/1/1/)
        if not all(np.isfinite([one.longitude, one.latitude]).all() for one in stations):
            raise InputError(f"{case.name}: `frame` places stations outside its `crs`; correct one of both.")
        points = [
            f'  <wpt lat="{one.latitude:.7f}" lon="{one.longitude:.7f}"><name>{escape(one.name)}</name>'
            f"<desc>{escape(f'{one.work.value}, x {one.x:g} m, y {one.y:g} m')}</desc></wpt>"
            for one in stations
        ]
        head = '<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="vegglue" xmlns="http://www.topografix.com/GPX/1/1">'
        name = f"  <metadata><name>{escape(case.title or case.name)}</name></metadata>"
        write_text(gpx, "\n".join([head, name, *points, "</gpx>", ""]), MAKE_ROOM)
    elif gpx.exists():
        gpx.unlink()
    write_made({folder / SHEET / name: text for name, text in sheets(folder / SHEET, case, plan).items()}, MAKE_ROOM)
    surveyed = [one for one in stations if one.work is Work.SURVEY_LINE]
    if surveyed:
        levels = [[f"{one.x:g}", f"{one.y:g}", ""] for one in surveyed]
        write_text(folder / "bed_levels.csv", csv_text(["x", "y", "z"], levels), MAKE_ROOM)
    return FieldFiles(folder, stations, without)


def refuse_filled_in(folder: Path) -> None:
    """Errors: InputError if the sheet in the folder of a plan was filled in since it was written."""
    tables = sorted((folder / SHEET).glob("*.csv"))
    try:
        refuse_not_made({**dict.fromkeys(tables, ""), folder / SHEET / "site.yaml": ""}, MAKE_ROOM)
    except InputError:
        raise InputError(
            f"{shown_path(folder / SHEET)}: was filled in since, or another version wrote it; move this folder "
            "to another place, then plan again."
        ) from None


def sheets(folder: Path, case: Case, plan: FieldPlan) -> dict[str, str]:
    """The tables of a plan to fill in, flow by flow from downstream as the work goes.

    Parameters
    ----------
    folder : Path
        Where they will be.

    Returns
    -------
    dict of str
        Texts by the name of the file, last the site file that names the case they are of.
    """
    planned, found = case.planned or Planned(), {}
    names = {(one.work, one.x, one.y): one.name for one in field_stations(case, plan)[0]}
    flows = list(dict.fromkeys(one.experiment for one in plan.pieces))
    pieces = sorted(plan.pieces, key=lambda one: (flows.index(one.experiment), -one.x))
    middle = 0.5 * (case.grid.y[0] + case.grid.y[1])
    files: dict[str, dict[str, str]] = {}
    for kind in (STREAMWISE, WATER_LEVEL, "discharge"):
        of, stated = KINDS[kind], getattr(planned.errors, kind)
        rows = []
        for one in pieces:
            if KIND_OF_WORK.get(one.work) != kind:
                continue
            section = "points" if one.work is Work.POINT else f"x{one.x:g}"
            error = of.usual_error if stated is None else stated
            for y in one.y or (middle,):
                name = names[one.work, one.x, y]
                rows.append([name, one.experiment, section, f"{one.x:g}", f"{y:g}", "", f"{error:g}"])
        if rows:
            heading = ["station", "experiment", "section", "x", "y", of.column, of.error_column]
            found[of.file] = csv_text(heading, rows)
            files[of.file] = {"coordinates": "channel"}
    named = path_from(folder.resolve(), case.source)
    text = yaml_of({OF_CASE: named, "files": files})
    return {**found, "site.yaml": f"{phrase('sheet_to_fill_in')}\n{text}"}


def _digits(value: float, places: int) -> str:
    return f"{value:.{places}f}" if np.isfinite(value) else ""
