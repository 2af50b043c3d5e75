"""Measurements that QRev saved: ADCP transects in *_QRev.mat, and the discharge in *_QRev.xml.

Formats: what QRev of the U.S. Geological Survey writes. MATLAB (Python2Matlab of its published source):
`meas_struct.transects` holds for each transect velocities east and north over ground (wVel, cells by ensembles; what is
no measurement, but was filled up, is not valid), depths of the bed and of the cells, the boat and durations, in SI.
XML: ChannelSummary with Discharge/Total and its unit, and Uncertainty/Total, that of 95 % in percent.
"""

import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import si_factor
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import ImportNote, Noted
from vegglue.importers.library_files import numbers_of_variable, readable_text, reading_structures
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.transects import BoatProfile, stations_of_transect
from vegglue.measurements.plausibility import is_mark_anywhere

QREV_VARIABLE = "meas_struct"  # of such a file
STANDARD_ERRORS = 2.0  # in an uncertainty of 95 %, as QRev has it
DECLARED = re.compile(r"^\s*<\?xml[^>]*\?>")  # the bytes are decoded already
ENTITIES = re.compile(r"<!(DOCTYPE|ENTITY)")  # QRev writes none, and some unpack to more than the memory


def stations_of_qrev(path: Path, parts: dict[str, Any], options: FileOptions) -> MeasuredRows:
    """Stations of all transects together that QRev used for the discharge.

    Raises
    ------
    InputError
        If velocities are not in earth coordinates, or the file lacks what this needs; as `stations_of_transect`.
    """
    with reading_structures(path, "QRev"):
        used = [one for one in np.atleast_1d(parts[QREV_VARIABLE].transects) if bool(one.checked)]
        profiles = [profile for one in used for profile in _profiles_of_transect(path, one, str(used[0].startEdge))]
    return stations_of_transect(path, options, profiles, "QRev", ImportNote(Noted.TRANSECTS, len(used)))


def _profiles_of_transect(path: Path, transect: Any, first_bank: str) -> list[BoatProfile]:
    """One profile for each ensemble within a transect.

    x_i = x_(i-1) + u_i dt_i east and north [m], as QRev sums it up, lost steps like their neighbours; places count from
    the end of the transect at `first_bank`, where the boat of the first transect started.
    """
    bed, water = getattr(transect.depths, str(transect.depths.selected)), transect.wVel
    if str(water.coordSys) != "Earth":
        raise InputError(
            f"{shown_path(path)}: expected velocities in earth coordinates, got them in {water.coordSys}; choose a "
            "navigation reference in QRev, and save it again."
        )
    inside = np.atleast_1d(transect.inTransectIdx).astype(int) - 1
    boat = getattr(transect.boatVel, str(transect.boatVel.selected))
    steps = numbers_of_variable(transect.dateTime.ensDuration_sec)
    moved = np.column_stack([numbers_of_variable(one) * steps for one in (boat.uProcessed_mps, boat.vProcessed_mps)])
    known = np.asarray(np.isfinite(moved).all(axis=1))
    order = np.arange(known.size)
    if known.any():  # the boat moves on where its own velocity is lost, as it does before and after
        moved = np.column_stack([np.interp(order, order[known], part[known]) for part in moved.T])
    places = np.cumsum(moved, axis=0)[inside]
    places = places - (places[0] if str(transect.startEdge) == first_bank else places[-1])
    places[~known[inside]] = np.nan
    depth = numbers_of_variable(bed.depthProcessed_m)[inside]
    below, east, north = (
        np.atleast_2d(numbers_of_variable(one))[:, inside]
        for one in (bed.depthCellDepth_m, water.uProcessed_mps, water.vProcessed_mps)
    )
    good = np.atleast_2d(np.asarray(water.validData)[..., 0] > 0)[:, inside]
    good = good & np.isfinite(east) & np.isfinite(north) & (below < depth)
    found = []
    for i, (x, y) in enumerate(places.tolist()):
        velocity = np.column_stack([east[good[:, i], i], north[good[:, i], i]])
        deep = float(np.nan_to_num(depth[i]))  # 0 if no beam found the bed: such an ensemble is left out
        found.append(BoatProfile((x, y), deep, deep - below[good[:, i], i], velocity))
    return found


def is_qrev_summary(text: str) -> bool:
    """Whether a text is a summary of QRev."""
    return "<Channel QRev" in text[:500]


def read_qrev_summary(path: Path, options: FileOptions) -> MeasuredRows:
    """The discharge of all transects, and half of its 95 % uncertainty as standard error.

    Parameters
    ----------
    path
        *_QRev.xml.
    options
        `start` of the boat [m], where the discharge stands.

    Returns
    -------
    MeasuredRows
        One row: x, y [m], discharge and its error [m3/s], NaN if the file states none.

    Raises
    ------
    InputError
        If there is no total, or `start` is not given.
    """
    if options.start is None:
        raise InputError(
            f"{shown_path(path)}: expected where the boat started, `start: [x, y]`, which no summary holds; add it to "
            "this file in `files`."
        )
    text = readable_text(path)
    try:
        if ENTITIES.search(text):
            raise ValueError("definitions of entities")
        summary = ElementTree.fromstring(DECLARED.sub("", text))
        total = summary.find("ChannelSummary/Discharge/Total")
        if total is None:
            raise ValueError("none")
        unit = total.get("unitsCode", "cms")
        discharge = float(total.text or "")
        if not np.isfinite(discharge) or is_mark_anywhere(discharge):
            raise ValueError(f"a mark of no value, {discharge:g}")
        share = float(summary.findtext("ChannelSummary/Uncertainty/Total") or "nan") / 100.0
        share = share if share > 0.0 and not is_mark_anywhere(100.0 * share) else float("nan")
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError(
            f"{shown_path(path)}: expected ChannelSummary/Discharge/Total of a summary by QRev, got {error}; save it "
            "anew in QRev."
        ) from None
    discharge *= si_factor(unit, "discharge", shown_path(path))
    standard_error = abs(discharge) * share / STANDARD_ERRORS
    x, y = options.start
    numbers = {"x": x, "y": y, "discharge": discharge, "discharge_se": standard_error}
    columns, units = {"discharge": "ChannelSummary/Discharge/Total"}, {"discharge": unit}
    note = (ImportNote(Noted.QREV_SUMMARY, standard_error),)
    return MeasuredRows({role: np.array([one]) for role, one in numbers.items()}, {}, columns, units, note)
