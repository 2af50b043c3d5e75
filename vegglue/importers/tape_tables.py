"""Discharge measurements along a tape: FlowTracker .dis, and RiverSurveyor Stationary Live .dis.

Both are text: settings, then a table of verticals with depth and mean velocity at places along the tape.
Formats: SonTek FlowTracker (file format 2.x) and RiverSurveyor Stationary Live (2.x), as their programs export them.
"""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import LooseTable, readable_text
from vegglue.importers.measured_rows import MeasuredRows, rows_of_table
from vegglue.importers.number_words import is_number
from vegglue.wording.numbers import in_digits

# How a file of each program says what it is; its columns of place, depth and mean velocity of the vertical.
FLOWTRACKER = re.compile(r"^Sensor_Type\s+FlowTracker|FlowTracker_Handheld_ADV", re.MULTILINE)
RIVERSURVEYOR = re.compile(r"^System Type;\s*RS-|RiverSurveyor Stationary", re.MULTILINE)
# Share by which a mean of one or two points is off that of its vertical [-], and the least error of a mean over the
# usual 40 s [m/s]. Chosen, not measured.
OF_THE_RULE, LEAST_ERROR = 0.05, 0.005


def is_tape_table(text: str) -> bool:
    """Whether the beginning of a file is that of one of the two programs."""
    return bool(FLOWTRACKER.search(text) or RIVERSURVEYOR.search(text))


def read_tape_table(path: Path, words: FileWords) -> MeasuredRows:
    """Verticals at their place on the tape, which `line` lays on the map. Errors: InputError naming the file."""
    text = readable_text(path)
    table, units = _flowtracker(path, text) if FLOWTRACKER.search(text) else _riversurveyor(path, text)
    taken = rows_of_table(path, table, replace(words, units={**units, **words.units}, columns=_columns(table)))
    if not {"tape", "depth", "u"} <= taken.numbers.keys() or not taken.size:
        raise InputError(
            f"{shown_path(path)}: expected rows with place, depth and mean velocity, got {len(table.rows)} rows of "
            f"{', '.join(table.headings)}; export it anew."
        )
    taken = replace(taken, others={})  # what else the program writes is known, and not wanted
    wet = np.isfinite(taken.numbers["u"]) & (taken.numbers["depth"] > 0.0)
    return on_the_tape(path, last_of_each_place(taken.only(wet)), words)


def on_the_tape(path: Path, taken: MeasuredRows, words: FileWords) -> MeasuredRows:
    """Places (x, y) = a + t (b - a) / |b - a| at the reading t of a tape from a to b.

    The velocity measured is that square to the tape; it is taken as the one along the channel, which a tape that is off
    square by 10 degrees makes 1.5 % too small. Errors: InputError without the ends of the tape.
    """
    if words.line is None:
        raise InputError(
            f"{shown_path(path)}: expected where the tape lay, `line: [[x, y], [x, y]]`, first the end where it reads "
            "0; add it to this file in `files`."
        )
    (x0, y0), (x1, y1) = words.line
    length = math.hypot(x1 - x0, y1 - y0)
    east, north = (x1 - x0) / length, (y1 - y0) / length
    t = taken.numbers["tape"]
    places = {"x": x0 + t * east, "y": y0 + t * north}
    return taken.having(places, f"places along a tape of {in_digits(length, 4)} m").without("tape")


def _columns(table: LooseTable) -> dict[str, str]:
    found = {"tape": ("Loc", "Location"), "depth": ("Depth",), "u": ("MeanV", "Mean Velocity"), "u_se": ("Verr",)}
    return {role: name for role, names in found.items() for name in names if name in table.headings}


def _flowtracker(path: Path, text: str) -> tuple[LooseTable, dict[str, str]]:
    """The table that begins with `St  Clock`; the line below holds its units."""
    lines = text.splitlines()
    head = next((i for i, line in enumerate(lines) if re.match(r"\s*St\s+Clock", line)), None)
    if head is None or head + 1 >= len(lines):
        raise InputError(
            f"{shown_path(path)}: expected the table of stations of a FlowTracker, got none; export it anew."
        )
    headings = tuple(lines[head].split())
    units = tuple("" if one in ("()", "(*D)") else one for one in lines[head + 1].split())
    units = (units + ("",) * len(headings))[: len(headings)]
    rows = [(number, line.split()) for number, line in enumerate(lines[head + 2 :], head + 3)]
    kept = tuple((number, row) for number, row in rows if len(row) == len(headings) and is_number(row[0]))
    return LooseTable(headings, units, kept, decimal_comma=False, form="FlowTracker"), {}


def _riversurveyor(path: Path, text: str) -> tuple[LooseTable, dict[str, str]]:
    """The table below `Measurement Results`, by tabs; its units stand in the part `Units`."""
    lines = text.splitlines()
    head = next((i + 1 for i, line in enumerate(lines) if line.startswith("Measurement Results")), None)
    if head is None or head >= len(lines):
        raise InputError(
            f"{shown_path(path)}: expected `Measurement Results` of a RiverSurveyor, got none; export it anew."
        )
    said = dict(re.findall(r"^(Distance|Velocity);\s*(\S+)", text, re.MULTILINE))
    units = {"tape": said.get("Distance", "m"), "depth": said.get("Distance", "m"), "u": said.get("Velocity", "m/s")}
    headings = tuple(field.strip() for field in lines[head].rstrip("\t ").split("\t"))
    rows = []
    for number, line in enumerate(lines[head + 1 :], head + 2):
        fields = [field.strip() for field in line.split("\t")][: len(headings)]
        if len(fields) == len(headings) and is_number(fields[0]):
            rows.append((number, fields))
    return LooseTable(headings, ("",) * len(headings), tuple(rows), False, "RiverSurveyor Stationary"), units


def last_of_each_place(taken: MeasuredRows) -> MeasuredRows:
    """Of points of one vertical the last row, which has its mean; with an error where the file has no sound one."""
    place = taken.numbers["tape"]
    last = np.array([not np.any(place[i + 1 :] == place[i]) for i in range(taken.size)], dtype=bool)
    kept = taken.only(last)
    return kept.having({"u_se": _errors(kept)})


def _errors(taken: MeasuredRows) -> Array:
    """se^2 = (share of the rule u)^2 + own^2; own: the instrument's, where it is below half of the velocity [m/s]."""
    u = np.abs(taken.numbers["u"])
    own = taken.numbers.get("u_se", np.full(taken.size, np.nan))
    sound = np.where(own < 0.5 * u, own, LEAST_ERROR)
    return np.asarray(np.hypot(OF_THE_RULE * u, np.fmax(sound, LEAST_ERROR)))
