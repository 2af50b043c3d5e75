"""What map programs say of a polygon beside its corners: its density, its class and its name, under which heading."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

from vegglue.importers.column_names import words_of
from vegglue.importers.number_words import is_number
from vegglue.importers.unit_words import UNITS

# Headings of a density, as words: `stems`, `Stems/m2`, `stem density per ft2`; plain ones are of 1/m2.
DENSITY = re.compile(
    r"(?:(?:stem|plant)s?(?: density)?|density|shoots|stengels?|stengeldichtheid|halme|halmdichte|stangel|stangeldichte"
    r"|tiges|tallos|steli|caules)(?: (?:per|par|por|pro))?(?: (m2|ft2))?"
)
# What a heading of a density may hold, and words of one that is rather of something else.
LIKE_DENSITY = re.compile(r"dens|dicht|stem|steng|stang|halm|tige|tallo|shoot|(?:per|par|por|pro) (?:m2|ft2)$")
NO_DENSITY = re.compile(r"diam|thick|height|hoog|hohe|haut|length|lengt|area|mass|(?:^| )(?:mm|cm|m)$")
CLASSES = ("class", "friction class", "friction", "roughness", "type", "landuse")
NAMES = ("name", "id", "patch", "fid")
Properties = Mapping[str, Any]


def density_heading(properties: Properties) -> str | None:
    """The first heading that is one of a density and holds something; None where there is none."""
    return next((one for one in properties if DENSITY.fullmatch(words_of(one)) and _holds(properties[one])), None)


def like_densities(properties: Properties) -> tuple[str, ...]:
    """Headings of numbers that may be a density, and are none of its usual ones."""
    said = {heading: words_of(heading) for heading, value in properties.items() if _is_number(value)}
    return tuple(one for one, words in said.items() if LIKE_DENSITY.search(words) and not NO_DENSITY.search(words))


def density_factor(heading: str) -> float:
    """Stems per m2 of one of what a heading is of [1/m2]: 10.76 for `stems_per_ft2`."""
    return UNITS["density"][f"1/{_area_named(heading) or 'm2'}"]


def names_its_unit(heading: str) -> bool:
    """Whether the heading of a density says of what it is."""
    return bool(_area_named(heading))


def _area_named(heading: str) -> str:
    """`m2` of `stems_m2`, '' where a heading ends in no area."""
    last = words_of(heading).rpartition(" ")[2]
    return last if last in ("m2", "ft2") else ""


def first_heading(properties: Properties, names: Iterable[str]) -> str | None:
    """The heading that is the first of these names and holds something; None where there is none."""
    known = {words_of(heading): heading for heading in properties if _holds(properties[heading])}
    return next((known[name] for name in names if name in known), None)


def given_heading(properties: Properties, heading: str) -> str | None:
    """A heading that the site file names, where it holds something; else None."""
    return heading if _holds(properties.get(heading)) else None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) or (isinstance(value, str) and is_number(value))


def _holds(value: Any) -> bool:
    return value not in (None, "")
