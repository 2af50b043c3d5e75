"""The one entry to files of measurements: which reader a file needs, that of an instrument or that of plain columns.

A further instrument is a file with a reader (path, its options) -> `MeasuredRows`, and its place here.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_options import FileOptions
from vegglue.importers.gaugings import ZIP_BEGINS, is_gauging, read_flowtracker2, read_gauging
from vegglue.importers.library_files import load_matlab, readable_text
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.nortek import (
    PROFILER_VARIABLES,
    VECTOR_BEGINS,
    is_nortek,
    read_nortek,
    read_samples,
    read_vector,
    rows_of_profiler,
)
from vegglue.importers.qrev import QREV_VARIABLE, is_qrev_summary, read_qrev_summary, stations_of_qrev
from vegglue.importers.riversurveyor import RIVERSURVEYOR_VARIABLES, stations_of_riversurveyor
from vegglue.importers.table_parser import WORKBOOKS
from vegglue.importers.teledyne import PD0_BEGINS, is_winriver, read_pd0, read_winriver
from vegglue.importers.velocimetry import read_velocimetry

# From the path of a file of measurements and its options to its rows in SI, by role; InputError begins with the file.
FileReader = Callable[[Path, FileOptions], MeasuredRows]
# Endings of files that instruments write for programs, beside those of tables.
BINARY_ENDINGS = (".pd0", ".000", ".ft", ".vec", ".vno", ".ntk", ".ad2cp")
# Of raw transects, which may begin with something else, up to so much of it [bytes].
PD0_ENDINGS, LONGEST_PREAMBLE = (".pd0", ".000"), 65_536
# How binary records of Nortek begin that no kept reader has: those of the Vectrino, and those of the Signature.
NORTEK_BEGINS = (b"\xa5\x05", b"\xa5\x0a")
# How a MATLAB file begins: version 5, which all instruments write, and 7.3, which is HDF5.
MAT_BEGINS, MAT_73_BEGINS = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"
# How a NetCDF begins: version 4, which is HDF5, and classic.
NETCDF_BEGINS, CLASSIC_BEGINS = b"\x89HDF", b"CDF"


def read_matlab(path: Path, options: FileOptions) -> MeasuredRows:
    """What a MATLAB file of an instrument holds, known by its variables.

    Raises
    ------
    InputError
        If it is damaged, or of no instrument that is read.
    """
    parts = {name.strip("\0 "): part for name, part in load_matlab(path).items()}  # MIDAS fills its names up
    if QREV_VARIABLE in parts:
        return stations_of_qrev(path, parts, options)
    if set(PROFILER_VARIABLES) <= parts.keys():
        return rows_of_profiler(path, parts, options)
    if set(RIVERSURVEYOR_VARIABLES) <= parts.keys():
        return stations_of_riversurveyor(path, parts, options)
    raise InputError(
        f"{shown_path(path)}: expected a MATLAB file of RiverSurveyor Live, QRev or MIDAS (Vectrino Profiler), got "
        f"one with {', '.join(name for name in parts if not name.startswith('__')) or 'nothing in it'}; export a table."
    )


# Readers of files that are no text, by how these begin.
BY_BEGINNING: Mapping[bytes, FileReader] = {
    PD0_BEGINS: read_pd0,
    VECTOR_BEGINS: read_vector,
    ZIP_BEGINS: read_flowtracker2,
    MAT_BEGINS: read_matlab,
    MAT_73_BEGINS: read_matlab,
    NETCDF_BEGINS: read_velocimetry,
    CLASSIC_BEGINS: read_velocimetry,
}


def reader_of(path: Path) -> FileReader:
    """The reader of a file, by how it begins.

    Returns
    -------
    callable
        Path, FileOptions -> MeasuredRows.

    Raises
    ------
    InputError
        For a record that none reads.
    """
    if path.suffix.lower() in WORKBOOKS:
        return read_samples
    try:
        with path.open("rb") as file:
            begin = file.read(LONGEST_PREAMBLE)
    except OSError as error:
        raise InputError("unreadable", file=path, why=error.strerror) from None
    known = next((reader for mark, reader in BY_BEGINNING.items() if begin.startswith(mark)), None)
    if known is not None:
        return known
    if path.suffix.lower() in PD0_ENDINGS and PD0_BEGINS in begin:  # a cut ensemble, or sentences of a GPS, in front
        return read_pd0
    nortek = begin.startswith(NORTEK_BEGINS)
    if nortek or path.suffix.lower() in BINARY_ENDINGS:
        raise InputError("binary_record", file=path, nortek=nortek, ending=path.suffix)
    text = readable_text(path)
    if is_winriver(text):
        return read_winriver
    if is_qrev_summary(text):
        return read_qrev_summary
    if is_gauging(text):
        return read_gauging
    return read_nortek if is_nortek(path, text) else read_samples
