"""The plan of HEC-RAS 2D with its results (.p01.hdf), of 5.0 to 6.x, read as HDF5.

Format: Geometry/2D Flow Areas/<name> (cells, faces) and Results/Unsteady/Output/Output Blocks/Base Output/Unsteady Time
Series/2D Flow Areas/<name> (Water Surface of cells, Face Velocity). Ghost cells beyond the perimeter come last, and
their bed is NaN. The bed of a cell is its lowest point, so that a depth is the largest one in the cell; the water
surface of a dry cell is its bed.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.model_result import (
    DRY_DEPTH,
    ModelResult,
    model_result,
    si_value,
    text_of,
    without_marks,
)

AREAS = "Geometry/2D Flow Areas"
SERIES = "Results/Unsteady/Output/Output Blocks/Base Output/Unsteady Time Series"
# Smallest eigenvalue of the normals of a cell over the largest [-], below which its faces give one component only.
ONE_HEADING = 1e-3


def read_hec_ras(path: Path) -> ModelResult:
    """The final state of a plan; all 2D flow areas together.

    Parameters
    ----------
    path
        A plan (.p01.hdf) that was computed.

    Returns
    -------
    ModelResult
        At the centres of its cells. Velocities are fits by least squares to the normal velocities of the faces of a
        cell, weighted by the wetted area of each.

    Raises
    ------
    InputError
        If it holds no geometry, or no result, of a 2D flow area.
    """
    with h5py.File(path) as file:
        results = file.get(f"{SERIES}/2D Flow Areas")
        geometry = file.get(AREAS)
        held = geometry or ()
        names = [name for name in results or () if f"{name}/Cells Center Coordinate" in held]
        if not names:
            raise InputError("not_computed", file=path, areas=geometry is not None and results is None)
        system, projection = text_of(file.attrs.get("Units System")), text_of(file.attrs.get("Projection"))
        customary = system != "" and "SI" not in system.upper()
        horizontal = 1.0 if not customary else si_value("us-ft" if "FOOT_US" in projection.upper() else "ft")
        parts = [
            _flow_of_area(geometry[name], results[name], si_value("ft") if customary else 1.0, horizontal)
            for name in names
        ]
        stamps = file.get(f"{SERIES}/Time Date Stamp")
        time = text_of(stamps[-1]) if stamps is not None and len(stamps) else ""
        notes = [ImportNote(Noted.WITHOUT_BED, sum(part["ghosts"] for part in parts))]
        notes += [ImportNote(Noted.FEET)] if customary else []
        joined = {key: np.concatenate([part[key] for part in parts]) for key in parts[0] if key != "ghosts"}
        rough = joined.pop("roughness")
        return model_result(
            "HEC-RAS", **joined, roughness=rough if np.isfinite(rough).any() else None, roughness_kind="manning",
            crs=projection if not customary else "", time=time, notes=tuple(notes),
        )  # fmt: skip


def _flow_of_area(geometry: Any, results: Any, vertical: float, horizontal: float) -> dict[str, Any]:
    """Places, bed, level, depth, velocities and roughness of one area [SI], and how many ghost cells it has."""
    bed = without_marks(np.asarray(geometry["Cells Minimum Elevation"], dtype=np.float64)) * vertical
    count, real = bed.size, np.isfinite(bed)
    level = _last_of(results["Water Surface"], vertical)[:count]
    depth = _last_of(results["Depth"], vertical)[:count] if "Depth" in results else level - bed
    wet = real & (np.nan_to_num(depth) > DRY_DEPTH)
    cells = np.asarray(geometry["Faces Cell Indexes"], dtype=np.int64)
    normal = np.asarray(geometry["Faces NormalUnitVector and Length"], dtype=np.float64)
    velocity = _last_of(results["Face Velocity"], vertical)
    inside = (cells >= 0) & (cells < count)
    at = np.where(inside, cells, 0)
    sides = np.where(inside & wet[at], level[at], -np.inf)  # of a dry side, or a ghost cell, the other one counts
    # Wetted area [m2] and Manning's n of each face at the higher level of its sides; walls stand above its table.
    at_face, info = sides.max(axis=1), np.asarray(geometry["Faces Area Elevation Info"], dtype=np.int64)
    table = np.asarray(geometry["Faces Area Elevation Values"], dtype=np.float64)
    z, of_table = table[:, 0] * vertical, table[:, 1] * vertical**2
    area, n_face = np.zeros(at_face.size), np.full(at_face.size, np.nan)
    for face, (start, rows) in enumerate(info):
        here = slice(start, start + rows)
        if rows and np.isfinite(at_face[face]):
            area[face] = np.interp(at_face[face], z[here], of_table[here], left=0.0)
            area[face] += normal[face, 2] * horizontal * max(at_face[face] - z[start + rows - 1], 0.0)
            n_face[face] = np.interp(at_face[face], z[here], table[here, 3]) if table.shape[1] > 3 else np.nan
    u, v = _cell_velocities(cells, inside, normal[:, :2], velocity, area, count)
    if "Cells Center Manning's n" in geometry:
        rough = np.asarray(geometry["Cells Center Manning's n"], dtype=np.float64)
    else:
        stated = inside & (n_face > 0.0)[:, None]
        faces = _sums_over_cells(np.ones(len(cells)), cells, stated, count)
        rough = np.where(faces > 0, _sums_over_cells(n_face, cells, stated, count) / np.maximum(faces, 1), np.nan)
    centre = np.asarray(geometry["Cells Center Coordinate"], dtype=np.float64) * horizontal
    return {
        "x": centre[real, 0], "y": centre[real, 1], "bed": bed[real], "level": level[real], "depth": depth[real],
        "u": u[real], "v": v[real], "roughness": rough[real], "ghosts": int((~real).sum()),
        "corners": np.asarray(geometry["FacePoints Coordinate"], dtype=np.float64) * horizontal,
    }  # fmt: skip


def _last_of(dataset: Any, default: float) -> Array:
    """The last state of a series [m or m/s], NaN where there is no value, by the unit that an attribute states: `Units`
    of 6.x, the quantity's own name in 5.0; else by the default.
    """
    stated = [text_of(one).lower() for one in dataset.attrs.values() if isinstance(one, bytes | np.bytes_)]
    unit = next(filter(None, map(si_value, stated)), default)
    return without_marks(np.asarray(dataset[-1], dtype=np.float64)) * unit


def _sums_over_cells(values: Array, cells: np.ndarray[Any, Any], used: np.ndarray[Any, Any], count: int) -> Array:
    """Sums of values of faces (faces,) over the cells (faces, 2) at their sides that are used (faces, 2): (count,)."""
    sums = np.zeros(count)
    for side, here in enumerate(used.T):
        sums += np.bincount(cells[here, side], values[here], count)
    return sums


def _cell_velocities(
    cells: np.ndarray[Any, Any], inside: np.ndarray[Any, Any], normal: Array, speed: Array, weight: Array, count: int
) -> tuple[Array, Array]:
    """min sum_f A_f (n_f . u - v_f)^2 of each cell: u and v (count,), along the only normal if all are parallel; NaN if
    no wet face of it has a speed.
    """
    of_face = {
        "xx": normal[:, 0] ** 2, "xy": normal[:, 0] * normal[:, 1], "yy": normal[:, 1] ** 2,
        "x": normal[:, 0] * speed, "y": normal[:, 1] * speed,
    }  # fmt: skip
    used = inside & (weight > 0.0)[:, None] & np.isfinite(speed)[:, None]
    sums = {key: _sums_over_cells(weight * value, cells, used, count) for key, value in of_face.items()}
    matrix = np.stack([np.stack([sums["xx"], sums["xy"]], -1), np.stack([sums["xy"], sums["yy"]], -1)], -2)
    inverse = np.linalg.pinv(matrix, rcond=ONE_HEADING, hermitian=True)
    found = (inverse @ np.stack([sums["x"], sums["y"]], -1)[..., None])[..., 0]
    unknown = inside & (weight > 0.0)[:, None] & ~np.isfinite(speed)[:, None]
    lost = np.bincount(cells[unknown], minlength=count)[:count] > 0
    found[lost & (sums["xx"] + sums["yy"] == 0.0)] = np.nan
    return found[:, 0], found[:, 1]
