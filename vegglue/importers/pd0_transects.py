"""ADCP transects as the instrument wrote them: PD0 of Teledyne RD Instruments, the raw files of WinRiver.

Format: WorkHorse Commands and Output Data Format (Teledyne RD Instruments, P/N 957-6156-00): velocities against the
boat, and those of the bottom against it.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.raw_files import opened_raw, turned_to_earth
from vegglue.importers.transects import BoatProfile, stations_of_transect

# How a file of ensembles begins.
PD0_BEGINS = b"\x7f\x7f"


def read_pd0(path: Path, words: FileWords) -> MeasuredRows:
    """Stations of a transect. The instrument hangs `draft` below the surface, else as deep as the file says.

    `declination` turns its compass to true north, beyond what the file says. Errors: InputError naming the file, and
    without mhkit.
    """
    data = _opened(path)
    draft = float(np.median(_draft(data, words)))
    turned = f", turned by a declination of {words.declination:g} degrees" if words.declination else ""
    form = f"PD0 of a {data.attrs['inst_model']} {draft:.3g} m below the surface{turned}"
    return stations_of_transect(path, words, _profiles(data, words), form)


def _opened(path: Path) -> Any:
    """The ensembles of a file, velocities turned to the earth (magnetic north)."""
    data = turned_to_earth(path, opened_raw(path, "classic ASCII output from WinRiver"))
    missing = {"vel", "vel_bt", "dist_bt"} - set(data)
    if missing:
        raise InputError(
            f"{shown_path(path)}: expected velocities and bottom track, got none of {', '.join(sorted(missing))}; "
            "without bottom track no boat has a place."
        )
    return data


def _profiles(data: Any, words: FileWords) -> Iterator[BoatProfile]:
    """Water over ground is the water against the boat less the bottom against it; the boat moves as the bottom seems
    to, the other way. Cells that the side lobes of the beams reach are left out: range > R cos(beam angle).
    """
    bottom = np.asarray(data["vel_bt"].values, dtype=np.float64)[:2]
    known = np.isfinite(bottom).all(axis=0)
    time = (data["time"].values - data["time"].values[0]) / np.timedelta64(1, "s")
    east, north = _track(time[known], -bottom[:, known])
    draft = _draft(data, words)[known]
    beams = np.asarray(data["dist_bt"].values, dtype=np.float64)[:, known]
    cells = np.asarray(data["range"].values, dtype=np.float64)
    size, slant = float(data.attrs["cell_size"]), math.cos(math.radians(float(data.attrs["beam_angle"])))
    water = np.asarray(data["vel"].values, dtype=np.float64)[:2, :, known] - bottom[:, None, known]
    for i in range(east.size):
        seen = beams[:, i][beams[:, i] > 0.0]
        reach = float(seen.min()) * slant if seen.size else 0.0
        velocity = _to_true_north(water[:, :, i].T, words.declination)
        good = np.isfinite(velocity).all(axis=1) & (cells + 0.5 * size <= reach)
        depth = float(seen.mean()) + float(draft[i]) if seen.size else 0.0
        ((x, y),) = _to_true_north(np.array([[east[i], north[i]]]), words.declination).tolist()
        yield BoatProfile((x, y), depth, depth - draft[i] - cells[good], velocity[good])


def _draft(data: Any, words: FileWords) -> Array:
    """Depth of the instrument in each ensemble (n,) [m]."""
    own = np.asarray(data["depth"].values, dtype=np.float64)
    return own if words.draft is None else np.full(own.shape, words.draft)


def _track(time: Array, boat: Array) -> tuple[Array, Array]:
    """x_i = x_(i-1) + u_i (t_i - t_(i-1)), as makers' programs sum it up [m]. boat: velocities (2, n) [m/s]."""
    steps = np.diff(time, prepend=time[:1])
    east, north = np.cumsum(boat * steps, axis=1)
    return east, north


def _to_true_north(vectors: Array, declination: float) -> Array:
    """E = E_m cos D + N_m sin D, N = N_m cos D - E_m sin D (n, 2): magnetic north lies D degrees east of true north."""
    d = math.radians(declination)
    east, north = vectors.T
    return np.column_stack([east * math.cos(d) + north * math.sin(d), north * math.cos(d) - east * math.sin(d)])
