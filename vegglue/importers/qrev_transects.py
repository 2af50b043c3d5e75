"""ADCP transects of a measurement that QRev saved, *_QRev.mat.

Format: what QRev of the U.S. Geological Survey writes (Python2Matlab of its published source): `meas_struct.transects`
holds for each transect velocities east and north over ground (wVel, cells by ensembles; what is no measurement, but was
filled up, is not valid), depths of the bed and of the cells, the boat and durations, in SI.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.matlab_loading import numbers_of_variable, reading_structures
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.transects import BoatProfile, stations_of_transect
from vegglue.wording.numbers import so_many

QREV_VARIABLE = "meas_struct"  # the variable by which such a file is known


def stations_of_qrev(path: Path, parts: dict[str, Any], words: FileWords) -> MeasuredRows:
    """Stations of all transects together that QRev used for the discharge. Errors: InputError naming the file."""
    with reading_structures(path, "the transects of a measurement saved by QRev", "save it anew in QRev"):
        used = [one for one in np.atleast_1d(parts[QREV_VARIABLE].transects) if bool(one.checked)]
        profiles = [profile for one in used for profile in _profiles(path, one, str(used[0].startEdge))]
    return stations_of_transect(path, words, profiles, f"QRev, {so_many(len(used), 'transect')}")


def _profiles(path: Path, transect: Any, first_bank: str) -> Iterator[BoatProfile]:
    """One profile for each ensemble within a transect.

    Places count from its end at `first_bank`, where the boat of the first transect started.
    """
    bed, water = getattr(transect.depths, str(transect.depths.selected)), transect.wVel
    if str(water.coordSys) != "Earth":
        raise InputError(
            f"{shown_path(path)}: expected velocities in earth coordinates, got them in {water.coordSys}; choose a "
            "navigation reference in QRev, and save it again."
        )
    inside = np.atleast_1d(transect.inTransectIdx).astype(int) - 1
    places = _track(transect)[inside]
    places = places - (places[0] if str(transect.startEdge) == first_bank else places[-1])
    depth = numbers_of_variable(bed.depthProcessed_m)[inside]
    below, east, north = (
        np.atleast_2d(numbers_of_variable(one))[:, inside]
        for one in (bed.depthCellDepth_m, water.uProcessed_mps, water.vProcessed_mps)
    )
    good = np.atleast_2d(np.asarray(water.validData)[..., 0].astype(bool))[:, inside]
    good = good & np.isfinite(east) & np.isfinite(north) & (below < depth)
    for i, (x, y) in enumerate(places.tolist()):
        velocity = np.column_stack([east[good[:, i], i], north[good[:, i], i]])
        deep = float(np.nan_to_num(depth[i]))  # 0 where no beam found the bed: such an ensemble is left out
        yield BoatProfile((x, y), deep, deep - below[good[:, i], i], velocity)


def _track(transect: Any) -> Array:
    """x_i = x_(i-1) + u_i dt_i east and north (n, 2) [m], as QRev sums it up."""
    boat = getattr(transect.boatVel, str(transect.boatVel.selected))
    steps = numbers_of_variable(transect.dateTime.ensDuration_sec)
    parts = (numbers_of_variable(one) * steps for one in (boat.uProcessed_mps, boat.vProcessed_mps))
    return np.column_stack([np.nancumsum(one) for one in parts])
