"""ADCP transects: the classic ASCII output of WinRiver II.

Format: WinRiver II User's Guide (Teledyne RD Instruments, P/N 957-6231-00), Classic ASCII Output: three lines of
header, then for each ensemble six lines and one for each depth cell.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import readable_text
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.transects import BoatProfile, stations_of_transect

# What marks no velocity, in the unit of the file.
NO_VELOCITY = -32768.0
# By the unit of the file: metres in one of depth, and in one of velocity (cm/s or ft/s).
SCALES = {"cm": (1.0, 0.01), "ft": (0.3048, 0.3048)}


def is_winriver(text: str) -> bool:
    """Whether a text begins as such an output: seven whole numbers on line 3, thirteen numbers of a time on line 4."""
    lines = text.splitlines()[:4]
    if len(lines) < 4 or len(lines[2].split()) != 7 or len(lines[3].split()) != 13:
        return False
    return all(word.lstrip("-").isdigit() for word in lines[2].split())


def read_winriver(path: Path, words: FileWords) -> MeasuredRows:
    """Stations of a transect. Errors: InputError naming the file."""
    return stations_of_transect(path, words, _ensembles(path, readable_text(path).splitlines()), "WinRiver ASCII")


def _ensembles(path: Path, lines: list[str]) -> Iterator[BoatProfile]:
    lines = [line for line in lines if line.strip()]
    at = 3
    while at + 6 <= len(lines):
        try:
            cells = int(lines[at + 5].split()[0])
            yield _ensemble([line.split() for line in lines[at : at + 6 + cells]])
        except (ValueError, IndexError, KeyError):
            raise InputError(
                f"{shown_path(path)}, after {at} lines: expected an ensemble of WinRiver's classic ASCII output, got "
                f"{lines[at][:40]!r}; export it anew."
            ) from None
        at += 6 + cells


def _ensemble(rows: list[list[str]]) -> BoatProfile:
    """Line 2: velocity of the boat, then depths of the beams; line 3: distances; line 6: unit; then the cells."""
    unit = rows[5][1].lower()
    metres, velocity = SCALES[unit]
    beams = np.array([float(text) for text in rows[1][8:12]])
    depth = metres * float(beams[beams > 0.0].mean()) if (beams > 0.0).any() else 0.0
    north, east = float(rows[2][2]), float(rows[2][3])
    cells = np.array([[float(row[column]) for column in (0, 3, 4)] for row in rows[6:]]).reshape(-1, 3)
    if not np.isfinite([depth, north, east, *cells.ravel()]).all():
        raise ValueError("a number that is none")
    cells = cells[(cells[:, 1:] != NO_VELOCITY).all(axis=1)]
    height = depth - metres * cells[:, 0]
    above = height > 0.0
    return BoatProfile((metres * east, metres * north), depth, height[above], velocity * cells[above, 1:])
