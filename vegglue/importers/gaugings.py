"""Gaugings along a tape: FlowTracker2 (.ft), FlowTracker and RiverSurveyor Stationary Live (.dis), AquaCalc (.csv),
OTT ADC (.tsv).

Formats: FlowTracker2 User's Manual (SonTek, January 2019), section 12.1: a ZIP whose DataFile.json holds `Stations`
with Location, Depth and Calculations, in metres and seconds, or with units in the keys (`Depth (ft)`). FlowTracker
(file format 2.x) and RiverSurveyor Stationary Live (2.x) as their programs export them: text with settings, then a
table of verticals. AquaCalc Pro (JBS Instruments, file version 1.5): settings, then a table that begins with VERT, in
feet, or in metres if its standard is metric. OTT ADC, as QReview exports it (2.17): settings, then a table that begins
with Time and Nr, its units below its headings. Edges, and verticals without a method, samples or time, are no
measurements: all programs write 0 for them.
"""

import csv
import json
import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from vegglue.arrays import Mask
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import si_factor
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.library_files import read_by_library, readable_text, reading_structures, refuse_larger
from vegglue.importers.measured_rows import MeasuredRows, on_the_tape, rows_of_table
from vegglue.importers.table_parser import ParsedTable, is_number
from vegglue.measurements.plausibility import is_mark_anywhere

ZIP_BEGINS = b"PK\x03\x04"
DATA_FILE = "datafile.json"
# How a file of each program begins.
FLOWTRACKER = re.compile(r"^Sensor_Type\s+FlowTracker|FlowTracker_Handheld_ADV", re.MULTILINE)
RIVERSURVEYOR = re.compile(r"^System Type;\s*RS-|RiverSurveyor Stationary", re.MULTILINE)
AQUACALC = re.compile(r"\A.{0,100}^\W*AquaCalc", re.MULTILINE | re.DOTALL)
TABLE_OF_POINTS = re.compile(r"^\s*OB\s*,\s*DIST\s*,", re.MULTILINE)  # the table of an AquaCalc 5000
QREVIEW = re.compile(r"^Time\s*\tNr\s*\tPnts\s*\tPos\.", re.MULTILINE)
# Columns of place, depth and mean velocity of the vertical, and its error.
COLUMNS_OF_GAUGINGS = {
    "tape": ("Loc", "Location", "DIST", "Pos."),
    "depth": ("Depth", "TDPTH"),
    "u": ("MeanV", "Mean Velocity", "VVEL"),
    "u_se": ("Verr",),
}
# Columns that are 0 or empty for a vertical that was not measured: samples, share of the depth measured, time.
PROOFS = ("Npts", "% Measured", "TIME")
NOT_MEASURED = ("none", "novelocity", "unknown")  # methods of a FlowTracker2 by which nothing is measured
# Share by which a mean of one or two points is off that of its vertical [-], and the least error of a mean over the
# usual 40 s [m/s]. Chosen, not measured.
OF_THE_RULE, LEAST_ERROR = 0.05, 0.005


def read_flowtracker2(path: Path, options: FileOptions) -> MeasuredRows:
    """Verticals of a FlowTracker2 (.ft), at their place on the tape.

    Parameters
    ----------
    path
        A ZIP with DataFile.json, in SI or with units in its keys.
    options
        `line`, the ends of the tape [m].

    Returns
    -------
    MeasuredRows
        Depths [m], velocities and their errors [m/s] of verticals that were measured.

    Raises
    ------
    InputError
        If the file holds no stations, or `line` is not given.

    References
    ----------
    FlowTracker2 User's Manual (SonTek, January 2019), section 12.1.
    """
    with read_by_library(path, "FlowTracker2"), ZipFile(path) as packed:
        (entry,) = [one for one in packed.infolist() if one.filename.lower() == DATA_FILE]
        refuse_larger(path, entry.file_size)
        tree = json.loads(packed.read(entry).decode("utf-8-sig"))
        stations = next(value for key, value in tree.items() if key.partition(" (")[0] == "Stations")
    if not isinstance(stations, list) or not stations:
        raise InputError(f"{shown_path(path)}: expected a list of Stations in DataFile.json, got none; check the file.")
    with reading_structures(path, "FlowTracker2"):
        rows = [_measured_vertical(path, station) for station in stations]
    tape, depth, u, own, measured = np.array(rows, dtype=np.float64).reshape(-1, 5).T
    columns = {"tape": "Location", "depth": "Depth", "u": "MeanVelocityInVertical.X", "u_se": "VelocityStandardError.X"}
    units = {"tape": "m", "depth": "m", "u": "m/s", "u_se": "m/s"}
    taken = MeasuredRows({"tape": tape, "depth": depth, "u": u, "u_se": own}, {}, columns, units, ("FlowTracker2",))
    return on_the_tape(path, _wet_verticals(taken, np.isfinite(tape) & (measured > 0.0)), options)


