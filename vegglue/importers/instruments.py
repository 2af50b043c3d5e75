"""Which reader a file of measurements needs: that of an instrument's export, or that of plain columns."""

from collections.abc import Callable, Mapping
from pathlib import Path

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.flowtracker2 import ZIP_BEGINS, read_flowtracker2
from vegglue.importers.loose_table import readable_text
from vegglue.importers.matlab_exports import MAT_73_BEGINS, MAT_BEGINS, read_matlab
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.nortek import VECTOR_BEGINS, is_nortek, read_nortek, read_vector
from vegglue.importers.pd0_transects import PD0_BEGINS, read_pd0
from vegglue.importers.placed_tables import read_placed_rows
from vegglue.importers.qrev_summary import is_qrev_summary, read_qrev_summary
from vegglue.importers.tape_tables import is_tape_table, read_tape_table
from vegglue.importers.winriver import is_winriver, read_winriver

# What reads a file of measurements: its path, and what the site file says of it -> its rows in SI, by role. Errors:
# InputError, which begins with the file.
FileReader = Callable[[Path, FileWords], MeasuredRows]
# Endings of files that instruments write for programs, beside those of tables.
BINARY_ENDINGS = (".pd0", ".000", ".ft", ".vec", ".vno", ".ntk", ".ad2cp")
# How binary records of Nortek begin that no kept reader has: those of the Vectrino, and those of the Signature.
NORTEK_BEGINS = (b"\xa5\x05", b"\xa5\x0a")
# Readers of files that are no text, by how these begin.
BY_BEGINNING: Mapping[bytes, FileReader] = {
    PD0_BEGINS: read_pd0,
    VECTOR_BEGINS: read_vector,
    ZIP_BEGINS: read_flowtracker2,
    MAT_BEGINS: read_matlab,
    MAT_73_BEGINS: read_matlab,
}
LONGEST_MARK = max(map(len, BY_BEGINNING))


def reader_of(path: Path) -> FileReader:
    """The reader that knows the file, told by how it begins. Errors: InputError for a record that none knows."""
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        return read_placed_rows
    begin = _beginning(path)
    known = next((reader for mark, reader in BY_BEGINNING.items() if begin.startswith(mark)), None)
    if known is not None:
        return known
    if begin.startswith(NORTEK_BEGINS) or path.suffix.lower() in BINARY_ENDINGS:
        raise InputError(
            f"{shown_path(path)}: expected an export as text, got {_binary_words(path, begin)}, which is not read; "
            "convert it to ASCII in the maker's program (Nortek: .dat with .hdr, MIDAS: .mat; WinRiver: classic ASCII "
            "output)."
        )
    text = readable_text(path)
    if is_winriver(text):
        return read_winriver
    if is_qrev_summary(text):
        return read_qrev_summary
    if is_tape_table(text):
        return read_tape_table
    return read_nortek if is_nortek(path, text) else read_placed_rows


def _beginning(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(LONGEST_MARK)
    except OSError as error:
        raise InputError(f"{shown_path(path)} cannot be read: {error.strerror}; check the path.") from None


def _binary_words(path: Path, begin: bytes) -> str:
    nortek = begin.startswith(NORTEK_BEGINS)
    return "a binary record of a Nortek instrument" if nortek else f"a record {path.suffix}"
