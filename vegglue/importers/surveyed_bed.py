"""Grid, bed and friction of a site whose bed was surveyed: read from files, brought onto a grid along the channel."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.case.grid import Grid, centres
from vegglue.case.resolved_config import Tree
from vegglue.case.size_limits import MOST_CELLS
from vegglue.case.text_files import case_name
from vegglue.errors import InputError, shown_path
from vegglue.importers.banks import BANK, bank_break, found_banks, with_banks
from vegglue.importers.config_parts import MANNING_BED, even
from vegglue.importers.field_site import FieldSite, FileOfSite, SiteGrid
from vegglue.importers.file_words import file_words
from vegglue.importers.measured_files import data_folder, record
from vegglue.importers.placement import Placement
from vegglue.importers.polygon_files import read_polygons, units_taken
from vegglue.importers.terrain_files import RASTERS, Terrain, filled, read_terrain

# Cells across the survey, and how much longer than wide a cell is, as for a straight channel.
SURVEYED_ROWS, LENGTH_OF_CELLS = 32, 8.0 / 3.0
NO_LEVEL = -9999
MOST_LEVELS = 10 * MOST_CELLS  # of some eight bytes each; a case reads no larger file


@dataclass(frozen=True)
class Ground:
    """tree: keys grid, bed and friction of a case; imported: what was taken from which file; texts: of files to be
    written beside the config, by their paths.
    """

    tree: Tree
    imported: list[Tree]
    texts: Mapping[Path, str]


def surveyed_bed(folder: Path, target: Path, site: FieldSite, place: Placement) -> Ground:
    """The ground of a site whose `bed` names a file: `{file: dtm.tif}`, `{file: sections.csv, sections: true}`.

    `grid` (x, y, cell in m, in the frame of the model) is that of the site file, as far as it says, and made of the
    extent of the survey. The bed belongs into the folder beside the config: as bed.asc, and as points along a
    centreline. Errors: InputError.
    """
    path = _named(folder, site.bed, "bed")
    given = dict(site.bed.model_extra or {}) if site.bed is not None else {}
    sections = bool(given.pop("sections", False))
    words = file_words(given, f"{shown_path(folder)}: `bed`")
    terrain = read_terrain(path, place, words, sections)
    grid = _grid_of(path, terrain, site.grid or SiteGrid(), place)
    layer = {"raster": "bed.asc"} if place.line is None else {"points": "bed.csv"}
    (file,) = layer.values()
    text, beyond = _bed_text(terrain, grid, place)
    outside = f"; {100.0 * beyond:.0f} % of the grid lies beyond it, with the nearest level" if beyond > 0.0 else ""
    friction, imported = _friction(folder, site, place)
    friction, banks = _banked(friction, site, terrain, grid, place)
    named = {form: f"{data_folder(target).name}/{name}" for form, name in layer.items()}
    tree = {"grid": grid, "bed": [named], "friction": friction}
    return Ground(
        tree,
        [record(path, None, f"bed: {terrain.said}{outside}{banks}"), *imported],
        {data_folder(target) / file: text},
    )


def _named(folder: Path, given: FileOfSite | None, key: str) -> Path:
    name = given.file if given is not None else None
    if name is None or not (folder / name).is_file():
        raise InputError(
            f"{shown_path(folder)}: `{key}.file` expected a file of this folder, got {name!r}; correct it."
        )
    return folder / name


def _grid_of(path: Path, terrain: Terrain, given: SiteGrid, place: Placement) -> Tree:
    """What the site file says, else the extent of the survey; along a centreline no further than the line goes."""
    west, east, south, north = terrain.extent
    if place.line is not None:
        west, east = max(west, 0.0), min(east, float(place.line.s[-1]))
        if given.y is None and path.suffix.lower() in RASTERS:
            raise InputError(
                f"{shown_path(path)}: expected `grid.y`, how far the grid reaches to the right and to the left of its "
                "centreline, as a raster lies on both sides of it; add it."
            )
    x, y = (list(one or (round(low, 4), round(high, 4))) for one, low, high in (
        (given.x, west, east), (given.y, south, north)))  # fmt: skip
    for key, (low, high) in (("x", x), ("y", y)):
        if not high > low:
            raise InputError(
                f"{shown_path(path)}: expected a bed that reaches along and across the channel, got one from {key} = "
                f"{low:g} to {high:g} m ({terrain.said}); say `grid.{key}` in the site file, or name sections by a "
                "column `section`."
            )
    dy = (y[1] - y[0]) / SURVEYED_ROWS
    columns = max(even((x[1] - x[0]) / (dy * LENGTH_OF_CELLS)), 4)
    cell = list(given.cell or ((x[1] - x[0]) / columns, dy))
    levels = (x[1] - x[0]) / min(cell) * (y[1] - y[0]) / min(cell)
    if levels > MOST_LEVELS:
        raise InputError(
            f"{shown_path(path)}: expected a bed of at most {MOST_LEVELS:,} levels on squares as small as the cells, "
            f"got {levels:.3g}; say larger cells by `grid.cell` in the site file, or less of the bed by `grid.x` and "
            "`grid.y`."
        )
    return {"x": x, "y": y, "cell": cell}


def _bed_text(terrain: Terrain, grid: Mapping[str, Any], place: Placement) -> tuple[str, float]:
    """Levels on squares as small as the cells of the grid, and the share of the grid that no level is known of."""
    size = float(min(grid["cell"]))
    (west, east), (south, north) = grid["x"], grid["y"]
    x = centres(west - size, size, int(np.ceil((east - west) / size)) + 2)
    y = centres(south - size, size, int(np.ceil((north - south) / size)) + 2)
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y, indexing="ij"))
    level, _ = filled(terrain, at_x, at_y)
    inside = (at_x > west) & (at_x < east) & (at_y > south) & (at_y < north)
    if place.line is None:
        text = _ascii(x, y, size, level.reshape(x.size, y.size))
    else:
        rows = np.column_stack([*place.to_case(at_x, at_y), level])
        text = "x,y,z\n" + "".join(f"{at[0]:.4f},{at[1]:.4f},{at[2]:.4f}\n" for at in rows.tolist())
    return text, float(np.isnan(terrain.level(at_x[inside], at_y[inside])).mean()) if inside.any() else 0.0


def _ascii(x: Array, y: Array, size: float, level: Array) -> str:
    head = {"ncols": x.size, "nrows": y.size, "xllcorner": x[0] - 0.5 * size, "yllcorner": y[0] - 0.5 * size}
    head |= {"cellsize": size, "nodata_value": NO_LEVEL}
    rows = [" ".join(f"{value:.4f}" for value in row) for row in level.T[::-1]]
    return "\n".join([f"{key} {float(value):.12g}" for key, value in head.items()] + rows) + "\n"


def _banked(friction: Tree, site: FieldSite, terrain: Terrain, grid: Tree, place: Placement) -> tuple[Tree, str]:
    """Friction with the banks that the site file states, as far as the survey has them, and what is said of them."""
    steeper = bank_break(site)
    if steeper is None or site.channel is None or BANK in friction["classes"]:
        return friction, ""
    cells = _cells(grid, place)
    at = (part.ravel() for part in np.meshgrid(cells.x, cells.y, indexing="ij"))
    level, _ = filled(terrain, *at)
    found, said = found_banks(level.reshape(cells.x.size, cells.y.size), cells, site.channel, steeper)
    return (with_banks(friction, steeper) if found else friction), f"; {said}"


def _cells(grid: Tree, place: Placement) -> Grid:
    (west, east), (south, north), (dx, dy) = grid["x"], grid["y"], grid["cell"]
    along, across = centres(west, dx, round((east - west) / dx)), centres(south, dy, round((north - south) / dy))
    return Grid(along, across, dx, dy, place.line)


def _friction(folder: Path, site: FieldSite, place: Placement) -> tuple[Tree, list[Tree]]:
    """One class of bed, or those of a file of polygons, which share one coefficient until the user parts them."""
    friction: Tree = {"classes": {"bed": MANNING_BED}, "default": "bed"}
    if site.classes is None:
        return friction, []
    path = _named(folder, site.classes, "classes")
    zones = []
    polygons = read_polygons(path, place.frame)
    for polygon in polygons:
        name = case_name(polygon.friction_class or polygon.name)
        friction["classes"].setdefault(name, MANNING_BED)
        zones.append({"class": name, "polygon": [list(corner) for corner in polygon.corners]})
    said = "; ".join([f"friction classes: {len(zones)} polygons", *units_taken(polygons)])
    return friction | {"zones": zones}, [record(path, None, said)]
