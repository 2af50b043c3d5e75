"""The one parser of tables: text with any separator, a decimal comma, comments, a title, a row of units; or XLSX."""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import groupby
from math import gcd
from pathlib import Path
from zipfile import ZipFile

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.importers.column_names import is_row_of_units, is_unit, role_of
from vegglue.importers.import_notes import FileNote, ImportNote, Noted
from vegglue.importers.library_files import (
    importing,
    read_by_library,
    readable_text,
    refuse_foreign_format,
    refuse_larger,
)

WORKBOOKS = (".xlsx", ".xlsm")
COMMENTS = ("#", "%", "//", "!", "$")
# In the order of trust: a comma may also be decimal, and a space stand in a name.
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars", ",": "commas", " ": "spaces"}
# Lines from the end of a file that decide on its separator: titles stand at its head.
LOOKED_AT = 200
# Share of the lines [-] by which a separator further back in that order has to cut more of them to be taken.
MORE_LINES_CUT = 0.2
# `U [m/s]` in a heading parted by spaces is one field; in a row of units none has a name before it.
UNIT_BEHIND_NAME = re.compile(r"(?<=[^\s\])])\s+([\[(][^\s\[\]()]+[\])])")
BYTES_OF_CELL = 8  # bytes that a cell of a workbook takes at least, empty or not
# Equal rows may be repeats that agree in the few digits of a table: four pairs in ten do where their scatter is 0.7 of
# the last digit. Those of five places then all agree in one table of a hundred, of ten in a row in one of ten thousand.
FEWEST_ROWS, FEWEST_IN_A_ROW = 5, 10
MOST_ROWS_NAMED = 5  # rows that a note lists
HIDDEN_ROW = re.compile(rb"<row\b[^>]*>")  # in the XML of a sheet
NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eEdD][-+]?\d+)?")
# Thousands apart by one sign, decimals by another, which is thereby known: 1.236,00 and 1,236.00 and 1 236,00.
GROUPED = re.compile(r"[-+]?\d{1,3}(?P<apart>[.,'’\s])\d{3}((?P=apart)\d{3})*(?!(?P=apart))(?P<decimal>[.,])\d*")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+")
# Rows of a summary among measurements: what their only words are.
SUMMARY = re.compile(
    r"(?:grand |sub ?)?(?:mean|average|avg|total|sum|mittel|mittelwert|summe|gesamt|moyenne|moy|somme|media|promedio"
    r"|suma|gemiddelde?|totaal|som|medie|totale|soma|median|min|max|minimum|maximum|std|stdev|st dev|sd|rms|count)"
    r"(?: (?:of )?\S+)?[.:]?",
    re.IGNORECASE,
)
SUMMARY_OF = re.compile(
    r"(mean|average|total|sum|mittel|moyenne|media|gemiddelde) (of|for|über|de|van) ", re.IGNORECASE
)
# The minus of mathematics, hyphens and dashes that word processors write.
DASHES = str.maketrans(dict.fromkeys("\u2212\u2010\u2011\u2012\u2013\u2014\ufe63\uff0d", "-"))
MISSING_WORDS = (
    "", "-", "--", "---", "nan", "na", "n/a", "n.a.", "n.d.", "k.a.", "k. a.", "null", "none", "nodata", "no data",
    "missing", "inf", "-inf", "+inf", "nd", "s/d",
    # Of the U.S. Geological Survey: ice, equipment, backwater, season, rating, maintenance, flood, discontinued, dry.
    "ice", "eqp", "bkw", "ssn", "rat", "mnt", "fld", "dis", "dry", "zfl", "***",
)  # fmt: skip
OF_TYPES = re.compile(r"(\d+[sSnNdD]\t)+\d+[sSnNdD]\s*")  # below its headings: widths and types of the columns
# What a workbook shows for a formula without a value, in any language: #DIV/0!, #N/A, #WERT!, #NOMBRE?
OF_FORMULA = re.compile(r"#[^\W_]+(/[^\W_]+)?[!?]?")
FORMULA_IN_FRONT = re.compile(r"\s*#(N/A|NV|[A-Z0/]+[!?])\s*[,;\t|]")  # no comment, though it begins like one
Line = tuple[int, list[str]]  # number in the file, from 1, and fields


def is_number(text: str) -> bool:
    """Whether a field is a number, however it is written."""
    plain = text.strip().translate(DASHES)
    return NUMBER.fullmatch(plain) is not None or GROUPED.fullmatch(plain) is not None


