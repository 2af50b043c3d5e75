"""Which reader a file of measurements needs: that of an instrument's export, or that of plain columns."""

from collections.abc import Callable
from pathlib import Path

from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import readable_text
from vegglue.importers.measured_rows import Taken, read_rows
from vegglue.importers.nortek import is_nortek, read_nortek
from vegglue.importers.tape_tables import is_tape_table, read_tape_table
from vegglue.importers.winriver import is_winriver, read_winriver

InstrumentReader = Callable[[Path, FileWords], Taken]


def reader_of(path: Path) -> InstrumentReader:
    """The reader that knows the file, told by how it begins."""
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        return read_rows
    text = readable_text(path)
    if is_winriver(text):
        return read_winriver
    if is_tape_table(text):
        return read_tape_table
    return read_nortek if is_nortek(path, text) else read_rows
