"""Bed level of each cell, from the layers of a case: trapezoids, ESRI ASCII grids and scattered survey points."""

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.grid import Grid, centres, places_on_map
from vegglue.case.schema import Case
from vegglue.case.site_schema import BedLayer, CovarianceOfBed, SurveyOfBed
from vegglue.case.size_limits import LARGEST_DATA
from vegglue.case.survey_error import FEWEST_SURVEYED, MOST_SURVEYED, BedSurvey, mean_level
from vegglue.case.text_files import read_text
from vegglue.errors import InputError, shown_path
from vegglue.memoised import memoised

FORTRAN_EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[-+]?\d)")  # 3.7D-01
# Keys of the header of an ESRI ASCII grid, in lower case.
HEADER = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "dx", "dy", "nodata_value")
# Words for no level, as some programs write into the header and among the values.
WORDS_FOR_NO_LEVEL = re.compile(r"\b(null|nodata|na|nan)\b", re.IGNORECASE)
# Distance at most of places between which what a survey says of the bed follows cubic splines, over the shortest
# length of its covariances [-]. On 150 x 50 cells, lengths from 2.8 and 2.3 m, lines every 12 m, the mean error over
# a Gaussian of 1 m (0.5 m) half width has a standard deviation 0.3 % (1.5 %) below that of the whole covariance, and
# 1.1 % (2.4 %) with a place in each cell: there MOST_OF_SQUARE_ROOT columns are spent on what no station sees.
SPACING = 0.5
# Kriged means that are kept in memory, of a bed and without the level of a line on each grid of a calibration.
MOST_MEANS_KEPT = 16


@dataclass(frozen=True)
class Raster:
    """Values of a raster at its centres.

    Attributes
    ----------
    x, y
        (nx,) and (ny,), both rising [m].
    size
        Of a cell [m].
    values
        (nx, ny), NaN where the file has no data.
    """

    x: Array
    y: Array
    size: float
    values: Array


def read_raster(path: Path) -> Raster:
    """The raster in an ESRI ASCII grid: a header, then rows of values from north (largest y) to south.

    Raises
    ------
    InputError
        Naming file and line, if the header or the values are incomplete or no numbers.
    """
    lines, header, first = read_text(path, LARGEST_DATA).splitlines(), dict[str, float](), 0
    while first < len(lines) and (words := lines[first].split()) and words[0].lower() in HEADER:
        if len(words) != 2:
            raise InputError(
                f"{path}, line {first + 1}: expected `{words[0]}` and one number, got {lines[first]!r}; correct it."
            )
        key = words[0].lower()
        if key == "nodata_value" and WORDS_FOR_NO_LEVEL.fullmatch(words[1]):
            header[key] = math.nan
        else:
            header[key] = _number(path, first + 1, words[1].replace(",", "."), words[0])
        first += 1
    if "cellsize" not in header and header.get("dx") == header.get("dy"):
        header["cellsize"] = header.get("dx", 0.0)
    for key in ("ncols", "nrows", "cellsize"):
        if header.get(key, 0.0) <= 0:
            raise InputError(
                f"{path}: expected an ESRI ASCII grid whose header has a `{key}` above 0, got {header or 'no header'}; "
                "export it anew."
            )
        if key != "cellsize" and header[key] != int(header[key]):
            raise InputError(
                f"{path}: expected a whole number of cells as `{key}`, got {header[key]:g}; correct the header."
            )
    columns, rows, size = int(header["ncols"]), int(header["nrows"]), header["cellsize"]
    corner = {}
    for axis in "xy":
        if f"{axis}llcorner" not in header and f"{axis}llcenter" not in header:
            raise InputError(
                f"{path}: expected `{axis}llcorner` or `{axis}llcenter` in the header, got neither; add one."
            )
        corner[axis] = header.get(f"{axis}llcorner", header.get(f"{axis}llcenter", 0.0) - 0.5 * size)
    found = [np.empty(0)]  # a line at a time, so that a large file takes little more than its numbers do
    for number, line in enumerate(lines[first:], first + 1):
        try:
            found.append(_levels_in(line))
        except ValueError as error:
            word = str(error).rpartition(": ")[2]
            raise InputError(f"{path}, line {number}: expected numbers, got {word}; correct it.") from None
        if np.isinf(found[-1]).any():
            word = line.split()[int(np.isinf(found[-1]).argmax())]
            raise InputError(f"{path}, line {number}: expected finite numbers, got {word!r}; correct it.")
    values = np.concatenate(found)
    if len(values) != rows * columns:
        raise InputError(
            f"{path}: expected nrows x ncols = {rows * columns} values after the header, got {len(values)}; export it "
            "anew."
        )
    values = values.reshape(rows, columns)[::-1].T
    values = np.where(values == header.get("nodata_value", -9999.0), np.nan, values)
    return Raster(centres(corner["x"], size, columns), centres(corner["y"], size, rows), size, values)


