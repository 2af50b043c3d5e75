"""Velocities of the surface by images of a camera (LSPIV, PTV), as pyorc writes them: a grid at many times, in NetCDF.

Format: pyorc 0.8 (its published source and example). v_x and v_y (time, y, x) [m/s] run along the axes x (x,) and y
(y,) of the images [m]; xs and ys (y, x) [m] are these places on the map.
"""

import math
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.library_files import read_by_library, refuse_larger
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.model_result import netcdf_variables
from vegglue.importers.repeats import autocorrelation_time
from vegglue.sandboxed_reader import why_unreadable

VELOCIMETRY_VARIABLES = ("v_x", "v_y", "xs", "ys", "x", "y")
# Share of the times at which a cell has to hold a velocity [-], as by default in pyorc.
LEAST_SEEN = 0.33
# Cells beside each other along each axis that share most of their images: windows of pyorc overlap by half.
OVERLAPPING = 2
_IN_ITS_PROCESS = "vegglue.importers.model_result:why_no_variables"


def read_velocimetry(path: Path, options: FileOptions) -> MeasuredRows:
    """Means over time of cells two by two, which overlap, and their standard errors by the spread over time.

        se = s (tau / n)^(1/2),   s of the values of a cell, n of them, tau their autocorrelation time

    Parameters
    ----------
    path
        NetCDF of pyorc.
    options
        `factor` from the surface to the mean of the vertical; without it a note asks for it.

    Returns
    -------
    MeasuredRows
        Velocities east and north [m/s], their errors [m/s], and places on the map [m].

    Raises
    ------
    InputError
        For a NetCDF of another kind, and where no cell holds enough velocities.
    """
    refuse_larger(path, path.stat().st_size)
    changed, size = path.stat().st_mtime_ns, path.stat().st_size
    why = why_unreadable(path.absolute(), size, changed, by=_IN_ITS_PROCESS)
    if why is not None:
        raise InputError("unreadable_as", file=path, kind="NetCDF", why=why)
    with read_by_library(path, "NetCDF"), netcdf_variables(path) as variables:
        if not set(VELOCIMETRY_VARIABLES) <= variables.keys():
            raise InputError(
                f"{shown_path(path)}: expected velocities of images, as pyorc writes them, with "
                f"{', '.join(VELOCIMETRY_VARIABLES)}, got a NetCDF with {', '.join(variables) or 'nothing in it'}; "
                "export a table."
            )
        refuse_larger(path, 8 * math.prod(variables["v_x"].shape))
        along, across, east, north, x, y = (variables[name].values() for name in VELOCIMETRY_VARIABLES)
        if along.ndim == 2:  # means over time already
            along, across = along[None], across[None]
        shape = along.shape[1:]
        if not (along.shape == across.shape == (len(along), y.size, x.size) and east.shape == north.shape == shape):
            raise ValueError(f"v_x (time, y, x) has the shape {along.shape}, xs (y, x) {east.shape}")
        if min(shape) < 2 or not all(np.isfinite(one).all() for one in (east, north, x, y)):
            raise ValueError("places")
    times = len(along)
    # Directions of the axes of the images on the map.
    to_x = np.array([np.mean(np.diff(part, axis=1) / np.diff(x)) for part in (east, north)])
    to_y = np.array([np.mean(np.diff(part, axis=0) / np.diff(y)[:, None]) for part in (east, north)])
    series = to_x[:, None, None, None] * along + to_y[:, None, None, None] * across
    seen = np.isfinite(series[0]).sum(axis=0)
    enough = seen >= max(LEAST_SEEN * times, min(times, 2))  # one value has no spread
    if not enough.any():
        raise InputError(
            f"{shown_path(path)}: expected velocities at {100 * LEAST_SEEN:.0f} % of {times} times in some cell, got "
            "none; mask less in pyorc."
        )
    series = np.where(enough, series, 0.0)
    mean, spread = np.nanmean(series, axis=1), np.nanstd(series, axis=1, ddof=min(times - 1, 1))
    tau = autocorrelation_time(one[np.isfinite(one)] for part in series for one in part[:, enough].T)
    error = spread * np.sqrt(tau / np.maximum(seen, 1))
    moving = means_of_blocks(np.where(enough, [*mean, *error], np.nan))
    found = np.concatenate([means_of_blocks(np.array([east, north])), moving])[:, np.isfinite(moving[0])]
    roles = ("x", "y", "east_velocity", "north_velocity", "u_se", "v_se")
    headings = ("xs", "ys", "v_x", "v_y")
    return MeasuredRows(
        numbers=dict(zip(roles[: 6 if times > 1 else 4], found, strict=False)),
        texts={},
        columns=dict(zip(roles, headings, strict=False)),
        units={"x": "m", "y": "m", "east_velocity": "m/s", "north_velocity": "m/s"},
        notes=("pyorc", ImportNote(Noted.IMAGES, times, ("" if options.factor else "factor",))),
    )


def means_of_blocks(fields: Array) -> Array:
    """Means (k, n) of cells OVERLAPPING by OVERLAPPING of fields (k, ny, nx), of those that hold a number; else NaN."""
    _, ny, nx = fields.shape
    pad = ((0, 0), (0, -ny % OVERLAPPING), (0, -nx % OVERLAPPING))
    padded = np.pad(fields, pad, constant_values=np.nan)
    blocks = padded.reshape(len(fields), padded.shape[1] // OVERLAPPING, OVERLAPPING, -1, OVERLAPPING)
    known = np.isfinite(blocks)
    number = known.sum(axis=(2, 4))
    total = np.where(known, blocks, 0.0).sum(axis=(2, 4))
    return np.where(number > 0, total / np.maximum(number, 1), np.nan).reshape(len(fields), -1)
