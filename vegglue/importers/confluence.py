"""The open-channel confluence set of R.B. Canelas (GitHub, Confluence-velocity-dataset-2021, GPL-3.0) -> a case.

The set is not part of this project: a user downloads it. Its tables are bed.csv (x_m, y_m, z_bed_m), water_level.csv
(x_m, y_m, z_ws_m) and depth_averaged.csv (verticals: x_m, y_m, h_m, U_depthavg_ms, V_depthavg_ms, bed_extrapolated).
As its author ships it, data_3d_velocity_topography_surface_maps/ holds a MATLAB file for each section (X, Y, Z, U, V:
points by height and vertical) and topo_water_level_maps.mat (Xtopo, Ytopo, Ztopo, Xwl, Ywl, Zwl). x runs downstream
from the upstream corner of the junction; the side inflow comes through the wall at y = 0. What the calibration needs of
it is written into a folder beside the config.
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from vegglue.arrays import Array
from vegglue.case.resolved_config import Tree
from vegglue.case.text_files import case_name, write_text
from vegglue.errors import InputError, shown_path
from vegglue.importers.config_parts import (
    FIRST_LOOK,
    MANNING_BED,
    bed_prior,
    even,
    loguniform_prior,
    normal_prior,
    observed,
    validated,
    wall_prior,
)
from vegglue.importers.import_notes import ConfluenceAssumptions
from vegglue.importers.library_files import load_matlab
from vegglue.measurements.csv_table import read_table
from vegglue.wording.remedies import ANOTHER_PLACE
from vegglue.wording.sentences import phrase

EXPERIMENT = "measured"
# Length of a cell, and about its width [m].
CELL = 0.05
# The authors do not give the width of the tributary [m]: assumed.
CONFLUENCE_WIDTH = 0.15
# No errors are given. Velocities: a share for the rule of averaging over the depth, and so much besides [m/s].
RULE, BESIDES = 0.02, 0.01
# Turn of a probe against the axis of the flume [rad], not stated: 3 degrees, as set by eye. It shows in the velocities
# across, whose means over the last four sections, where walls leave them no place, are -0.05 to -0.11 of those along.
TURN = 0.05
# Manning's n of the walls [s m^(-1/3)], whose material is not stated: glass 0.010, wood 0.012 (Chow 1959, table 5-6).
WALL = 0.011
# Levels are means of so many blocks across, and as long; what is left of their error [m].
BLOCKS, LEVEL_ERROR = 3, 0.001
# Spread of the priors of what integration of the sections gives [-], and of the level at the outlet [m].
UPSTREAM, SIDE, OUTLET = 0.05, 0.5, 0.002
MAPS_OF_THE_SET, OF_THE_SET = "topo_water_level_maps.mat", "confluence"
# Folders within folders that are looked through: its archive unpacks to two. Not all: it may be a whole disk.
DEEPEST_FOLDER = 2
# Of the map of the bed every fourth value along x [-]: it is stored each centimetre, and was measured each 5 cm.
THINNED = 4
NOT_STATED = ConfluenceAssumptions(RULE, BESIDES, LEVEL_ERROR, WALL, CONFLUENCE_WIDTH)


def holds_confluence(folder: Path) -> bool:
    """Whether a folder holds the tables of the confluence set."""
    return (folder / "depth_averaged.csv").is_file()


def mat_folder(folder: Path) -> Path | None:
    """The folder of the MATLAB files, the one given or one inside it; None if there is none."""
    for depth in range(1 + DEEPEST_FOLDER):
        found = sorted(folder.glob("*/" * depth + MAPS_OF_THE_SET)) if folder.is_dir() else []
        if found:
            return found[0].parent
    return None


def case_from_confluence(folder: Path, target: Path) -> Tree:
    """The config of the set in a folder; every second section is held out as validation.

    Parameters
    ----------
    folder : Path
        With bed.csv, water_level.csv and depth_averaged.csv.
    target : Path
        The config to be written; files go into a folder beside it.

    Returns
    -------
    dict
        Keys and values.

    Raises
    ------
    InputError
        For what cannot be read.
    """
    verticals = folder / "depth_averaged.csv"
    bed = _columns(folder / "bed.csv", "x_m", "y_m", "z_bed_m")
    level = _columns(folder / "water_level.csv", "x_m", "y_m", "z_ws_m")
    vertical = _columns(verticals, "x_m", "y_m", "h_m", "U_depthavg_ms", "bed_extrapolated")
    width = float(bed[:, 1].max())
    grid = _grid(bed, vertical, width)
    across = []
    with verticals.open(encoding="utf-8-sig", newline="") as file:
        for row, fields in enumerate(csv.DictReader(file), 2):
            text = fields.get("V_depthavg_ms") or "nan"
            try:
                across.append(float(text))
            except ValueError:
                raise InputError(
                    f"{shown_path(verticals)}, row {row}: expected a number or nothing in column V_depthavg_ms, got "
                    f"{text!r}; correct it."
                ) from None
    vertical = np.column_stack([vertical, across])
    # The water heads from the mouth of the tributary, y <= 0, so many degrees from downstream; 90 if none was measured.
    mouth = vertical[(vertical[:, 1] <= 0.0) & ~np.isnan(vertical[:, 5])]
    ahead, aside = mouth[:, 3].sum(), mouth[:, 5].sum()
    angle = round(float(np.degrees(np.arctan2(aside, ahead))), 1) if aside > 0.0 else 90.0
    # Where the bed is not known there is no depth to average over; and the tributary itself is not modelled.
    vertical = vertical[(vertical[:, 4] == 0) & (vertical[:, 1] > 0.0) & (vertical[:, 1] < width)]
    sections = np.unique(vertical[:, 0])
    blocks = _block_means(level, grid, width)
    into = target.with_name(f"{target.stem}-data")
    carried = []  # to the walls: the outermost level of each cross-section
    for x in np.unique(bed[:, 0]):
        here = bed[bed[:, 0] == x]
        for edge, row in ((0.0, here[here[:, 1].argmin()]), (width, here[here[:, 1].argmax()])):
            if row[1] != edge:
                carried.append([x, edge, row[2]])
    _write(into / "bed.csv", "x,y,z", np.vstack([bed, np.array(carried).reshape(-1, 3)]))
    _write(into / "levels.csv", "x,y,level,level_se", blocks)
    seen, unseen = (vertical[np.isin(vertical[:, 0], part)] for part in (sections[::2], sections[1::2]))
    setting = {"discharge": {"upstream": "discharge", "side": "side_discharge"}, "level": "outlet_level"}
    levels = observed("level", f"{into.name}/levels.csv", EXPERIMENT)
    return {
        "name": case_name(target.stem),
        "title": phrase("title_of_case", "confluence"),
        "grid": grid,
        "bed": [{"points": f"{into.name}/bed.csv"}],
        "friction": {"classes": {"bed": MANNING_BED}, "default": "bed", "walls": {"law": "manning", "n": "n_w"}},
        "inflows": {
            "upstream": {"side": "west", "spread": "conveyance"},
            "side": {"side": "south", "range": [0.0, CONFLUENCE_WIDTH], "spread": "uniform", "angle": angle},
        },
        "outlet": {},
        "eddy_viscosity": "eddy_viscosity",
        "experiments": {EXPERIMENT: setting},
        "parameters": _priors(seen, blocks, width),
        "observations": [*_velocities(into, "velocities", seen), levels],
        **validated({EXPERIMENT: {**setting}}, _velocities(into, "held_out", unseen)),
        "numerics": {"film_depth": 0.002},
        **FIRST_LOOK,
    }


def flat_bed(folder: Path, parent: Path) -> Tree:
    """A config that extends that of the set by the plane, level across, that fits its bed best."""
    bed = _columns(folder / "bed.csv", "x_m", "y_m", "z_bed_m")
    grid = _grid(bed, _columns(folder / "depth_averaged.csv", "x_m", "y_m"), float(bed[:, 1].max()))
    (low, high), (_, width) = grid["x"], grid["y"]
    inside = (bed[:, 0] >= low) & (bed[:, 0] <= high)
    slope, level = np.polyfit(bed[inside, 0] - low, bed[inside, 2], 1)
    plane = {"axis": width / 2, "bottom_width": 2 * width, "bank_slope": 1.0}
    plane |= {"bed_slope": round(float(-slope), 6), "level": round(float(level), 5)}
    return {
        "extends": parent.name,
        "name": f"{case_name(parent.stem)}-flat",
        "title": phrase("title_of_case", "flat"),
        "bed": [{"trapezoid": plane}],
    }


def discharge(y: Array, unit: Array, width: float) -> float:
    """Q = int_0^B h U dy [m3/s] by trapezoids, constant from the outermost verticals to the walls."""
    order = np.argsort(y)
    across, inner = np.concatenate([[0.0], y[order], [width]]), unit[order]
    return float(np.trapezoid(np.concatenate([inner[:1], inner, inner[-1:]]), across))


def _priors(vertical: Array, blocks: Array, width: float) -> Tree:
    sections = np.unique(vertical[:, 0])
    flows = []
    for x in sections:
        here = vertical[vertical[:, 0] == x]
        flows.append(discharge(here[:, 1], here[:, 2] * here[:, 3], width))
    above, below = np.array(flows)[sections <= 0.0], np.array(flows)[sections > 4.0 * CONFLUENCE_WIDTH]
    before = float(above.mean())
    side = max(float(below.mean()) - before, 0.02 * before)
    level = float(blocks[blocks[:, 0] > blocks[:, 0].max() - 0.5 * width, 2].mean())
    return {
        "discharge": normal_prior(
            round(before, 5), round(UPSTREAM * before, 5), "m3/s", "Q", phrase("meaning_of_parameter", "discharge")
        ),
        "side_discharge": normal_prior(
            round(side, 5), round(SIDE * side, 5), "m3/s", "Q_s", phrase("meaning_of_parameter", "side_discharge"),
            low=round(0.02 * side, 5), high=round(3.0 * side, 5),
        ),
        "outlet_level": normal_prior(
            round(level, 5), OUTLET, "m", "z_out", phrase("meaning_of_parameter", "outlet_level")
        ),
        "n_b": bed_prior(0.005, 0.05),
        "n_w": wall_prior(WALL),
        "eddy_viscosity": loguniform_prior(3e-5, 1e-2, "m2/s", "ν", phrase("meaning_of_parameter", "viscosity")),
    }  # fmt: skip


def _grid(bed: Array, vertical: Array, width: float) -> Tree:
    """From just above the first section to just beyond the last one; edges of coarser cells meet the junction.

    Smooth flumes are too short to change how water is spread across (C^2 h / 2 g is some metres), and the bed at the
    end of the map need not show it: so it enters where its spread is measured.
    """
    coarse = 4.0 * CELL
    low = max(np.floor((vertical[:, 0].min() - 0.5 * width) / coarse), np.ceil(bed[:, 0].min() / coarse - 1e-9))
    high = min(np.ceil(vertical[:, 0].max() / coarse) + 1, np.floor(bed[:, 0].max() / coarse + 1e-9))
    return {
        "x": [round(float(low) * coarse, 6), round(float(high) * coarse, 6)],
        "y": [0.0, width],
        "cell": [CELL, round(width / even(width / CELL), 9)],
    }


def _block_means(level: Array, grid: Tree, width: float) -> Array:
    """Means of the water level in squares, with their standard error: (block, 4) of x, y, level, error."""
    size = width / BLOCKS
    low, high = grid["x"]
    inside = level[(level[:, 0] > low) & (level[:, 0] < high) & (level[:, 1] < width)]
    number = np.floor((inside[:, :2] - [low, 0.0]) / size)
    found = []
    for block in np.unique(number, axis=0):
        here = inside[(number == block).all(axis=1)]
        if len(here) > 4:
            own = here[:, 2].std(ddof=1) / np.sqrt(len(here))
            found.append([*here.mean(axis=0), np.hypot(own, LEVEL_ERROR)])
    return np.array(found)


def _velocities(into: Path, name: str, vertical: Array) -> list[Tree]:
    """Velocities along, and across if there are any, written and named.

    A small turn of the probe changes u by its square only; the error of v has a share of u. Not all verticals have v.
    """
    along: list[list[float | str]] = []
    across: list[list[float | str]] = []
    for x, y, _, u, _, v in vertical.tolist():
        along.append([f"x{x:+.2f}", x, y, u, float(np.hypot(RULE * u, BESIDES))])
        if not np.isnan(v):
            across.append([f"x{x:+.2f}", x, y, v, float(np.linalg.norm([RULE * v, BESIDES, TURN * u]))])
    _write(into / f"{name}.csv", "section,x,y,u,u_se", along)
    found = [observed("velocity", f"{into.name}/{name}.csv", EXPERIMENT)]
    if across:
        _write(into / f"{name}_across.csv", "section,x,y,v,v_se", across)
        found.append(observed("velocity_across", f"{into.name}/{name}_across.csv", EXPERIMENT))
    return found


def _columns(path: Path, *names: str) -> Array:
    return np.asarray(read_table(path, (), names).to_numpy(), dtype=np.float64)


def _write(path: Path, heading: str, rows: Sequence[Sequence[float | str]] | Array) -> None:
    lines = [",".join(cell if isinstance(cell, str) else f"{cell:.5f}" for cell in row) for row in rows]
    write_text(path, "\n".join([heading, *lines]) + "\n", ANOTHER_PLACE)


def tables_of_mat(source: Path, into: Path) -> Path:
    """Write bed.csv, water_level.csv and depth_averaged.csv of the MATLAB files.

    Returns
    -------
    Path
        Their folder.

    Raises
    ------
    InputError
        For a file that is none of the set.
    StorageError
        If a file cannot be written.
    """
    maps = load_matlab(source / MAPS_OF_THE_SET, OF_THE_SET, ("Xtopo", "Ytopo", "Ztopo", "Xwl", "Ywl", "Zwl"))
    bed, level = (_points_of_map([maps[f"{axis}{name}"] for axis in "XYZ"]) for name in ("topo", "wl"))
    files = sorted(source.glob("section_uvw_x*.mat"))
    sections = [load_matlab(path, OF_THE_SET, ("X", "Y", "Z", "U", "V")) for path in files]
    if not sections:
        raise InputError(f"{shown_path(source)}: expected files section_uvw_x*.mat, got none; add them.")
    verticals = np.vstack([_verticals(section, bed, level) for section in sections])
    verticals = verticals[np.lexsort((verticals[:, 1], verticals[:, 0]))]
    thinned = {
        name: _points_of_map([maps[f"{axis}{name}"][::2, ::THINNED] for axis in "XYZ"]) for name in ("topo", "wl")
    }
    heading = "x_m,y_m,h_m,U_depthavg_ms,V_depthavg_ms,bed_extrapolated"
    for name, columns, rows in (
        ("bed.csv", "x_m,y_m,z_bed_m", thinned["topo"]),
        ("water_level.csv", "x_m,y_m,z_ws_m", thinned["wl"]),
        ("depth_averaged.csv", heading, verticals),
    ):
        lines = [",".join("" if np.isnan(value) else f"{value:.6g}" for value in row) for row in rows]
        write_text(into / name, "\n".join([columns, *lines]) + "\n", ANOTHER_PLACE)
    return into


def _points_of_map(axes: Sequence[Array]) -> Array:
    known = ~np.isnan(axes[2])
    return np.column_stack([axis[known] for axis in axes])


def _verticals(section: dict[str, Array], bed: Array, level: Array) -> Array:
    """Rows x, y, h, U, V and whether the bed lies beyond its map, of each vertical with points (verticals, 6).

    U = (1/h) int_0^h u dz by trapezoids, zero at the bed, constant above the highest point.
    """

    def read_at(points: Array) -> tuple[Array, Array]:
        """Levels of a map at the verticals, and whether they lie beyond it, where the nearest level holds."""
        x, y = section["X"][0], section["Y"][0]
        near = points[(points[:, 0] > x.min() - 0.2) & (points[:, 0] < x.max() + 0.2)]
        inside = np.asarray(LinearNDInterpolator(near[:, :2], near[:, 2])(x, y))
        nearest = np.asarray(NearestNDInterpolator(near[:, :2], near[:, 2])(x, y))
        return np.where(np.isnan(inside), nearest, inside), np.isnan(inside)

    def depth_average(height: Array, values: Array, depth: float) -> float:
        order = np.argsort(height)[~np.isnan(values[np.argsort(height)])]
        if not order.size:
            return np.nan
        below, known = height[order], values[order]
        levels = np.concatenate([[0.0], below, [max(depth, below[-1])]])
        return float(np.trapezoid(np.concatenate([[0.0], known, known[-1:]]), levels) / levels[-1])

    surface, _ = read_at(level)
    floor, beyond = read_at(bed)
    rows = []
    for column in range(section["X"].shape[1]):
        z, u, v = (section[name][:, column] for name in ("Z", "U", "V"))
        there = ~np.isnan(u) & (z > floor[column])
        depth = surface[column] - floor[column]
        if there.sum() < 2 or depth <= 0.0:
            continue
        means = [depth_average(z[there] - floor[column], values[there], depth) for values in (u, v)]
        rows.append([section["X"][0, column], section["Y"][0, column], depth, *means, float(beyond[column])])
    return np.array(rows).reshape(-1, 6)
