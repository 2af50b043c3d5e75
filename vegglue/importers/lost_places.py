"""A table whose velocities would all fall on the axis, as the column that says where they stand across is not known."""

from collections.abc import Sequence

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.importers.column_names import unit_stated, words_of
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.number_words import is_number, number_in

VELOCITIES = ("u", "v", "speed")


def refuse_lost_places(taken: MeasuredRows, file: str) -> None:
    """Errors: InputError where velocities of one x differ by a length that is in no role: they are no repeats.

    taken: rows with an experiment, a section and x. What differs by no length, such as the time, may be repeats.
    """
    if "y" in taken.numbers or not taken.numbers.keys() & set(VELOCITIES):
        return
    for heading, lengths in _lengths_unread(taken).items():
        seen: dict[tuple[str, str, float], float] = {}
        places = zip(taken.texts["experiment"], taken.texts["section"], taken.numbers["x"].tolist(), strict=True)
        for place, length in zip(places, lengths.tolist(), strict=True):
            if np.isfinite(length) and seen.setdefault(place, length) != length:
                raise InputError(
                    f"{file}: expected where across the channel each velocity was measured, got no column of y, and "
                    f"velocities at x = {place[2]:g} m that differ in {heading!r}; name it by "
                    "`columns: {y: ...}` of this file in `files` of the site file, with `flip: y` and `zero: [0, 2.5]` "
                    "where it counts from a left bank 2.5 m off the axis (or by `height` or `z`, if it is one), or "
                    "take it out where they are repeats at one place."
                )


def _lengths_unread(taken: MeasuredRows) -> dict[str, Array]:
    """By heading: readings along a tape, depths of a stated unit, and columns of no role headed by a unit of length or,
    as `y/B`, by y.
    """
    found = {taken.columns["tape"]: taken.numbers["tape"]} if "tape" in taken.numbers else {}
    depth = taken.columns.get("depth", "")
    found |= {depth: taken.numbers["depth"]} if unit_stated(depth, "length") else {}
    said = {
        heading: texts
        for heading, texts in taken.others.items()
        if unit_stated(heading, "length") or "y" in words_of(heading).split()
    }
    return found | {heading: numbers for heading, texts in said.items() if (numbers := numbers_of(texts)) is not None}


def numbers_of(texts: Sequence[str]) -> Array | None:
    """A column of numbers, NaN where there is none; None of a column that has words."""
    if not all(is_number(text) for text in texts if text.strip()):
        return None
    values = (number_in(text, decimal_comma="," in text) for text in texts)
    return np.array([np.nan if value is None else value for value in values])
