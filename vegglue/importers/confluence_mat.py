"""The confluence set as its author ships it: sections of points and maps in MATLAB files -> the three tables.

data_3d_velocity_topography_surface_maps/ holds a file for each section (X, Y, Z, U, V: points by height and vertical)
and topo_water_level_maps.mat (Xtopo, Ytopo, Ztopo, Xwl, Ywl, Zwl).
"""

from pathlib import Path

import numpy as np
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.io import loadmat

from vegglue.arrays import Array
from vegglue.case.text_files import write_text
from vegglue.errors import InputError, shown_path
from vegglue.importers.library_files import read_by_library
from vegglue.importers.matlab_loading import refuse_unreadable_matlab

MAPS, OF_THE_SET = "topo_water_level_maps.mat", "a file of the set"
# Folders within folders that are looked through: its archive unpacks to two. Not all: it may be a whole disk.
DEEPEST = 2
# Of the map of the bed every fourth value along x [-]: it is stored each centimetre, and was measured each 5 cm.
THINNED = 4
HEADING_OF_VERTICALS = "x_m,y_m,h_m,U_depthavg_ms,V_depthavg_ms,bed_extrapolated"


def mat_folder(folder: Path) -> Path | None:
    """The folder of the MATLAB files, the one given or one inside it; None where there is none."""
    for depth in range(1 + DEEPEST):
        found = sorted(folder.glob("*/" * depth + MAPS)) if folder.is_dir() else []
        if found:
            return found[0].parent
    return None


def tables_of_mat(source: Path, into: Path) -> Path:
    """Write bed.csv, water_level.csv and depth_averaged.csv as `confluence.py` reads them; returns their folder.

    Errors: InputError for a file that is none of the set; StorageError.
    """
    maps = _loaded(source / MAPS, "Xtopo", "Ytopo", "Ztopo", "Xwl", "Ywl", "Zwl")
    bed, level = (_points(*(maps[f"{axis}{name}"] for axis in "XYZ")) for name in ("topo", "wl"))
    sections = [_loaded(path, "X", "Y", "Z", "U", "V") for path in sorted(source.glob("section_uvw_x*.mat"))]
    if not sections:
        raise InputError(f"{shown_path(source)}: expected files section_uvw_x*.mat, got none; add them.")
    verticals = np.vstack([_verticals(section, bed, level) for section in sections])
    verticals = verticals[np.lexsort((verticals[:, 1], verticals[:, 0]))]
    _write_rows(into / "bed.csv", "x_m,y_m,z_bed_m", _thinned(maps, "topo"))
    _write_rows(into / "water_level.csv", "x_m,y_m,z_ws_m", _thinned(maps, "wl"))
    _write_rows(into / "depth_averaged.csv", HEADING_OF_VERTICALS, verticals)
    return into


def _loaded(path: Path, *names: str) -> dict[str, Array]:
    refuse_unreadable_matlab(path, OF_THE_SET)
    with read_by_library(path, OF_THE_SET):
        found = loadmat(path, variable_names=names)
        return {name: np.asarray(found[name], dtype=np.float64) for name in names}


def _points(x: Array, y: Array, z: Array) -> Array:
    known = ~np.isnan(z)
    return np.column_stack([x[known], y[known], z[known]])


def _thinned(maps: dict[str, Array], name: str) -> Array:
    return _points(*(maps[f"{axis}{name}"][::2, ::THINNED] for axis in "XYZ"))


def _verticals(section: dict[str, Array], bed: Array, level: Array) -> Array:
    """Rows x, y, h, U, V and whether the bed lies beyond its map, of each vertical with points (verticals, 6).

    U = (1/h) int_0^h u dz by trapezoids, zero at the bed, constant above the highest point.
    """
    surface = _read_at(level, section["X"][0], section["Y"][0])[0]
    floor, beyond = _read_at(bed, section["X"][0], section["Y"][0])
    rows = []
    for column in range(section["X"].shape[1]):
        z, u, v = (section[name][:, column] for name in ("Z", "U", "V"))
        there = ~np.isnan(u) & (z > floor[column])
        depth = surface[column] - floor[column]
        if there.sum() < 2 or depth <= 0.0:
            continue
        height = z[there] - floor[column]
        means = [_depth_average(height, values[there], depth) for values in (u, v)]
        rows.append([section["X"][0, column], section["Y"][0, column], depth, *means, float(beyond[column])])
    return np.array(rows).reshape(-1, 6)


def _depth_average(height: Array, values: Array, depth: float) -> float:
    order = np.argsort(height)[~np.isnan(values[np.argsort(height)])]
    if not order.size:
        return np.nan
    below, known = height[order], values[order]
    levels = np.concatenate([[0.0], below, [max(depth, below[-1])]])
    return float(np.trapezoid(np.concatenate([[0.0], known, known[-1:]]), levels) / levels[-1])


def _read_at(points: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Levels at places (n,) and whether they lie beyond the map, where the nearest level holds."""
    near = points[(points[:, 0] > x.min() - 0.2) & (points[:, 0] < x.max() + 0.2)]
    inside = np.asarray(LinearNDInterpolator(near[:, :2], near[:, 2])(x, y))
    nearest = np.asarray(NearestNDInterpolator(near[:, :2], near[:, 2])(x, y))
    return np.where(np.isnan(inside), nearest, inside), np.isnan(inside)


def _write_rows(path: Path, heading: str, rows: Array) -> None:
    lines = [",".join("" if np.isnan(value) else f"{value:.6g}" for value in row) for row in rows]
    write_text(path, "\n".join([heading, *lines]) + "\n", "give another place by --to")
