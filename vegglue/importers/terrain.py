"""Grid, bed and friction of a surveyed site: GeoTIFF and ESRI ASCII grids, scattered points, and cross-sections."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator, RegularGridInterpolator
from scipy.spatial import QhullError

from vegglue.arrays import Array, Mask
from vegglue.case.bed import Raster, read_raster
from vegglue.case.grid import Grid, centres
from vegglue.case.resolved_config import Tree
from vegglue.case.site_schema import CovarianceOfBed, Frame, LinesLeftOut
from vegglue.case.size_limits import MOST_CELLS
from vegglue.case.survey_error import (
    BedSurvey,
    bed_survey_text,
    covariances_beside_wrong_line,
    lines_left_out,
    mean_level,
)
from vegglue.case.text_files import case_name, told_apart
from vegglue.case.zones import beyond_slope_break, slope
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import UNITS, role_of, unit_named, words_of
from vegglue.importers.config_parts import MANNING_BED, bed_prior, even, loguniform_prior
from vegglue.importers.coordinate_systems import StatedSystem, refuse_other_system, system_of_wkt
from vegglue.importers.file_options import FileOptions, read_file_options
from vegglue.importers.import_notes import BanksOfBed, FileNote, ImportNote, Noted
from vegglue.importers.library_files import importing, read_by_library, readable_text, refuse_larger
from vegglue.importers.measured_files import data_folder, record
from vegglue.importers.measured_rows import Placement, in_the_channel, read_rows, refuse_far_places
from vegglue.importers.site_file import FieldSite, FileOfSite, SiteGrid
from vegglue.importers.stations import ONE_PLACE
from vegglue.importers.table_parser import parse_table
from vegglue.importers.vector_files import read_polygons, refuse_far_polygons, units_assumed
from vegglue.wording.numbers import listed, so_many
from vegglue.wording.sentences import phrase, sentences

# Endings of files of levels on a grid.
RASTERS = (".tif", ".tiff", ".asc", ".grd")
# How a geometry of HEC-RAS begins (.g01 and on), of which no reader is kept here.
GEOMETRY_OF_RAS = b"Geom Title="
# Tags of a GeoTIFF: size of a pixel, a point of it and its place on the map, keys, and, of GDAL, what marks no data.
PIXEL_SCALE, TIE_POINT, KEYS, NO_DATA, GDAL_METADATA = 33550, 33922, 34735, 42113, 42112
# Among the keys, in fours from the fifth number on: the one of the type of raster, and its value if a place on the map
# is that of the middle of a pixel, not of its corner; of the kind of system, and its value for degrees; of the
# system, of the units of its coordinates and of levels, and metres in these (GeoTIFF 1.1: 9002 foot, 9003 US survey).
TYPE_OF_RASTER, OF_POINTS = 1025, 2
KIND_OF_SYSTEM, OF_DEGREES, PROJECTED_SYSTEM, LENGTH_UNITS, VERTICAL_UNITS = 1024, 2, 3072, 3076, 4099
FEET = {9002: 0.3048, 9003: 1200.0 / 3937.0}
USER_DEFINED = 32767
# No river lies below the Dead Sea or above mountains [m]; a mark of no value lies so far from all levels [m].
LOWEST, HIGHEST, APART_FROM_LEVELS = -450.0, 9000.0, 20.0
FILL_VALUES = (0.0, -1.0, 255.0, -99.0, -999.0, 99.0, 999.0, -100.0, -9.0, 9.0)
SEPARATE = 2  # of a TIFF whose bands lie one behind the other, not pixel by pixel
# Levels of a raster that are sought along a centreline to know how far it reaches, for a message.
MOST_FOR_EXTENT = 5000
# What is read of a file of points; columns of anything else are not read.
ROLES_OF_BED = {"x", "y", "z", "section"}
# Points of a cross-section without a name lie within so much of the next one along the channel [m], as surveyed in a
# stream, unless most points share their x: a tape, or a flume.
SPREAD_OF_SECTION = 1.0
# Cells across the survey, and how much longer than wide a cell is. On 32 by 8/3 the error of the cells was 0.019 to
# 0.027 m/s on three drawn reaches of 84 by 15 m with nothing hidden, larger than that of their readings, and each had a
# false name; on 50 by 2 it was 0.010 to 0.014 m/s, and none had one. Chosen after these three.
SURVEYED_ROWS, LENGTH_OF_CELLS = 50, 2.0
MARK_OF_NO_LEVEL = -9999
MOST_LEVELS = 10 * MOST_CELLS  # of some eight bytes each; a case reads no larger file
# Kind and name of the file of a bed: on a straight grid, and along a centreline.
BED_FILES = (("raster", "bed.asc"), ("points", "bed.csv"))
# Most points in no line of which each is left out in turn.
MOST_LEFT_OUT = 100
# Standard deviation of a bed around its mean cross-section, or error of what is left out of its survey [m], below which
# it is a design and has no error of a survey. Chosen: no staff is read to it.
LEAST_BED_ERROR = 1e-4
BANK = "bank"
TAKEN_NAMES = ("n_b", "n_w")  # parameters of the bed and of walls
BANK_CLASS = {"law": "keulegan", "k_s": "k_s"}
# Manning's n of the bed [s m^(-1/3)]: of streams, and of flumes from plaster and glass up to cobbles.
BED_OF_STREAM, BED_OF_FLUME = (0.01, 0.2), (0.005, 0.05)


@dataclass(frozen=True)
class Ground:
    """The ground of a site as parts of a case.

    Attributes
    ----------
    tree : Tree
        Keys grid, bed and friction of a case.
    imported : list of Tree
        What was taken from which file.
    texts : mapping of str
        Of files to be written beside the config, by their paths.
    level : callable
        Of the bed, from x and y (n,) to z (n,) in the channel [m].
    parameters : Tree
        Priors of the coefficients of friction.
    """

    tree: Tree
    imported: list[Tree]
    texts: Mapping[Path, str]
    level: Callable[[Array, Array], Array]
    parameters: Tree


@dataclass(frozen=True)
class FittedSurvey:
    """Points of a survey and what they say about the bed between them."""

    survey: BedSurvey
    covariances: tuple[CovarianceOfBed, ...]
    left_out: LinesLeftOut


@dataclass(frozen=True)
class Terrain:
    """Levels of a survey in the channel.

    Attributes
    ----------
    level : callable
        From x and y (n,) to z (n,) [m], NaN beyond the survey.
    extent : (float, float, float, float)
        Least and largest x, then y, of the survey [m].
    taken : str
        What was taken from which columns.
    survey : FittedSurvey or None
        What states how wrong the levels are between its points, None of a raster and of few or very many points.
    """

    level: Callable[[Array, Array], Array]
    extent: tuple[float, float, float, float]
    taken: str
    survey: FittedSurvey | None = None


def surveyed_ground(folder: Path, target: Path, site: FieldSite, place: Placement) -> Ground:
    """The ground of a site whose `bed` names a file: `{file: dtm.tif}`, `{file: sections.csv, sections: true}`.

    `grid` (x, y, cell in m, in the frame of the model) is that of the site file, as far as it is given, and made of the
    extent of the survey.

    Parameters
    ----------
    folder : Path
        Of the measurements.
    target : Path
        Of the config; the bed belongs into the folder beside it: as bed.asc, and as points along a centreline.

    Raises
    ------
    InputError
        If the survey cannot be read, or makes no grid.
    """
    path = _file_of(folder, site.bed, "bed")
    given = dict(site.bed.model_extra or {}) if site.bed is not None else {}
    sections = bool(given.pop("sections", False))
    options = read_file_options(given, f"{shown_path(folder)}: `bed`")
    terrain = read_terrain(path, place, options, sections)
    grid = grid_of_terrain(path, terrain, site.grid, place)
    kind, file = BED_FILES[place.line is not None]
    text, beyond = _bed_text(terrain, grid, place)
    texts = {data_folder(target) / file: text}
    layer: Tree = {kind: f"{data_folder(target).name}/{file}"}
    if terrain.survey is not None:
        texts[data_folder(target) / "survey.csv"] = bed_survey_text(terrain.survey.survey)
        layer["survey"] = {
            "file": f"{data_folder(target).name}/survey.csv",
            "covariances": [one.model_dump() for one in terrain.survey.covariances],
            "left_out": terrain.survey.left_out.model_dump(),
        }
    notes: list[BanksOfBed | FileNote] = [f"bed: {terrain.taken}"]
    notes += [ImportNote(Noted.BEYOND_BED, beyond)] if beyond > 0.0 else []
    friction, imported = mapped_classes(folder, site, place)
    steeper = slope_of_banks(site)
    if steeper is not None and site.channel is not None and BANK not in friction["classes"]:
        cells = grid_of_keys(grid, place)
        at = (part.ravel() for part in np.meshgrid(cells.x, cells.y, indexing="ij"))
        level = filled(terrain, *at).reshape(cells.x.size, cells.y.size)
        banks = beyond_slope_break(slope(level, cells) > steeper, level)
        floor = float(np.mean((~banks).sum(axis=1)) * cells.dy) if banks.any() else None
        friction = with_banks(friction, steeper) if banks.any() else friction
        notes.append(BanksOfBed(steeper, floor, site.channel.bottom_width_m))
    tree = {"grid": grid, "bed": [layer], "friction": friction}
    taken = [record(path, None, "; ".join(sentences(notes))), *imported]
    return Ground(tree, taken, texts, terrain.level, friction_priors(friction, site))


def ground_on_grid(
    target: Path, terrain: Terrain, grid: Tree, friction: Tree, parameters: Tree, place: Placement
) -> Ground:
    """The ground of a terrain on a grid with this friction; its bed is written beside the config `target`."""
    kind, file = BED_FILES[place.line is not None]
    text, _ = _bed_text(terrain, grid, place)
    tree = {"grid": grid, "bed": [{kind: f"{data_folder(target).name}/{file}"}], "friction": friction}
    return Ground(tree, [], {data_folder(target) / file: text}, terrain.level, parameters)


def mapped_classes(folder: Path, site: FieldSite, place: Placement) -> tuple[Tree, list[Tree]]:
    """One class of bed, and those of a file of polygons, each with a coefficient of its own; and what was taken."""
    friction: Tree = {"classes": {"bed": MANNING_BED}, "default": "bed"}
    if site.classes is None:
        return friction, []
    path = _file_of(folder, site.classes, "classes")
    polygons = read_polygons(path, place.frame)
    refuse_far_polygons(path, polygons, place)
    zones, texts = [], [polygon.friction_class or polygon.name for polygon in polygons]
    called = told_apart({words_of(text): case_name(text, "class") for text in texts})
    for polygon, text in zip(polygons, texts, strict=True):
        name = called[words_of(text)]
        coefficient = f"n_{re.sub('[^a-z0-9]', '_', name)}"
        own = {"law": "manning", "n": f"{coefficient}_class" if coefficient in TAKEN_NAMES else coefficient}
        friction["classes"].setdefault(name, own)
        zones.append({"class": name, "polygon": [list(corner) for corner in polygon.corners]})
    notes = sentences([f"friction classes: {so_many(len(zones), 'polygon')}", units_assumed(polygons)])
    return friction | {"zones": zones}, [record(path, None, "; ".join(notes))]


def friction_priors(friction: Tree, site: FieldSite) -> Tree:
    """Priors of the coefficients of all classes: of a flume's bed between walls, else of a stream's; and of banks."""
    of_bed = bed_prior(*(BED_OF_STREAM if site.walls is None else BED_OF_FLUME))
    found = {"n_b": of_bed} | {
        one["n"]: of_bed | {"symbol": one["n"], "meaning": phrase("meaning_of_parameter", "bed_class", name)}
        for name, one in friction["classes"].items()
        if one.get("n", "n_b") != "n_b"
    }
    if BANK_CLASS in friction["classes"].values():
        found["k_s"] = loguniform_prior(0.01, 5.0, "m", "k_s", phrase("meaning_of_parameter", "banks"))
    return found


def slope_of_banks(site: FieldSite) -> float | None:
    """Half of the stated slope of the banks [-], in the middle between floor and bank; None if none is stated.

    Nearer to the floor, a surveyor's errors of some centimetres would end the floor.
    """
    if site.walls is not None or site.channel is None or site.channel.bank_slope_v_per_h is None:
        return None
    return round(0.5 * site.channel.bank_slope_v_per_h, 4)


def with_banks(friction: Tree, steeper: float) -> Tree:
    """Friction with banks beyond such a slope [-]; zones that are there already win over them."""
    zones = [{"class": BANK, "beyond_slope_break": steeper}, *friction.get("zones", [])]
    return friction | {"classes": friction["classes"] | {BANK: BANK_CLASS}, "zones": zones}


def _file_of(folder: Path, given: FileOfSite | None, key: str) -> Path:
    name = given.file if given is not None else None
    if name is None or not (folder / name).is_file():
        raise InputError(
            f"{shown_path(folder)}: `{key}.file` expected a file of this folder, got {name!r}; correct it."
        )
    return folder / name


def grid_of_terrain(path: Path, terrain: Terrain, asked: SiteGrid | None, place: Placement) -> Tree:
    """The grid of the site file, else of the extent of the survey; along a centreline no further than the line goes.

    Parameters
    ----------
    path : Path
        Of the survey, for messages.
    asked : SiteGrid or None
        What the site file states.

    Returns
    -------
    Tree
        Keys x, y and cell [m].

    Raises
    ------
    InputError
        If the bed has no extent along or across, or would have more than MOST_LEVELS levels.
    """
    west, east, south, north = terrain.extent
    given = asked or SiteGrid()
    if place.line is not None:
        west, east = max(west, 0.0), min(east, float(place.line.s[-1]))
        if given.y is None and path.suffix.lower() in RASTERS:
            raise InputError(
                f"{shown_path(path)}: expected `grid.y`, how far the grid reaches to the right and to the left of its "
                "centreline, as a raster lies on both sides of it; add it."
            )
    x = list(given.x or (round(west, 4) + 0.0, round(east, 4) + 0.0))  # no -0.0
    y = list(given.y or (round(south, 4), round(north, 4)))
    for key, (low, high) in (("x", x), ("y", y)):
        if not high > low:
            raise InputError(
                f"{shown_path(path)}: expected a bed that reaches along and across the channel, got one from {key} = "
                f"{low:g} to {high:g} m ({terrain.taken}); state `grid.{key}` in the site file, or name sections by a "
                "column `section`."
            )
    dy = (y[1] - y[0]) / SURVEYED_ROWS
    columns = max(even((x[1] - x[0]) / (dy * LENGTH_OF_CELLS)), 4)
    cell = list(given.cell or ((x[1] - x[0]) / columns, dy))
    levels = (x[1] - x[0]) / min(cell) * (y[1] - y[0]) / min(cell)
    if levels > MOST_LEVELS:
        raise InputError(
            f"{shown_path(path)}: expected a bed of at most {MOST_LEVELS:,} levels on squares as small as the cells, "
            f"got {levels:.3g}; state larger cells by `grid.cell` in the site file, or less of the bed by `grid.x` and "
            "`grid.y`."
        )
    return {"x": x, "y": y, "cell": cell}


def grid_of_keys(tree: Mapping[str, Any], place: Placement) -> Grid:
    """The cells of the keys x, y and cell of a grid."""
    (west, east), (south, north), (dx, dy) = tree["x"], tree["y"], tree["cell"]
    x, y = centres(west, dx, round((east - west) / dx)), centres(south, dy, round((north - south) / dy))
    return Grid(x, y, dx, dy, place.line)


def ascii_grid(x: Array, y: Array, size: float, values: Array, digits: int) -> str:
    """An ESRI ASCII grid of squares of this size around x (nx,) and y (ny,) [m], with the values (nx, ny)."""
    head = {"ncols": x.size, "nrows": y.size, "xllcorner": x[0] - 0.5 * size, "yllcorner": y[0] - 0.5 * size}
    head |= {"cellsize": size, "nodata_value": MARK_OF_NO_LEVEL}
    rows = [" ".join(f"{value:.{digits}f}" for value in row) for row in values.T[::-1].tolist()]
    return "\n".join([f"{key} {float(value):.12g}" for key, value in head.items()] + rows) + "\n"


def _bed_text(terrain: Terrain, grid: Mapping[str, Any], place: Placement) -> tuple[str, float]:
    """Levels on squares as small as the cells of the grid, and the share of the grid without a known level."""
    size = float(min(grid["cell"]))
    (west, east), (south, north) = grid["x"], grid["y"]
    x = centres(west - size, size, int(np.ceil((east - west) / size)) + 2)
    y = centres(south - size, size, int(np.ceil((north - south) / size)) + 2)
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y, indexing="ij"))
    level = filled(terrain, at_x, at_y)
    inside = (at_x > west) & (at_x < east) & (at_y > south) & (at_y < north)
    if place.line is None:
        text = ascii_grid(x, y, size, level.reshape(x.size, y.size), 4)
    else:
        points = np.column_stack([*place.to_case(at_x, at_y), level])
        text = "x,y,z\n" + "".join(f"{at[0]:.4f},{at[1]:.4f},{at[2]:.4f}\n" for at in points.tolist())
    return text, float(np.isnan(terrain.level(at_x[inside], at_y[inside])).mean()) if inside.any() else 0.0


def filled(terrain: Terrain, x: Array, y: Array) -> Array:
    """Levels at x and y (n,) [m], that of the nearest known one beyond the survey."""
    level = terrain.level(x, y)
    known = ~np.isnan(level)
    if not known.any():
        raise InputError(
            f"The bed ({terrain.taken}) lies at x = {terrain.extent[0]:.6g} to {terrain.extent[1]:.6g}, y = "
            f"{terrain.extent[2]:.6g} to {terrain.extent[3]:.6g} m, none of it in the grid; check `frame` and `grid`."
        )
    nearest = NearestNDInterpolator(np.column_stack([x[known], y[known]]), level[known])
    return np.where(known, level, nearest(x, y))


def read_terrain(path: Path, place: Placement, options: FileOptions, sections: bool) -> Terrain:
    """The bed in a file.

    Parameters
    ----------
    path
        A GeoTIFF, an ESRI ASCII grid, or a table of points.
    place
        Of the channel on the map.
    options
        Columns, units and coordinates of a table.
    sections
        Whether its points stand in cross-sections.

    Returns
    -------
    Terrain
        Levels in the channel, NaN beyond the survey [m].

    Raises
    ------
    InputError
        For another file, coordinate system or unit, and too few points.
    """
    if path.suffix.lower() in RASTERS:
        return terrain_of_raster(path, place)
    return terrain_of_points(path, place, options, sections)


def terrain_of_raster(path: Path, place: Placement) -> Terrain:
    """The bed in a GeoTIFF or an ESRI ASCII grid, without levels that are none, declared or not; as `read_terrain`.

    Beyond LOWEST and HIGHEST lies no river; a usual mark of no value is one if it lies further from all other levels
    than APART_FROM_LEVELS and than ten times what they span.
    """
    scaled = filled_up = ""
    if path.suffix.lower() in (".tif", ".tiff"):
        raster = read_geotiff(path, place.frame)
    else:
        if (system := path.with_suffix(".prj")).is_file():
            refuse_other_system(path, system_of_wkt(readable_text(system)), place.frame)
        raster = read_raster(path)
        beside = path.with_name(f"{path.name}.aux.xml")  # what GDAL keeps of a format that has no room for it
        if beside.is_file():
            with read_by_library(beside, "GDAL"):
                stated = dict(re.findall(r"<(Scale|Offset)>([^<]+)<", readable_text(beside)))
                scale, offset = float(stated.get("Scale", 1.0)), float(stated.get("Offset", 0.0))
            raster = replace(raster, values=raster.values * scale + offset)
            scaled = f", times {scale:g} plus {offset:g} m" if stated else ""
    values = raster.values
    wrong = np.isfinite(values) & ~((values >= LOWEST) & (values <= HIGHEST)) | np.isinf(values)
    for mark in FILL_VALUES:
        rest = values[np.isfinite(values) & ~wrong & (values != mark)]
        if rest.size and (values == mark).any():
            apart = max(float(rest.min()) - mark, mark - float(rest.max()))
            if apart > max(APART_FROM_LEVELS, 10.0 * float(np.ptp(rest))):
                wrong |= values == mark
    if wrong.any():
        marks = listed([f"{value:g}" for value in np.unique(values[wrong])[:3]])
        filled_up = f", {so_many(int(wrong.sum()), 'undeclared fill value')} left out ({marks})"
        values = np.where(wrong, np.nan, values)
    reader = RegularGridInterpolator((raster.x, raster.y), values, bounds_error=False, fill_value=np.nan)
    known = np.argwhere(~np.isnan(values))
    if not len(known):
        raise InputError("no_levels", file=path)
    shown = known if place.line is None else known[:: max(len(known) // MOST_FOR_EXTENT, 1)]
    refuse_far_places(shown_path(path), raster.x[shown[:, 0]], raster.y[shown[:, 1]], place)
    along, across = place.to_channel(raster.x[shown[:, 0]], raster.y[shown[:, 1]])
    return Terrain(
        lambda x, y: np.asarray(reader(np.column_stack(place.to_map(x, y)))),
        _extent(along, across),
        f"grid of {len(known):,} levels, {raster.size:g} m apart{scaled}{filled_up}",
    )


def terrain_of_points(path: Path, place: Placement, options: FileOptions, sections: bool) -> Terrain:
    """The bed in a table of points, which a survey has; as `read_terrain`."""
    with path.open("rb") as file:
        of_ras = file.read(len(GEOMETRY_OF_RAS)) == GEOMETRY_OF_RAS
    if of_ras:
        raise InputError(
            f"{shown_path(path)}: expected a table or a grid, got a geometry of HEC-RAS; write its cross-sections into "
            "a table with the columns section, x, y and z, x from upstream and y from the middle to the left."
        )
    points, names, taken = _surveyed_points(path, place, options)
    if sections:
        parts = _cross_sections(path, points, names)
        line = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
        survey = BedSurvey(np.concatenate(parts), line)

        def without(left: NDArray[np.int64]) -> Terrain:
            return _of_sections([part for number, part in enumerate(parts) if number != line[left[0]]], "")

        return _between_points(_of_sections(parts, taken), survey, without)

    def triangulated(points: Array) -> Terrain:
        surface = LinearNDInterpolator(points[:, :2], points[:, 2])
        return Terrain(lambda x, y: np.asarray(surface(x, y)), _extent(points[:, 0], points[:, 1]), taken)

    try:
        terrain = triangulated(points)
    except (QhullError, ValueError):
        raise InputError(
            f"{shown_path(path)}: expected at least three points that are not on one line, got {len(points)}."
        ) from None
    named = np.unique(names, return_inverse=True)[1] if names and all(names) else np.full(len(points), -1)
    survey = BedSurvey(points, named.astype(np.int64))
    return _between_points(terrain, survey, lambda left: triangulated(np.delete(points, left, axis=0)))


def _between_points(terrain: Terrain, survey: BedSurvey, without: Callable[[NDArray[np.int64]], Terrain]) -> Terrain:
    """The terrain with what its survey says about the bed between its points; its mean is the bed within the survey,
    unless straight lines predict better what is left out. without: the terrain without some rows of the survey.
    """
    if not survey.tells_its_error:
        return terrain
    points, straight = survey.points, np.full(len(survey.points), np.nan)
    single = np.flatnonzero(survey.line < 0)[:, None]
    for rows in [*survey.lines[1:-1], *single[:: len(single) // MOST_LEFT_OUT + 1]]:
        straight[rows] = points[rows, 2] - without(rows).level(points[rows, 0], points[rows, 1])
    if not np.isfinite(straight).any():
        return terrain
    try:
        covariances = tuple(covariances_beside_wrong_line(survey))
        if max(one.sd for one in covariances) < LEAST_BED_ERROR:
            return terrain
        left_out = lines_left_out(survey, covariances, straight)
    except np.linalg.LinAlgError:  # points too much alike for a covariance
        return terrain
    if left_out.error < LEAST_BED_ERROR:
        return terrain
    fitted = FittedSurvey(survey, covariances, left_out)
    if left_out.error > left_out.straight:
        return replace(terrain, survey=fitted)

    def level(x: Array, y: Array) -> Array:
        inside = ~np.isnan(terrain.level(x, y))
        found = np.full(x.size, np.nan)
        found[inside] = mean_level(survey, covariances, np.column_stack([x, y])[inside])
        return found

    return replace(terrain, level=level, survey=fitted, taken=f"{terrain.taken}; kriged between them")


def _extent(x: Array, y: Array) -> tuple[float, float, float, float]:
    return float(x.min()), float(x.max()), float(y.min()), float(y.max())


def read_geotiff(path: Path, frame: Frame | None = None) -> Raster:
    """The first band of a GeoTIFF whose rows run along the map, with the scale and offset that GDAL keeps.

    Parameters
    ----------
    path
        The file.
    frame
        Of the model on the map, whose coordinate system the file has to have.

    Returns
    -------
    Raster
        Levels [m], NaN for none.

    Raises
    ------
    InputError
        For a turned one, oblong pixels, and another system than that of the frame.

    References
    ----------
    OGC GeoTIFF 1.1 (19-008).
    """
    with importing("tifffile", path, "field", "an ESRI ASCII grid"):
        import tifffile
    with read_by_library(path, "GeoTIFF", "tifffile"), tifffile.TiffFile(path) as file:
        codecs = tifffile.tifffile.imagecodecs
        for name, decoder in (("lzw_decode", lzw_decode), ("floatpred_decode", floatpred_decode)):
            if not hasattr(codecs, name):  # as without the library imagecodecs
                setattr(codecs, name, decoder)
        page = file.pages.first
        refuse_larger(path, page.nbytes)  # before they are unpacked
        known = (PIXEL_SCALE, TIE_POINT, KEYS, NO_DATA, GDAL_METADATA)
        tags = {code: page.tags[code].value for code in known if code in page.tags}
        if PIXEL_SCALE not in tags or TIE_POINT not in tags or not 0.0 < tags[PIXEL_SCALE][0] == tags[PIXEL_SCALE][1]:
            raise InputError(
                f"{shown_path(path)}: expected a GeoTIFF with square pixels along the map (tags ModelPixelScale and "
                "ModelTiepoint), got another; warp it to its own coordinate system first."
            )
        values = np.asarray(page.asarray())
        if values.ndim == 3:
            values = values[0] if page.planarconfig == SEPARATE else values[..., 0]
        levels = values.astype(np.float64)
        if NO_DATA in tags:
            mark = np.float64(str(tags[NO_DATA]).strip("\x00 "))
            if np.issubdtype(values.dtype, np.floating):  # rounded as they are: none of float32 is -99999.9 itself
                with np.errstate(over="ignore"):  # the largest of float64 is a usual mark, too
                    mark = np.float64(mark.astype(values.dtype))
            levels = np.where(levels == mark, np.nan, levels)
        directory = tags.get(KEYS, ())
        keys = dict(zip(directory[4::4], directory[7::4], strict=False))
        number = keys.get(PROJECTED_SYSTEM, 0)
        metres = FEET.get(keys.get(LENGTH_UNITS, 0), 1.0) if keys.get(KIND_OF_SYSTEM) != OF_DEGREES else 0.0
        number = 0 if number == USER_DEFINED else number
        refuse_other_system(path, StatedSystem(number, "its GeoTIFF keys", metres), frame)
        band = dict(
            re.findall(r'<Item[^>]*sample="0"[^>]*role="(\w+)"[^>]*>([^<]*)<', str(tags.get(GDAL_METADATA, "")))
        )
        if {"scale", "offset"} & band.keys():
            levels = levels * float(band.get("scale", 1.0)) + float(band.get("offset", 0.0))
        unit = unit_named(band.get("unittype", ""), "length")
        levels = levels * (UNITS["length"][unit] if unit else FEET.get(keys.get(VERTICAL_UNITS, 0), 1.0))
        size = tags[PIXEL_SCALE][0]
        column, row, _, east, north, _ = tags[TIE_POINT][:6]
        middle = 0.0 if keys.get(TYPE_OF_RASTER) == OF_POINTS else 0.5
        x = np.array(east + (np.arange(levels.shape[1]) + middle - column) * size)
        y = np.array(north - (np.arange(levels.shape[0]) + middle - row) * size)
        if not (np.diff(x) > 0.0).all() or not (np.diff(y) < 0.0).all():
            raise ValueError(f"pixels of {size:g} m at {east:g}, {north:g} m have no places of their own")
        return Raster(x, y[::-1].copy(), size, levels[::-1].T)


def lzw_decode(data: bytes, out: object = None) -> bytes:
    """Bytes packed by the LZW of TIFF 6.0 (section 13): codes of 9 to 12 bits, the highest first; 256 clears the table,
    257 ends. One code earlier than in other LZW the codes become longer.
    """
    table: list[bytes] = []
    found: list[bytes] = []
    before, width, bits, held = b"", 9, 0, 0
    for byte in data:
        held, bits = held << 8 | byte, bits + 8
        if bits < width:
            continue
        bits -= width
        code, held = held >> bits, held & ((1 << bits) - 1)
        if code == 257:
            break
        if code == 256:
            table, width, before = [*(bytes([one]) for one in range(256)), b"", b""], 9, b""
            continue
        entry = table[code] if code < len(table) else before + before[:1]
        if before:
            table.append(before + entry[:1])
        found.append(entry)
        before = entry
        width = min(max((len(table) + 1).bit_length(), 9), 12)
    return b"".join(found)


def floatpred_decode(data: Any, axis: int = -2, dist: int = 1, out: object = None) -> Any:
    """Rows of floating-point numbers whose bytes are apart, the highest first, and differences (Adobe, TIFF note 3)."""
    rows = np.moveaxis(np.asarray(data), axis, -1)
    size, width = rows.dtype.itemsize, rows.shape[-1]
    packed = np.ascontiguousarray(rows).view(np.uint8).reshape(-1, width * size)
    planes = np.cumsum(packed, axis=1, dtype=np.uint8).reshape(-1, size, width)
    levels = np.ascontiguousarray(np.moveaxis(planes, 1, -1)).view(f">f{size}").astype(rows.dtype)
    return np.moveaxis(levels.reshape(rows.shape), -1, axis)


def _surveyed_points(path: Path, place: Placement, options: FileOptions) -> tuple[Array, list[str], str]:
    """x, y, z (points, 3) [m], the section of each if a column names it, and what was taken.

    Three columns without a heading are x, y and z.
    """
    bare = {"x": "1", "y": "2", "z": "3"}
    unnamed = not options.columns and parse_table(path, options.sheet).headings == tuple(bare.values())
    taken = read_rows(path, replace(options, columns=bare) if unnamed else options)
    if "z" not in taken.numbers and "z_bed" in taken.numbers:
        taken = taken.renamed("z_bed", "z")
    if not {"x", "y", "z"} <= taken.numbers.keys():
        headings = taken.headings
        roles = {known[0] for heading in headings if (known := role_of(heading)) is not None}
        deep = {"depth", "below"} & roles or any("depth" in words_of(heading).split() for heading in headings)
        raise InputError("no_bed_columns", file=path, got=headings, deep=deep and "z" not in roles)
    on_map = Placement() if options.coordinates == "channel" else place
    refuse_far_places(shown_path(path), taken.numbers["x"], taken.numbers["y"], on_map)
    taken = in_the_channel(taken, place, options)
    points = np.column_stack([taken.numbers[role] for role in "xyz"])
    there: Mask = np.asarray(np.isfinite(points).all(axis=1))
    if not there.any():
        raise InputError(f"{shown_path(path)}: expected points with x, y and z, got none; check the columns.")
    summary = taken.not_reading(*(taken.columns.keys() - ROLES_OF_BED)).summary
    return points[there], list(taken.only(there).texts.get("section", [])), summary


def _cross_sections(path: Path, points: Array, names: list[str]) -> list[Array]:
    """The points (n, 3) of each cross-section, along the channel, and in each one from the right to the left [m].

    As a column names them; else those of one x, if most points share theirs, or those within SPREAD_OF_SECTION.
    InputError for a section without a width, and for two at one place along the channel.
    """
    ordered = np.argsort(points[:, 0], kind="stable")
    if names and all(names):
        parts = [points[np.array(names) == name] for name in dict.fromkeys(names)]
    else:
        steps = np.diff(points[ordered, 0])
        gap = ONE_PLACE if 2 * ((steps > ONE_PLACE).sum() + 1) <= len(points) else SPREAD_OF_SECTION
        parts = np.split(points[ordered], np.flatnonzero(steps > gap) + 1)
    parts.sort(key=lambda part: float(part[:, 0].mean()))
    for part in parts:
        if not np.ptp(part[:, 1]) > 0.0:
            raise InputError(
                f"{shown_path(path)}: expected two or more points across in each cross-section, got one at x = "
                f"{part[0, 0]:.6g} m; name sections by a column `section`, or take it out."
            )
    middles = np.array([part[:, 0].mean() for part in parts])
    if (np.diff(middles) <= ONE_PLACE).any():
        raise InputError(
            f"{shown_path(path)}: expected cross-sections at places of their own along the channel, got two at x = "
            f"{middles[:-1][np.diff(middles) <= ONE_PLACE][0]:.6g} m; give both one name, or take one out."
        )
    return [part[np.argsort(part[:, 1], kind="stable")] for part in parts]


def _of_sections(sections: Sequence[Array], taken: str) -> Terrain:
    """z(x, eta) linear along the channel between neighbouring sections, at one share eta of their widths.

    eta = (y - y_left) / (y_right - y_left); so that a thalweg is carried on from one section to the next, where a
    triangulation would make steps of it.
    """
    along = np.array([section[:, 0].mean() for section in sections])
    ends = np.array([[section[0, 1], section[-1, 1]] for section in sections])
    shares = [(section[:, 1] - section[0, 1]) / (section[-1, 1] - section[0, 1]) for section in sections]

    def level(x: Array, y: Array) -> Array:
        low, high = (np.interp(x, along, ends[:, side]) for side in (0, 1))
        share = (y - low) / (high - low)
        each = np.array([np.interp(share, own, section[:, 2]) for own, section in zip(shares, sections, strict=True)])
        one = len(along) == 1
        after = np.zeros(x.size, int) if one else np.clip(np.searchsorted(along, x), 1, len(along) - 1)
        before = np.maximum(after - 1, 0)
        span = np.where(after > before, along[after] - along[before], 1.0)
        weight = np.clip((x - along[before]) / span, 0.0, 1.0) * (after > before)
        cells = np.arange(x.size)
        found = (1.0 - weight) * each[before, cells] + weight * each[after, cells]
        return np.where((share >= 0.0) & (share <= 1.0), found, np.nan)

    extent = (float(along.min()), float(along.max()), float(ends[:, 0].min()), float(ends[:, 1].max()))
    return Terrain(level, extent, f"{taken}, in {so_many(len(sections), 'cross-section')}")
