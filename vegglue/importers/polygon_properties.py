"""What map programs say of a polygon beside its corners: its density, its class and its name, under which heading."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

from vegglue.importers.column_names import words_of
from vegglue.importers.unit_words import UNITS

# Headings of a density, as words: `stems`, `Stems/m2`, `stem density per ft2`; plain ones are of 1/m2.
DENSITY = re.compile(r"(?:(?:stem|plant)s?(?: density)?|density|shoots)(?: per)?(?: (m2|ft2))?")
CLASSES = ("class", "friction class", "friction", "roughness", "type", "landuse")
NAMES = ("name", "id", "patch", "fid")
Properties = Mapping[str, Any]


def density_heading(properties: Properties) -> str | None:
    """The first heading that is one of a density and holds something; None where there is none."""
    return next((one for one in properties if DENSITY.fullmatch(words_of(one)) and _holds(properties[one])), None)


def density_factor(heading: str) -> float:
    """Stems per m2 of one of what a heading is of [1/m2]: 10.76 for `stems_per_ft2`."""
    found = DENSITY.fullmatch(words_of(heading))
    return UNITS["density"][f"1/{(found and found[1]) or 'm2'}"]


def names_its_unit(heading: str) -> bool:
    """Whether the heading of a density says of what it is."""
    found = DENSITY.fullmatch(words_of(heading))
    return bool(found and found[1])


def first_heading(properties: Properties, names: Iterable[str]) -> str | None:
    """The heading that is the first of these names and holds something; None where there is none."""
    known = {words_of(heading): heading for heading in properties if _holds(properties[heading])}
    return next((known[name] for name in names if name in known), None)


def _holds(value: Any) -> bool:
    return value not in (None, "")
