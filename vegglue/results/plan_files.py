"""Files to take along into the field: stations in map coordinates as CSV and for a GPS (GPX), and an empty sheet that
`vegglue import` reads back.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from vegglue.case.grid import centreline_in, on_map
from vegglue.case.safe_yaml import yaml_of
from vegglue.case.schema import Case, Planned
from vegglue.case.text_files import write_text
from vegglue.errors import InputError, path_from
from vegglue.measurements.kinds import KINDS, STREAMWISE, WATER_LEVEL
from vegglue.results.plan import FieldPlan, PlannedPiece, Work
from vegglue.wording.remedies import MAKE_ROOM

# Letters before the numbers of places, by their work.
LETTERS = {Work.TRANSECT: "T", Work.POINT: "V", Work.GAUGE: "G", Work.DISCHARGE: "Q", Work.SURVEY_LINE: "L"}
KIND_OF_WORK = {
    Work.TRANSECT: STREAMWISE, Work.POINT: STREAMWISE, Work.GAUGE: WATER_LEVEL, Work.DISCHARGE: "discharge",
}  # fmt: skip
# Folder of the sheet in that of the plan, and key of its site file that names the case.
SHEET, OF_CASE = "sheet", "case"
WGS84 = "EPSG:4326"


@dataclass(frozen=True)
class FieldPlace:
    """A place where work is done, in one flow or in several: its name, and y of its stations [m], the lowest first."""

    name: str
    work: Work
    x: float
    y: tuple[float, ...]
    experiments: tuple[str, ...]


@dataclass(frozen=True)
class FieldStation:
    """A station: its name, x and y in the case [m], east and north on the map [m], NaN without a frame or centreline,
    longitude and latitude [degrees], NaN if unknown; experiments in which something is measured there.
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
    """What was written: the folder, and why there is no GPX, '' if there is one: 'frame' or 'crs' of the case is
    missing, 'pyproj' is not installed, or 'system' is unknown to it.
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
    """Stations of all places with their map coordinates, and why they have no longitude and latitude, '' if they do."""
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
                     float(latitude[k]), tuple(flow for flow in one.experiments if _in_flow(plan, one, flow, y[k])))
        for k, (name, one, _) in enumerate(rows)
    ]  # fmt: skip
    return tuple(stations), without


def _in_flow(plan: FieldPlan, place: FieldPlace, flow: str, y: float) -> bool:
    """Whether a station is measured in a flow: a bank may be dry in another one."""
    return any(
        one.work is place.work and one.x == place.x and one.experiment == flow and (not one.y or y in one.y)
        for one in plan.pieces
    )


def write_field_files(folder: Path, case: Case, plan: FieldPlan) -> FieldFiles:
    """Write stations.csv, stations.gpx and sheet/ into the folder of a plan. Raises StorageError."""
    stations, without = field_stations(case, plan)
    heading = ["station", "work", "x", "y", "east", "north", "longitude", "latitude", "flows"]
    rows = [
        [one.name, one.work.value, f"{one.x:g}", f"{one.y:g}", _digits(one.east, 2), _digits(one.north, 2),
         _digits(one.longitude, 7), _digits(one.latitude, 7), "; ".join(one.experiments)]
        for one in stations
    ]  # fmt: skip
    write_text(folder / "stations.csv", _table(heading, rows), MAKE_ROOM)
    gpx = folder / "stations.gpx"
    if not without:
        write_text(gpx, _gpx(case, stations), MAKE_ROOM)
    elif gpx.exists():
        gpx.unlink()
    for name, text in sheets(folder / SHEET, case, plan).items():
        write_text(folder / SHEET / name, text, MAKE_ROOM)
    surveyed = [one for one in stations if one.work is Work.SURVEY_LINE]
    if surveyed:
        levels = [[f"{one.x:g}", f"{one.y:g}", ""] for one in surveyed]
        write_text(folder / "bed_levels.csv", _table(["x", "y", "z"], levels), MAKE_ROOM)
    return FieldFiles(folder, stations, without)


def sheets(folder: Path, case: Case, plan: FieldPlan) -> dict[str, str]:
    """The tables to fill in, by their names, and the site file that names the case they are of."""
    planned, found = case.planned or Planned(), {}
    files: dict[str, dict[str, str]] = {}
    for kind in (STREAMWISE, WATER_LEVEL, "discharge"):
        of, stated = KINDS[kind], getattr(planned.errors, kind)
        rows = []
        for one in plan.pieces:
            if KIND_OF_WORK.get(one.work) != kind:
                continue
            section = "points" if one.work is Work.POINT else f"x{one.x:g}"
            error = of.usual_error if stated is None else stated
            for y in one.y or (0.0,):
                rows.append([one.experiment, section, f"{one.x:g}", f"{y:g}", "", f"{error:g}"])
        if rows:
            found[of.file] = _table(["experiment", "section", "x", "y", of.column, of.error_column], rows)
            files[of.file] = {"coordinates": "channel"}
    named = path_from(folder.resolve(), case.source)
    text = yaml_of({OF_CASE: named, "files": files})
    return {**found, "site.yaml": f"# Fill in the tables beside this file; empty rows are ignored.\n{text}"}


def _table(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([heading, *rows])
    return text.getvalue()


def _digits(value: float, places: int) -> str:
    return f"{value:.{places}f}" if np.isfinite(value) else ""


def _gpx(case: Case, stations: Sequence[FieldStation]) -> str:
    """Waypoints after GPX 1.1 (https://www.topografix.com/GPX/1/1/)."""
    if not all(np.isfinite([one.longitude, one.latitude]).all() for one in stations):
        raise InputError(f"{case.name}: `frame` places stations outside its `crs`; correct one of both.")
    points = [
        f'  <wpt lat="{one.latitude:.7f}" lon="{one.longitude:.7f}"><name>{escape(one.name)}</name>'
        f"<desc>{escape(f'{one.work.value}, x {one.x:g} m, y {one.y:g} m')}</desc></wpt>"
        for one in stations
    ]
    head = '<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="vegglue" xmlns="http://www.topografix.com/GPX/1/1">'
    name = f"  <metadata><name>{escape(case.title or case.name)}</name></metadata>"
    return "\n".join([head, name, *points, "</gpx>", ""])
