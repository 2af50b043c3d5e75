"""Records of one point: Nortek's Vectrino and Vector as ASCII (.dat), and the Vector as it wrote it (.vec).

Format: Nortek's conversion to ASCII: no heading, one line a sample; Vectrino: time, counter, status, velocities x, y,
z1, z2 [m/s], then amplitudes, ratios and correlations of four beams; Vector: burst, counter, velocities x, y, z [m/s],
then amplitudes, ratios and correlations of three beams, pressure and two inputs. The .hdr beside it says the rate.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import readable_text
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.point_records import record_mean, refuse_nowhere
from vegglue.importers.raw_files import opened_raw

# How a binary record of a Vector begins: its hardware configuration, with its serial number.
VECTOR_BEGINS = b"\xa5\x05\x18\x00VEC"
BYTES_OF_A_SAMPLE = 24  # of the record of velocities in a .vec


@dataclass(frozen=True)
class _Layout:
    """Columns of a line: the first velocity, the correlations, and how many there are at least."""

    name: str
    velocity: int
    correlation: slice
    columns: int


_VECTRINO = _Layout("Vectrino", 3, slice(15, 19), 19)
_VECTOR = _Layout("Vector", 2, slice(11, 14), 17)
_LAYOUTS = (_VECTRINO, _VECTOR)


def is_nortek(path: Path, text: str) -> bool:
    """Whether it is a .dat with its .hdr beside it, and as wide a first line as the exports have."""
    line = next(iter(text.splitlines()), "")
    wide = len(line.split()) >= min(layout.columns for layout in _LAYOUTS)
    return wide and path.suffix.lower() == ".dat" and _header(path) is not None


def read_nortek(path: Path, words: FileWords) -> MeasuredRows:
    """One row: the mean of an ASCII record at its `position`. Errors: InputError naming the file."""
    refuse_nowhere(path, words)
    layout, rows = _rows(path)
    axes = _in_header(path, r"Coordinate system\s+(\w+)") or "XYZ"
    if axes not in ("XYZ", "ENU"):
        raise InputError(f"{shown_path(path)}: expected velocities in XYZ or ENU, got {axes}; export them anew.")
    velocity = rows[:, layout.velocity : layout.velocity + 3]
    mean = record_mean(path, words, layout.name, velocity, rows[:, layout.correlation], _rate(path))
    return replace(mean, of_probe=axes == "XYZ")


def read_vector(path: Path, words: FileWords) -> MeasuredRows:
    """One row of a binary record of a Vector, as the probe's axes x, y and z have it.

    Errors: InputError naming the file, for other axes, and without mhkit.
    """
    refuse_nowhere(path, words)
    most = path.stat().st_size // BYTES_OF_A_SAMPLE
    data = opened_raw(path, "ASCII data from Nortek's program, the .dat and the .hdr", most)
    axes = str(data.attrs.get("coord_sys"))
    if axes != "inst" or not {"vel", "corr"} <= set(data):
        raise InputError(
            f"{shown_path(path)}: expected a record in XYZ coordinates, got one in {axes}; convert it in Nortek's "
            "program, and export ASCII data."
        )
    velocity, correlation = (np.asarray(data[name].values, dtype=np.float64).T for name in ("vel", "corr"))
    there = np.isfinite(velocity).all(axis=1)  # the reader fills up what the file does not hold
    return record_mean(path, words, "Vector, binary", velocity[there], correlation[there], float(data.attrs["fs"]))


def _rows(path: Path) -> tuple[_Layout, Array]:
    lines = [line.split() for line in readable_text(path).splitlines() if line.strip()]
    layout = next((one for one in _LAYOUTS if lines and len(lines[0]) >= one.columns), None)
    try:
        rows = np.array([[float(word) for word in line] for line in lines])
    except ValueError as error:
        raise InputError(
            f"{shown_path(path)}: expected rows of numbers of a Nortek export, got {error}; export it anew."
        ) from None
    if layout is None or rows.ndim != 2:
        raise InputError(
            f"{shown_path(path)}: expected the columns of a Vectrino or Vector, got others; export it anew."
        )
    return layout, rows


def _header(path: Path) -> Path | None:
    """The .hdr beside a record; None without."""
    return next((there for end in (".hdr", ".HDR") if (there := path.with_suffix(end)).is_file()), None)


def _rate(path: Path) -> float:
    found = _in_header(path, r"Sampling rate\s+([\d.]+)\s*Hz")
    if found is None:
        raise InputError(
            f"{shown_path(path)}: expected `Sampling rate` in the .hdr beside it, got none; export it too."
        )
    return float(found)


def _in_header(path: Path, line: str) -> str | None:
    """What a line of the .hdr says; None without such a line."""
    header = _header(path)
    found = re.search(f"^{line}", readable_text(header), re.MULTILINE) if header else None
    return found[1] if found else None
