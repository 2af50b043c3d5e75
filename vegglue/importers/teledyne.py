"""ADCP transects of Teledyne RD Instruments: raw files (PD0), and the classic ASCII output of WinRiver II.

Formats: WorkHorse Commands and Output Data Format (P/N 957-6156-00): velocities against the boat, and those of the
bottom against it. WinRiver II User's Guide (P/N 957-6231-00), Classic ASCII Output: three lines of header, then for
each ensemble six lines and one for each depth cell.
"""

import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_options import FileOptions
from vegglue.importers.library_files import open_raw, read_by_library, readable_text
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.transects import DEEPEST_RIVER, FASTEST, BoatProfile, refuse_leaps, stations_of_transect

# How a file of ensembles begins.
PD0_BEGINS = b"\x7f\x7f"
INSTEAD = "classic ASCII output from WinRiver"
# What marks no value in the output of WinRiver, whatever the unit.
NO_VALUE = -32768.0
# By the unit of the file: metres in one of depth, and in one of velocity (cm/s or ft/s).
SCALES = {"cm": (1.0, 0.01), "ft": (0.3048, 0.3048)}


def read_pd0(path: Path, options: FileOptions) -> MeasuredRows:
    """Stations of a transect. The instrument hangs `draft` below the surface, else as deep as the file has it.

    `declination` turns its compass to true north, beyond what the file does. InputError, also without mhkit.
    Water over ground is the water against the boat less the bottom against it; the boat moves as the bottom seems to,
    the other way, x_i = x_(i-1) + u_i (t_i - t_(i-1)), as makers' programs sum it up. Cells that the side lobes of the
    beams reach are left out: range > R cos(beam angle).
    """
    with TemporaryDirectory() as folder:
        data = open_raw(_with_last_ensemble_twice(path, Path(folder)), INSTEAD, named=path)
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
    own = np.where((own >= 0.0) & (own <= DEEPEST_RIVER), own, np.nan)
    own = np.where(np.isnan(own), np.nanmedian(own) if np.isfinite(own).any() else 0.0, own)
    draft = own if options.draft is None else np.full(own.shape, options.draft)
    bottom = np.asarray(data["vel_bt"].values, dtype=np.float64)[:2]
    # -32.768 m/s marks a lost bottom; the reader keeps it.
    known = np.isfinite(bottom).all(axis=0) & (np.abs(np.nan_to_num(bottom)) <= FASTEST).all(axis=0)
    if not known.any():
        raise InputError(
            f"{shown_path(path)}: expected bottom track, got none in {known.size} ensembles; without it no boat has a "
            "place. Export classic ASCII output with GPS as reference from WinRiver."
        )
    time = (data["time"].values - data["time"].values[0]) / np.timedelta64(1, "s")
    track = np.cumsum(-bottom[:, known] * np.diff(time[known], prepend=time[known][:1]), axis=1)
    places = _to_true_north(track.T, options.declination)
    beams = np.asarray(data["dist_bt"].values, dtype=np.float64)[:, known]
    beams = np.where((beams > 0.0) & (beams <= DEEPEST_RIVER), beams, np.nan)  # 0 marks a lost beam
    cells = np.asarray(data["range"].values, dtype=np.float64)
    size, slant = float(data.attrs["cell_size"]), math.cos(math.radians(float(data.attrs["beam_angle"])))
    water = np.asarray(data["vel"].values, dtype=np.float64)[:2, :, known] - bottom[:, None, known]
    profiles = [BoatProfile((np.nan, np.nan), 0.0, np.zeros(0), np.zeros((0, 2)))] * int((~known).sum())
    for i, (deep, (x, y)) in enumerate(zip(draft[known], places.tolist(), strict=True)):
        seen = beams[:, i][np.isfinite(beams[:, i])]
        reach = float(seen.min()) * slant if seen.size else 0.0
        velocity = _to_true_north(water[:, :, i].T, options.declination)
        good = np.isfinite(velocity).all(axis=1) & (cells + 0.5 * size <= reach)
        depth = float(seen.mean()) + float(deep) if seen.size else 0.0
        profiles.append(BoatProfile((x, y), depth, depth - deep - cells[good], velocity[good]))
    refuse_leaps(path, profiles)
    turned = f", turned by a declination of {options.declination:g} degrees" if options.declination else ""
    form = f"PD0 of a {data.attrs['inst_model']} {float(np.median(draft)):.3g} m below the surface{turned}"
    return stations_of_transect(path, options, profiles, form)


def _with_last_ensemble_twice(path: Path, folder: Path) -> Path:
    """A copy of a file whose last whole ensemble stands there again: the reader drops the last one that it meets.

    Each ensemble begins with its mark and its number of bytes, without the check sum of two behind it.
    """
    content = path.read_bytes()
    at = last = 0
    while content[at : at + 2] == PD0_BEGINS and at + 4 <= len(content):
        end = at + int.from_bytes(content[at + 2 : at + 4], "little") + 2
        if end > len(content):
            break
        last, at = at, end
    copy = folder / path.name
    copy.write_bytes(content[:at] + content[last:at] if at else content)
    return copy


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
            profiles.append(_ensemble(path, [line.split() for line in lines[at : at + 6 + cells]]))
        except InputError:
            raise
        except (ValueError, IndexError, KeyError):
            raise InputError(
                f"{shown_path(path)}, after {at} lines: expected an ensemble of WinRiver's classic ASCII output, got "
                f"{lines[at][:40]!r}; export it anew."
            ) from None
        at += 6 + cells
    refuse_leaps(path, profiles)
    return stations_of_transect(path, options, profiles, "WinRiver ASCII")


def _ensemble(path: Path, rows: list[list[str]]) -> BoatProfile:
    """Line 2: velocity of the boat, then depths of the beams; line 3: distances; line 6: unit, reference of the
    velocities; then the cells. An ensemble without bottom track or position has no place.
    """
    if rows[5][2].upper() == "NONE":
        raise InputError(
            f"{shown_path(path)}: expected velocities over ground (reference BT, GGA or VTG), got NONE; choose a "
            "reference in WinRiver and export it anew."
        )
    metres, velocity = SCALES[rows[5][1].lower()]
    beams = np.array([float(text) for text in rows[1][8:12]])
    depth = metres * float(beams[beams > 0.0].mean()) if (beams > 0.0).any() else 0.0
    north, east = float(rows[2][2]), float(rows[2][3])
    cells = np.array([[float(row[column]) for column in (0, 3, 4)] for row in rows[6:]]).reshape(-1, 3)
    if not np.isfinite([depth, north, east, *cells.ravel()]).all():
        raise ValueError("a number that is none")
    cells = cells[(cells != NO_VALUE).all(axis=1)]
    height = depth - metres * cells[:, 0]
    above = height > 0.0
    boat = [float(text) for text in (rows[1][0], *rows[2][2:4])]
    place = (np.nan, np.nan) if NO_VALUE in boat else (metres * east, metres * north)
    return BoatProfile(place, depth, height[above], velocity * cells[above, 1:])
