"""Which reader a file of measurements needs: that of an instrument's export, or that of plain columns."""

from collections.abc import Callable
from pathlib import Path

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import readable_text
from vegglue.importers.measured_rows import Taken, read_rows
from vegglue.importers.nortek import is_nortek, read_nortek
from vegglue.importers.raw_transects import PD0_BEGINS, read_pd0
from vegglue.importers.tape_tables import is_tape_table, read_tape_table
from vegglue.importers.winriver import is_winriver, read_winriver

InstrumentReader = Callable[[Path, FileWords], Taken]
# Endings of files that instruments write for programs, beside those of tables.
BINARY_ENDINGS = (".pd0", ".000", ".vec", ".vno", ".ntk", ".ad2cp")
# How binary records of Nortek begin: those of the Vector and Vectrino, and those of the Signature.
NORTEK_BEGINS = (b"\xa5\x05", b"\xa5\x0a")


def reader_of(path: Path) -> InstrumentReader:
    """The reader that knows the file, told by how it begins. Errors: InputError for a record that none knows."""
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        return read_rows
    if (begin := _beginning(path)) == PD0_BEGINS:
        return read_pd0
    if begin in NORTEK_BEGINS or path.suffix.lower() in BINARY_ENDINGS:
        raise InputError(
            f"{shown_path(path)}: expected an export as text, got {_binary_words(path, begin)}, which is not read; "
            "convert it to ASCII in the maker's program (Nortek: .dat with .hdr; WinRiver: classic ASCII output)."
        )
    text = readable_text(path)
    if is_winriver(text):
        return read_winriver
    if is_tape_table(text):
        return read_tape_table
    return read_nortek if is_nortek(path, text) else read_rows


def _beginning(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(2)
    except OSError as error:
        raise InputError(f"{shown_path(path)} cannot be read: {error.strerror}; check the path.") from None


def _binary_words(path: Path, begin: bytes) -> str:
    return "a binary record of a Nortek instrument" if begin in NORTEK_BEGINS else f"a record {path.suffix}"