def number_in(text: str, decimal_comma: bool) -> float | None:
    """A field of a table as a number.

    Parameters
    ----------
    decimal_comma : bool
        Whether decimals stand behind a comma, else behind a point.

    Returns
    -------
    float or None
        None for a mark of no value.

    Raises
    ------
    ValueError
        `comma` or `point` if that is wanted, else `no number`.
    """
    plain = text.strip().translate(DASHES)
    if plain.lower() in MISSING_WORDS or OF_FORMULA.fullmatch(plain):
        return None
    sign = "," if decimal_comma else "."
    if (written := _decimal_sign(plain)) and written != sign:
        raise ValueError("comma" if decimal_comma else "point")
    if GROUPED.fullmatch(plain):
        plain = re.sub(rf"[^-+\d{sign}]", "", plain)
    try:
        return float(re.sub("[dD]", "e", plain.replace(",", ".")))
    except ValueError:
        raise ValueError("no number") from None


def has_decimal_comma(fields: Iterable[str], quoted: bool = False) -> bool:
    """Whether more of these numbers are written with a decimal comma than with a point.

    quoted: whether commas part the fields, so that one within a field was quoted; between thousands in `"1,236"`, so
    that a number of another form and none with a point are asked for.
    """
    numbers = [number for field in fields if _decimal_sign(number := field.strip().translate(DASHES))]
    signs = [_decimal_sign(number) for number in numbers]
    if quoted and ("." in signs or all(map(THOUSANDS.fullmatch, numbers))):
        return False
    return signs.count(",") > signs.count(".")


def _decimal_sign(plain: str) -> str:
    """The sign before the decimals of a number, '' if there is none."""
    if (grouped := GROUPED.fullmatch(plain)) is not None:
        return grouped["decimal"]
    return next((sign for sign in ",." if sign in plain), "") if NUMBER.fullmatch(plain) else ""


def numbers_of(texts: Sequence[str]) -> Array | None:
    """A column of numbers, NaN for none; None for a column that has words."""
    if not all(is_number(text) for text in texts if text.strip()):
        return None
    values = (number_in(text, decimal_comma="," in text) for text in texts)
    return np.array([np.nan if value is None else value for value in values])


@dataclass(frozen=True)
class ParsedTable:
    """A table as it stands in a file.

    Attributes
    ----------
    headings : tuple of str (columns,)
    units : tuple of str (columns,)
        '' if none is stated.
    rows : tuple of sequence of str (rows, columns)
    row_numbers : tuple of int (rows,)
        Of each in the file.
    decimal_comma : bool
        Whether numbers have one.
    form : tuple of FileNote
        How the table was read.
    beside : tuple of (int, str)
        Number and text of each line above the heading, and of each comment.
    """

    headings: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[Sequence[str], ...]
    row_numbers: tuple[int, ...]
    decimal_comma: bool
    form: tuple[FileNote, ...]
    beside: tuple[tuple[int, str], ...] = ()

    def texts(self, column: int) -> list[str]:
        """The fields of a column (rows,)."""
        return [row[column] for row in self.rows]

    def numbers(self, path: Path, column: int) -> Array:
        """A column as numbers (rows,), NaN for none. InputError, which names file, row and column."""
        values = np.full(len(self.rows), np.nan)
        for i, text in enumerate(self.texts(column)):
            try:
                number = number_in(text, self.decimal_comma)
            except ValueError as error:
                row, heading = self.row_numbers[i], self.headings[column]
                raise InputError("no_number", file=path, row=row, column=heading, got=text, why=str(error)) from None
            values[i] = np.nan if number is None else number
        return values

    def without(self, left_out: set[int], why: ImportNote) -> "ParsedTable":
        """The table without the rows at some places, and why, in its form."""
        kept = [place for place in range(len(self.rows)) if place not in left_out]
        return replace(
            self,
            rows=tuple(self.rows[place] for place in kept),
            row_numbers=tuple(self.row_numbers[place] for place in kept),
            form=(*self.form, why),
        )


