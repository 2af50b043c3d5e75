"""How high above the bed velocities were measured, where a table counts from the surface or does not say."""

from collections.abc import Hashable, Mapping, Sequence

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.importers.column_names import known_name, words_of
from vegglue.importers.columns_of_table import NAMES_OF_BED
from vegglue.importers.lost_places import numbers_of
from vegglue.importers.measured_rows import MeasuredRows

# Words of headings that say how high or deep: `rel. depth`, `z/h`, `Messtiefe`; or where from: `dist. to bed`.
HEIGHT_WORDS = {"z", "depth", "height", "below", "above", "surface", "hohe", "tiefe", "profondeur", "hauteur"} | {
    "profundidad",
    "diepte",
    "profondita",
    "profundidade",
    "altura",
    "hoogte",
    "altezza",
    "hoehe",
    "messhohe",
    "bed",
    "bottom",
    "sohle",
    "grund",
    "fond",
    "lecho",
    "fondo",
    "bodem",
}
# Heights at one place differ by such a factor [-]; depths of the water that were read again do not.
APART = 1.5


def vertical_role(taken: MeasuredRows) -> str | None:
    """What says how high each velocity was measured: above the bed there, else z; None where z is that of the bed."""
    if "height" in taken.numbers:
        return "height"
    known = known_name(taken.columns.get("z", ""))
    return "z" if "z" in taken.numbers and (known is None or known[0] not in NAMES_OF_BED) else None


def with_heights(taken: MeasuredRows) -> MeasuredRows:
    """Heights above the bed, depth of the water less depth of the point, where a table has both and says no other."""
    numbers = taken.numbers
    if not {"below", "depth"} <= numbers.keys() or vertical_role(taken) is not None:
        return taken
    height = {"height": numbers["depth"] - numbers["below"]}
    return taken.having(height, "height above the bed from both depths")


def without_unused_depth(taken: MeasuredRows) -> MeasuredRows:
    """The rows as stations use them: a depth of the water of which no height was made counts among what is not read,
    for water is as deep as levels and the bed of the case make it.
    """
    is_used = "height" in taken.numbers and "height" not in taken.columns
    return taken if is_used else taken.leaving("depth")


def refuse_lost_heights(taken: MeasuredRows, places: Sequence[Hashable], file: str) -> None:
    """Errors: InputError where velocities of one place differ in a depth or a height that no role tells.

    places (rows,): what is one where they are equal. Such velocities are points of a vertical, and no repeats.
    """
    if "u" not in taken.numbers:
        return
    for heading, heights in _unread_heights(taken).items():
        seen: dict[Hashable, float] = {}
        for place, height, u in zip(places, np.abs(heights).tolist(), taken.numbers["u"].tolist(), strict=True):
            if not np.isfinite([height, u]).all():
                continue
            low, high = sorted((seen.setdefault(place, height), height))
            if high > APART * low:
                raise InputError(
                    f"{file}: expected how high above the bed each velocity was measured, got several at one place "
                    f"that differ in {heading!r}; name it in `columns` of this file in `files` of the site file, as "
                    "`z` (a level), `height` (above the bed) or `below` (the surface, beside `depth` of the water), "
                    "or take it out where they are repeats."
                )


def _unread_heights(taken: MeasuredRows) -> Mapping[str, Array]:
    """By heading: depths, and columns of numbers in no role whose headings say how high or deep."""
    found = {taken.columns[role]: taken.numbers[role] for role in ("below", "depth") if role in taken.numbers}
    said = {name: texts for name, texts in taken.others.items() if HEIGHT_WORDS & set(words_of(name).split())}
    return found | {name: numbers for name, texts in said.items() if (numbers := numbers_of(texts)) is not None}