def _measured_vertical(path: Path, station: Mapping[str, Any]) -> list[float]:
    """Location, depth [m], mean velocity and its error [m/s], and 1 if the vertical was measured, else 0.

    A correction factor belongs to the velocity: -1 for flow that runs against the probe. Discharge over area, which
    the file may hold, shows whether the velocity has it already.
    """

    def number(of: Mapping[str, Any], name: str, quantity: str = "") -> float:
        """A value under its name, with or without its unit in the key; of components the X. NaN for none."""
        key = next((key for key in of if key.partition(" (")[0] == name), None)
        value = of[key] if key is not None else None
        if key is None or value is None:
            return math.nan
        unit = key.partition(" (")[2].removesuffix(")")
        factor = si_factor(unit, quantity, shown_path(path)) if unit and quantity else 1.0
        if isinstance(value, dict):
            return factor * number(value, "X", quantity)
        return math.nan if is_mark_anywhere(float(value)) else factor * float(value)

    names = {key.partition(" (")[0]: value for key, value in station.items()}
    if "Location" not in names:
        raise KeyError("Location")
    means = names.get("Calculations") or {}
    u, factor = number(means, "MeanVelocityInVertical", "velocity"), number(station, "CorrectionFactor")
    area = number(means, "Area")
    panel = number(means, "Discharge") / area if area > 0.0 else math.nan
    has_factor = math.isfinite(panel) and abs(panel - u) <= abs(panel - factor * u)
    if math.isfinite(factor) and factor != 0.0 and not has_factor:
        u *= factor
    method, kind = (str(names.get(key) or "").lower() for key in ("VelocityMethod", "StationType"))
    samples = number(means, "Samples")
    unmeasured = method in NOT_MEASURED or "bank" in kind or "edge" in kind or samples == 0.0
    return [
        number(station, "Location", "length"),
        number(station, "Depth", "length"),
        u,
        number(means, "VelocityStandardError", "velocity"),
        float(not unmeasured),
    ]


def is_gauging(text: str) -> bool:
    """Whether a text is an export of one of the four programs."""
    return any(program.search(text) for program in (FLOWTRACKER, RIVERSURVEYOR, AQUACALC, QREVIEW))


def read_gauging(path: Path, options: FileOptions) -> MeasuredRows:
    """Verticals of a FlowTracker, a RiverSurveyor Stationary, an AquaCalc or an OTT ADC, at their place on the tape.

    Parameters
    ----------
    path
        A text with settings and one table of verticals.
    options
        `line`, the ends of the tape [m].

    Returns
    -------
    MeasuredRows
        Depths [m], velocities and their errors [m/s] of verticals that were measured.

    Raises
    ------
    InputError
        If there is no such table, or `line` is not given.
    """
    table = _table_of_gauging(path, readable_text(path))
    columns = {role: name for role, names in COLUMNS_OF_GAUGINGS.items() for name in names if name in table.headings}
    taken = rows_of_table(path, table, replace(options, columns=columns))
    if not {"tape", "depth", "u"} <= taken.numbers.keys() or not taken.size:
        raise InputError(
            f"{shown_path(path)}: expected rows with place, depth and mean velocity, got {len(table.rows)} rows of "
            f"{', '.join(table.headings)}; export it anew."
        )
    measured = np.ones(taken.size, dtype=bool)
    for proof in (name for name in PROOFS if name in taken.others):
        texts = [text.strip().rstrip("%") for text in taken.others[proof]]
        known = [float(text) if is_number(text) and "," not in text else 0.0 for text in texts]
        measured &= np.array([number > 0.0 and not is_mark_anywhere(number) for number in known], dtype=bool)
    return on_the_tape(path, _wet_verticals(replace(taken, others={}), measured), options)


