"""The map file of Delft3D-4 (trim-*.nc), written as netCDF by `FlNcdf = #map#`.

Format (Delft3D-FLOW user manual, appendix on output files): a curvilinear grid (M, N) with centres XZ, YZ and corners
XCOR, YCOR; DPS0, DPS [m, positive down] and S1 at centres; U1 and V1 along the grid lines at faces, so that centre m
lies between the U points m - 1 and m; KFU and KFV are 0 at dry faces; ALFAS is the angle of the grid line [degrees].
"""

from pathlib import Path

import numpy as np

from vegglue.arrays import Array, Mask
from vegglue.errors import InputError, shown_path
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.model_result import (
    ModelResult,
    NetcdfVariable,
    RoughnessKind,
    last_time,
    model_result,
    netcdf_variables,
    refuse_degrees,
)

NEEDED = ("XZ", "YZ", "S1", "U1", "V1", "ALFAS")


def read_delft3d_trim(path: Path) -> ModelResult:
    """u = cos(a) U - sin(a) V, v = sin(a) U + cos(a) V: the final state at active centres.

    Parameters
    ----------
    path
        A netCDF file.

    Returns
    -------
    ModelResult
        a is ALFAS, counter-clockwise from east, or clockwise if the grid lines between the centres run so. Layers are
        averaged by their thickness. Centres with four dry faces are dry.

    Raises
    ------
    InputError
        If a variable is missing, or places are in degrees.
    """
    with netcdf_variables(path) as variables:
        missing = [name for name in NEEDED if name not in variables]
        bed_name = next((name for name in ("DPS", "DPS0") if name in variables), None)
        if missing or bed_name is None:
            raise InputError(
                f"{shown_path(path)}: expected a trim file of Delft3D-4 with {', '.join(missing) or 'DPS0'}, got none; "
                "write it with `FlNcdf = #map#`."
            )
        refuse_degrees(path, variables["XZ"])
        times = variables["time"].shape[0] if "time" in variables else variables["S1"].shape[0]
        x, y = (np.asarray(variables[name].values()) for name in ("XZ", "YZ"))
        shape = x.shape
        depth_down, level = (variables[name].values(times) for name in (bed_name, "S1"))
        bed = -depth_down
        along, across = (_of_layers(variables, name, times, shape) for name in ("U1", "V1"))
        open_u, open_v = (  # where nothing states which faces are closed, those without a value are
            variables[name].values(times).reshape(shape) > 0 if name in variables else np.isfinite(speed)
            for name, speed in (("KFU", along), ("KFV", across))
        )
        along, across = np.where(open_u, along, 0.0), np.where(open_v, across, 0.0)
        before_u, before_v = _before(along, 0), _before(across, 1)
        wet = open_u | open_v | (_before(open_u.astype(float), 0) > 0) | (_before(open_v.astype(float), 1) > 0)
        u, v = 0.5 * (along + before_u), 0.5 * (across + before_v)
        active = np.isfinite(x) & np.isfinite(y)
        if "KCS" in variables:
            active &= np.isin(variables["KCS"].values(times).reshape(shape), (1.0, 3.0))
        else:
            active &= ~((x == 0.0) & (y == 0.0))
        angle = np.radians(np.nan_to_num(variables["ALFAS"].values().reshape(shape)))
        turned, angle = _turned_as_the_grid(x, y, active, angle)
        east, north = np.cos(angle) * u - np.sin(angle) * v, np.sin(angle) * u + np.cos(angle) * v
        corners = np.column_stack([x[active], y[active]])
        if "XCOR" in variables and "YCOR" in variables:
            at = np.column_stack([variables[name].values().ravel() for name in ("XCOR", "YCOR")])
            corners = at[np.isfinite(at).all(axis=1) & (at != 0.0).any(axis=1)]
        roughness: Array | None = None
        kind: RoughnessKind = "not-stated"
        if "CFUROU" in variables and "chezy" in variables["CFUROU"].text("long_name").lower():
            of_faces = variables["CFUROU"].values(times).reshape(shape)
            both = np.stack([of_faces, _before(of_faces, 0)])  # the mean of those above 0
            known = np.isfinite(both) & (both > 0.0)
            total, count = np.where(known, both, 0.0).sum(axis=0), known.sum(axis=0)
            roughness, kind = np.where(count > 0, total / np.maximum(count, 1), np.nan)[active], "chezy"
        level, bed = level.reshape(shape), bed.reshape(shape)
        depth = np.where(wet, level - bed, 0.0)
        return model_result(
            "Delft3D-4", x[active], y[active], bed[active], level[active], depth[active],
            east[active], north[active], roughness=roughness, roughness_kind=kind, corners=corners,
            time=last_time(variables.get("time")), notes=turned,
        )  # fmt: skip


def _of_layers(variables: dict[str, NetcdfVariable], name: str, times: int, shape: tuple[int, ...]) -> Array:
    """Velocities (M, N), averaged over layers by their share of the depth: between SIG_INTF, else THICK."""
    found = variables[name].values(times)
    layers = found.reshape(-1, *shape)
    share = np.full(len(layers), 1.0 / len(layers))
    if "SIG_INTF" in variables and variables["SIG_INTF"].shape == (len(layers) + 1,):
        share = np.abs(np.diff(variables["SIG_INTF"].values()))
    elif "THICK" in variables and variables["THICK"].shape == (len(layers),):
        share = variables["THICK"].values()
    return np.asarray(np.einsum("k,kmn->mn", share, layers))


def _before(field: Array, axis: int) -> Array:
    """The value at the face before each centre, 0 before the first."""
    moved = np.roll(np.asarray(field, dtype=np.float64), 1, axis=axis)
    moved[(slice(None),) * axis + (0,)] = 0.0
    return moved


def _turned_as_the_grid(x: Array, y: Array, active: Mask, angle: Array) -> tuple[tuple[ImportNote, ...], Array]:
    """The angle with the sign with which it runs along the line from one centre to the next, and a note."""
    pairs = active[1:] & active[:-1]
    dx, dy = np.diff(x, axis=0)[pairs], np.diff(y, axis=0)[pairs]
    own = angle[1:][pairs]
    if not own.size or not np.hypot(dx, dy).any():
        return (), angle

    def along(sign: float) -> float:
        return float(np.mean((np.cos(own) * dx + sign * np.sin(own) * dy) / np.maximum(np.hypot(dx, dy), 1e-12)))

    if along(-1.0) > along(1.0) + 1e-6:
        return (ImportNote(Noted.CLOCKWISE),), -angle
    return (), angle
