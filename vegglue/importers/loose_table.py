"""A table as people have it: any separator, a decimal comma, comments, a title, a row of units; text or XLSX."""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from vegglue.case.size_limits import LARGEST_DATA
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import role_of
from vegglue.importers.library_files import read_by_library, refuse_larger
from vegglue.importers.number_words import MISSING_WORDS, has_decimal_comma, is_number, number_in
from vegglue.importers.unit_words import is_unit
from vegglue.wording.numbers import listed, so_many

COMMENTS = ("#", "%", "//", "!", "$")
CHECK_OR_MOVE = "check the file, or move it out of the folder where it holds no measurements"
# In the order of trust: a comma may also be decimal, and a space stand in a name.
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars", ",": "commas", " ": "spaces"}
# Lines from the end of a file by which its separator is told: titles stand at its head.
LOOKED_AT = 200
# Share of the lines [-] by which one further back in that order has to cut more of them to be taken.
MORE_LINES_CUT = 0.2
# `U [m/s]` in a heading parted by spaces is one field; in a row of units none has a name before it.
UNIT_BEHIND_NAME = re.compile(r"(?<=[^\s\])])\s+([\[(][^\s\[\]()]+[\])])")
BYTES_OF_CELL = 8  # bytes that a cell of a workbook takes at least, empty or not
Line = tuple[int, list[str]]  # number in the file, from 1, and fields


@dataclass(frozen=True)
class LooseTable:
    """Headings (columns,), units (columns,) with '' where none is stated, and rows of texts with their number in the
    file. decimal_comma: whether numbers have one; form: how it was read, in words.
    """

    headings: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[Line, ...]
    decimal_comma: bool
    form: str

    def number(self, text: str) -> float | None:
        """A field as a number; None where it says that there is none. Errors: ValueError, with what to do."""
        return number_in(text, self.decimal_comma)


def read_loosely(path: Path, sheet: str | None = None) -> LooseTable:
    """The table of numbers in a file. sheet: that of a workbook, its first one if not given.

    Errors: InputError when the file cannot be read or holds no table of numbers with two columns or more.
    """
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        return _table(path, *_sheet(path, sheet), "")
    lines, comments = _without_comments(readable_text(path))
    separator = _separator([text for _, text in lines])
    fields = [(number, _fields(text, separator)) for number, text in lines]
    comma = separator != "," and has_decimal_comma(field for _, row in fields for field in row)
    words = [
        SEPARATORS[separator],
        "decimal comma" if comma else "",
        so_many(comments, "comment line") if comments else "",
    ]
    return _table(path, fields, ", ".join(word for word in words if word), separator, comma)


def readable_text(path: Path) -> str:
    """The text of a file: UTF-8, UTF-16 with its mark, or what Windows in the west writes. Errors: InputError."""
    try:
        size = path.stat().st_size
        raw = path.read_bytes() if size <= LARGEST_DATA else b""
    except OSError as error:
        raise InputError(f"{shown_path(path)} cannot be read: {error.strerror}; check the path.") from None
    refuse_larger(path, size)
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def _without_comments(text: str) -> tuple[list[tuple[int, str]], int]:
    there = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip(" \t;,")]
    kept = [(number, line) for number, line in there if not line.lstrip().startswith(COMMENTS)]
    return kept, len(there) - len(kept)


def _separator(lines: Sequence[str]) -> str:
    """That which cuts most lines into equally many fields, two or more; titles are not cut.

    A row of numbers most of which are none any more is cut amiss: `155020,7;463045,2` by its commas.
    """
    found, best = " ", 0.0
    looked_at = lines[-LOOKED_AT:]
    cut = {separator: [_filled(_fields(line, separator)) for line in looked_at] for separator in SEPARATORS}
    holds = {separator: [_is_cut_well(fields) for fields in rows] for separator, rows in cut.items()}
    of_words = [not any(one) for one in zip(*holds.values(), strict=True)]
    for separator, rows in cut.items():
        sound = [one or words for one, words in zip(holds[separator], of_words, strict=True)]
        counts = Counter(len(fields) for fields, kept in zip(rows, sound, strict=True) if kept and len(fields) > 1)
        share = max(counts.values(), default=0) / len(rows) if rows else 0.0
        if share > best + MORE_LINES_CUT:
            found, best = separator, share
    return found


