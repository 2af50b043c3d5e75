"""ADCP transects of Teledyne RD Instruments: raw files (PD0), and the classic ASCII output of WinRiver II.

Formats: WorkHorse Commands and Output Data Format (P/N 957-6156-00): velocities against the boat, and those of the
bottom against it. WinRiver II User's Guide (P/N 957-6231-00), Classic ASCII Output: three lines of header, then for
each ensemble six lines and one for each depth cell.
"""

import math
import struct
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.library_files import open_raw, read_by_library, readable_text
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.transects import (
    DEEPEST_RIVER,
    FASTEST,
    FEWEST_ENSEMBLES,
    BoatProfile,
    refuse_leaps,
    stations_of_transect,
)

# How a file of ensembles begins, and each ensemble; bytes of the shortest one, header and leaders alone.
PD0_BEGINS, LEAST_ENSEMBLE = b"\x7f\x7f", 100
# How blocks begin: the fixed leader, and those of the surface layer of a RiverPro or a StreamPro.
FIXED_LEADER = b"\x00\x00"
SURFACE_BLOCKS = {bytes([0x10, number]) for number in range(6)}
# The bottom moves if it drifts by more than this share of the speed of the water, Mueller et al. (2013), Techniques and
# Methods 3-A22 (not compared with the source), and by more standard errors of its mean than this, chosen.
MOVING_BED, ERRORS_OF_DRIFT = 0.01, 3.0
# Way of the boat while the bottom was lost that is told [m]. Chosen: bottom track alone places a boat no better.
LONGEST_WAY = 1.0
EARTH, FLATTENING = 6_378_137.0, 1.0 / 298.257223563  # equatorial radius [m], and flattening of WGS 84
# What marks no value in the output of WinRiver, whatever the unit.
NO_VALUE = -32768.0
# By the unit of the file: metres in one of depth, and in one of velocity (cm/s or ft/s).
SCALES = {"cm": (1.0, 0.01), "ft": (0.3048, 0.3048)}


@dataclass(frozen=True)
class _RawEnsemble:
    """Time; draft [m]; bottom against the boat (2,) [m/s]; depth below the instrument [m], 0 for none; ranges of the
    cells above the side lobes (cells,) [m], and their velocities against the boat (cells, 2) [m/s]; latitude and
    longitude by GPS (2,) [degrees], NaN for none.
    """

    time: np.datetime64
    draft: float
    bottom: Array
    depth: float
    cells: Array
    water: Array
    fix: Array


