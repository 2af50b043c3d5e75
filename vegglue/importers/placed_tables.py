"""A table whose rows the site file helps to their places: along a tape, or at one x that no column says."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.measured_rows import MeasuredRows, read_rows
from vegglue.importers.point_heights import with_heights
from vegglue.importers.tape_tables import on_the_tape


def read_placed_rows(path: Path, words: FileWords) -> MeasuredRows:
    """What a table holds, with places of `line` or `x`. Errors: InputError, also where its columns say them already."""
    taken = with_heights(read_rows(path, replace(words, line=None)))
    places = [taken.columns[role] for role in ("x", "y") if role in taken.numbers]
    if words.line is not None:
        if places:
            raise InputError(
                f"{shown_path(path)}: expected no `line` in its entry of `files`, which is for tables along a tape, "
                f"got a table that says its own places in {' and '.join(places)}; take it out."
            )
        if "tape" not in taken.numbers:
            raise InputError(
                f"{shown_path(path)}: expected a column with readings of the tape for `line`, got "
                f"{', '.join([*taken.columns.values(), *taken.others])}; name it by `columns: {{tape: ...}}`."
            )
        return on_the_tape(path, taken, words)
    if words.x is not None:
        if "x" in taken.numbers:
            raise InputError(
                f"{shown_path(path)}: expected no `x` in its entry of `files`, which is for tables without one, got x "
                f"in {taken.columns['x']}; take it out, or name the column by `columns`."
            )
        return taken.having({"x": np.full(taken.size, words.x)}, f"x = {words.x:g} m of all rows")
    return taken
