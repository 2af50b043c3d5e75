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

    Parameters
    ----------
    names, numbers : sequence of str
        Columns that must exist, as text and as float64.
    optional, labels : sequence of str
        Numbers and text that are read if there is such a column.
    gaps : sequence of str
        Those of the numbers whose cells may be empty, which are NaN.

    Returns
    -------
    DataFrame
        These columns alone.

    Raises
    ------
    InputError
        Naming file and row, if the file cannot be read, has no rows or lacks a column, and for a name that is empty or
        a number that is missing, infinite or none.
    """
    raw, shown = _raw_table(path), shown_path(path)
    missing = [column for column in (*names, *numbers) if column not in raw.columns]
    if missing:
        raise InputError(
            "missing_columns", file=path, wanted=(*names, *numbers), got=list(raw.columns), missing=missing
        )
    for column in (*names, *numbers, *optional, *labels):
        if list(raw.columns).count(column) > 1:
            raise InputError(f"{shown}, row 1: expected one column {column}, got two; rename one of them.")
    raw.index = pd.RangeIndex(2, len(raw) + 2)
    if raw.empty:
        raise InputError(f"{shown}: expected rows below the heading, got none.")
    found: dict[str, pd.Series] = {}
    for column in (*names, *(name for name in labels if name in raw.columns)):
        text = found[column] = raw[column].str.strip()
        refuse_rows(path, text == "", "no_name", text)
        signs = text.map(unprintable)
        refuse_rows(path, signs.notna(), "unprintable_name", signs)
    for column in (*numbers, *(name for name in optional if name in raw.columns)):
        text = raw[column].str.strip()
        value = found[column] = pd.to_numeric(text, errors="coerce").astype(float)
        wrong = ~np.isfinite(value) & ~((text == "") & (column in gaps))
        refuse_rows(path, wrong, "no_number", raw[column], why="no number")
    return pd.DataFrame(found)


def headings_of(path: Path) -> list[str]:
    """The headings of a CSV.

    Raises
    ------
    InputError
        If it cannot be read as a table.
    """
    return list(_raw_table(path).columns)


def _raw_table(path: Path) -> pd.DataFrame:
    """All columns as text, their names without spaces around them; what a short row lacks is empty.

    pandas would read a row that is longer than the heading without its last fields: with decimal commas all of `u`.
    """
    rows, shown, fields = csv.reader(StringIO(read_text(path, LARGEST_DATA)), strict=True), shown_path(path), []
    try:
        heading = [name.strip() for name in next(rows, [])]
        if len(heading) == 1 and any(sign in heading[0] for sign in ";\t|"):
            raise InputError(
                f"{shown}, row 1: expected columns separated by commas, got {heading[0]!r}; write commas, and decimal "
                "points, or let `vegglue import` read the file as it is."
            )
        for number, row in enumerate(rows, 2):
            if any(field.strip() for field in row[len(heading) :]):  # spreadsheets leave empty ones behind
                raise InputError(
                    f"{shown}, row {number}: expected {len(heading)} fields as in the heading, got {len(row)}; write "
                    "numbers with a decimal point, and text that holds a comma in quotes."
                )
            fields.append([*row[: len(heading)], *[""] * (len(heading) - len(row))])
    except csv.Error as error:
        raise InputError(f"{shown}: expected a CSV table, which cannot be read ({error}); check it.") from None
    return pd.DataFrame(fields, columns=heading, dtype=str)


def refuse_rows(path: Path, wrong: pd.Series, kind: str, column: pd.Series, **values: object) -> None:
    """Refuse a table in which a row is wrong.

    Parameters
    ----------
    wrong : Series of bool (rows,)
    kind : str
        Of the refusal.
    column : Series (rows,)
        Where it is wrong.
    **values
        Of the refusal.

    Raises
    ------
    InputError
        With file, row, column and value of the first row that is wrong.
    """
    if wrong.any():
        row = wrong.idxmax()
        raise InputError(kind, file=path, row=row, column=str(column.name), got=column[row], **values)


def refuse_repeated(path: Path, table: pd.DataFrame, columns: Sequence[str]) -> None:
    """Refuse a table of which two rows agree in some columns.

    Raises
    ------
    InputError
        Naming file and rows.
    """
    repeated = table.duplicated(list(columns))
    if repeated.any():
        row = repeated.idxmax()
        same = (table.loc[: row - 1, list(columns)] == table.loc[row, list(columns)]).all(axis=1).idxmax()
        raise InputError(
            f"{shown_path(path)}, row {row}: expected {', '.join(columns)} to differ from every other row, got those "
            f"of row {same} again; take one of the two out."
        )