def read_pd0(path: Path, options: FileOptions) -> MeasuredRows:
    """Stations of a raw transect.

    x_i = x_(i-1) + u_i (t_i - t_(i-1)), the boat moving as the bottom seems to, the other way. Water over ground is the
    water against the boat less the bottom against it. If the file has places by GPS, these count, and their velocity
    dx/dt where the bottom was lost, everywhere if the bottom drifts against them: over a bed that moves, bottom track
    gives too little. Cells that the side lobes of the beams reach are left out: range > R cos(beam angle).

    Parameters
    ----------
    path
        Velocities in coordinates of the earth, the ship, the instrument or its beams.
    options
        `start` of the boat [m]; `draft` of the instrument [m], else that of the file; `declination`, which turns its
        compass to true north beyond what the file does [degrees].

    Returns
    -------
    MeasuredRows
        Velocities east and north at up to 15 stations, with errors [m/s].

    Raises
    ------
    InputError
        Also without mhkit, without bottom track and GPS, and if the boat leaps.

    References
    ----------
    WorkHorse Commands and Output Data Format (P/N 957-6156-00). Mueller et al. (2013), doi:10.3133/tm3A22.
    """
    groups, damaged, of_surface = _sound_ensembles(path.read_bytes())
    read = [_raw_ensembles(path, group) for group in groups]
    model, found = read[-1][0], sorted((one for _, some in read for one in some), key=lambda one: one.time)
    bottoms = np.array([one.bottom for one in found])
    known = (np.isfinite(bottoms) & (np.abs(np.nan_to_num(bottoms)) <= FASTEST)).all(axis=1)
    time = np.array([(one.time - found[0].time) / np.timedelta64(1, "s") for one in found])
    fixes = np.array([one.fix for one in found])
    by_gps = np.isfinite(fixes).all(axis=1) & (np.diff(time, prepend=-1.0) > 0.0)
    has_gps = np.count_nonzero(by_gps) >= FEWEST_ENSEMBLES
    if not (known.any() or has_gps):
        raise InputError(
            f"{shown_path(path)}: expected bottom track or GPS, got none in {known.size} ensembles; where the boat "
            "was is unknown. Export classic ASCII output with GPS as reference from WinRiver."
        )
    own = np.array([one.draft for one in found])
    usual = float(np.nanmedian(own)) if np.isfinite(own).any() else 0.0
    draft = np.where(np.isnan(own), usual, own) if options.draft is None else np.full(own.shape, options.draft)
    boat = np.where(known[:, None], -_to_true_north(bottoms, options.declination), np.nan)
    place = np.full(boat.shape, np.nan)
    place[known] = np.cumsum(boat[known] * np.diff(time[known], prepend=time[known][:1])[:, None], axis=0)
    against = [_to_true_north(one.water, options.declination) for one in found]
    reference: tuple[ImportNote, ...] = ()
    if has_gps:
        place = _metres_from_first(fixes)
        moved = np.full(boat.shape, np.nan)
        moved[by_gps] = np.gradient(place[by_gps], time[by_gps], axis=0)
        drift = _drift_of_bottom(boat, moved, against)
        boat = np.where(np.isfinite(boat) & (drift == 0.0), boat, moved)
        reference = (ImportNote(Noted.BY_GPS, drift),)
    else:
        # The longest way [m] between ensembles with bottom track, others between them, at the velocity after it.
        lost = np.diff(np.searchsorted(time, time[known])) > 1
        way = float((np.hypot(*boat[known][1:].T) * np.diff(time[known]))[lost].max(initial=0.0))
        if way > LONGEST_WAY:
            reference = (ImportNote(Noted.BOTTOM_BRIDGED, way),)
    profiles = []
    for one, deep, at, own_velocity, water in zip(found, draft.tolist(), place.tolist(), boat, against, strict=True):
        if not np.isfinite([*at, *own_velocity]).all():
            profiles.append(BoatProfile((np.nan, np.nan), 0.0, np.zeros(0), np.zeros((0, 2))))
            continue
        velocity = water + own_velocity
        good = np.isfinite(velocity).all(axis=1)
        depth = one.depth + deep if one.depth > 0.0 else 0.0
        profiles.append(BoatProfile((at[0], at[1]), depth, depth - deep - one.cells[good], velocity[good]))
    refuse_leaps(path, profiles)
    form = [ImportNote(Noted.ADCP_AT, float(np.median(draft)), (model,))]
    form += [ImportNote(Noted.DECLINATION, options.declination)] if options.declination else []
    form += reference
    form += [ImportNote(Noted.DAMAGED, damaged)] if damaged else []
    form += [ImportNote(Noted.SURFACE_LAYER)] if of_surface else []
    return stations_of_transect(path, options, profiles, *form)