def _is_cut_well(fields: Sequence[str]) -> bool:
    """Whether half of the fields are numbers, marks for none or words behind them, and not half of them several."""
    values = [field if is_number(field) or field.lower() not in MISSING_WORDS else "0" for field in fields]
    several = [field for field in fields if " " in field and not is_number(field)]
    joined = sum(all(map(is_number, field.split())) for field in several)
    return any(map(is_number, fields)) and _is_half_numbers(values) and joined * 2 < len(fields)


def _fields(line: str, separator: str) -> list[str]:
    if separator == " ":
        return UNIT_BEHIND_NAME.sub(lambda found: found[1] if is_unit(found[1]) else found[0], line).split()
    return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _filled(fields: list[str]) -> list[str]:
    """The fields without empty ones behind them: lines may end in separators."""
    last = next((place for place in range(len(fields), 1, -1) if fields[place - 1]), 1)
    return fields[:last]


def _table(path: Path, whole: list[Line], form: str, separator: str, decimal_comma: bool = False) -> LooseTable:
    """The longest stretch of rows of numbers, with the heading and the units above it."""
    lines = [(number, _filled(fields)) for number, fields in whole]
    numeric = _rows_of_numbers(lines, separator)
    if not any(numeric):
        raise InputError(f"{shown_path(path)}: expected a table of numbers, got none; {CHECK_OR_MOVE}.")
    first, begin, width = _begin(lines, numeric)
    head, of_units = first - 1, False
    if head > 0 and not numeric[head] and all(map(is_unit, lines[head][1])):
        form, head, of_units = f"{form}, a row of units", head - 1, True
    named = head >= 0 and len(lines[head][1]) >= min(width, 2) and not numeric[head]
    rows = [line for line in lines[first:] if len(line[1]) > 1]
    room = len(whole[head][1]) if named else width
    _refuse_longer(path, rows if named else lines[begin:], room, separator, named)
    width = max(width, min(room, max(len(fields) for _, fields in rows)))
    units = tuple(_padded(lines[first - 1][1] if of_units else [], width))
    headings = _padded(lines[head][1], width) if named else [str(number) for number in range(1, width + 1)]
    kept = tuple((number, _padded(fields, width)) for number, fields in rows)
    lone = len(lines) - first - len(rows)
    form += ("" if named else ", no heading") + (f", {so_many(lone, 'line')} of one field left out" if lone else "")
    return LooseTable(tuple(headings), units, kept, decimal_comma, form)


def _rows_of_numbers(lines: Sequence[Line], separator: str) -> list[bool]:
    """Which lines are rows of the table, and neither a title nor a heading: half of the fields are numbers.

    Words behind the last number are a remark, and not counted below the heading; above it they are the unit of what a
    title says. A line below names of columns is a row if it holds a number and no name.
    """
    found = [_is_row(fields) for _, fields in lines]
    heading = _last_heading(lines, found)
    for i, (_, fields) in enumerate(lines):
        found[i] = (
            found[i] or (i > heading and _has_remark(fields, separator)) or (0 <= heading < i and _is_thin(fields))
        )
    return found


def _is_thin(fields: Sequence[str]) -> bool:
    """Whether it holds a number, and neither a name of a column nor units alone."""
    several = len(fields) > 1 and any(map(is_number, fields))
    return several and not any(map(role_of, fields)) and not all(map(is_unit, fields))


def _last_heading(lines: Sequence[Line], numeric: Sequence[bool]) -> int:
    """Where the last line of names stands above the first row of numbers of the usual width; -1 where none does."""
    width = _usual_width(lines, numeric)
    first = (i for i, (_, fields) in enumerate(lines) if numeric[i] and len(fields) == width)
    above = range(next(first, len(lines)))
    return max((i for i in above if _names_columns(lines[i][1])), default=-1)


def _usual_width(lines: Sequence[Line], numeric: Sequence[bool]) -> int:
    """The commonest number of fields of rows of numbers, 0 where there are none."""
    widths = Counter(len(fields) for (_, fields), row in zip(lines, numeric, strict=True) if row)
    return widths.most_common(1)[0][0] if widths else 0


def _names_columns(fields: Sequence[str]) -> bool:
    return len(fields) > 1 and any(map(role_of, fields)) and not any(map(is_number, fields))


