"""The site of a finished result: what the site file leaves out is taken from the flow of another model.

The grid covers its mesh along a straight channel, or along the centreline that the site file draws; bed, friction
classes, discharge and outlet level are those of the result.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError
from scipy.interpolate import LinearNDInterpolator

from vegglue.arrays import Array
from vegglue.case.grid import Grid, centres
from vegglue.case.resolved_config import Tree
from vegglue.case.text_files import case_name, told_apart
from vegglue.errors import InputError, shown_path
from vegglue.importers.config_parts import MANNING_BED, bed_prior, lognormal_prior
from vegglue.importers.finished_results import holds_result, read_result
from vegglue.importers.import_notes import FlowTaken
from vegglue.importers.measured_files import data_folder, record
from vegglue.importers.measured_rows import Placement
from vegglue.importers.model_result import ModelResult
from vegglue.importers.site_file import FieldSite, ResultEntry, read_keys, read_site, site_file, site_refusal
from vegglue.importers.terrain import Ground, Terrain, ascii_grid, grid_of_keys, grid_of_terrain, ground_on_grid
from vegglue.importers.vector_files import drawn_placement
from vegglue.measurements.their_flow import TheirFlow, text_of_flow
from vegglue.wording.numbers import in_digits
from vegglue.wording.sentences import phrase, sentences

# Name of the experiment of a result if the site file names none.
ONLY_EXPERIMENT = "run"
# Below this angle [degrees] a result without a coordinate system is taken to lie along the channel already.
ALONG_ALREADY = 0.5
# A mesh so much longer than wide [-] shows the axis of the channel; else the flow does.
ELONGATED = 2.0
# Direction of the flow through a section, off the axis of the grid [degrees], beyond which a straight grid is refused.
MOST_OFF_AXIS = 30.0
# Spread of the discharge along the channel over its mean [-], beyond which a result is refused: water enters, the flow
# is not at rest, or the grid cuts the river. Chosen: interpolation loses some per cent.
MOST_SPREAD = 0.15
# Land kept beside the water, over its width [-].
LAND_BESIDE = 0.1
# Values of Manning's n that differ by less [-] are one class, and the most classes; more values are grouped.
ONE_CLASS, MOST_CLASSES = 0.05, 5
# Share of the wet places from which a value is a class of its own [-].
OWN_CLASS = 0.1
# Spread of the logarithm of n of a class of several: a factor of 1.5, as between the rows of Chow (1959, table 5-6).
LOG_SD_OF_CLASS = round(math.log(1.5), 4)
TRIES_ALONG = 12
# The result in a file, by its path and the time of its last change.
read_once = lru_cache(maxsize=8)(lambda path, changed: read_result(path))


@dataclass(frozen=True, eq=False)
class PlacedResult:
    """A finished result in the channel.

    Attributes
    ----------
    flow : TheirFlow
        In the channel.
    corners : ndarray (k, 2)
        Of the mesh, in the channel [m].
    manning : ndarray (n,) or None
        Manning's n [s m^(-1/3)].
    """

    result: ModelResult
    flow: TheirFlow
    corners: Array
    manning: Array | None


@dataclass(frozen=True, eq=False)
class SiteOfResult:
    """The site file with what a finished result adds to it.

    Attributes
    ----------
    paths : mapping of Path
        Of the results, by experiment.
    placed : mapping of PlacedResult
        By experiment.
    terrain : Terrain
        The bed of the first.
    """

    site: FieldSite
    place: Placement
    paths: Mapping[str, Path]
    placed: Mapping[str, PlacedResult]
    stated: ResultEntry
    terrain: Terrain
    grid: Tree


def site_of(folder: Path) -> SiteOfResult | FieldSite:
    """The site of a folder: that of its site file, completed by a result if the folder holds one.

    Raises
    ------
    InputError
        If the site file or a result cannot be read, or the result cannot be laid along a channel.
    """
    path = site_file(folder)
    if not folder.is_dir():
        return read_site(path)
    given = read_keys(path) if path.is_file() else {}
    mappings = ("experiments", "holdout", "grid", "frame", "files")
    if not isinstance(given, dict) or not all(isinstance(given.get(key) or {}, dict) for key in mappings):
        return read_site(path)
    try:
        stated = ResultEntry.model_validate(given.get("result") or {})
    except ValidationError as error:
        raise site_refusal(path, error, "result") from None
    if not (paths := _result_files(folder, given, stated)):
        return read_site(path)
    results = {name: read_once(one, one.stat().st_mtime_ns) for name, one in paths.items()}
    completed = dict(given)
    if "frame" not in given and not (given.get("grid") or {}).get("centreline"):
        completed |= _frame_of(next(iter(results.values())))
    completed.setdefault("bed", {"file": next(iter(paths.values())).name})
    experiments = {name: dict((given.get("experiments") or {}).get(name) or {}) for name in paths}
    experiments = {name: one for name, one in experiments.items() if name not in (given.get("holdout") or {})}
    held = {name: dict(one or {}) for name, one in (given.get("holdout") or {}).items()}
    # With any numbers the rest of the site can be read, and with it where the channel lies.
    filler = {"discharge": 1.0, "level": 0.0}
    tried = {name: filler | one for name, one in experiments.items()}
    site = read_site(
        path, completed | {"experiments": tried, "holdout": {name: filler | one for name, one in held.items()}}
    )
    _, place = drawn_placement(folder, site)
    placed = {name: _along_channel(paths[name], one, place, stated) for name, one in results.items()}
    first = next(iter(placed.values()))
    flow, corners = first.flow, first.corners
    surface = LinearNDInterpolator(np.column_stack([flow.x, flow.y]), flow.bed)
    wet = flow.y[flow.depth > 0.0]
    beside = LAND_BESIDE * float(np.ptp(wet)) + flow.spacing
    south = max(float(corners[:, 1].min()), float(wet.min()) - beside)
    north = min(float(corners[:, 1].max()), float(wet.max()) + beside)
    # As far along as the mesh reaches, and across as far as its water and some land.
    extent = (float(corners[:, 0].min()), float(corners[:, 0].max()), south, north)
    terrain = Terrain(lambda x, y: np.asarray(surface(x, y)), extent, f"bed of {first.result.code}")
    tree = grid_of_terrain(next(iter(paths.values())), terrain, site.grid, place)
    of_grid = grid_of_keys(tree, place)
    for flows in (experiments, held):
        for name, one in flows.items():
            discharge, level = _boundary_values(paths[name], placed[name].flow, of_grid, place.line is None)
            if not {"discharge", "discharge_m3_s"} & one.keys():
                one["discharge"] = discharge
            if not {"level", "downstream_level_m"} & one.keys():
                one["level"] = level
    site = read_site(path, completed | {"experiments": experiments, "holdout": held})
    return SiteOfResult(site, place, paths, placed, stated, terrain, tree)


def ground_of_result(target: Path, found: SiteOfResult) -> tuple[Ground, Tree]:
    """Grid, bed and friction of the first result, and the flows of all, to be written beside the config.

    Returns
    -------
    Ground
    Tree
        `finished_result` of the case.
    """
    name, placed = next(iter(found.placed.items()))
    friction, parameters, values, texts, words = _friction_of_result(target, placed, found)
    imported: list[Tree] = []
    files: dict[str, str] = {}
    called = told_apart({experiment: case_name(experiment) for experiment in found.placed})
    for experiment, one in found.placed.items():
        file = f"flow-{called[experiment]}.csv"
        flow, (west, east), (south, north) = one.flow, found.grid["x"], found.grid["y"]
        beside = 2.0 * flow.spacing  # of the flow beyond the grid two spacings are kept
        near = (
            (flow.x > west - beside) & (flow.x < east + beside) & (flow.y > south - beside) & (flow.y < north + beside)
        )
        kept = TheirFlow(*(part[near] for part in (flow.x, flow.y, flow.bed, flow.depth, flow.u, flow.v)))
        texts[data_folder(target) / file] = text_of_flow(kept)
        files[experiment] = f"{data_folder(target).name}/{file}"
        stated = {**found.site.experiments, **found.site.holdout}[experiment]
        places, wet = len(flow.x), int((flow.depth > 0).sum())
        boundary = stated.discharge_m3_s, stated.downstream_level_m
        taken = FlowTaken(one.result.code, one.result.time, places, wet, *boundary)
        notes = [taken, *one.result.notes, *([words] if experiment == name else [])]
        imported.append(record(found.paths[experiment], None, "; ".join(sentences(notes))))
    ground = ground_on_grid(target, found.terrain, found.grid, friction, parameters, found.place)
    ground = replace(ground, imported=imported, texts={**ground.texts, **texts})
    key = {"code": placed.result.code, "files": files, "parameters": values | dict(found.stated.parameters)}
    return ground, key


def _result_files(folder: Path, given: Mapping[str, Any], stated: ResultEntry) -> dict[str, Path]:
    """The result file of each experiment; none if the folder holds none."""
    path = site_file(folder)
    experiments = [*(given.get("experiments") or {}), *(given.get("holdout") or {})]
    if stated.files:
        named = {name: folder / file for name, file in stated.files.items()}
        if missing := [name for name in experiments if name not in named]:
            raise InputError(
                f"{shown_path(path)}: `result.files` expected the result of {missing[0]}, got none; add it."
            )
    else:
        measured = given.get("files") or {}  # velocities of images are netCDF, too
        of_model = (one for one in folder.iterdir() if one.name not in measured and holds_result(one))
        there = [folder / stated.file] if stated.file else sorted(of_model)
        if not there:
            return {}
        if len(there) > 1:
            raise InputError(
                f"{shown_path(folder)}: expected one result of a model, got {len(there)}; name it in the site file by "
                "`result: FILE`, or one for each experiment by `result: {files: {EXPERIMENT: FILE}}`."
            )
        if len(experiments) > 1:
            raise InputError(
                f"{shown_path(path)}: expected a result for each of {len(experiments)} experiments, got one; "
                "name them by `result: {files: {EXPERIMENT: FILE}}`."
            )
        named = {experiments[0] if experiments else ONLY_EXPERIMENT: there[0]}
    for one in named.values():
        if not one.is_file():
            raise InputError("not_there", folder=folder, key="result", name=one.name)
    return named


def _frame_of(result: ModelResult) -> Tree:
    """`frame` along the mesh: x downstream from its upper end, y = 0 in its middle; empty if it lies so already."""
    wet = result.wet
    flow = np.array([(result.depth * result.u)[wet].sum(), (result.depth * result.v)[wet].sum()])
    middle = result.corners - result.corners.mean(axis=0)
    size, axes = np.linalg.eigh(middle.T @ middle)
    axis = axes[:, 1] * math.copysign(1.0, float(axes[:, 1] @ flow))
    if size[1] < ELONGATED**2 * size[0] and np.hypot(*flow) > 0.0:
        axis = flow / np.hypot(*flow)
    angle = math.degrees(math.atan2(axis[1], axis[0]))
    if abs(angle) < ALONG_ALREADY and not result.crs:
        return {}
    across = np.array([-axis[1], axis[0]])
    along_all, across_all = result.corners @ axis, result.corners @ across
    origin = along_all.min() * axis + 0.5 * (across_all.min() + across_all.max()) * across
    frame: Tree = {"origin": [round(float(one), 3) for one in origin], "angle": round(angle, 4)}
    return {"frame": frame | ({"crs": result.crs} if result.crs.upper().startswith("EPSG:") else {})}


def _along_channel(path: Path, result: ModelResult, place: Placement, stated: ResultEntry) -> PlacedResult:
    """The result along the channel. Raises InputError if nothing states the law of its friction."""
    along, across = place.to_channel(result.x, result.y)
    u, v = place.turned_to_channel(along, result.u, result.v)
    corners = np.column_stack(place.to_channel(*result.corners.T))
    manning = result.manning(stated.law) if stated.manning is None else np.full(result.x.size, stated.manning)
    if manning is None or not np.isfinite(manning).any():
        raise InputError("no_roughness", file=path, lawless=result.roughness is not None)
    there = np.isfinite(along) & np.isfinite(across)
    flow = TheirFlow(*(one[there] for one in (along, across, result.bed, result.depth, u, v)))
    if not (flow.depth > 0.0).any():
        raise InputError(f"{shown_path(path)}: expected water in the last time step, got none; run it anew.")
    return PlacedResult(result, flow, corners[np.isfinite(corners).all(axis=1)], manning[there])


def _boundary_values(path: Path, flow: TheirFlow, grid: Grid, straight: bool) -> tuple[float, float]:
    """Discharge [m3/s], the median along the channel, and level [m], the mean at the outlet. Raises InputError for a
    flow that is not along the grid, or whose discharge changes along it.
    """
    inner = np.linspace(grid.x[0], grid.x[-1], TRIES_ALONG + 2)[1:-1]
    along, across = flow.discharge(grid, inner)
    off = np.degrees(np.abs(np.arctan2(across, along)))
    if not (off <= MOST_OFF_AXIS).all():
        x = float(inner[off.argmax()])
        raise InputError("flow_off_grid", file=path, most=MOST_OFF_AXIS, got=off.max(), x=x, straight=straight)
    spread = float(np.std(along) / np.mean(along))
    if spread > MOST_SPREAD:
        raise InputError(
            f"{shown_path(path)}: expected the same discharge along the channel, got {along.min():.3g} to "
            f"{along.max():.3g} m3/s; run the model until it is steady, and let `grid` hold the whole river."
        )
    last = flow.at(np.full(grid.y.size, grid.x[-1]), grid.y)["level"]
    if not np.isfinite(last).any():
        raise InputError(
            f"{shown_path(path)}: expected water at the outlet, x = {grid.x[-1]:.4g} m, got none; let `grid.x` end "
            "upstream of it."
        )
    return round(float(np.median(along)), 5), round(float(np.nanmean(last)), 4)


def _friction_of_result(
    target: Path, placed: PlacedResult, found: SiteOfResult
) -> tuple[Tree, Tree, dict[str, float], dict[Path, str], str]:
    """Friction of the case, priors, values of the run, a raster of classes, and words: one class, or some by value."""
    flow, manning = placed.flow, placed.manning
    assert manning is not None
    wet = (flow.depth > 0.0) & np.isfinite(manning)
    values = manning[wet] if wet.any() else manning[np.isfinite(manning)]
    typical = round(float(np.median(values)), 5)
    low, high = min(0.01, 0.5 * typical), max(0.2, 2.0 * typical)
    one_class = {"classes": {"bed": MANNING_BED}, "default": "bed"}
    words = f"n {in_digits(typical)} s m^(-1/3)"
    if np.ptp(values) <= ONE_CLASS * typical or found.place.line is not None or found.stated.manning is not None:
        if np.ptp(values) > ONE_CLASS * typical:
            words += f", the median of {in_digits(values.min())} to {in_digits(values.max())}"
        return one_class, {"n_b": bed_prior(low, high)}, {"n_b": typical}, {}, words
    rounded = np.round(values, 4)
    distinct, counts = np.unique(rounded, return_counts=True)
    groups = [float(one) for one in distinct]
    if len(groups) > MOST_CLASSES:  # values of a share of their own, and the others by the size of ln n
        own = distinct[counts >= OWN_CLASS * values.size][: MOST_CLASSES - 2]
        rest = np.log(values[~np.isin(rounded, own)])
        edges = np.linspace(rest.min(), rest.max(), MOST_CLASSES - own.size + 1)[1:-1]
        of_bin = np.searchsorted(edges, rest)
        means = [round(float(np.exp(rest[of_bin == k].mean())), 5) for k in np.unique(of_bin)]
        groups = sorted({*own.tolist(), *means})
    number = {value: k for k, value in enumerate(groups, 1)}
    size = float(min(found.grid["cell"]))
    (west, east), (south, north) = found.grid["x"], found.grid["y"]
    x = centres(west, size, math.ceil((east - west) / size))
    y = centres(south, size, math.ceil((north - south) / size))
    at_x, at_y = (part.ravel() for part in np.meshgrid(x, y, indexing="ij"))
    nearest = flow.nearest(at_x, at_y, np.isfinite(manning))
    there = np.abs(np.log(manning[np.isfinite(manning)][nearest][:, None] / np.array(groups))).argmin(axis=1) + 1
    text = ascii_grid(x, y, size, there.reshape(x.size, y.size), 0)
    names = {value: f"n{k}" for value, k in number.items()}
    shares = np.bincount(np.abs(np.log(values[:, None] / np.array(groups))).argmin(axis=1), minlength=len(groups))
    main = groups[int(shares.argmax())]
    names[main] = "bed"
    parameter = {value: "n_b" if value == main else f"n_{k}" for value, k in number.items()}
    classes = {names[value]: {"law": "manning", "n": parameter[value]} for value in groups}
    zone = {"raster": f"{data_folder(target).name}/classes.asc", "values": {k: names[v] for v, k in number.items()}}
    friction: Tree = {"classes": classes, "default": "bed", "zones": [zone]}
    priors = {
        parameter[value]: lognormal_prior(
            value,
            LOG_SD_OF_CLASS,
            "s m^(-1/3)",
            parameter[value],
            phrase("meaning_of_parameter", "bed_of_run", (placed.result.code, value)),
        )
        for value in groups
    }
    words = f"{len(groups)} classes of n, {in_digits(groups[0])} to {in_digits(groups[-1])} s m^(-1/3)"
    if len(distinct) > len(groups):
        words += f", of {len(distinct)} values"
    of_run = {parameter[value]: value for value in groups}
    return friction, priors, of_run, {data_folder(target) / "classes.asc": text}, words