def _raw_ensembles(path: Path, group: list[bytes]) -> tuple[str, list[_RawEnsemble]]:
    """The instrument, and what it measured in ensembles with the same cells, velocities east and north."""
    with TemporaryDirectory() as folder:  # the reader drops the last ensemble
        copy = Path(folder) / path.name
        copy.write_bytes(b"".join([*group, group[-1]]))
        data = open_raw(copy, "WinRiver", named=path)
    if missing := {"vel", "vel_bt", "dist_bt"} - set(data):
        raise InputError(
            f"{shown_path(path)}: expected velocities and bottom track, got none of {', '.join(sorted(missing))}; "
            "without bottom track the way of the boat is unknown: leave the file out."
        )
    lost = np.abs(data["vel_bt"]) > FASTEST  # -32.768 m/s marks a lost bottom; the reader keeps it
    data["vel_bt"] = data["vel_bt"].where(~lost)
    if data.attrs["coord_sys"] == "beam" and str(data.attrs.get("use_3beam", "")) == "yes":
        for name in ("vel", "vel_bt"):  # one lost of four from b1 + b2 - b3 - b4 = 0, no error of velocity
            beams = np.asarray(data[name].values, dtype=np.float64)
            signs, lost_beams = np.array([1.0, 1.0, -1.0, -1.0]).reshape(-1, *[1] * (beams.ndim - 1)), np.isnan(beams)
            rest = -signs * np.nansum(signs * beams, axis=0)
            data[name] = (data[name].dims, np.where(lost_beams & (lost_beams.sum(axis=0) == 1), rest, beams))
    model = str(data.attrs["inst_model"])
    if data.attrs["coord_sys"] != "earth":
        from mhkit import dolfyn  # which has opened the file

        with read_by_library(path, "turned"):
            data = dolfyn.rotate2(data, "earth", inplace=False)
    own, beams, bottom, water, cells = (
        np.asarray(data[name].values, dtype=np.float64) for name in ("depth", "dist_bt", "vel_bt", "vel", "range")
    )
    own = np.where((own >= 0.0) & (own <= DEEPEST_RIVER), own, np.nan)
    beams = np.where((beams > 0.0) & (beams <= DEEPEST_RIVER), beams, np.nan)  # 0 marks a lost beam
    fixes = _fixes(data)
    half, slant = 0.5 * float(data.attrs["cell_size"]), math.cos(math.radians(float(data.attrs["beam_angle"])))
    found = []
    for i, time in enumerate(data["time"].values):
        seen = beams[np.isfinite(beams[:, i]), i]
        reached = cells + half <= (float(seen.min()) * slant if seen.size else 0.0)
        depth = float(seen.mean()) if seen.size else 0.0
        found.append(
            _RawEnsemble(time, own[i], bottom[:2, i], depth, cells[reached], water[:2, reached, i].T, fixes[i])
        )
    return model, found


def _fixes(data: Any) -> Array:
    """Latitude and longitude at the times of the ensembles (n, 2) [degrees], NaN before the first fix and after the
    last; a file without GPS has none.
    """
    time = data["time"].values
    if not {"latitude_gps", "longitude_gps", "hdwtime_gps"} <= set(data):
        return np.full((time.size, 2), np.nan)
    at = (data["hdwtime_gps"].values - time[0]) / np.timedelta64(1, "s")
    places = np.column_stack([data[name].values for name in ("latitude_gps", "longitude_gps")]).astype(np.float64)
    sound = np.isfinite(at) & np.isfinite(places).all(axis=1) & (places != 0.0).any(axis=1)
    if not sound.any():
        return np.full((time.size, 2), np.nan)
    order = np.argsort(at[sound])
    seconds = (time - time[0]) / np.timedelta64(1, "s")
    return np.column_stack(
        [np.interp(seconds, at[sound][order], part[sound][order], np.nan, np.nan) for part in places.T]
    )


def _metres_from_first(fixes: Array) -> Array:
    """East and north of the first fix (n, 2) [m], by the radii of WGS 84 along its parallel and its meridian."""
    first = fixes[np.flatnonzero(np.isfinite(fixes).all(axis=1))[0]]
    latitude, squared = math.radians(first[0]), FLATTENING * (2.0 - FLATTENING)
    flat = 1.0 - squared * math.sin(latitude) ** 2
    north, east = np.radians(fixes - first).T
    return np.column_stack([east * EARTH / flat**0.5 * math.cos(latitude), north * EARTH * (1.0 - squared) / flat**1.5])


