"""A boat's transect as stations: profiles averaged over the depth, and along the section."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import FileNote, ImportNote, Noted
from vegglue.importers.measured_rows import MeasuredRows

# Exponent of the profile by which measured cells are carried on to bed and surface, the one of the maker's programs.
PROFILE_POWER = 1.0 / 6.0
# Stations along a section, and the fewest ensembles whose scatter shows how well a station is known.
STATIONS, FEWEST_ENSEMBLES = 15, 4
LEAST_ERROR_OF_MEAN = 0.005  # m/s; the boat's own velocity is known no better
# Neither water nor a boat is faster [m/s], nor a river deeper [m]: what is larger marks no value. A boat that leaps
# further between two ensembles [m], and so many times further than it usually does, was lost in between. Chosen.
FASTEST, DEEPEST_RIVER, LEAP, TIMES_USUAL = 7.0, 200.0, 10.0, 20.0


@dataclass(frozen=True)
class BoatProfile:
    """One profile of a boat.

    Attributes
    ----------
    place : (float, float)
        East and north of the start of the transect [m], NaN if unknown.
    depth : float
        [m]
    height : ndarray (cells,)
        Of the cells above the bed [m].
    velocity : ndarray (cells, 2)
        To the east and north [m/s].
    """

    place: tuple[float, float]
    depth: float
    height: Array
    velocity: Array


def stations_of_transect(
    path: Path, options: FileOptions, profiles: Sequence[BoatProfile], *form: FileNote
) -> MeasuredRows:
    """Stations along the straight line that fits a transect, each the mean of the ensembles around it.

    Parameters
    ----------
    path : Path
        For messages.
    options : FileOptions
        With `start`, where the boat started, in the coordinates of the site [m].
    *form : FileNote
        How they were read.

    Returns
    -------
    MeasuredRows
        Velocities to the east and north with their standard errors [m/s]; each ensemble for itself on a short transect.

    Raises
    ------
    InputError
        Without `start`, or with fewer than FEWEST_ENSEMBLES ensembles of a place and velocities.
    """
    if options.start is None:
        raise InputError(
            f"{shown_path(path)}: expected where the boat started, `start: [x, y]`, as the file counts from there; "
            "add it to this file in `files`."
        )
    placed = [one for one in profiles if np.isfinite(one.place).all()]
    used = []
    for one in placed:
        good = (np.abs(one.velocity) <= FASTEST).all(axis=1) & (one.height > 0.0)
        if 0.0 < one.depth <= DEEPEST_RIVER and good.any():
            used.append(replace(one, height=one.height[good], velocity=one.velocity[good]))
    if len(used) < FEWEST_ENSEMBLES:
        lost = len(profiles) - len(placed)
        raise InputError(
            f"{shown_path(path)}: expected {FEWEST_ENSEMBLES} ensembles or more with a place and velocities, got "
            f"{len(used)} ({lost} of {len(profiles)} have no place); export it anew."
        )
    places = np.array([one.place for one in used]) + np.array(options.start)
    velocities = np.array([depth_mean(one) for one in used])
    # Means and their standard errors s / sqrt(n) in equal parts of the line through the places.
    middle = places.mean(axis=0)
    direction = np.linalg.svd(places - middle, full_matrices=False)[2][0]
    along = (places - middle) @ direction
    part = np.digitize(along, np.linspace(along.min(), along.max() + 1e-9, STATIONS + 1)) - 1
    parts = [rows for number in range(STATIONS) if (rows := part == number).sum() >= FEWEST_ENSEMBLES]
    at, mean, error = places, velocities, np.full(velocities.shape, np.nan)
    if parts:  # else a short transect: each ensemble for itself
        at = middle + np.outer([along[rows].mean() for rows in parts], direction)
        mean = np.array([velocities[rows].mean(axis=0) for rows in parts])
        scatter = np.array([velocities[rows].std(axis=0, ddof=1) / np.sqrt(rows.sum()) for rows in parts])
        error = np.maximum(scatter, LEAST_ERROR_OF_MEAN)
    numbers = {"x": at[:, 0], "y": at[:, 1], "east_velocity": mean[:, 0], "north_velocity": mean[:, 1]}
    numbers |= {"u_se": error[:, 0], "v_se": error[:, 1]}
    notes = [*form, ImportNote(Noted.ENSEMBLES, len(used))]
    for dropped, what in ((len(placed) - len(used), "velocities"), (len(profiles) - len(placed), "a place")):
        notes += [ImportNote(Noted.ENSEMBLES_LACKING, dropped, (what,))] if dropped else []
    columns = {"x": "distance east", "y": "distance north", "east_velocity": "east", "north_velocity": "north"}
    units = dict.fromkeys(columns, "m") | {"east_velocity": "m/s", "north_velocity": "m/s"}
    return MeasuredRows(numbers, {}, columns, units, tuple(notes))


def refuse_leaps(path: Path, profiles: Sequence[BoatProfile]) -> None:
    """InputError if a boat leaps between two ensembles of one transect."""
    places = np.array([one.place for one in profiles]).reshape(-1, 2)
    known = np.flatnonzero(np.isfinite(places).all(axis=1))
    if known.size < FEWEST_ENSEMBLES:
        return
    steps = np.linalg.norm(np.diff(places[known], axis=0), axis=1)
    allowed = LEAP + TIMES_USUAL * float(np.median(steps)) * np.diff(known)
    if (steps > allowed).any():
        worst = int(np.argmax(steps - allowed))
        raise InputError(
            f"{shown_path(path)}: expected the boat to move by up to {allowed[worst]:.3g} m, got {steps[worst]:.3g} m "
            f"from ensemble {known[worst] + 1} to {known[worst + 1] + 1}; remove ensembles whose place was lost, and "
            "export it anew."
        )


def depth_mean(ensemble: BoatProfile) -> tuple[float, float]:
    """U = a h^p / (p + 1), with the a that gives the measured cells their mean under u = a z^p

    Makers' programs do so above and below the cells.

    Returns
    -------
    float, float
        To the east and north [m/s].

    References
    ----------
    Chen (1991), doi:10.1061/(ASCE)0733-9429(1991)117:3(371).
    """
    shape = ensemble.height**PROFILE_POWER
    a = ensemble.velocity.mean(axis=0) / shape.mean()
    east, north = a * ensemble.depth**PROFILE_POWER / (PROFILE_POWER + 1.0)
    return float(east), float(north)