def _table_of_gauging(path: Path, text: str) -> ParsedTable:
    """The table of verticals, whose units a FlowTracker and QReview state below its headings, a RiverSurveyor in the
    part `Units`, and an AquaCalc by its standard. Its rows begin with a number, or hold half as many as the heading has
    fields.
    """
    unit_of: dict[str, str] = {}
    if AQUACALC.search(text):
        program, mark, below = "AquaCalc", re.compile(r'\s*"?VERT"?\s*(,|$)'), 0
        metric = re.search(r"^\s*Meas\w* standard:\s*,\s*(metric|SI)\b", text, re.MULTILINE | re.IGNORECASE)
        length, velocity = ("m", "m/s") if metric else ("ft", "ft/s")
        unit_of = {"DIST": length, "TDPTH": length, "VVEL": velocity}
    elif FLOWTRACKER.search(text):
        program, mark, below = "FlowTracker", re.compile(r"\s*St\s+Clock"), 0
    elif QREVIEW.search(text):
        program, mark, below = "OTT QReview", re.compile(r"Time\s*\tNr"), 0
    else:
        program, mark, below = "RiverSurveyor Stationary", re.compile("Measurement Results"), 1
        part = re.search(r"^Units\s*$(.*?)^\s*$", text, re.MULTILINE | re.DOTALL)
        stated = dict(re.findall(r"^(Distance|Velocity);\s*(\S+)", part[1] if part else "", re.MULTILINE))
        length, velocity = stated.get("Distance", "m"), stated.get("Velocity", "m/s")
        unit_of = {"Location": length, "Depth": length, "Mean Velocity": velocity}

    def cut(line: str) -> list[str]:
        if program == "FlowTracker":
            return line.split()
        by_commas = program == "AquaCalc"
        fields = next(csv.reader([line], skipinitialspace=True), []) if by_commas else line.split("\t")
        return [field.strip() for field in fields]

    lines = text.splitlines()
    head = below + next((i for i, line in enumerate(lines) if mark.match(line)), len(lines))
    if head >= len(lines) and TABLE_OF_POINTS.search(text):
        raise InputError(
            f"{shown_path(path)}: expected verticals of an AquaCalc Pro, got points of an AquaCalc 5000; write a table "
            "with DIST, DEPTH, VEL times COS:VF as `velocity`, and DEPTH times LOC / 10 as `below surface`, with units."
        )
    if head >= len(lines):
        raise InputError(
            f"{shown_path(path)}: expected the table of verticals of a {program}, got none; export it anew."
        )
    headings, rest = tuple(cut(lines[head].rstrip("\t "))), [cut(line) for line in lines[head + 1 :]]
    if program in ("FlowTracker", "OTT QReview") and rest:
        unit_of = {name: unit for name, unit in zip(headings, rest[0], strict=False) if unit not in ("()", "(*D)")}
    if program in ("RiverSurveyor Stationary", "OTT QReview"):  # its rows end in tabs
        rest = [fields[: len(headings)] for fields in rest]
    there = [
        (number, fields)
        for number, fields in enumerate(rest, head + 2)
        if fields and (is_number(fields[0]) or 2 * sum(map(is_number, fields)) >= len(headings))
    ]
    kept = [(number, fields) for number, fields in there if len(fields) == len(headings)]
    other = [ImportNote(Noted.OTHER_WIDTH, len(there) - len(kept))] if len(there) > len(kept) else []
    texts, numbers = tuple(fields for _, fields in kept), tuple(number for number, _ in kept)
    units = tuple(unit_of.get(name, "") for name in headings)
    return ParsedTable(headings, units, texts, numbers, decimal_comma=False, form=(program, *other))


def _wet_verticals(taken: MeasuredRows, measured: Mask) -> MeasuredRows:
    """Of points of one vertical in the water the last row, which has its mean; with an error.

    se^2 = (share of the rule u)^2 + own^2; own: the instrument's, if it is below half of the velocity [m/s]. measured
    (rows,): which rows are measurements; edges and the like are left out.
    """
    wet = np.isfinite(taken.numbers["u"]) & (taken.numbers["depth"] > 0.0) & measured
    lost = int((~wet & (taken.numbers["depth"] != 0.0)).sum())
    notes = [ImportNote(Noted.UNMEASURED, lost)] if lost else []
    taken = taken.only(wet)
    place = taken.numbers["tape"]
    last = np.array([not np.any(place[i + 1 :] == place[i]) for i in range(taken.size)], dtype=bool)
    kept = taken.only(last)
    u = np.abs(kept.numbers["u"])
    own = kept.numbers.get("u_se", np.full(kept.size, np.nan))
    unknown = int(np.isnan(own).sum())
    notes += [ImportNote(Noted.ERRORS_UNKNOWN, unknown)] if 0 < unknown < kept.size else []
    sound = np.where(own < 0.5 * u, own, LEAST_ERROR)
    return kept.having({"u_se": np.hypot(OF_THE_RULE * u, np.fmax(sound, LEAST_ERROR))}, *notes)
