"""Gaugings along a tape: SonTek's FlowTracker2 (.ft), FlowTracker and RiverSurveyor Stationary Live (.dis).

Formats: FlowTracker2 User's Manual (SonTek, January 2019), section 12.1: a ZIP whose DataFile.json holds `Stations`
with Location, Depth and Calculations, in metres and seconds whatever the handheld showed. FlowTracker (file format 2.x)
and RiverSurveyor Stationary Live (2.x) as their programs export them: text with settings, then a table of verticals.
"""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from zipfile import ZipFile

import numpy as np

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_options import FileOptions
from vegglue.importers.library_files import read_by_library, readable_text, reading_structures, refuse_larger
from vegglue.importers.measured_rows import MeasuredRows, on_the_tape, rows_of_table
from vegglue.importers.table_parser import Line, ParsedTable, is_number

ZIP_BEGINS = b"PK\x03\x04"
DATA_FILE = "datafile.json"
# How a file of each program begins.
FLOWTRACKER = re.compile(r"^Sensor_Type\s+FlowTracker|FlowTracker_Handheld_ADV", re.MULTILINE)
RIVERSURVEYOR = re.compile(r"^System Type;\s*RS-|RiverSurveyor Stationary", re.MULTILINE)
# Columns of place, depth and mean velocity of the vertical, and its error.
COLUMNS_OF_GAUGINGS = {
    "tape": ("Loc", "Location"),
    "depth": ("Depth",),
    "u": ("MeanV", "Mean Velocity"),
    "u_se": ("Verr",),
}
# Share by which a mean of one or two points is off that of its vertical [-], and the least error of a mean over the
# usual 40 s [m/s]. Chosen, not measured.
OF_THE_RULE, LEAST_ERROR = 0.05, 0.005


def read_flowtracker2(path: Path, options: FileOptions) -> MeasuredRows:
    """Verticals at their place on the tape, which `line` lays on the map. InputError."""
    with (
        read_by_library(path, "a FlowTracker2 file, a ZIP with DataFile.json and its Stations"),
        ZipFile(path) as packed,
    ):
        (entry,) = [one for one in packed.infolist() if one.filename.lower() == DATA_FILE]
        refuse_larger(path, entry.file_size)
        stations = json.loads(packed.read(entry).decode("utf-8-sig"))["Stations"]
    if not isinstance(stations, list) or not stations:
        raise InputError(f"{shown_path(path)}: expected a list of Stations in DataFile.json, got none; check the file.")
    rows = []
    advice = "export it as CSV from the maker's program"
    with reading_structures(path, "stations with Location, Depth and Calculations", advice):
        for station in stations:
            means = station.get("Calculations") or {}
            values = [station["Location"], station.get("Depth")]
            values += [(means.get(name) or {}).get("X") for name in ("MeanVelocityInVertical", "VelocityStandardError")]
            rows.append([math.nan if value is None else float(value) for value in values])
    tape, depth, u, own = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    columns = {"tape": "Location", "depth": "Depth", "u": "MeanVelocityInVertical.X", "u_se": "VelocityStandardError.X"}
    units = {"tape": "m", "depth": "m", "u": "m/s", "u_se": "m/s"}
    taken = MeasuredRows({"tape": tape, "depth": depth, "u": u, "u_se": own}, {}, columns, units, ("FlowTracker2",))
    return on_the_tape(path, _wet_verticals(taken.only(np.isfinite(tape))), options)


def is_gauging(text: str) -> bool:
    """Whether a text is an export of one of the two programs."""
    return bool(FLOWTRACKER.search(text) or RIVERSURVEYOR.search(text))


def read_gauging(path: Path, options: FileOptions) -> MeasuredRows:
    """Verticals at their place on the tape, which `line` lays on the map. InputError."""
    text = readable_text(path)
    table = _flowtracker_table(path, text) if FLOWTRACKER.search(text) else _riversurveyor_table(path, text)
    columns = {role: name for role, names in COLUMNS_OF_GAUGINGS.items() for name in names if name in table.headings}
    taken = rows_of_table(path, table, replace(options, columns=columns))
    if not {"tape", "depth", "u"} <= taken.numbers.keys() or not taken.size:
        raise InputError(
            f"{shown_path(path)}: expected rows with place, depth and mean velocity, got {len(table.rows)} rows of "
            f"{', '.join(table.headings)}; export it anew."
        )
    return on_the_tape(path, _wet_verticals(replace(taken, others={})), options)


def _flowtracker_table(path: Path, text: str) -> ParsedTable:
    """The table that begins with `St  Clock`; the line below holds its units."""
    lines = text.splitlines()
    head = next((i for i, line in enumerate(lines) if re.match(r"\s*St\s+Clock", line)), len(lines))
    if head + 1 >= len(lines):
        raise InputError(
            f"{shown_path(path)}: expected the table of stations of a FlowTracker, got none; export it anew."
        )
    headings = tuple(lines[head].split())
    units = tuple("" if one in ("()", "(*D)") else one for one in lines[head + 1].split())
    units = (units + ("",) * len(headings))[: len(headings)]
    rows = [(number, line.split()) for number, line in enumerate(lines[head + 2 :], head + 3)]
    return _table(headings, units, rows, "FlowTracker")


def _riversurveyor_table(path: Path, text: str) -> ParsedTable:
    """The table below `Measurement Results`, by tabs; its units stand in the part `Units`."""
    lines = text.splitlines()
    head = next((i + 1 for i, line in enumerate(lines) if line.startswith("Measurement Results")), len(lines))
    if head >= len(lines):
        raise InputError(
            f"{shown_path(path)}: expected `Measurement Results` of a RiverSurveyor, got none; export it anew."
        )
    stated = dict(re.findall(r"^(Distance|Velocity);\s*(\S+)", text, re.MULTILINE))
    length, velocity = stated.get("Distance", "m"), stated.get("Velocity", "m/s")
    headings = tuple(field.strip() for field in lines[head].rstrip("\t ").split("\t"))
    units = tuple({"Location": length, "Depth": length, "Mean Velocity": velocity}.get(one, "") for one in headings)
    cut = [[field.strip() for field in line.split("\t")][: len(headings)] for line in lines[head + 1 :]]
    return _table(headings, units, list(enumerate(cut, head + 2)), "RiverSurveyor Stationary")


def _table(headings: tuple[str, ...], units: tuple[str, ...], rows: list[Line], form: str) -> ParsedTable:
    """The rows that are as wide as the heading, and begin with a number."""
    kept = [(number, fields) for number, fields in rows if len(fields) == len(headings) and is_number(fields[0])]
    texts, numbers = tuple(fields for _, fields in kept), tuple(number for number, _ in kept)
    return ParsedTable(headings, units, texts, numbers, decimal_comma=False, form=form)


def _wet_verticals(taken: MeasuredRows) -> MeasuredRows:
    """Of points of one vertical in the water the last row, which has its mean; with an error.

    se^2 = (share of the rule u)^2 + own^2; own: the instrument's, if it is below half of the velocity [m/s].
    """
    taken = taken.only(np.isfinite(taken.numbers["u"]) & (taken.numbers["depth"] > 0.0))
    place = taken.numbers["tape"]
    last = np.array([not np.any(place[i + 1 :] == place[i]) for i in range(taken.size)], dtype=bool)
    kept = taken.only(last)
    u = np.abs(kept.numbers["u"])
    own = kept.numbers.get("u_se", np.full(kept.size, np.nan))
    sound = np.where(own < 0.5 * u, own, LEAST_ERROR)
    return kept.having({"u_se": np.hypot(OF_THE_RULE * u, np.fmax(sound, LEAST_ERROR))})
