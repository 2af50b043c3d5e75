"""A column of a table as numbers: what marks no value, and numbers that no reading can be."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import Role
from vegglue.importers.loose_table import LooseTable
from vegglue.measurements.plausibility import (
    LARGEST_COORDINATE,
    MARKS_OF_ANY_COLUMN,
    MARKS_OR_VALUES,
    is_of_nines,
)
from vegglue.wording.numbers import so_many

FEWEST_NINES = 3  # in a mark; 0.9 and 99 are measured
# What no reading of a quantity or a role exceeds [SI]: no stream among plants runs at 7 m/s, a direction is less than
# two turns, plants grow in no 50 m of water, and no river lies 7 km above the sea. 7777 mm is a level in a flume, 7777
# ft one in the mountains. Places along and across, times and discharges have no such bound.
LARGEST_OF = {
    "velocity": 7.0, "angle": 720.0, "depth": 50.0, "height": 50.0, "below": 50.0, "level_se": 50.0, "level": 7e3,
    "z": 7e3,
}  # fmt: skip


def marks_of_role(role: Role, factor: float) -> tuple[float, ...]:
    """Numbers that mark no value in a column of this role, as no reading of it is so large; factor: SI value of its
    unit.
    """
    largest = LARGEST_OF.get(role.name, LARGEST_OF.get(role.quantity, math.inf))
    return tuple(sign * mark for mark in MARKS_OR_VALUES if mark * factor > largest for sign in (1.0, -1.0))


def numbers_of_column(path: Path, table: LooseTable, place: int, missing: Sequence[float]) -> tuple[Array, list[str]]:
    """A column as numbers, NaN where there is none, and how often that is so: by marks, words or numbers, or empty.

    missing: numbers that are marks there beside those of any column. Nines are where they are negative, as 99 m may be
    a level.
    """
    values = np.full(len(table.rows), np.nan)
    for i, (line, row) in enumerate(table.rows):
        try:
            number = table.number(row[place])
        except ValueError as error:
            again = "the heading stands there again: put what is said above each block, such as its place, in a column"
            raise InputError(
                f"{shown_path(path)}, row {line}: expected a number in column {table.headings[place]}, got "
                f"{row[place]!r}; {again if row[place] == table.headings[place] else error}."
            ) from None
        values[i] = np.nan if number is None else number
    marked = (
        np.isin(values, [*MARKS_OF_ANY_COLUMN, *missing])
        | (np.abs(values) > LARGEST_COORDINATE)
        | np.array([_nines(one) for one in values], dtype=bool)
    )
    empty = sum(not row[place].strip() for _, row in table.rows)
    values = np.where(marked, np.nan, values)
    marks = int(np.isnan(values).sum()) - empty
    absent = [f"{so_many(marks, 'mark')} for no value"] if marks else []
    return values, absent + ([so_many(empty, "empty cell")] if empty else [])


def refuse_negative(path: Path, table: LooseTable, place: int, errors: Array) -> None:
    """Errors: InputError for an error or a scatter below 0, which may mark that none is known."""
    for (line, row), error in zip(table.rows, errors.tolist(), strict=True):
        if error < 0.0:
            raise InputError(
                f"{shown_path(path)}, row {line}: expected 0 or above in column {table.headings[place]}, got "
                f"{row[place]}; correct it, or where it marks no value say `missing: [{error:g}]` of this file."
            )


def _nines(value: float) -> bool:
    """-99, -999.9 and the like: no level, and no velocity in any unit that comes near to it."""
    return bool(value <= -99.0) and is_of_nines(-value)


def doubted_nines(values: Array, heading: str) -> list[str]:
    """That velocities of nines only, 99.99, may be marks; they may be velocities, too, and are kept."""
    nines = {f"{value:g}" for value in values if value > 0.0 and is_of_nines(value)}
    return [
        f"kept {nine} in {heading} (if it marks no value, say `missing: [{nine}]`)"
        for nine in sorted(nines)
        if nine.count("9") >= FEWEST_NINES
    ]