def _is_row(fields: Sequence[str]) -> bool:
    """Whether half of the fields are numbers; marks for no value beside two numbers count as such."""
    values = sum(map(is_number, fields))
    marked = values + sum(field.lower() in MISSING_WORDS for field in fields if field) if values > 1 else values
    return marked * 2 >= len(fields) > 1


def _has_remark(fields: Sequence[str], separator: str) -> bool:
    """Whether it is a row with words behind its numbers; between spaces they may be those of a title."""
    return separator != " " and not all(map(is_unit, fields)) and _is_half_numbers(fields)


def _is_half_numbers(fields: Sequence[str]) -> bool:
    """Whether half of the fields up to the last number are numbers; a number in front alone is none."""
    numbers = [is_number(field) for field in fields]
    last = max((place for place, number in enumerate(numbers, 1) if number), default=0)
    return sum(numbers) * 2 >= last > 1


def _begin(lines: Sequence[Line], numeric: Sequence[bool]) -> tuple[int, int, int]:
    """The first row of the table, the first of all rows of numbers around it, and the usual number of fields.

    Rows of other widths belong to it where words stand above them: its first rows may lack or have a field.
    """
    width = _usual_width(lines, numeric)
    first = next(i for i, (_, fields) in enumerate(lines) if numeric[i] and len(fields) == width)
    begin = first - next((i for i, row in enumerate(reversed(numeric[:first])) if not row), first)
    return begin if begin > 0 and len(lines[begin - 1][1]) > 1 else first, begin, width


def _refuse_longer(path: Path, rows: Sequence[Line], width: int, separator: str, named: bool) -> None:
    """Errors: InputError for the first row whose fields may stand in the columns of others, as it has too many.

    A comma may be that of a number, wherever it stands; elsewhere words behind the last column are a remark.
    """
    for number, fields in rows:
        if len(fields) > width and (separator == "," or any(map(is_number, fields[width:]))):
            advice = (
                "if numbers are written with a decimal comma, part fields by semicolons or tabs, and put text with "
                "commas in quotes"
                if separator == ","
                else "mend the row, or give each of its fields a heading"
            )
            pattern = "the heading" if named else "others"
            raise InputError(
                f"{shown_path(path)}, row {number}: expected {width} fields as in {pattern}, got "
                f"{len(fields)}; {advice}."
            )


def _padded(fields: list[str], width: int) -> list[str]:
    return (fields + [""] * width)[:width]


def _sheet(path: Path, name: str | None) -> tuple[list[Line], str]:
    """The rows of a sheet, and in words which of several it is."""
    try:
        import openpyxl
    except ImportError:
        raise InputError(
            f"{shown_path(path)}: workbooks are read by openpyxl, which is not installed; run "
            "`pip install 'vegglue[field]'`, or save the sheet as CSV."
        ) from None
    with read_by_library(path, "a workbook"), ZipFile(path) as packed:
        refuse_larger(path, sum(part.file_size for part in packed.infolist()))
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        with closing(book):
            if name is not None and name not in book.sheetnames:
                raise InputError(f"{shown_path(path)}: expected the sheet {name!r}, got {', '.join(book.sheetnames)}.")
            chosen = book[name] if name is not None else book.worksheets[0]
            others = [sheet.title for sheet in book.worksheets if sheet.title != chosen.title]
            only = f" (only sheet {chosen.title}; measurements of {listed(others)} need a file of their own)"
            form = "workbook" + (only if others and name is None else "")
            return list(_lines_of_sheet(path, chosen.iter_rows(values_only=True))), form


def _lines_of_sheet(path: Path, rows: Iterable[tuple[Any, ...]]) -> Iterator[Line]:
    """Rows that hold something. A sheet of few bytes may have a last column 16,384 cells to the right."""
    size = 0
    for number, row in enumerate(rows, 1):
        if any(cell is not None for cell in row):
            size += BYTES_OF_CELL * len(row)
            refuse_larger(path, size)
            yield number, ["" if cell is None else _with_point(cell) for cell in row]


def _with_point(cell: Any) -> str:
    """A cell as text; a number that was typed as text with a decimal comma has a point then, as true numbers have. A
    date has no time of day, which a workbook keeps of it: 2024-06-03.
    """
    text = str(cell).strip()
    if isinstance(cell, datetime):
        return text.removesuffix(" 00:00:00")
    return text.replace(",", ".") if isinstance(cell, str) and is_number(text) and "." not in text else text
