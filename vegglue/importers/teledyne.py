"""ADCP transects of Teledyne RD Instruments: raw files (PD0), and the classic ASCII output of WinRiver II.

Formats: WorkHorse Commands and Output Data Format (P/N 957-6156-00): velocities against the boat, and those of the
bottom against it. WinRiver II User's Guide (P/N 957-6231-00), Classic ASCII Output: three lines of header, then for
each ensemble six lines and one for each depth cell.
"""

import math
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_options import FileOptions
from vegglue.importers.library_files import open_raw, read_by_library, readable_text
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.transects import BoatProfile, stations_of_transect

# How a file of ensembles begins.
PD0_BEGINS = b"\x7f\x7f"
INSTEAD = "classic ASCII output from WinRiver"
# What marks no velocity in the output of WinRiver, in the unit of the file.
NO_VELOCITY = -32768.0
# By the unit of the file: metres in one of depth, and in one of velocity (cm/s or ft/s).
SCALES = {"cm": (1.0, 0.01), "ft": (0.3048, 0.3048)}


def read_pd0(path: Path, options: FileOptions) -> MeasuredRows:
    """Stations of a transect. The instrument hangs `draft` below the surface, else as deep as the file has it.

    `declination` turns its compass to true north, beyond what the file does. InputError, also without mhkit.
    Water over ground is the water against the boat less the bottom against it; the boat moves as the bottom seems to,
    the other way, x_i = x_(i-1) + u_i (t_i - t_(i-1)), as makers' programs sum it up. Cells that the side lobes of the
    beams reach are left out: range > R cos(beam angle).
    """
    data = open_raw(path, INSTEAD)
    if data.attrs["coord_sys"] != "earth":
        from mhkit import dolfyn  # which has opened the file

        with read_by_library(path, "velocities to be turned to the earth", "", "export them in earth coordinates"):
            data = dolfyn.rotate2(data, "earth", inplace=False)
    if missing := {"vel", "vel_bt", "dist_bt"} - set(data):
        raise InputError(
            f"{shown_path(path)}: expected velocities and bottom track, got none of {', '.join(sorted(missing))}; "
            "without bottom track no boat has a place."
        )
    own = np.asarray(data["depth"].values, dtype=np.float64)
    draft = own if options.draft is None else np.full(own.shape, options.draft)
    bottom = np.asarray(data["vel_bt"].values, dtype=np.float64)[:2]
    known = np.isfinite(bottom).all(axis=0)
    time = (data["time"].values - data["time"].values[0]) / np.timedelta64(1, "s")
    track = np.cumsum(-bottom[:, known] * np.diff(time[known], prepend=time[known][:1]), axis=1)
    places = _to_true_north(track.T, options.declination)
    beams = np.asarray(data["dist_bt"].values, dtype=np.float64)[:, known]
    cells = np.asarray(data["range"].values, dtype=np.float64)
    size, slant = float(data.attrs["cell_size"]), math.cos(math.radians(float(data.attrs["beam_angle"])))
    water = np.asarray(data["vel"].values, dtype=np.float64)[:2, :, known] - bottom[:, None, known]
    profiles = []
    for i, (deep, (x, y)) in enumerate(zip(draft[known], places.tolist(), strict=True)):
        seen = beams[:, i][beams[:, i] > 0.0]
        reach = float(seen.min()) * slant if seen.size else 0.0
        velocity = _to_true_north(water[:, :, i].T, options.declination)
        good = np.isfinite(velocity).all(axis=1) & (cells + 0.5 * size <= reach)
        depth = float(seen.mean()) + float(deep) if seen.size else 0.0
        profiles.append(BoatProfile((x, y), depth, depth - deep - cells[good], velocity[good]))
    turned = f", turned by a declination of {options.declination:g} degrees" if options.declination else ""
    form = f"PD0 of a {data.attrs['inst_model']} {float(np.median(draft)):.3g} m below the surface{turned}"
    return stations_of_transect(path, options, profiles, form)


def _to_true_north(vectors: Array, declination: float) -> Array:
    """E = E_m cos D + N_m sin D, N = N_m cos D - E_m sin D (n, 2): magnetic north lies D degrees east of true north."""
    d = math.radians(declination)
    east, north = vectors.T
    return np.column_stack([east * math.cos(d) + north * math.sin(d), north * math.cos(d) - east * math.sin(d)])


def is_winriver(text: str) -> bool:
    """Whether a text begins as such an output: seven whole numbers on line 3, thirteen numbers of a time on line 4."""
    lines = text.splitlines()[:4]
    if len(lines) < 4 or len(lines[2].split()) != 7 or len(lines[3].split()) != 13:
        return False
    return all(word.lstrip("-").isdigit() for word in lines[2].split())


def read_winriver(path: Path, options: FileOptions) -> MeasuredRows:
    """Stations of a transect. InputError."""
    lines = [line for line in readable_text(path).splitlines() if line.strip()]
    profiles, at = [], 3
    while at + 6 <= len(lines):
        try:
            cells = int(lines[at + 5].split()[0])
            profiles.append(_ensemble([line.split() for line in lines[at : at + 6 + cells]]))
        except (ValueError, IndexError, KeyError):
            raise InputError(
                f"{shown_path(path)}, after {at} lines: expected an ensemble of WinRiver's classic ASCII output, got "
                f"{lines[at][:40]!r}; export it anew."
            ) from None
        at += 6 + cells
    return stations_of_transect(path, options, profiles, "WinRiver ASCII")


def _ensemble(rows: list[list[str]]) -> BoatProfile:
    """Line 2: velocity of the boat, then depths of the beams; line 3: distances; line 6: unit; then the cells."""
    metres, velocity = SCALES[rows[5][1].lower()]
    beams = np.array([float(text) for text in rows[1][8:12]])
    depth = metres * float(beams[beams > 0.0].mean()) if (beams > 0.0).any() else 0.0
    north, east = float(rows[2][2]), float(rows[2][3])
    cells = np.array([[float(row[column]) for column in (0, 3, 4)] for row in rows[6:]]).reshape(-1, 3)
    if not np.isfinite([depth, north, east, *cells.ravel()]).all():
        raise ValueError("a number that is none")
    cells = cells[(cells[:, 1:] != NO_VELOCITY).all(axis=1)]
    height = depth - metres * cells[:, 0]
    above = height > 0.0
    return BoatProfile((metres * east, metres * north), depth, height[above], velocity * cells[above, 1:])
