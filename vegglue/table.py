"""Measured tables: CSV files read strictly, every fault named with its file and row."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.errors import InputError


def read_table(
    path: Path, names: Sequence[str], numbers: Sequence[str], optional_numbers: Sequence[str] = ()
) -> pd.DataFrame:
    """The named columns of a CSV: `names` as text, `numbers` and, where present, `optional_numbers` as float64.

    Other columns are left out. The index is the row in the file, whose heading is row 1. Raises InputError naming file
    and row for a file that cannot be read, a missing column, and a missing, non-numeric or infinite value.
    """
    shown = os.path.relpath(path)
    try:
        raw = pd.read_csv(path, dtype=str, keep_default_na=False, skip_blank_lines=False, index_col=False)
    except (OSError, UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError, pd.errors.ParserWarning) as error:
        raise InputError(f"{shown}: expected a CSV table, which cannot be read ({' '.join(str(error).split())}).") from None
    raw.columns = raw.columns.str.strip()
    missing = [column for column in (*names, *numbers) if column not in raw.columns]
    if missing:
        raise InputError(
            f"{shown}, row 1: expected the columns {', '.join((*names, *numbers))}, but {', '.join(missing)} is not among "
            f"{', '.join(raw.columns)}; rename or add it."
        )
    raw.index = pd.RangeIndex(2, len(raw) + 2)
    if raw.empty:
        raise InputError(f"{shown}: expected rows below the heading, got none.")
    present = [column for column in optional_numbers if column in raw.columns]
    return pd.DataFrame(
        {column: _texts(shown, raw[column]) for column in names}
        | {column: _numbers(shown, raw[column]) for column in (*numbers, *present)}
    )


def refuse_rows(path: Path, wrong: pd.Series, complaint: str) -> None:
    """Raise InputError naming the file and the first row where `wrong` (rows,) is true."""
    if wrong.any():
        raise InputError(f"{os.path.relpath(path)}, row {wrong.idxmax()}: {complaint}.")


def refuse_repeated(path: Path, table: pd.DataFrame, columns: Sequence[str]) -> None:
    """Raise InputError when two rows agree in all these columns."""
    repeated = table.duplicated(list(columns))
    if repeated.any():
        row = repeated.idxmax()
        same = (table.loc[: row - 1, list(columns)] == table.loc[row, list(columns)]).all(axis=1).idxmax()
        raise InputError(
            f"{os.path.relpath(path)}, row {row}: expected {', '.join(columns)} to differ from every other row, but they "
            f"repeat row {same}; take one of the two out."
        )


def _texts(shown: str, column: "pd.Series[str]") -> "pd.Series[str]":
    text = column.str.strip()
    if (text == "").any():
        raise InputError(f"{shown}, row {(text == '').idxmax()}: expected a name in column {column.name}, got nothing.")
    return text


def _numbers(shown: str, column: "pd.Series[str]") -> "pd.Series[float]":
    values = pd.to_numeric(column.str.strip(), errors="coerce").astype(float)
    wrong = ~np.isfinite(values)
    if wrong.any():
        row = wrong.idxmax()
        raise InputError(
            f"{shown}, row {row}: expected a number in column {column.name}, got {column[row]!r}; mend or remove the row."
        )
    return values