def parse_table(path: Path, sheet: str | None = None) -> ParsedTable:
    """The table of numbers in a text file or a workbook.

    Parameters
    ----------
    path
        The file; a workbook by its ending.
    sheet
        That of a workbook; its first one if not given.

    Raises
    ------
    InputError
        If the file cannot be read, or holds no table of numbers with two columns or more.
    """
    if path.suffix.lower() in WORKBOOKS:
        return _without_summaries(_table(path, *_lines_of_sheet(path, sheet), "", False))
    refuse_foreign_format(path)
    there = [(number, text) for number, text in enumerate(readable_text(path).splitlines(), 1) if text.strip(" \t;,")]
    lines = [
        (number, text)
        for number, text in there
        if not text.lstrip().startswith(COMMENTS) or FORMULA_IN_FRONT.match(text)
    ]
    kept = {number for number, _ in lines}
    comments = tuple(line for line in there if line[0] not in kept)
    typed = next((number for number, text in lines if OF_TYPES.fullmatch(text)), 0)
    lines = [line for line in lines if line[0] != typed]
    separator = _separator([text for _, text in lines])
    fields = [(number, _fields(text, separator)) for number, text in lines]
    comma = has_decimal_comma((field for _, row in fields for field in row), quoted=separator == ",")
    form: list[FileNote] = [SEPARATORS[separator], *([ImportNote(Noted.DECIMAL_COMMA)] if comma else [])]
    form += [ImportNote(Noted.COMMENTS, len(comments))] if comments else []
    form += [ImportNote(Noted.TYPES)] if typed else []
    quoted = all(text.lstrip().startswith('"') for _, text in lines)
    table = _table(path, fields, form, separator, comma, quoted, typed)
    return _without_summaries(replace(table, beside=(*table.beside, *comments)))


def _separator(lines: Sequence[str]) -> str:
    """The separator that cuts most lines into equally many fields, two or more; titles are not cut.

    A row of numbers is cut amiss if most of its fields are none any more: `155020,7;463045,2` by its commas.
    """

    def is_cut_well(fields: Sequence[str]) -> bool:
        """Half of the fields are numbers, marks for none or words behind them, and not half of them several numbers."""
        values = [field if is_number(field) or field.lower() not in MISSING_WORDS else "0" for field in fields]
        several = [field for field in fields if " " in field and not is_number(field)]
        joined = sum(all(map(is_number, field.split())) for field in several)
        return any(map(is_number, fields)) and _is_half_numbers(values) and joined * 2 < len(fields)

    found, best = " ", 0.0
    cut = {one: [_without_empty_end(_fields(line, one)) for line in lines[-LOOKED_AT:]] for one in SEPARATORS}
    well = {one: [is_cut_well(fields) for fields in rows] for one, rows in cut.items()}
    of_words = [not any(one) for one in zip(*well.values(), strict=True)]
    for separator, rows in cut.items():
        sound = [one or words for one, words in zip(well[separator], of_words, strict=True)]
        counts = Counter(len(fields) for fields, kept in zip(rows, sound, strict=True) if kept and len(fields) > 1)
        share = max(counts.values(), default=0) / len(rows) if rows else 0.0
        if share > best + MORE_LINES_CUT:
            found, best = separator, share
    return found


def _fields(line: str, separator: str) -> list[str]:
    if separator == " ":
        line = UNIT_BEHIND_NAME.sub(lambda found: found[1] if is_unit(found[1]) else found[0], line)
        if '"' not in line:
            return line.split()
        return [
            field
            for field in next(csv.reader([line.replace("\t", " ")], delimiter=" ", skipinitialspace=True))
            if field
        ]
    return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _without_empty_end(fields: list[str]) -> list[str]:
    """The fields without empty ones behind them: lines may end in separators."""
    return fields[: next((place for place in range(len(fields), 1, -1) if fields[place - 1]), 1)]


