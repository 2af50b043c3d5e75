"""Grid, bed and friction of a site whose bed was surveyed: read from files, brought onto a grid along the channel."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.case.frame import Frame
from vegglue.case.resolved_config import Tree
from vegglue.case.text_files import case_name, write_text
from vegglue.errors import InputError, shown_path
from vegglue.importers.config_parts import MANNING_BED, even
from vegglue.importers.file_words import file_words
from vegglue.importers.measured_files import data_folder, record
from vegglue.importers.polygon_files import read_polygons
from vegglue.importers.site_file import FieldSite, FileOfSite
from vegglue.importers.terrain_files import Terrain, filled, read_terrain
from vegglue.site.grid import centres

# Cells across the survey, and how much longer than wide a cell is, as for a straight channel.
SURVEYED_ROWS, LENGTH_OF_CELLS = 32, 8.0 / 3.0
NO_LEVEL = -9999


@dataclass(frozen=True)
class Ground:
    """tree: keys grid, bed and friction of a case; imported: what was taken from which file."""

    tree: Tree
    imported: list[Tree]


def surveyed_bed(folder: Path, target: Path, site: FieldSite, frame: Frame | None) -> Ground:
    """The ground of a site whose `bed` names a file: `{file: dtm.tif}`, `{file: sections.csv, sections: true}`.

    `grid` (x, y, cell in m, in the frame of the model) is that of the site file, else made of the extent of the survey.
    The bed is written as bed.asc into the folder beside the config. Errors: InputError.
    """
    path = _named(folder, site.bed, "bed")
    given = dict(site.bed.model_extra or {}) if site.bed is not None else {}
    sections = bool(given.pop("sections", False))
    words = file_words(given, f"{shown_path(folder)}: `bed`")
    terrain = read_terrain(path, frame, words, sections)
    grid = _grid_of(terrain) if site.grid is None else {name: list(value) for name, value in site.grid}
    beyond = _write_bed(data_folder(target) / "bed.asc", terrain, grid)
    outside = f"; {100.0 * beyond:.0f} % of the grid lies beyond it, with the nearest level" if beyond > 0.0 else ""
    friction, imported = _friction(folder, site, frame)
    tree = {"grid": grid, "bed": [{"raster": f"{data_folder(target).name}/bed.asc"}], "friction": friction}
    return Ground(tree, [record(path, None, f"bed: {terrain.said}{outside}"), *imported])


def _named(folder: Path, given: FileOfSite | None, key: str) -> Path:
    name = given.file if given is not None else None
    if name is None or not (folder / name).is_file():
        raise InputError(
            f"{shown_path(folder)}: `{key}.file` expected a file of this folder, got {name!r}; correct it."
        )
    return folder / name


def _grid_of(terrain: Terrain) -> Tree:
    west, east, south, north = terrain.extent
    dy = (north - south) / SURVEYED_ROWS
    columns = max(even((east - west) / (dy * LENGTH_OF_CELLS)), 4)
    x, y = ([round(low, 4), round(high, 4)] for low, high in ((west, east), (south, north)))
    return {"x": x, "y": y, "cell": [(x[1] - x[0]) / columns, (y[1] - y[0]) / SURVEYED_ROWS]}


def _write_bed(path: Path, terrain: Terrain, grid: Mapping[str, Any]) -> float:
    """An ESRI ASCII grid of square cells as small as those of the grid; returns the share that no level is known of."""
    size = float(min(grid["cell"]))
    (west, east), (south, north) = grid["x"], grid["y"]
    x = centres(west - size, size, int(np.ceil((east - west) / size)) + 2)
    y = centres(south - size, size, int(np.ceil((north - south) / size)) + 2)
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y, indexing="ij"))
    level, _ = filled(terrain, at_x, at_y)
    inside = (at_x > west) & (at_x < east) & (at_y > south) & (at_y < north)
    write_text(path, _ascii(x, y, size, level.reshape(x.size, y.size)), "give another place by --to")
    return float(np.isnan(terrain.level(at_x[inside], at_y[inside])).mean())


def _ascii(x: Array, y: Array, size: float, level: Array) -> str:
    head = {"ncols": x.size, "nrows": y.size, "xllcorner": x[0] - 0.5 * size, "yllcorner": y[0] - 0.5 * size}
    head |= {"cellsize": size, "nodata_value": NO_LEVEL}
    rows = [" ".join(f"{value:.4f}" for value in row) for row in level.T[::-1]]
    return "\n".join([f"{key} {float(value):.12g}" for key, value in head.items()] + rows) + "\n"


def _friction(folder: Path, site: FieldSite, frame: Frame | None) -> tuple[Tree, list[Tree]]:
    """One class of bed, or those of a file of polygons, which share one coefficient until the user parts them."""
    friction: Tree = {"classes": {"bed": MANNING_BED}, "default": "bed"}
    if site.classes is None:
        return friction, []
    path = _named(folder, site.classes, "classes")
    zones = []
    for polygon in read_polygons(path, frame):
        name = case_name(polygon.friction_class or polygon.name)
        friction["classes"].setdefault(name, MANNING_BED)
        zones.append({"class": name, "polygon": [list(corner) for corner in polygon.corners]})
    return friction | {"zones": zones}, [record(path, None, f"friction classes: {len(zones)} polygons")]
