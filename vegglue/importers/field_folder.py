"""A field team's folder -> a case: a site file and its measurements, wide priors, sensible defaults.

site.json or site.yaml has channel (length_m, bottom_width_m, bank_slope_v_per_h, bed_slope; floor_level_m at x = 0,
else z = 0 there; y = 0 on the axis) or bed (a survey; see terrain.py), patches (x, y, stems_per_m2, or a file of
polygons), walls of a flume, canopy_height_guess_m, eddy_viscosity_m2_s and eddy_viscosity_factor, which it is good to,
experiments (discharge_m3_s, downstream_level_m), and, if needed, frame and grid (site_file.py), its centreline
(vector_files.py) and files (file_options.py). What is not stated there is left at the defaults below.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.case.config import load_case, read_tree
from vegglue.case.grid import centreline_in
from vegglue.case.gridded_site import build_site, cells_at
from vegglue.case.resolved_config import Tree
from vegglue.case.text_files import case_name, told_apart
from vegglue.case.zones import BANK_SLOPE
from vegglue.effects.physical_constants import GRAVITY
from vegglue.errors import InputError, path_from, shown_path
from vegglue.importers.config_parts import (
    FIRST_LOOK,
    MODEL_ERROR_OF_FLUME,
    PLACE_OF_VERTICAL,
    POLYGON_SIDES,
    VISCOSITY,
    even,
    loguniform_prior,
    normal_prior,
    validated,
    viscosity_prior,
    wall_prior,
)
from vegglue.importers.measured_files import held_out_measurements, measured_files, record, texts_of_tables
from vegglue.importers.measured_rows import Placement
from vegglue.importers.result_site import SiteOfResult, ground_of_result, site_of
from vegglue.importers.site_file import Channel, FieldSite, FileOfSite, MeasuredFlow, PlantedPatch, SiteGrid, site_file
from vegglue.importers.terrain import (
    BANK,
    Ground,
    friction_priors,
    mapped_classes,
    slope_of_banks,
    surveyed_ground,
    with_banks,
)
from vegglue.importers.vector_files import (
    drawn_placement,
    planted_polygons,
    refuse_crossing,
    refuse_far_polygons,
    summary_of_plants,
)
from vegglue.measurements.plausibility import DEEPEST_CHANNEL, STANDING_WATER
from vegglue.wording.sentences import phrase

# Cells across the floor, and how much longer than wide a cell is: patches of some metres with 16 cells across are as
# well resolved as by cells of half that length (open-a and open-e change by less than 0.3 mm/s).
CELLS_ACROSS, LENGTHENED = 16, 8.0 / 3.0
# A shorter channel than wide still has an even number of cells along it, as many as the schema wants.
FEWEST_COLUMNS = 4
# Dry bank kept above the highest water level [m].
FREEBOARD = 0.35
# Bank slope of a bed without banks, whose grid ends where its floor does.
OF_NO_BANK = 1.0
# Key of the site file in a sheet of `vegglue plan` that names the config it is of.
OF_SHEET = "case"
# Relative error of a canopy height estimated by eye.
BY_EYE = 0.12
# Transverse mixing over h u* [-] (Fischer et al. 1979, chapter 5): of straight flumes and of streams. Points each
# way at which the bed is sampled for it.
MIXING_OF_FLUME, MIXING_OF_STREAM, SAMPLED = 0.15, 0.6, 48


@dataclass(frozen=True)
class FolderCase:
    """A folder of measurements as a case that is not written yet.

    Attributes
    ----------
    tree : Tree
        Keys and values of the config.
    texts : mapping of str
        Of the files beside it that it names, by their paths.
    """

    tree: Tree
    texts: Mapping[Path, str]


def case_from_folder(folder: Path, target: Path) -> FolderCase:
    """The config of the measurements in a folder.

    Parameters
    ----------
    folder
        With a site file and tables.
    target
        The config to be written; files beside it are named relative to it.

    Returns
    -------
    FolderCase
        Keys and values, and the files that belong to them. Nothing is written.

    Raises
    ------
    InputError
        If the site file or every file of measurements is missing, or states too little.
    """
    path, found = site_file(folder), site_of(folder)
    site = found.site if isinstance(found, SiteOfResult) else found
    _refuse_standing_water(path, site)
    drawn, place = drawn_placement(folder, site)
    frame, given = place.frame, site.grid.centreline if site.grid is not None else None
    patches, drawn_patches = _patches(folder, site.patches, place)
    # Files that the site file names and that hold no measurements.
    used = [one.file for one in (site.bed, site.classes, *site.patches) if one is not None and one.file is not None]
    used += [given.file] if isinstance(given, FileOfSite) else []
    finished: Tree = {}
    if isinstance(found, SiteOfResult):
        ground, finished = ground_of_result(target, found)
        used += [one.name for one in found.paths.values()]
    elif site.bed is not None or site.channel is None:
        ground = surveyed_ground(folder, target, site, place)
    else:
        ground = _straight_ground(folder, site, site.channel, place)
    measured = measured_files(folder, target, site, place, used, ground.level)
    held_out = held_out_measurements(folder, target, site, place, ground.level)
    stated, factor = site.eddy_viscosity_m2_s, site.viscosity_factor
    if "eddy_viscosity_m2_s" not in site.model_fields_set:
        stated = usual_viscosity(site, ground)
    of_viscosity = {VISCOSITY: viscosity_prior(stated, factor)} if factor > 1 else {}
    measured.imported.extend([*ground.imported, *drawn_patches])
    tree: Tree = {
        "name": case_name(folder.resolve().name),
        "title": phrase("title_of_case", "folder", folder.resolve().name),
        **ground.tree,
        "inflows": {"upstream": {"side": "west", "spread": "conveyance"}},
        "outlet": {},
        "eddy_viscosity": VISCOSITY if factor > 1 else stated,
        "experiments": {name: _experiment(flow) for name, flow in site.experiments.items()},
        "parameters": ground.parameters | of_viscosity,
        "observations": measured.observations,
        **FIRST_LOOK,
    }
    if finished:
        tree["finished_result"] = finished
    if site.walls is not None:  # a smoother bed than a stream's, and one that is known better
        tree["friction"] = tree["friction"] | {"walls": {"law": "manning", "n": "n_w"}}
        tree["parameters"] = tree["parameters"] | {"n_w": wall_prior(site.walls.n)}
        tree |= MODEL_ERROR_OF_FLUME
    elif site.bed is not None:  # of a natural reach, surveyed outdoors
        walked = any(patch.polygon is not None for patch in patches)
        usual = {"probes": PLACE_OF_VERTICAL} | ({"edges": POLYGON_SIDES} if walked else {})
        tree["model_error"] = tree["model_error"] | usual
    if site.exclude:
        tree["exclude"] = dict(site.exclude)
    if held_out.observations:
        tree |= validated({name: _experiment(flow) for name, flow in site.holdout.items()}, held_out.observations)
        measured.imported.extend(held_out.imported)
    if drawn is not None:
        tree["grid"]["centreline"] = drawn.shape
        source = folder / given.file if isinstance(given, FileOfSite) else path
        measured.imported.insert(
            0, record(source, None, drawn.taken) | {"columns": drawn.columns, "units": drawn.units}
        )
    if patches:
        plants, priors = _plants(patches, site.canopy_height_guess_m)
        tree["plants"], tree["parameters"] = plants, tree["parameters"] | priors
    texts = {**ground.texts, **texts_of_tables(target, [*measured.tables, *held_out.tables])}
    kept = {"frame": frame.model_dump(exclude_none=True) | {"origin": list(frame.origin)}} if frame is not None else {}
    return FolderCase(tree | kept | ({"imported": measured.imported} if measured.imported else {}), texts)


def usual_viscosity(site: FieldSite, ground: Ground) -> float:
    """nu = a h u* [m2/s], a = 0.15 between walls and 0.6 in streams, u* = (g h S)^(1/2), to two digits; the mean of the
    experiments.

    h is the depth where water stands, with a surface parallel to the floor but nowhere below the outlet's, and S what
    n = 0.011 between walls and 0.035 in streams needs, S = (n U)^2 / h^(4/3), U = Q / A.
    """
    (west, east), (south, north), (dx, dy) = (ground.tree["grid"][key] for key in ("x", "y", "cell"))
    x = np.linspace(west + 0.5 * dx, east - 0.5 * dx, SAMPLED)
    y = np.linspace(south + 0.5 * dy, north - 0.5 * dy, SAMPLED)
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y, indexing="ij"))
    bed = np.asarray(ground.level(at_x, at_y)).reshape(SAMPLED, SAMPLED)
    share, n = (MIXING_OF_FLUME, 0.011) if site.walls is not None else (MIXING_OF_STREAM, 0.035)
    known = np.isfinite(bed).any(axis=1)
    floor, found = np.nanmin(bed[known], axis=1), []
    for flow in site.experiments.values():
        surface = np.maximum(flow.downstream_level_m, floor + flow.downstream_level_m - floor[-1])
        depth = np.nan_to_num(np.maximum(surface[:, None] - bed[known], 0.0))
        if not (depth > 0.0).any():
            continue
        h, area = float(depth[depth > 0.0].mean()), float(depth.mean() * (north - south))
        found.append(share * GRAVITY**0.5 * n * flow.discharge_m3_s / area * h ** (5.0 / 6.0))
    return float(f"{np.mean(found):.2g}") if found else site.eddy_viscosity_m2_s


def _refuse_standing_water(path: Path, site: FieldSite) -> None:
    """h = z - z_0 + S L at the outlet, U = Q / (h (b + h / m)), b the width of the floor and m the slope of the banks.

    InputError for an experiment that is more than twice as deep there as its floor is wide, and all but stands: its
    level is as a rule one above the sea. A grid that held it would be as wide as the lake.
    """
    channel = site.channel
    if channel is None or site.bed is not None:
        return
    for key, flows in (("experiments", site.experiments), ("holdout", site.holdout)):
        for name, flow in flows.items():
            depth = flow.downstream_level_m - channel.floor_level_m + channel.bed_slope * (channel.length_m or 0.0)
            has_banks = channel.bank_slope_v_per_h and site.walls is None
            beside = depth / channel.bank_slope_v_per_h if has_banks and channel.bank_slope_v_per_h else 0.0
            area = depth * (channel.bottom_width_m + beside)
            speed = flow.discharge_m3_s / area if area > 0.0 else 0.0
            if depth > DEEPEST_CHANNEL * channel.bottom_width_m and speed < STANDING_WATER:
                raise InputError(
                    f"{shown_path(path)}: `{key}.{name}` expected a level near the floor, at "
                    f"{channel.floor_level_m:g} m where x = 0, got {flow.downstream_level_m:g} m (outlet {depth:.3g} m "
                    f"deep at {speed:.1g} m/s); write the level of that floor as `channel.floor_level_m`."
                )


def case_of_sheet(folder: Path) -> Path | None:
    """The config that a sheet of `vegglue plan` is of, as its site file names it; None of any other folder."""
    path = site_file(folder)
    tree = read_tree(path) if path.name == "site.yaml" and path.is_file() else {}
    named = tree.get(OF_SHEET)
    return folder / named if isinstance(named, str) else None


def case_from_sheet(folder: Path, target: Path, config: Path) -> FolderCase:
    """A child of the case that a sheet is of, with what was filled in as its measurements.

    Options of a table are those of its name: it may have been saved in another format, or be of what was not measured.

    Parameters
    ----------
    folder : Path
        Of the sheet.
    target, config : Path
        Of the child, and of the case.

    Raises
    ------
    InputError
        If the config is not there, or nothing was filled in.
    """
    path = site_file(folder)
    if not config.is_file():
        raise InputError(
            f"{shown_path(path)}: `{OF_SHEET}` expected the config that this sheet was planned with, got {config}, "
            "which is not there; correct its path."
        )
    case = load_case(config)
    options = {Path(name).stem: one for name, one in (read_tree(path).get("files") or {}).items()}
    given = {one.name: options[one.stem] for one in sorted(folder.iterdir()) if one.stem in options}
    site = FieldSite.model_construct(experiments=dict.fromkeys(case.experiments), holdout={}, files=given)
    ground = build_site(case)

    def level(along: Array, across: Array) -> Array:
        return np.asarray(ground.bed[cells_at(ground, along, across)])

    place = Placement(case.frame, centreline_in(case))
    measured = measured_files(folder, target, site, place, (), level)
    tree: Tree = {
        "extends": path_from(target.resolve().parent, config.resolve()),
        "name": case_name(target.stem),
        "observations": measured.observations,
        "imported": measured.imported,
        "planned": None,
    }
    return FolderCase(tree, texts_of_tables(target, measured.tables))


def _patches(folder: Path, given: Sequence[PlantedPatch], place: Placement) -> tuple[list[PlantedPatch], list[Tree]]:
    """The patches of a site file, and those of the files of polygons that it names, with what was taken from these."""
    found: list[PlantedPatch] = []
    imported: list[Tree] = []
    for number, one in enumerate(given):
        if one.file is None:
            refuse_crossing(f"{shown_path(site_file(folder))}: `patches[{number}]`", one.polygon or ())
            found.append(one)
            continue
        if not (folder / one.file).is_file():
            raise InputError("not_there", folder=folder, key="patches", name=one.file)
        polygons = planted_polygons(folder / one.file, place.frame, one.columns)
        refuse_far_polygons(folder / one.file, polygons, place)
        imported.append(record(folder / one.file, None, summary_of_plants(polygons)))
        for polygon in polygons:
            density = polygon.density if polygon.density is not None else one.stems_per_m2
            corners = tuple(polygon.corners)
            found.append(PlantedPatch(name=polygon.name, polygon=corners, stems_per_m2=density))
    return found, imported


def _plants(patches: Sequence[PlantedPatch], guess: float) -> tuple[Tree, Tree]:
    """The key `plants` of a case, of one stand, and the priors of its phi and of its height, which is guessed [m]."""
    canopy = normal_prior(
        guess, round(BY_EYE * guess, 4), "m", "h_d", phrase("meaning_of_parameter", "canopy_height"),
        low=round(0.4 * guess, 4), high=round(1.8 * guess, 4),
    )  # fmt: skip
    phi = loguniform_prior(0.02, 100.0, "-", "φ", phrase("meaning_of_parameter", "phi"))
    numbered = {f"p{number}": patch for number, patch in enumerate(patches, 1)}
    names = told_apart({number: case_name(patch.name or number, number) for number, patch in numbered.items()})
    rows = []
    for number, patch in numbered.items():
        shape: Tree = {"x": list(patch.x or ()), "y": list(patch.y or ())}
        if patch.polygon is not None:
            shape = {"polygon": [list(corner) for corner in patch.polygon]}
        rows.append({"name": names[number], "stand": "plants", **shape, "stems": patch.stems_per_m2})
    densest = max(patch.stems_per_m2 for patch in patches)
    stand = {"phi": "phi", "canopy_height": "canopy_height", "bare_chezy": 60.0, "stems": densest}
    return {"stands": {"plants": stand}, "patches": rows}, {"phi": phi, "canopy_height": canopy}


def _straight_ground(folder: Path, site: FieldSite, channel: Channel, place: Placement) -> Ground:
    """Grid, bed and friction of a channel by its numbers.

    The grid is that of the site file, else of cells that fit the floor, as wide as the water can get, or as the walls
    let it.
    """
    given = site.grid or SiteGrid()
    along = float(place.line.s[-1]) if place.line is not None else 0.0
    x = list(given.x or (0.0, round(along, 4) if channel.length_m is None else channel.length_m))
    length, width = x[1] - x[0], channel.bottom_width_m
    fall = channel.bed_slope * length
    floor = channel.floor_level_m
    highest = max(one.downstream_level_m for one in (*site.experiments.values(), *site.holdout.values())) - floor
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
    trapezoid = {
        "axis": 0.0,
        "bottom_width": channel.bottom_width_m,
        "bank_slope": round(channel.bank_slope_v_per_h or OF_NO_BANK, 6),
        "bed_slope": channel.bed_slope,
        "level": floor - channel.bed_slope * x[0],
    }
    friction, imported = mapped_classes(folder, site, place)
    if (steeper := slope_of_banks(site)) is not None and BANK not in friction["classes"]:
        friction = with_banks(friction, min(BANK_SLOPE, steeper))
    grid = {"x": x, "y": y, "cell": list(given.cell or (length / columns, dy))}

    def level(along: Array, across: Array) -> Array:
        """z = z_0 - S x + m max(|y| - b / 2, 0)."""
        bank_rise = np.maximum(np.abs(across) - 0.5 * channel.bottom_width_m, 0.0) * trapezoid["bank_slope"]
        return floor - channel.bed_slope * along + bank_rise

    tree = {"grid": grid, "bed": [{"trapezoid": trapezoid}], "friction": friction}
    return Ground(tree, imported, {}, level, friction_priors(friction, site))


def _experiment(given: MeasuredFlow) -> Tree:
    return {"discharge": given.discharge_m3_s, "level": given.downstream_level_m}
