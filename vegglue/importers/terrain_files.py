"""Beds from files, brought onto the channel: GeoTIFF and ESRI ASCII grids, scattered points, and cross-sections."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator, RegularGridInterpolator
from scipy.spatial import QhullError

from vegglue.arrays import Array, Mask
from vegglue.case.terrain import Raster, read_raster
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import role_of, words_of
from vegglue.importers.file_words import FileWords
from vegglue.importers.library_files import read_by_library, refuse_larger
from vegglue.importers.loose_table import read_loosely
from vegglue.importers.measured_rows import in_the_channel, read_rows, taken_in_words
from vegglue.importers.nameless_sections import ONE_PLACE
from vegglue.importers.placement import Placement

# Endings of files of levels on a grid.
RASTERS = (".tif", ".tiff", ".asc", ".grd")
# How a geometry of HEC-RAS begins (.g01 and on), of which no reader is kept here.
GEOMETRY_OF_RAS = b"Geom Title="
# Tags of a GeoTIFF: size of a pixel, a point of it and its place on the map, keys, and, of GDAL, what marks no data.
PIXEL_SCALE, TIE_POINT, KEYS, NO_DATA = 33550, 33922, 34735, 42113
# Among the keys, in fours from the fifth number on: the one of the type of raster, and its value where a place on the
# map is that of the middle of a pixel, not of its corner.
TYPE_OF_RASTER, OF_POINTS = 1025, 2
SEPARATE = 2  # of a TIFF whose bands lie one behind the other, not pixel by pixel
Tags = dict[int, tuple[float, ...]]
# Levels of a raster that are sought along a centreline to tell how far it reaches: it is told in words only.
MOST_FOR_EXTENT = 5000
# What is read of a file of points; columns of anything else are told as not read.
ROLES_OF_BED = {"x", "y", "z", "section"}
# Points of a cross-section without a name lie within so much of the next one along the channel [m], as surveyed in a
# stream, unless most points share their x: a tape, or a flume.
SPREAD_OF_SECTION = 1.0


@dataclass(frozen=True)
class Terrain:
    """Levels of a survey in the channel. level: from x and y (n,) to z (n,) [m], NaN beyond the survey; extent: least
    and largest x, then y, of the survey [m]; said: what was taken from where.
    """

    level: Callable[[Array, Array], Array]
    extent: tuple[float, float, float, float]
    said: str


def read_terrain(path: Path, place: Placement, words: FileWords, sections: bool) -> Terrain:
    """The bed in a file, by what kind of file it is. sections: whether its points stand in cross-sections.

    Errors: InputError for what cannot be read.
    """
    ending = path.suffix.lower()
    if ending in RASTERS:
        return _of_raster(read_geotiff(path) if ending in (".tif", ".tiff") else read_raster(path), place)
    with path.open("rb") as file:
        of_ras = file.read(len(GEOMETRY_OF_RAS)) == GEOMETRY_OF_RAS
    if of_ras:
        raise InputError(
            f"{shown_path(path)}: expected a table or a grid, got a geometry of HEC-RAS; write its cross-sections into "
            "a table with the columns section, x, y and z, x from upstream and y from the middle to the left."
        )
    points, names, said = _points(path, place, words)
    return _of_sections(_sections(path, points, names), said) if sections else _of_points(path, points, said)


def read_geotiff(path: Path) -> Raster:
    """The first band of a GeoTIFF whose rows run along the map. Errors: InputError for another or a turned one."""
    try:
        import tifffile
    except ImportError:
        raise InputError(
            f"{shown_path(path)}: GeoTIFFs are read by tifffile, which is not installed; run "
            "`pip install 'vegglue[field]'`, or save it as an ESRI ASCII grid."
        ) from None
    with read_by_library(path, "a GeoTIFF", "tifffile"), tifffile.TiffFile(path) as file:
        page = file.pages.first
        refuse_larger(path, page.nbytes)  # before they are unpacked
        known = (PIXEL_SCALE, TIE_POINT, KEYS, NO_DATA)
        tags = {code: page.tags[code].value for code in known if code in page.tags}
        if PIXEL_SCALE not in tags or TIE_POINT not in tags or not 0.0 < tags[PIXEL_SCALE][0] == tags[PIXEL_SCALE][1]:
            raise InputError(
                f"{shown_path(path)}: expected a GeoTIFF with square pixels along the map (tags ModelPixelScale and "
                "ModelTiepoint), got another; warp it to its own coordinate system first."
            )
        values = np.asarray(page.asarray())
        if values.ndim == 3:
            values = values[0] if page.planarconfig == SEPARATE else values[..., 0]
        return _north_up(_without_marks(values, tags), tags)


def _without_marks(values: NDArray[Any], tags: Tags) -> Array:
    """Levels [m], NaN where there is none. The mark is rounded as they are: none of float32 is -99999.9 itself."""
    levels = values.astype(np.float64)
    if NO_DATA not in tags:
        return levels
    mark = np.float64(str(tags[NO_DATA]).strip("\x00 "))
    if np.issubdtype(values.dtype, np.floating):
        with np.errstate(over="ignore"):  # the largest of float64 is a usual mark, too
            mark = np.float64(mark.astype(values.dtype))
    return np.where(levels == mark, np.nan, levels)


def _north_up(values: Array, tags: Tags) -> Raster:
    size = tags[PIXEL_SCALE][0]
    column, row, _, east, north, _ = tags[TIE_POINT][:6]
    middle = 0.0 if _is_of_points(tags) else 0.5
    x = np.array(east + (np.arange(values.shape[1]) + middle - column) * size)
    y = np.array(north - (np.arange(values.shape[0]) + middle - row) * size)
    if not (np.diff(x) > 0.0).all() or not (np.diff(y) < 0.0).all():
        raise ValueError(f"pixels of {size:g} m at {east:g}, {north:g} m have no places of their own")
    return Raster(x, y[::-1].copy(), size, values[::-1].T)


def _is_of_points(tags: Tags) -> bool:
    keys = tags.get(KEYS, ())
    return any(key == TYPE_OF_RASTER and value == OF_POINTS for key, value in zip(keys[4::4], keys[7::4], strict=False))


def _of_raster(raster: Raster, place: Placement) -> Terrain:
    reader = RegularGridInterpolator((raster.x, raster.y), raster.values, bounds_error=False, fill_value=np.nan)

    def level(x: Array, y: Array) -> Array:
        return np.asarray(reader(np.column_stack(place.to_map(x, y))))

    known = np.argwhere(~np.isnan(raster.values))
    shown = known if place.line is None else known[:: max(len(known) // MOST_FOR_EXTENT, 1)]
    along, across = place.to_channel(raster.x[shown[:, 0]], raster.y[shown[:, 1]])
    return Terrain(level, _extent(along, across), f"grid of {len(known):,} levels, {raster.size:g} m apart")


def _points(path: Path, place: Placement, words: FileWords) -> tuple[Array, list[str], str]:
    """x, y, z (points, 3) [m], the section of each where a column names it, and what was taken.

    Three columns without a heading are x, y and z.
    """
    bare = {"x": "1", "y": "2", "z": "3"}
    unnamed = not words.columns and read_loosely(path, words.sheet).headings == tuple(bare.values())
    taken = read_rows(path, replace(words, columns=bare) if unnamed else words)
    if not {"x", "y", "z"} <= taken.numbers.keys():
        headings = [*taken.columns.values(), *taken.others]
        raise InputError(
            f"{shown_path(path)}: expected columns of x, y and z, got {', '.join(headings)}; {_naming(headings)}."
        )
    taken = in_the_channel(taken, place, words)
    points = np.column_stack([taken.numbers[role] for role in "xyz"])
    there: Mask = np.asarray(np.isfinite(points).all(axis=1))
    if not there.any():
        raise InputError(f"{shown_path(path)}: expected points with x, y and z, got none; check the columns.")
    said = taken_in_words(taken.leaving(*(taken.columns.keys() - ROLES_OF_BED)))
    return points[there], list(taken.only(there).texts.get("section", [])), said


def _naming(headings: Sequence[str]) -> str:
    """What to do about the columns of a bed that are not known."""
    roles = {known[0] for heading in headings if (known := role_of(heading)) is not None}
    deep = {"depth", "below"} & roles or any("depth" in words_of(heading).split() for heading in headings)
    if deep and "z" not in roles:
        return (
            "take depths off the level of the water above them, and call that z (or off the datum that they count from)"
        )
    return (
        "name them in its entry of the site file, `bed: {file: ..., columns: {x: Chainage, y: Station, z: Elevation}}` "
        "(1, 2 and 3 where there is no heading), with `flip: [x, y]` and `zero: [40, 5]` where x counts upstream from "
        "an end at 40 m and y from a left bank 5 m off the axis"
    )


def _of_points(path: Path, points: Array, said: str) -> Terrain:
    """Linear between the points of a triangulation, as levels of survey points are read anywhere."""
    try:
        surface = LinearNDInterpolator(points[:, :2], points[:, 2])
    except (QhullError, ValueError):
        raise InputError(
            f"{shown_path(path)}: expected at least three points that are not on one line, got {len(points)}."
        ) from None
    return Terrain(lambda x, y: np.asarray(surface(x, y)), _extent(points[:, 0], points[:, 1]), said)


def _sections(path: Path, points: Array, names: list[str]) -> list[Array]:
    """The points (n, 3) of each cross-section, along the channel, and in each one from the right to the left [m].

    As a column names them; else those of one x, where most points share theirs, or those within SPREAD_OF_SECTION.
    Errors: InputError for sections that make no bed.
    """
    ordered = np.argsort(points[:, 0], kind="stable")
    if names and all(names):
        parts = [points[np.array(names) == name] for name in dict.fromkeys(names)]
    else:
        steps = np.diff(points[ordered, 0])
        gap = ONE_PLACE if 2 * ((steps > ONE_PLACE).sum() + 1) <= len(points) else SPREAD_OF_SECTION
        parts = np.split(points[ordered], np.flatnonzero(steps > gap) + 1)
    parts.sort(key=lambda part: float(part[:, 0].mean()))
    _refuse_no_bed(path, parts)
    return [part[np.argsort(part[:, 1], kind="stable")] for part in parts]


def _refuse_no_bed(path: Path, sections: list[Array]) -> None:
    """Errors: InputError for a section without a width, and for two at one place along the channel."""
    for part in sections:
        if not np.ptp(part[:, 1]) > 0.0:
            raise InputError(
                f"{shown_path(path)}: expected two or more points across in each cross-section, got one at x = "
                f"{part[0, 0]:.6g} m; name sections by a column `section`, or take it out."
            )
    middles = np.array([part[:, 0].mean() for part in sections])
    if (np.diff(middles) <= ONE_PLACE).any():
        raise InputError(
            f"{shown_path(path)}: expected cross-sections at places of their own along the channel, got two at x = "
            f"{middles[:-1][np.diff(middles) <= ONE_PLACE][0]:.6g} m; give both one name, or take one out."
        )


def _of_sections(sections: list[Array], said: str) -> Terrain:
    """z(x, eta) linear along the channel between neighbouring sections, at one share eta of their widths.

    eta = (y - y_left) / (y_right - y_left); so that a thalweg is carried on from one section to the next, where a
    triangulation would make steps of it.
    """
    along = np.array([section[:, 0].mean() for section in sections])
    ends = np.array([[section[0, 1], section[-1, 1]] for section in sections])

    def level(x: Array, y: Array) -> Array:
        low, high = (np.interp(x, along, ends[:, side]) for side in (0, 1))
        share = (y - low) / (high - low)
        each = np.array([np.interp(share, _shares(section), section[:, 2]) for section in sections])
        after = (
            np.clip(np.searchsorted(along, x), 1, max(len(along) - 1, 1)) if len(along) > 1 else np.zeros(x.size, int)
        )
        before = np.maximum(after - 1, 0)
        span = np.where(after > before, along[after] - along[before], 1.0)
        weight = np.clip((x - along[before]) / span, 0.0, 1.0) * (after > before)
        cells = np.arange(x.size)
        found = (1.0 - weight) * each[before, cells] + weight * each[after, cells]
        return np.where((share >= 0.0) & (share <= 1.0), found, np.nan)

    extent = (float(along.min()), float(along.max()), float(ends[:, 0].min()), float(ends[:, 1].max()))
    return Terrain(level, extent, f"{said}, in {len(sections)} cross-sections")


def _shares(section: Array) -> Array:
    return np.asarray((section[:, 1] - section[0, 1]) / (section[-1, 1] - section[0, 1]))


def filled(terrain: Terrain, x: Array, y: Array) -> tuple[Array, float]:
    """Levels at x and y (n,) [m], that of the nearest known one beyond the survey; and the share beyond it [-]."""
    level = terrain.level(x, y)
    known = ~np.isnan(level)
    if not known.any():
        raise InputError(
            f"The bed ({terrain.said}) lies at x = {terrain.extent[0]:.6g} to {terrain.extent[1]:.6g}, y = "
            f"{terrain.extent[2]:.6g} to {terrain.extent[3]:.6g} m, none of it in the grid; check `frame` and `grid`."
        )
    nearest = NearestNDInterpolator(np.column_stack([x[known], y[known]]), level[known])
    return np.where(known, level, nearest(x, y)), float(1.0 - known.mean())


def _extent(x: Array, y: Array) -> tuple[float, float, float, float]:
    return float(x.min()), float(x.max()), float(y.min()), float(y.max())
