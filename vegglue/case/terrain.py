"""Bed levels and classes from files: ESRI ASCII grids and scattered survey points, read off at cell centres."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.grid import centres
from vegglue.case.size_limits import LARGEST_DATA
from vegglue.case.text_files import read_text
from vegglue.errors import InputError

# Keys of the header of an ESRI ASCII grid, in lower case.
HEADER = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "nodata_value")


@dataclass(frozen=True)
class Raster:
    """Values (nx, ny) at centres x (nx,) and y (ny,), both rising [m]; NaN where the file has no data."""

    x: Array
    y: Array
    size: float
    values: Array


def read_raster(path: Path) -> Raster:
    """The raster in an ESRI ASCII grid: a header, then rows of values from north (largest y) to south.

    Errors: InputError, naming file and line, when the header or the values are incomplete or no numbers.
    """
    lines = read_text(path, LARGEST_DATA).splitlines()
    header, first = _header(path, lines)
    columns, rows, size = (
        _whole(path, header, "ncols"),
        _whole(path, header, "nrows"),
        _positive(path, header, "cellsize"),
    )
    values = _numbers(path, lines[first:], first, rows * columns).reshape(rows, columns)[::-1].T
    values = np.where(values == header.get("nodata_value", -9999.0), np.nan, values)
    x = centres(_corner(path, header, "x", size), size, columns)
    y = centres(_corner(path, header, "y", size), size, rows)
    return Raster(x, y, size, values)


def levels_at(raster: Raster, x: Array, y: Array) -> Array:
    """Levels [m] at x (nx, 1) and y (1, ny), or both (nx, ny): bilinear between the centres of the raster.

    Constant in its outer half cell; NaN outside and next to missing data.
    """
    i, weight_x = _between(raster.x, x)
    j, weight_y = _between(raster.y, y)
    shape = np.broadcast_shapes(x.shape, y.shape)
    level, share = np.zeros(shape), np.zeros(shape)
    for di, wx in ((0, 1.0 - weight_x), (1, weight_x)):
        for dj, wy in ((0, 1.0 - weight_y), (1, weight_y)):
            weight = wx * wy
            corner = raster.values[np.minimum(i + di, raster.x.size - 1), np.minimum(j + dj, raster.y.size - 1)]
            known = ~np.isnan(corner)
            level += np.where(known, weight * np.where(known, corner, 0.0), 0.0)
            share += np.where(known, weight, 0.0)
    return np.where(_covered(raster, x, y) & (share > 1.0 - 1e-9), level, np.nan)


def nearest_at(raster: Raster, x: Array, y: Array) -> Array:
    """Values of the raster cells in which x (nx, 1) and y (1, ny), or both (nx, ny), lie; NaN outside."""
    i = np.clip(np.rint((x - raster.x[0]) / raster.size).astype(int), 0, raster.x.size - 1)
    j = np.clip(np.rint((y - raster.y[0]) / raster.size).astype(int), 0, raster.y.size - 1)
    return np.where(_covered(raster, x, y), raster.values[i, j], np.nan)


def survey_levels(path: Path, x: Array, y: Array) -> Array:
    """Levels [m] at x (nx, 1) and y (1, ny), or both (nx, ny): linear on the Delaunay triangles of surveyed points x,
    y, z; NaN outside their hull.

    Errors: InputError when the file cannot be read, or all points lie on one line.
    """
    from scipy.interpolate import LinearNDInterpolator  # late: a bed without points need not wait for it
    from scipy.spatial import QhullError

    points = read_points(path)
    try:
        surface = LinearNDInterpolator(points[:, :2], points[:, 2])
    except (QhullError, ValueError):
        raise InputError(
            f"{path}: expected at least three points that are not on one line, got {len(points)}: add more."
        ) from None
    return np.asarray(surface(*np.broadcast_arrays(x, y)), dtype=np.float64)


def read_points(path: Path) -> Array:
    """The columns x, y, z of a CSV file, (points, 3) [m]. Errors: InputError for a missing column or number."""
    lines = (line for line in read_text(path, LARGEST_DATA).splitlines() if line.strip() and not line.startswith("#"))
    try:
        rows = csv.DictReader(lines)
        missing = [name for name in "xyz" if name not in (rows.fieldnames or ())]
        if missing:
            raise InputError(f"{path}: expected a header with the columns x, y and z, got {rows.fieldnames}.")
        points = [_point(path, number, row) for number, row in enumerate(rows, 1)]
    except csv.Error as error:
        raise InputError(f"{path}: expected a CSV table, which cannot be read ({error}); check it.") from None
    return np.array(points).reshape(-1, 3)


def _point(path: Path, number: int, row: dict[str | None, Any]) -> list[float]:
    """x, y and z; `csv` keeps what goes beyond the heading under None."""
    if any(text.strip() for text in row.get(None, ())):
        raise InputError(
            f"{path}, data row {number}: expected as many fields as in the heading, got more; write numbers with a "
            "decimal point."
        )
    return [_number(path, number, row[name], name) for name in "xyz"]


def _number(path: Path, row: int, text: str | None, name: str) -> float:
    try:
        number = float(text or "")
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{path}, data row {row}: column {name} expected a number in m, got {text!r}.")
    return number


def _header(path: Path, lines: list[str]) -> tuple[dict[str, float], int]:
    header: dict[str, float] = {}
    for number, line in enumerate(lines):
        words = line.split()
        if not words or words[0].lower() not in HEADER:
            return header, number
        if len(words) != 2:
            raise InputError(f"{path}, line {number + 1}: expected `{words[0]}` and one number, got {line!r}.")
        header[words[0].lower()] = _number(path, number + 1, words[1], words[0])
    return header, len(lines)


def _positive(path: Path, header: dict[str, float], key: str) -> float:
    if header.get(key, 0.0) <= 0:
        raise InputError(
            f"{path}: expected an ESRI ASCII grid whose header has a `{key}` above 0, got {header or 'no header'}."
        )
    return header[key]


def _whole(path: Path, header: dict[str, float], key: str) -> int:
    number = _positive(path, header, key)
    if number != int(number):
        raise InputError(f"{path}: expected a whole number of cells as `{key}`, got {number:g}; correct the header.")
    return int(number)


def _corner(path: Path, header: dict[str, float], axis: str, size: float) -> float:
    if f"{axis}llcorner" in header:
        return header[f"{axis}llcorner"]
    if f"{axis}llcenter" in header:
        return header[f"{axis}llcenter"] - 0.5 * size
    raise InputError(f"{path}: expected `{axis}llcorner` or `{axis}llcenter` in the header, got neither.")


def _numbers(path: Path, lines: list[str], before: int, count: int) -> Array:
    """All values after the header; a line at a time, so that a large file takes little more than its numbers do."""
    rows = [_row(path, number, line) for number, line in enumerate(lines, before + 1)]
    values = np.concatenate([np.empty(0), *rows])
    if len(values) != count:
        raise InputError(f"{path}: expected nrows x ncols = {count} values after the header, got {len(values)}.")
    return values


def _row(path: Path, number: int, line: str) -> Array:
    words = line.split()
    try:
        values = np.array(words, dtype=np.float64)
    except ValueError:
        word = next(word for word in words if not _is_number(word))
        raise InputError(f"{path}, line {number}: expected numbers, got {word!r}.") from None
    if np.isinf(values).any():
        raise InputError(
            f"{path}, line {number}: expected finite numbers, got {words[int(np.isinf(values).argmax())]!r}."
        )
    return values


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _between(centres: Array, at: Array) -> tuple[NDArray[np.int64], Array]:
    """Index of the centre before each point, and the weight of the one after it."""
    inside = np.clip(at, centres[0], centres[-1])
    index = np.clip(np.searchsorted(centres, inside, side="right") - 1, 0, max(centres.size - 2, 0))
    step = centres[1] - centres[0] if centres.size > 1 else 1.0
    return index, (inside - centres[index]) / step


def _covered(raster: Raster, x: Array, y: Array) -> NDArray[np.bool_]:
    half = 0.5 * raster.size
    along = (x >= raster.x[0] - half) & (x <= raster.x[-1] + half)
    across = (y >= raster.y[0] - half) & (y <= raster.y[-1] + half)
    return along & across
