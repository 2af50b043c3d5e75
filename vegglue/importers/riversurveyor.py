"""ADCP transects of SonTek's RiverSurveyor (S5, M9), as RiverSurveyor Live exports them to MATLAB.

Format: RiverSurveyor S5/M9 System Manual (SonTek, February 2013), appendix C, with velocities east, north and up:
structures Summary (Depth, Cells, Track of each sample), System (Cell_Start, Cell_Size, Step) and WaterTrack (Velocity,
over ground). Cell_Start counts from the surface, as QRev of the U.S. Geological Survey reads it.
"""

from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import si_factor
from vegglue.importers.file_options import FileOptions
from vegglue.importers.library_files import reading_structures
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.transects import BoatProfile, refuse_leaps, stations_of_transect

RIVERSURVEYOR_VARIABLES = ("Setup", "Summary", "System", "WaterTrack")  # of such a file
# Numbers of the manual: velocities as east, north and up; a boat placed by the bottom or by satellites; the step of a
# sample within the transect, between those at its edges.
EAST_NORTH_UP, OVER_GROUND, IN_TRANSECT = 2, (1, 2, 3), 3


def stations_of_riversurveyor(path: Path, parts: dict[str, Any], options: FileOptions) -> MeasuredRows:
    """Stations of a transect, from an export of RiverSurveyor Live to MATLAB.

    Parameters
    ----------
    path
        For messages.
    parts
        Variables of the file: Setup, Summary, System, WaterTrack.
    options
        `start` of the boat [m].

    Returns
    -------
    MeasuredRows
        Velocities east and north at up to 15 stations, with errors [m/s].

    Raises
    ------
    InputError
        For other coordinates than ENU, and a boat that leaps.
    """
    with reading_structures(path, "RiverSurveyor Live"):
        setup, summary, system, water = (parts[name] for name in RIVERSURVEYOR_VARIABLES)
        if int(setup.coordinateSystem) != EAST_NORTH_UP or int(setup.trackReference) not in OVER_GROUND:
            raise InputError(
                f"{shown_path(path)}: expected velocities in ENU coordinates with a track reference, got others; set "
                "both in RiverSurveyor Live and export it again."
            )

        def in_si(part: Any, name: str, quantity: str) -> Array:
            """A variable in the SI unit; `Units` beside it holds that of the file."""
            unit = str(getattr(getattr(part, "Units", None), name, ""))
            factor = si_factor(unit, quantity, shown_path(path)) if unit else 1.0
            return np.asarray(getattr(part, name), dtype=np.float64) * factor

        velocity = in_si(water, "Velocity", "velocity")
        velocity = np.where(velocity == 0.0, np.nan, velocity)  # the file is filled up with zeros
        depth, track = in_si(summary, "Depth", "length"), in_si(summary, "Track", "length")
        start, size = in_si(system, "Cell_Start", "length"), in_si(system, "Cell_Size", "length")
        used = np.asarray(summary.Cells, dtype=np.float64)  # for the discharge; others hold no velocity
        cells = np.where((used >= 0.0) & (used <= len(velocity)), used, 0.0).astype(int)
        profiles = []
        for i in np.flatnonzero(np.asarray(system.Step) == IN_TRANSECT):
            below = start[i] + (np.arange(cells[i]) + 0.5) * size[i]
            moving = velocity[: cells[i], :2, i]
            good = np.isfinite(moving).all(axis=1) & (below < depth[i])
            place = (float(track[i, 0]), float(track[i, 1]))
            profiles.append(BoatProfile(place, float(depth[i]), depth[i] - below[good], moving[good]))
    refuse_leaps(path, profiles)
    return stations_of_transect(path, options, profiles, "RiverSurveyor MATLAB export")