def _levels_in(line: str) -> Array:
    """The numbers of a line [m]. Errors: ValueError for what is none."""
    try:
        return np.array(line.split(), dtype=np.float64)
    except ValueError:  # decimal commas, exponents of Fortran, words for no level: rare, and slow to look for
        plain = WORDS_FOR_NO_LEVEL.sub("nan", FORTRAN_EXPONENT.sub("e", line.replace(",", ".")))
        return np.array(plain.split(), dtype=np.float64)


def _bilinear(raster: Raster, x: Array, y: Array) -> Array:
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
    """Values of the raster cells in which places lie; NaN outside.

    Parameters
    ----------
    x, y : (nx, 1), (1, ny), or both (nx, ny) [m]
    """
    i = np.clip(np.rint((x - raster.x[0]) / raster.size).astype(int), 0, raster.x.size - 1)
    j = np.clip(np.rint((y - raster.y[0]) / raster.size).astype(int), 0, raster.y.size - 1)
    return np.where(_covered(raster, x, y), raster.values[i, j], np.nan)


def survey_levels(path: Path, x: Array, y: Array) -> Array:
    """z linear on the Delaunay triangles of surveyed points, (nx, ny) [m]; NaN outside their hull.

    Parameters
    ----------
    path : Path
        A table of x, y, z.
    x, y : (nx, 1), (1, ny), or both (nx, ny) [m]

    Raises
    ------
    InputError
        If the file cannot be read, or all points lie on one line.
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


def read_points(path: Path, columns: Sequence[str] = ("x", "y", "z")) -> Array:
    """Columns of a CSV file, (points, columns) [m].

    Raises
    ------
    InputError
        For a missing column or number.
    """
    lines = (line for line in read_text(path, LARGEST_DATA).splitlines() if line.strip() and not line.startswith("#"))
    points = []
    try:
        rows = csv.DictReader(lines)
        if any(name not in (rows.fieldnames or ()) for name in columns):
            wanted = f"{', '.join(columns[:-1])} and {columns[-1]}"
            found = ", ".join(rows.fieldnames or ["none"])
            raise InputError(f"{path}: expected the columns {wanted}, got {found}; correct the heading.")
        for number, row in enumerate(rows, 1):
            if any(text.strip() for text in row.get(None, ())):  # where `csv` keeps what goes beyond the heading
                raise InputError(
                    f"{path}, data row {number}: expected as many fields as in the heading, got more; write numbers "
                    "with a decimal point."
                )
            points.append([_number(path, number, row[name], name) for name in columns])
    except csv.Error as error:
        raise InputError(f"{path}: expected a CSV table, which cannot be read ({error}); check it.") from None
    return np.array(points).reshape(-1, len(columns))


def read_bed_survey(path: Path, loose: Sequence[int] = ()) -> BedSurvey:
    """The columns x, y, z and line of a CSV file.

    Parameters
    ----------
    loose : sequence of int
        See `BedSurvey`.

    Raises
    ------
    InputError
        For what is no number, or too few or too many points.
    """
    points = read_points(path, (*"xyz", "line"))
    if not FEWEST_SURVEYED <= len(points) <= MOST_SURVEYED:
        raise InputError(
            f"{shown_path(path)}: expected {FEWEST_SURVEYED} to {MOST_SURVEYED} points, got {len(points)}; take "
            "`survey` out of the config."
        )
    return BedSurvey(points[:, :3], points[:, 3].astype(np.int64), tuple(loose))


def _number(path: Path, row: int, text: str | None, name: str) -> float:
    try:
        number = float(FORTRAN_EXPONENT.sub("e", text or ""))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{path}, data row {row}: expected a number in m in column {name}, got {text!r}; correct it.")
    return number


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


def layer_levels(layer: BedLayer, grid: Grid, upstream: float) -> Array:
    """z_b of one layer, (nx, ny) [m]; NaN for no data.

    A trapezoid has z_b = level - S (x - x_0) + s min(max(|y - axis| - b/2, 0), (B - b)/2), with floor b and top B [m].
    Relevelled lines of a survey change it by what the kriged mean changes by without their levels.

    Parameters
    ----------
    upstream : [m]
        x_0, that of the upstream edge of the case.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    if layer.trapezoid is not None:
        channel = layer.trapezoid
        out = np.abs(grid.y - channel.axis) - 0.5 * channel.bottom_width
        reach = np.inf if channel.top_width is None else 0.5 * (channel.top_width - channel.bottom_width)
        bank = channel.bank_slope * np.clip(out, 0.0, reach)
        return np.asarray((channel.level - channel.bed_slope * (grid.x - upstream))[:, None] + bank[None, :])
    if layer.raster is not None:
        level = _bilinear(read_raster(layer.raster), *places_on_map(grid))
    elif layer.points is not None:
        level = survey_levels(layer.points, *places_on_map(grid))
    else:
        return np.full((grid.x.size, grid.y.size), np.nan)
    if (survey := layer.survey) is not None and survey.relevelled:
        now, places = surveyed(survey), cell_places(grid)
        as_before = replace(now, loose=survey.loose)
        without, before = (kept_mean_level(one, survey.covariances, places) for one in (now, as_before))
        level = level + (without - before).reshape(level.shape)
    return level