def _table(
    path: Path, whole: list[Line], form: list[FileNote], separator: str, decimal_comma: bool, quoted: bool = False,
    typed: int = 0,
) -> ParsedTable:  # fmt: skip
    """The longest stretch of rows of numbers, with the heading and the units above it.

    quoted: whether all lines begin with a quotation mark, as names of rows in tables of R do; typed: number of the line
    of types, which all rows are below, 0 for none.
    """
    lines = [(number, _without_empty_end(fields)) for number, fields in whole]
    numeric = [number > typed for number, _ in lines] if typed else _rows_of_numbers(lines, separator)
    if not any(numeric):
        sheets = [one.names for one in form if isinstance(one, ImportNote) and one.kind == Noted.ONE_SHEET]
        raise InputError("no_table", file=path, sheets=sheets[0] if sheets else ())
    width = _usual_width(lines, numeric)
    first = next(i for i, (_, fields) in enumerate(lines) if numeric[i] and len(fields) == width)
    begin = first - next((i for i, row in enumerate(reversed(numeric[:first])) if not row), first)
    if begin > 0 and len(lines[begin - 1][1]) > 1:  # below words, first rows may lack or have a field
        first = begin
    head, of_units = first - 1, False
    if head > 0 and not numeric[head] and is_row_of_units(lines[head][1]):
        form, head, of_units = [*form, ImportNote(Noted.UNITS)], head - 1, True
    named = head >= 0 and len(lines[head][1]) >= min(width, 2) and not numeric[head]
    rows = [line for line in lines[first:] if len(line[1]) > 1]
    if named and _has_row_names([fields for _, fields in rows], len(lines[head][1]), separator, quoted):
        lines[head], whole[head] = ((number, ["", *fields]) for number, fields in (lines[head], whole[head]))
        form = [*form, ImportNote(Noted.ROW_NAMES)]
    room = len(whole[head][1]) if named else width
    for number, fields in rows if named else lines[begin:]:
        # A comma may be that of a number, wherever it stands; elsewhere words behind the last column are a remark.
        if len(fields) > room and (separator == "," or any(map(is_number, fields[room:]))):
            form_of_row = {"fields": room, "got": len(fields), "headed": named, "commas": separator == ","}
            raise InputError("other_width", file=path, row=number, **form_of_row)
    width = max(width, min(room, max(len(fields) for _, fields in rows)))

    def padded(fields: list[str]) -> list[str]:
        return (fields + [""] * width)[:width]

    headings = padded(lines[head][1]) if named else [str(number) for number in range(1, width + 1)]
    lone = len(lines) - first - len(rows)
    form = [*form, *([] if named else [ImportNote(Noted.UNHEADED)])]
    form += [ImportNote(Noted.LONE_FIELDS, lone)] if lone else []
    return ParsedTable(
        headings=tuple(headings),
        units=tuple(padded(lines[first - 1][1] if of_units else [])),
        rows=tuple(padded(fields) for _, fields in rows),
        row_numbers=tuple(number for number, _ in rows),
        decimal_comma=decimal_comma,
        form=tuple(form),
        beside=tuple((number, " ".join(fields)) for number, fields in lines[: head if named else first]),
    )


def _has_row_names(rows: Sequence[Sequence[str]], headed: int, separator: str, quoted: bool) -> bool:
    """Whether all rows have one field more than the heading, the first of which names the row: 1 to n, or words.

    Between commas a field more may be a decimal comma: there the names stand in quotes.
    """
    names = [fields[0] for fields in rows]
    if (
        any(len(fields) != headed + 1 for fields in rows)
        or len(set(names)) < len(names)
        or (separator == "," and not quoted)
    ):
        return False
    return names == [str(number) for number in range(1, len(names) + 1)] or not any(map(is_number, names))


def _without_summaries(table: ParsedTable) -> ParsedTable:
    """The table without rows of means, totals and the like, which one of their fields is called; not if all are."""
    found = {
        place
        for place, fields in enumerate(table.rows)
        if any(SUMMARY.fullmatch(field.strip()) for field in fields if not is_number(field))
        or SUMMARY_OF.match(next((field for field in fields if field), ""))
    }
    if not found or len(found) == len(table.rows):
        return table
    rows = tuple(str(table.row_numbers[place]) for place in sorted(found)[:MOST_ROWS_NAMED])
    return table.without(found, ImportNote(Noted.SUMMARIES, len(found), rows))


def _rows_of_numbers(lines: Sequence[Line], separator: str) -> list[bool]:
    """Which lines are rows of the table, and neither a title nor a heading: half of the fields are numbers.

    Marks for no value count as numbers beside two of these. Words behind the last number are a remark, and not counted
    below the heading; above it they are the unit of what a title says, as between spaces they may be those of a title.
    A line below names of columns is a row if it holds a number, or a mark for none, and no name.
    """
    found = []
    for _, fields in lines:
        values = sum(map(is_number, fields))
        marks = sum(field.lower() in MISSING_WORDS for field in fields if field) if values > 1 else 0
        found.append((values + marks) * 2 >= len(fields) > 1)
    width = _usual_width(lines, found)
    first = next((i for i, (_, fields) in enumerate(lines) if found[i] and len(fields) == width), len(lines))
    of_names = (
        i
        for i, (_, fields) in enumerate(lines[:first])
        if len(fields) > 1 and any(map(role_of, fields)) and not any(map(is_number, fields))
    )
    heading = max(of_names, default=-1)
    for i, (_, fields) in enumerate(lines[heading + 1 :], heading + 1):
        if found[i] or is_row_of_units(fields):
            continue
        has_remark = separator != " " and _is_half_numbers(fields)
        has_value = any(is_number(field) or field.lower() in MISSING_WORDS[1:] for field in fields)
        is_thin = len(fields) > 1 and has_value and not any(map(role_of, fields))
        found[i] = has_remark or (heading >= 0 and is_thin)
    return found


