"""Which instrument or program a MATLAB file is of, told by the variables in it."""

from pathlib import Path
from typing import Any

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.matlab_loading import loaded_matlab
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.qrev_transects import QREV_VARIABLE, stations_of_qrev
from vegglue.importers.riversurveyor_mat import RIVERSURVEYOR_VARIABLES, stations_of_riversurveyor
from vegglue.importers.vectrino_profiler import PROFILER_VARIABLES, rows_of_profiler

# How a MATLAB file begins: version 5, which all of them write, and 7.3, which is HDF5.
MAT_BEGINS, MAT_73_BEGINS = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"


def read_matlab(path: Path, words: FileWords) -> MeasuredRows:
    """What a MATLAB file of an instrument holds. Errors: InputError naming the file."""
    # MIDAS fills its names up.
    parts: dict[str, Any] = {name.strip("\0 "): part for name, part in loaded_matlab(path).items()}
    if QREV_VARIABLE in parts:
        return stations_of_qrev(path, parts, words)
    if set(PROFILER_VARIABLES) <= parts.keys():
        return rows_of_profiler(path, parts, words)
    if set(RIVERSURVEYOR_VARIABLES) <= parts.keys():
        return stations_of_riversurveyor(path, parts, words)
    raise InputError(
        f"{shown_path(path)}: expected a MATLAB file of RiverSurveyor Live, QRev or MIDAS (Vectrino Profiler), got "
        f"one with {', '.join(name for name in parts if not name.startswith('__')) or 'nothing in it'}; export a table."
    )
