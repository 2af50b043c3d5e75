"""Polygons in a table: the corners of each in their order, a row each, with its name and what is known of it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import names_without_unit, role_of
from vegglue.importers.columns_of_table import columns_of_table, taken_as_si
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import read_loosely
from vegglue.importers.measured_rows import rows_of_table
from vegglue.importers.polygon_properties import NAMES, first_heading

Corners = list[tuple[float, float]]
FEWEST_CORNERS = 3


NONE_NAMED: Mapping[str, str] = MappingProxyType({})


def columns_named(path: Path, columns: Mapping[str, str], headings: Sequence[str]) -> dict[str, str]:
    """The headings that the site file names, which may leave their unit out, by what they hold.

    Errors: InputError for one that is not there.
    """
    found: dict[str, str] = {}
    for what, named in columns.items():
        alike = [one for one in headings if named in names_without_unit(one)]
        if named not in headings and len(alike) != 1:
            raise InputError(
                f"{shown_path(path)}: expected {named!r} for {what} of each polygon, got "
                f"{', '.join(headings) or 'none'}; correct `columns` of this file in `patches`."
            )
        found[what] = named if named in headings else alike[0]
    return found


def polygons_of_table(
    path: Path, columns: Mapping[str, str] = NONE_NAMED
) -> tuple[list[tuple[Corners, Mapping[str, str]]], tuple[str, ...]]:
    """Corners [m] and properties, those of its first row, of each name; of all rows where no column names polygons.
    And which of x and y nobody gave a unit of. columns: headings of `stems` and `name`, as the site file names them.

    Errors: InputError for a table without x and y, a corner that lacks one, and fewer corners than a triangle has.
    """
    table = read_loosely(path)
    if not {"x", "y"} <= {known[0] for heading in table.headings if (known := role_of(heading)) is not None}:
        raise InputError(
            f"{shown_path(path)}: expected columns of x and y, with a row for each corner of a patch, got "
            f"{', '.join(table.headings)}; rectangles may stand in the site file, "
            "`patches: [{x: [20, 24], y: [0, 1.5], stems_per_m2: 22}]`."
        )
    taken = rows_of_table(path, table, FileWords())
    headings = columns_named(path, columns, table.headings)
    texts = {**{taken.columns[role]: words for role, words in taken.texts.items()}, **taken.others}
    rows = [{heading: column[row].strip() for heading, column in texts.items()} for row in range(taken.size)]
    named = (
        headings.get("name")
        or first_heading(rows[0], NAMES)
        or next(iter(taken.columns[role] for role in taken.texts), None)
    )
    places = np.column_stack([taken.numbers["x"], taken.numbers["y"]])
    found: dict[str, tuple[Corners, Mapping[str, str]]] = {}
    for line, properties, place in zip(taken.lines, rows, places.tolist(), strict=True):
        if not np.isfinite(place).all():
            raise InputError(f"{shown_path(path)}, row {line}: expected x and y of a corner, got none; add them.")
        name = properties.get(named or "", "")
        found.setdefault(name, ([], properties))[0].append((place[0], place[1]))
    for name, (corners, _) in found.items():
        if len(corners) < FEWEST_CORNERS:
            raise InputError(
                f"{shown_path(path)}: expected three corners or more of patch {name!r}, got {len(corners)}; add them, "
                "a row each, or write a rectangle into the site file, `patches: [{x: [20, 24], y: [0, 1.5]}]`."
            )
    assumed = taken_as_si(table, columns_of_table(path, table, FileWords()), FileWords())
    return list(found.values()), tuple(one for one in ("x", "y") if one in assumed)