kept_mean_level = memoised(MOST_MEANS_KEPT)(mean_level)  # it is part of the bed, and of its error


def surveyed(survey: SurveyOfBed) -> BedSurvey:
    """The survey of a layer as it counts now.

    Raises
    ------
    InputError
        If its file cannot be read.
    """
    return read_bed_survey(survey.file, (*survey.loose, *survey.relevelled))


def all_places(x: Array, y: Array) -> Array:
    """x along and y across (nx ny, 2) [m] of all places with x (nx,) and y (ny,)."""
    return np.column_stack([part.ravel() for part in np.meshgrid(x, y, indexing="ij")])


def cell_places(grid: Grid) -> Array:
    """x along and y across of cell centres (nx ny, 2) [m]."""
    return all_places(grid.x, grid.y)


def spline_places(grid: Grid, covariances: Sequence[CovarianceOfBed]) -> tuple[Array, Array]:
    """Places from edge to edge of a grid from which `to_cells` follows a bed of such covariances.

    SPACING of their shortest length apart, or as many as there are cells.

    Returns
    -------
    x, y : (a,), (b,) [m]
    """

    def places(centres: Array, size: float, lengths: Sequence[float]) -> Array:
        low, high = centres[0] - 0.5 * size, centres[-1] + 0.5 * size
        count = min(math.ceil((high - low) / (SPACING * min(lengths))) + 1, centres.size)
        return np.linspace(low, high, max(count, 2)).round(9)

    along, across = ([getattr(one, axis) for one in covariances] for axis in ("along", "across"))
    return places(grid.x, grid.dx, along), places(grid.y, grid.dy, across)


def to_cells(values: Array, x: Array, y: Array, grid: Grid) -> Array:
    """Cubic splines through values at places, at all cells (nx ny, k), in the single precision that a bed has.

    Parameters
    ----------
    values : (a b, k)
    x, y : (a,), (b,) [m]
        See `spline_places`.
    """
    from scipy.interpolate import make_interp_spline  # late: a case without a survey need not wait for it

    along, across = (
        make_interp_spline(there, np.eye(there.size), min(3, there.size - 1))(centres).astype("float32")
        for there, centres in ((x, grid.x), (y, grid.y))
    )
    field = values.reshape(x.size, y.size, -1).astype("float32")
    return np.einsum("xa,yb,abk->xyk", along, across, field, optimize=True).reshape(grid.x.size * grid.y.size, -1)


def bed_levels(case: Case, grid: Grid, experiment: str = "") -> Array:
    """z_b at the centres of any grid, (nx, ny) [m]: of each cell that of the last layer that has data.

    Parameters
    ----------
    experiment : str
        Whose own layers come after those of the case, if it is named and has some.

    Raises
    ------
    InputError
        If no layer has data, or a file cannot be read.
    """
    bed = np.full((grid.x.size, grid.y.size), np.nan)
    own = case.experiments[experiment].bed if experiment in case.experiments else None
    for layer in (*case.bed, *(own or ())):
        level = layer_levels(layer, grid, case.grid.x[0])
        bed = np.where(np.isnan(level), bed, level)
    if np.isnan(bed).any():
        i, j = np.argwhere(np.isnan(bed))[0]
        raise InputError(
            f"{shown_path(case.source)}: `bed` gives no level to {np.isnan(bed).sum()} of {bed.size} cells, the first "
            f"at x = {grid.x[i]:g}, y = {grid.y[j]:g} m: add a layer that covers them, or shrink `grid`."
        )
    return bed
