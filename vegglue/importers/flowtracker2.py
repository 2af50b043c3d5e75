"""Gaugings of SonTek's FlowTracker2: an .ft file, which is a ZIP of JSON files.

Format: FlowTracker2 User's Manual (SonTek, January 2019), section 12.1: DataFile.json holds `Stations` with Location,
Depth and Calculations, in metres and seconds whatever the handheld showed.
"""

import json
import math
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.library_files import read_by_library, refuse_larger
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.tape_tables import last_of_each_place, on_the_tape

ZIP_BEGINS = b"PK\x03\x04"
DATA_FILE = "datafile.json"


def read_flowtracker2(path: Path, words: FileWords) -> MeasuredRows:
    """Verticals at their place on the tape, which `line` lays on the map. Errors: InputError naming the file."""
    stations = _stations(path)
    try:
        rows = [
            (_number(one["Location"]), _number(one.get("Depth")), *_velocity(one.get("Calculations") or {}))
            for one in stations
        ]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{shown_path(path)}: expected stations with Location, Depth and Calculations, got others ({error}); "
            "export it as CSV from the maker's program."
        ) from None
    tape, depth, u, own = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    wet = np.isfinite(tape) & np.isfinite(u) & (depth > 0.0)
    columns = {"tape": "Location", "depth": "Depth", "u": "MeanVelocityInVertical.X", "u_se": "VelocityStandardError.X"}
    units = {"tape": "m", "depth": "m", "u": "m/s", "u_se": "m/s"}
    taken = MeasuredRows({"tape": tape, "depth": depth, "u": u, "u_se": own}, {}, columns, units, ("FlowTracker2",))
    return on_the_tape(path, last_of_each_place(taken.only(wet)), words)


def _stations(path: Path) -> list[dict[str, Any]]:
    kind = "a FlowTracker2 file, a ZIP with DataFile.json and its Stations"
    with read_by_library(path, kind), ZipFile(path) as archive:
        (entry,) = [one for one in archive.infolist() if one.filename.lower() == DATA_FILE]
        refuse_larger(path, entry.file_size)
        found = json.loads(archive.read(entry).decode("utf-8-sig"))["Stations"]
    if not isinstance(found, list) or not found:
        raise InputError(f"{shown_path(path)}: expected a list of Stations in DataFile.json, got none; check the file.")
    return found


def _velocity(calculations: dict[str, Any]) -> tuple[float, float]:
    """Mean of the vertical along the channel, and the standard error of its points [m/s]."""
    parts = (calculations.get(name) or {} for name in ("MeanVelocityInVertical", "VelocityStandardError"))
    mean, error = (_number(part.get("X")) for part in parts)
    return mean, error


def _number(value: Any) -> float:
    """A number; NaN for none, and for the word that the format has for it."""
    return math.nan if value is None else float(value)
