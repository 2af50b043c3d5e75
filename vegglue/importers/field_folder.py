"""A field team's folder -> a case: a site file and its measurements, wide priors, sensible defaults.

site.json or site.yaml says channel (length_m, bottom_width_m, bank_slope_v_per_h, bed_slope; z = 0 on the floor at
x = 0, y = 0 on the axis) or bed (a survey; see surveyed_bed.py), patches (x, y, stems_per_m2, or a file of polygons),
walls of a flume, canopy_height_guess_m, eddy_viscosity_m2_s and eddy_viscosity_factor, which it is good to,
experiments (discharge_m3_s, downstream_level_m), and, where needed, frame and grid (site_file.py), its centreline
(drawn_centreline.py) and files (file_words.py). What is not said there is left at the defaults below.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vegglue.case.frame import Frame
from vegglue.case.resolved_config import Tree
from vegglue.case.text_files import case_name, told_apart
from vegglue.case.zones import BANK_SLOPE
from vegglue.errors import InputError, shown_path
from vegglue.importers.banks import bank_break, roughness_of_banks, with_banks
from vegglue.importers.config_parts import (
    FIRST_LOOK,
    MANNING_BED,
    MODEL_ERROR_OF_FLUME,
    VISCOSITY,
    bed_prior,
    even,
    loguniform_prior,
    normal_prior,
    validated,
    viscosity_prior,
    wall_prior,
)
from vegglue.importers.drawn_centreline import drawn_centreline
from vegglue.importers.field_site import Channel, FieldSite, FileOfSite, MeasuredFlow, PlantedPatch, SiteGrid
from vegglue.importers.measured_files import held_out_files, measured_files, record, texts_of_tables
from vegglue.importers.placement import Placement
from vegglue.importers.polygon_files import planted_in_words, planted_polygons
from vegglue.importers.site_file import read_site, site_file
from vegglue.importers.standing_water import refuse_standing_water
from vegglue.importers.surveyed_bed import Ground, surveyed_bed

# Cells across the floor, and how much longer than wide a cell is: patches of some metres with 16 cells across are as
# well resolved as by cells of half that length (open-a and open-e change by less than 0.3 mm/s).
CELLS_ACROSS, LENGTHENED = 16, 8.0 / 3.0
# A shorter channel than wide still has an even number of cells along it, as many as the schema wants.
FEWEST_COLUMNS = 4
# Dry bank kept above the highest water level [m].
FREEBOARD = 0.35
# Bank slope of a bed without banks, whose grid ends where its floor does.
OF_NO_BANK = 1.0
# Relative error of a canopy height estimated by eye.
BY_EYE = 0.12


@dataclass(frozen=True)
class FolderCase:
    """tree: keys and values of a config; texts: of the files beside it that it names, by their paths."""

    tree: Tree
    texts: Mapping[Path, str]


def case_from_folder(folder: Path, target: Path) -> FolderCase:
    """The config of the measurements in a folder, and the files it comes with, named relative to `target`.

    Errors: InputError when the site file or every file of measurements is missing or says too little.
    """
    site = read_site(site_file(folder))
    refuse_standing_water(site_file(folder), site)
    frame = site.frame.frame if site.frame is not None else None
    given = site.grid.centreline if site.grid is not None else None
    drawn = drawn_centreline(folder, given, frame) if given is not None else None
    place = Placement(frame, drawn.line if drawn is not None else None)
    patches, drawn_patches = _patches(folder, site.patches, frame)
    measured = measured_files(folder, target, site, place, _used_elsewhere(site))
    held_out = held_out_files(folder, target, site, place)
    unknown = _viscosity(site)
    ground = _ground(folder, target, site, place)
    measured.imported.extend([*ground.imported, *drawn_patches])
    tree: Tree = {
        "name": case_name(folder.resolve().name),
        "title": f"Measurements of {folder.resolve().name}",
        **ground.tree,
        "inflows": {"upstream": {"side": "west", "spread": "conveyance"}},
        "outlet": {},
        "eddy_viscosity": VISCOSITY if unknown else site.eddy_viscosity_m2_s,
        "experiments": {name: _experiment(given) for name, given in site.experiments.items()},
        "parameters": PARAMETERS | roughness_of_banks(ground.tree["friction"]) | unknown,
        "observations": measured.observations,
        **FIRST_LOOK,
    }
    if site.walls is not None:
        tree |= _as_flume(tree, site.walls.n)
    if held_out.observations:
        tree |= validated({name: _experiment(given) for name, given in site.holdout.items()}, held_out.observations)
        measured.imported.extend(held_out.imported)
    if drawn is not None:
        tree["grid"]["centreline"] = drawn.shape
        said = folder / given.file if isinstance(given, FileOfSite) else site_file(folder)
        measured.imported.insert(0, record(said, None, drawn.taken) | {"columns": drawn.columns, "units": drawn.units})
    if patches:
        tree["plants"] = _plants(patches)
        tree["parameters"] |= {"phi": PHI, "canopy_height": _canopy(site.canopy_height_guess_m)}
    texts = {**ground.texts, **texts_of_tables(target, [*measured.tables, *held_out.tables])}
    kept = {"frame": frame.model_dump(exclude_none=True) | {"origin": list(frame.origin)}} if frame is not None else {}
    return FolderCase(tree | kept | ({"imported": measured.imported} if measured.imported else {}), texts)


def _used_elsewhere(site: FieldSite) -> list[str]:
    """Files that the site file names and that hold no measurements."""
    line = site.grid.centreline if site.grid is not None else None
    files = [one.file for one in (site.bed, site.classes, *site.patches) if one is not None and one.file is not None]
    return files + ([line.file] if isinstance(line, FileOfSite) and line.file is not None else [])


def _ground(folder: Path, target: Path, site: FieldSite, place: Placement) -> Ground:
    """Grid, bed and friction: of a survey, or of a channel by its numbers."""
    if site.bed is not None or site.channel is None:
        return surveyed_bed(folder, target, site, place)
    grid = _grid(site, site.channel, place)
    friction: Tree = {"classes": {"bed": MANNING_BED}, "default": "bed"}
    if (steeper := bank_break(site)) is not None:
        friction = with_banks(friction, min(BANK_SLOPE, steeper))
    bed = [{"trapezoid": _trapezoid(site.channel, grid["x"][0])}]
    return Ground({"grid": grid, "bed": bed, "friction": friction}, [], {})


def _as_flume(tree: Tree, wall: float) -> Tree:
    """Side walls of Manning's n about `wall`, a smoother bed than a stream's, and one that is known better."""
    return {
        "friction": tree["friction"] | {"walls": {"law": "manning", "n": "n_w"}},
        "parameters": tree["parameters"] | {"n_b": BED_OF_FLUME, "n_w": wall_prior(wall)},
        **MODEL_ERROR_OF_FLUME,
    }


def _patches(folder: Path, given: Sequence[PlantedPatch], frame: Frame | None) -> tuple[list[PlantedPatch], list[Tree]]:
    """The patches of a site file, and those of the files of polygons that it names, with what was taken from these."""
    found: list[PlantedPatch] = []
    imported: list[Tree] = []
    for one in given:
        if one.file is None:
            found.append(one)
            continue
        if not (folder / one.file).is_file():
            raise InputError(f"{shown_path(folder)}: `patches` names {one.file}, which is not there; correct it.")
        polygons = planted_polygons(folder / one.file, frame, one.columns)
        imported.append(record(folder / one.file, None, planted_in_words(polygons)))
        for polygon in polygons:
            density = polygon.density if polygon.density is not None else one.stems_per_m2
            corners = tuple(polygon.corners)
            found.append(PlantedPatch(name=polygon.name, polygon=corners, stems_per_m2=density))
    return found, imported


PARAMETERS: Tree = {"n_b": bed_prior(0.01, 0.2)}
# Of plaster and glass up to cobbles.
BED_OF_FLUME = bed_prior(0.005, 0.05)
PHI = loguniform_prior(0.02, 100.0, "-", "φ", "drag of the densest patches")


def _viscosity(site: FieldSite) -> Tree:
    """The prior of the eddy viscosity by its name; none where it is taken for right."""
    stated, factor = site.eddy_viscosity_m2_s, site.viscosity_factor
    return {VISCOSITY: viscosity_prior(stated, factor)} if factor > 1 else {}


def _canopy(guess: float) -> Tree:
    return normal_prior(
        guess, round(BY_EYE * guess, 4), "m", "h_d", "height of the canopy, estimated by eye",
        low=round(0.4 * guess, 4), high=round(1.8 * guess, 4),
    )  # fmt: skip


def _trapezoid(channel: Channel, upstream: float) -> Tree:
    """With z = 0 on the floor at x = 0, wherever the grid begins [m]."""
    return {
        "axis": 0.0,
        "bottom_width": channel.bottom_width_m,
        "bank_slope": round(channel.bank_slope_v_per_h or OF_NO_BANK, 6),
        "bed_slope": channel.bed_slope,
        "level": 0.0 - channel.bed_slope * upstream,
    }


def _grid(site: FieldSite, channel: Channel, place: Placement) -> Tree:
    """What the site file says, else cells that fit the floor, as wide as the water can get, or as the walls let it."""
    given = site.grid or SiteGrid()
    along = float(place.line.s[-1]) if place.line is not None else 0.0
    x = list(given.x or (0.0, round(along, 4) if channel.length_m is None else channel.length_m))
    length, width = x[1] - x[0], channel.bottom_width_m
    fall = channel.bed_slope * length
    highest = max(one.downstream_level_m for one in (*site.experiments.values(), *site.holdout.values()))
    # The surface upstream may stand as much above the outlet's as the bed does, and friction adds to it.
    depth = highest + fall + max(fall, 0.1 * highest) + FREEBOARD
    dy = width / CELLS_ACROSS
    bank = channel.bank_slope_v_per_h
    beside = math.ceil(depth / bank / dy / 2) * 2 if bank is not None and site.walls is None else 0
    half = round(0.5 * width + beside * dy, 6)
    y = list(given.y or (-half, half))
    if given.y is not None:
        dy = (y[1] - y[0]) / max(even((y[1] - y[0]) / dy), FEWEST_COLUMNS)
    columns = max(even(length / (dy * LENGTHENED)), FEWEST_COLUMNS)
    return {"x": x, "y": y, "cell": list(given.cell or (length / columns, dy))}


def _experiment(given: MeasuredFlow) -> Tree:
    return {"discharge": given.discharge_m3_s, "level": given.downstream_level_m}


def _plants(patches: Sequence[PlantedPatch]) -> Tree:
    densest = max(patch.stems_per_m2 for patch in patches)
    stand = {"phi": "phi", "canopy_height": "canopy_height", "bare_chezy": 60.0, "stems": densest}
    told = {f"p{number}": patch for number, patch in enumerate(patches, 1)}
    names = told_apart({place: case_name(patch.name or place, place) for place, patch in told.items()})
    rows = [
        {"name": names[place], "stand": "plants", **_shape(patch), "stems": patch.stems_per_m2}
        for place, patch in told.items()
    ]
    return {"stands": {"plants": stand}, "patches": rows}


def _shape(patch: PlantedPatch) -> Tree:
    if patch.polygon is not None:
        return {"polygon": [list(corner) for corner in patch.polygon]}
    return {"x": list(patch.x or ()), "y": list(patch.y or ())}
