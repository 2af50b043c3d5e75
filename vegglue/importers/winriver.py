"""ADCP transects: the classic ASCII output of WinRiver II, averaged over the depth and along the section.

Format: WinRiver II User's Guide (Teledyne RD Instruments, P/N 957-6231-00), Classic ASCII Output: three lines of
header, then for each ensemble six lines and one for each depth cell.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import readable_text
from vegglue.importers.measured_rows import Taken

# What marks no velocity, in the unit of the file.
NO_VELOCITY = -32768.0
# By the unit of the file: metres in one of depth, and in one of velocity (cm/s or ft/s).
SCALES = {"cm": (1.0, 0.01), "ft": (0.3048, 0.3048)}
# Exponent of the profile by which measured cells are carried on to bed and surface, the one of the maker's programs.
PROFILE_POWER = 1.0 / 6.0
# Stations along a section, and the fewest ensembles whose scatter says how well a station is known.
STATIONS, FEWEST_ENSEMBLES = 15, 4
LEAST_ERROR_OF_MEAN = 0.005  # m/s; the boat's own velocity is known no better


@dataclass(frozen=True)
class BoatProfile:
    """One profile: east and north of the start of the transect [m], depth [m], heights of the cells above the bed
    (cells,) [m] and their velocities to the east and north (cells, 2) [m/s].
    """

    place: tuple[float, float]
    depth: float
    height: Array
    velocity: Array


def is_winriver(text: str) -> bool:
    """Whether a text begins as such an output: seven whole numbers on line 3, thirteen numbers of a time on line 4."""
    lines = text.splitlines()[:4]
    if len(lines) < 4 or len(lines[2].split()) != 7 or len(lines[3].split()) != 13:
        return False
    return all(word.lstrip("-").isdigit() for word in lines[2].split())


def read_winriver(path: Path, words: FileWords) -> Taken:
    """Stations along the straight line that fits the transect, each the mean of the ensembles around it.

    `start` of the file, in the coordinates of the site, is where the boat started. Errors: InputError naming the file.
    """
    if words.start is None:
        raise InputError(
            f"{shown_path(path)}: expected where the boat started, `start: [x, y]`, as the file counts from there; "
            "add it to this file in `files`."
        )
    ensembles = list(_ensembles(path, readable_text(path).splitlines()))
    means = [(one, *depth_mean(one)) for one in ensembles if one.depth > 0.0 and one.height.size]
    if len(means) < FEWEST_ENSEMBLES:
        raise InputError(f"{shown_path(path)}: expected ensembles with velocities, got {len(means)}; export it anew.")
    places = np.array([one.place for one, *_ in means]) + np.array(words.start)
    velocities = np.array([velocity for _, *velocity in means])
    x, y, mean, error = _along_the_section(places, velocities)
    numbers = {"x": x, "y": y, "east_velocity": mean[:, 0], "north_velocity": mean[:, 1]}
    numbers |= {"u_se": error[:, 0], "v_se": error[:, 1]}
    dropped = len(ensembles) - len(means)
    said = (
        f"WinRiver ASCII, {len(means)} ensembles" + (f", {dropped} without velocities left out" if dropped else ""),
    )
    columns = {"x": "distance east", "y": "distance north", "east_velocity": "east", "north_velocity": "north"}
    return Taken(
        numbers, {}, columns, dict.fromkeys(columns, "m") | {"east_velocity": "m/s", "north_velocity": "m/s"}, said
    )


def depth_mean(ensemble: BoatProfile) -> tuple[float, float]:
    """U = a h^p / (p + 1), with the a that gives the measured cells their mean under u = a z^p [m/s].

    Source: Chen (1991), doi 10.1061/(ASCE)0733-9429(1991)117:3(371); makers' programs do so above and below the cells.
    """
    shape = ensemble.height**PROFILE_POWER
    a = ensemble.velocity.mean(axis=0) / shape.mean()
    east, north = a * ensemble.depth**PROFILE_POWER / (PROFILE_POWER + 1.0)
    return float(east), float(north)


def _along_the_section(places: Array, velocities: Array) -> tuple[Array, Array, Array, Array]:
    """Means and their standard errors in equal parts of the line through the places, s / sqrt(n) of n ensembles."""
    middle = places.mean(axis=0)
    direction = np.linalg.svd(places - middle, full_matrices=False)[2][0]
    along = (places - middle) @ direction
    edges = np.linspace(along.min(), along.max() + 1e-9, STATIONS + 1)
    part = np.digitize(along, edges) - 1
    used = [number for number in range(STATIONS) if (part == number).sum() >= FEWEST_ENSEMBLES]
    if not used:  # a short transect: each ensemble for itself
        return places[:, 0], places[:, 1], velocities, np.full(velocities.shape, np.nan)
    at = middle + np.outer([along[part == number].mean() for number in used], direction)
    mean = np.array([velocities[part == number].mean(axis=0) for number in used])
    scatter = np.array([velocities[part == n].std(axis=0, ddof=1) / np.sqrt((part == n).sum()) for n in used])
    return at[:, 0], at[:, 1], mean, np.maximum(scatter, LEAST_ERROR_OF_MEAN)


def _ensembles(path: Path, lines: list[str]) -> Iterator[BoatProfile]:
    lines = [line for line in lines if line.strip()]
    at = 3
    while at + 6 <= len(lines):
        try:
            cells = int(lines[at + 5].split()[0])
            yield _ensemble([line.split() for line in lines[at : at + 6 + cells]])
        except (ValueError, IndexError, KeyError):
            raise InputError(
                f"{shown_path(path)}, after {at} lines: expected an ensemble of WinRiver's classic ASCII output, got "
                f"{lines[at][:40]!r}; export it anew."
            ) from None
        at += 6 + cells


def _ensemble(rows: list[list[str]]) -> BoatProfile:
    """Line 2: velocity of the boat, then depths of the beams; line 3: distances; line 6: unit; then the cells."""
    unit = rows[5][1].lower()
    metres, velocity = SCALES[unit]
    beams = np.array([float(text) for text in rows[1][8:12]])
    depth = metres * float(beams[beams > 0.0].mean()) if (beams > 0.0).any() else 0.0
    north, east = float(rows[2][2]), float(rows[2][3])
    cells = np.array([[float(row[column]) for column in (0, 3, 4)] for row in rows[6:]]).reshape(-1, 3)
    cells = cells[(cells[:, 1:] != NO_VELOCITY).all(axis=1)]
    height = depth - metres * cells[:, 0]
    above = height > 0.0
    return BoatProfile((metres * east, metres * north), depth, height[above], velocity * cells[above, 1:])