def _drift_of_bottom(boat: Array, moved: Array, against: list[Array]) -> float:
    """How fast the bottom drifts against the places [m/s], 0 if it stands still.

    boat, moved: velocity of the boat by bottom track and by GPS (n, 2), NaN for none; against: that of the water
    against the boat, cells of each ensemble.
    """
    both = np.isfinite(boat + moved).all(axis=1)
    if both.sum() < FEWEST_ENSEMBLES:
        return 0.0
    apart = (boat - moved)[both]
    drift, error = apart.mean(axis=0), apart.std(axis=0, ddof=1) / math.sqrt(len(apart))
    over = np.vstack([against[i] + moved[i] for i in np.flatnonzero(both)])
    speed = float(np.hypot(*over[np.isfinite(over).all(axis=1)].mean(axis=0)))
    size = float(np.hypot(*drift))
    return size if size > MOVING_BED * speed and size > ERRORS_OF_DRIFT * float(np.hypot(*error)) else 0.0


def _sound_ensembles(content: bytes) -> tuple[list[list[bytes]], int, bool]:
    """Whole ensembles with a right check sum, those with the same cells together, as the reader takes all cells for
    those of the first ensemble; how many are damaged; and whether
    blocks of a surface layer were taken out, whose cells of another size the reader misplaces.

    Each ensemble begins with its mark, its number of bytes without the check sum, and the places of its blocks.
    """
    groups: dict[bytes, list[bytes]] = {}
    at = damaged = 0
    of_surface = False
    while at + 4 <= len(content):
        size = int.from_bytes(content[at + 2 : at + 4], "little")
        whole = content[at : at + size + 2]
        if (
            size < LEAST_ENSEMBLE
            or len(whole) < size + 2
            or int.from_bytes(whole[size:], "little") != sum(whole[:size]) & 0xFFFF
        ):
            damaged += content[at : at + 2] == PD0_BEGINS
            at = content.find(PD0_BEGINS, at + 1)
            if at < 0:
                break
            continue
        at += size + 2
        starts = [int.from_bytes(whole[6 + 2 * i : 8 + 2 * i], "little") for i in range(whole[5])]
        blocks = [whole[a:b] for a, b in pairwise([*starts, size - 2])]
        kept = [block for block in blocks if block[:2] not in SURFACE_BLOCKS]
        if len(kept) < len(blocks):
            of_surface = True
            ends = np.cumsum([6 + 2 * len(kept), *map(len, kept)]).tolist()
            whole = struct.pack("<HHBB", 0x7F7F, ends[-1] + 2, whole[4], len(kept))
            whole += struct.pack(f"<{len(kept)}H", *ends[:-1]) + b"".join(kept) + bytes(2)
            whole += struct.pack("<H", sum(whole) & 0xFFFF)
        leader = next((block for block in kept if block[:2] == FIXED_LEADER), b"")
        groups.setdefault(leader[9:10] + leader[12:14] + leader[32:34], []).append(whole)  # count, size and first range
    return [*groups.values()] or [[content]], damaged, of_surface


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
    """Stations of a transect, from classic ASCII output.

    Parameters
    ----------
    path
        Velocities over ground (reference BT, GGA or VTG), in cm or ft.
    options
        `start` of the boat [m].

    Returns
    -------
    MeasuredRows
        Velocities east and north at up to 15 stations, with errors [m/s].

    Raises
    ------
    InputError
        For velocities against the boat, a file that is cut short, and a boat that leaps.

    References
    ----------
    WinRiver II User's Guide (P/N 957-6231-00), Classic ASCII Output.
    """
    text = readable_text(path).replace(",", ".")  # decimal commas: spaces part the fields
    lines = [line for line in text.splitlines() if line.strip()]
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
    if not rows[5][2][0].isalpha():
        raise ValueError("a reference that is none")  # a mark of no value: over what these velocities are is unknown
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
