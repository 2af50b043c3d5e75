"""Measured tables: CSV files read strictly, every fault named with its file and row."""

import csv
from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.case.size_limits import LARGEST_DATA
from vegglue.case.text_files import read_text, unprintable
from vegglue.errors import InputError, shown_path


def read_table(
    path: Path,
    names: Sequence[str],
    numbers: Sequence[str],
    optional: Sequence[str] = (),
    labels: Sequence[str] = (),
    gaps: Sequence[str] = (),
) -> pd.DataFrame:
    """A CSV as a table, its index the number of each row in the file, whose heading is row 1.

    names: columns that must be there, as text; numbers: columns that must be there, as float64; optional and labels:
    numbers and text that are read where there is such a column; gaps: those of the numbers whose cells may be empty,
    which are NaN. Other columns are left out.
    Errors: InputError, naming file and row, when the file cannot be read, has no rows or lacks a column, and for a name
    that is empty or a number that is missing, infinite or none.
    """
    raw = _raw_table(path)
    missing = [column for column in (*names, *numbers) if column not in raw.columns]
    if missing:
        raise InputError(
            f"{shown_path(path)}, row 1: expected the columns {', '.join((*names, *numbers))}, got "
            f"{', '.join(raw.columns) or 'nothing,'} without {', '.join(missing)}; rename or add what is missing."
        )
    for column in (*names, *numbers, *optional, *labels):
        if list(raw.columns).count(column) > 1:
            raise InputError(f"{shown_path(path)}, row 1: expected one column {column}, got two; rename one of them.")
    raw.index = pd.RangeIndex(2, len(raw) + 2)
    if raw.empty:
        raise InputError(f"{shown_path(path)}: expected rows below the heading, got none.")
    texts = [*names, *(column for column in labels if column in raw.columns)]
    values = [*numbers, *(column for column in optional if column in raw.columns)]
    return pd.DataFrame(
        {column: _texts(path, raw[column]) for column in texts}
        | {column: _numbers(path, raw[column], column in gaps) for column in values}
    )


def headings_of(path: Path) -> list[str]:
    """The headings of a CSV. Errors: as `read_table`."""
    return list(_raw_table(path).columns)


def _raw_table(path: Path) -> pd.DataFrame:
    """All columns as text, their names without spaces around them; what a short row lacks is empty.

    pandas would read a row that is longer than the heading without its last fields: with decimal commas all of `u`.
    """
    rows = csv.reader(StringIO(read_text(path, LARGEST_DATA)), strict=True)
    try:
        heading = [name.strip() for name in next(rows, [])]
        _refuse_other_separators(path, heading)
        fields = [_fields(path, number, row, len(heading)) for number, row in enumerate(rows, 2)]
    except csv.Error as error:
        raise InputError(
            f"{shown_path(path)}: expected a CSV table, which cannot be read ({error}); check it."
        ) from None
    return pd.DataFrame(fields, columns=heading, dtype=str)


def _refuse_other_separators(path: Path, heading: list[str]) -> None:
    """Errors: InputError for a heading of one column that semicolons, tabs or bars would make several."""
    if len(heading) == 1 and any(sign in heading[0] for sign in ";\t|"):
        raise InputError(
            f"{shown_path(path)}, row 1: expected columns separated by commas, got {heading[0]!r}; write commas, and "
            "decimal points, or let `vegglue import` read the file as it is."
        )


def _fields(path: Path, number: int, row: list[str], columns: int) -> list[str]:
    if any(field.strip() for field in row[columns:]):  # spreadsheets leave empty ones behind
        raise InputError(
            f"{shown_path(path)}, row {number}: expected {columns} fields as in the heading, got {len(row)}; write "
            "numbers with a decimal point, and text that holds a comma in quotes."
        )
    return [*row[:columns], *[""] * (columns - len(row))]


def refuse_rows(path: Path, wrong: pd.Series, complaint: str) -> None:
    """Errors: InputError with the complaint, naming the file and the first row where `wrong` (rows,) is true."""
    if wrong.any():
        raise InputError(f"{shown_path(path)}, row {wrong.idxmax()}: {complaint}.")


def refuse_repeated(path: Path, table: pd.DataFrame, columns: Sequence[str]) -> None:
    """Errors: InputError naming file and rows when two rows agree in all these columns."""
    repeated = table.duplicated(list(columns))
    if repeated.any():
        row = repeated.idxmax()
        same = (table.loc[: row - 1, list(columns)] == table.loc[row, list(columns)]).all(axis=1).idxmax()
        raise InputError(
            f"{shown_path(path)}, row {row}: expected {', '.join(columns)} to differ from every other row, got those "
            f"of row {same} again; take one of the two out."
        )


def _texts(path: Path, column: "pd.Series[str]") -> "pd.Series[str]":
    text = column.str.strip()
    if (text == "").any():
        raise InputError(
            f"{shown_path(path)}, row {(text == '').idxmax()}: expected a name in column {column.name}, got nothing."
        )
    wrong = text.map(unprintable).dropna()
    if len(wrong):
        sign = f"expected a name in column {column.name}, got one with the sign {wrong.iloc[0]!a}; take it out"
        raise InputError(f"{shown_path(path)}, row {wrong.index[0]}: {sign}.")
    return text


def _numbers(path: Path, column: "pd.Series[str]", gaps: bool) -> "pd.Series[float]":
    values = pd.to_numeric(column.str.strip(), errors="coerce").astype(float)
    wrong = ~np.isfinite(values) & ~((column.str.strip() == "") & gaps)
    if wrong.any():
        row = wrong.idxmax()
        got = f"expected a number in column {column.name}, got {column[row]!r}"
        raise InputError(f"{shown_path(path)}, row {row}: {got}; mend or remove the row.")
    return values