def _usual_width(lines: Sequence[Line], numeric: Sequence[bool]) -> int:
    """The commonest number of fields of rows of numbers, 0 if there are none."""
    widths = Counter(len(fields) for (_, fields), row in zip(lines, numeric, strict=True) if row)
    return widths.most_common(1)[0][0] if widths else 0


def _is_half_numbers(fields: Sequence[str]) -> bool:
    """Whether half of the fields up to the last number are numbers; a number in front alone is none."""
    numbers = [is_number(field) for field in fields]
    last = max((place for place, number in enumerate(numbers, 1) if number), default=0)
    return sum(numbers) * 2 >= last > 1


def _lines_of_sheet(path: Path, name: str | None) -> tuple[list[Line], list[FileNote]]:
    """The rows of a sheet that hold something, and which of several it is."""
    with importing("openpyxl", path, "field", "CSV"):
        import openpyxl
    with read_by_library(path, "workbook"), ZipFile(path) as packed:
        refuse_larger(path, sum(part.file_size for part in packed.infolist()))
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        with closing(book):
            if name is not None and name not in book.sheetnames:
                raise InputError("no_sheet", file=path, sheet=name, got=book.sheetnames)
            shown = [sheet for sheet in book.worksheets if sheet.sheet_state == "visible"] or book.worksheets
            chosen = book[name] if name is not None else shown[0]
            others = [sheet.title for sheet in shown if sheet.title != chosen.title]
            hidden = _hidden_rows(packed, chosen)
            lines, size, skipped = [], 0, []
            for number, row in enumerate(chosen.iter_rows(values_only=True), 1):
                if number in hidden and any(cell is not None for cell in row):
                    skipped.append(str(number))
                elif any(cell is not None for cell in row):
                    size += BYTES_OF_CELL * len(row)  # few bytes may have a last column 16,384 cells to the right
                    refuse_larger(path, size)
                    # A date has no time of day, which a workbook adds; a number typed as text has a point.
                    texts = ["" if cell is None else str(cell).strip() for cell in row]
                    for place, cell in enumerate(row):
                        if isinstance(cell, datetime):
                            texts[place] = texts[place].removesuffix(" 00:00:00")
                        elif isinstance(cell, str) and is_number(texts[place]) and "." not in texts[place]:
                            texts[place] = texts[place].replace(",", ".")
                    lines.append((number, texts))
            form: list[FileNote] = ["workbook"]
            form += [ImportNote(Noted.ONE_SHEET, names=(chosen.title, *others))] if others and name is None else []
            if skipped:
                more = [f"{len(skipped) - MOST_ROWS_NAMED} more"] if len(skipped) > MOST_ROWS_NAMED else []
                form.append(ImportNote(Noted.HIDDEN, len(skipped), (*skipped[:MOST_ROWS_NAMED], *more)))
            return lines, form


def _hidden_rows(packed: ZipFile, sheet: object) -> set[int]:
    """Numbers of the rows that a sheet hides, by a filter or by hand: what its author took out."""
    part = str(getattr(sheet, "_worksheet_path", "")).lstrip("/")
    if part not in packed.namelist():
        return set()
    hidden, number = set(), 0
    for found in HIDDEN_ROW.finditer(packed.read(part)):
        attributes = dict(re.findall(rb'(\w+)="([^"]*)"', found[0]))
        number = int(attributes.get(b"r", number + 1))
        if attributes.get(b"hidden") in (b"1", b"true"):
            hidden.add(number)
    return hidden


def without_copies(table: ParsedTable) -> ParsedTable:
    """The table with rows that were pasted twice counted once.

    Rows are copies only if they agree in the text of every column, and either the whole table stands there k times
    (every row k times, or a multiple of that, and five rows or more that differ: of each the k-th part is kept), or a
    stretch of ten rows or more, no two alike, stands there again in the same order. All other equal rows are repeats.
    """
    rows = [tuple(fields) for fields in table.rows]
    counts = Counter(rows)
    times = gcd(*counts.values())
    copied: set[int] = set()
    if times > 1 and len(counts) >= FEWEST_ROWS:
        met: Counter[tuple[str, ...]] = Counter()
        for place, row in enumerate(rows):
            met[row] += 1
            if met[row] > counts[row] // times:
                copied.add(place)
    else:
        first: dict[tuple[str, ...], int] = {}
        behind = [place - first.setdefault(row, place) for place, row in enumerate(rows)]
        for shift, stretch in groupby(range(len(rows)), key=behind.__getitem__):
            places = list(stretch)
            if shift and len(places) >= FEWEST_IN_A_ROW:
                copied.update(places)
    return table.without(copied, ImportNote(Noted.COPIES, len(copied))) if copied else table
