"""Which column of a table holds what, and in which unit: by the site file, else by its heading."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import (
    NAMES_OF_GAUGES,
    ROLES,
    bracketed,
    is_in_degrees,
    known_name,
    names_without_unit,
    role_of,
    unit_stated,
    words_of,
)
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import LooseTable
from vegglue.importers.number_words import is_number
from vegglue.importers.unit_words import UNITS, is_like_unit, unit_named
from vegglue.wording.numbers import listed

# Words of a heading that say across; V alone says none, and may be the velocity.
WORDS_FOR_ACROSS = {"vy", "uy", "y", "transverse", "lateral", "cross"}
NAMES_OF_BED = {"bed level", "z bed", "zb", "bed elevation"}
# Words of a heading of u that say along; one without them is that of a speed where a direction stands beside it.
WORDS_FOR_ALONG = {"u", "ux", "vx", "umean", "x", "streamwise"}
# Names that stand for a role where no other column has it: beside z of a point there may be the bed, beside Vx the
# magnitude of the velocity, and beside the depth of the water that of a point.
SECTIONS_PROPER = {*ROLES["section"].names} - {*NAMES_OF_GAUGES}
LESS_SAID = {
    "section": {*NAMES_OF_GAUGES},
    "z": NAMES_OF_BED,
    "depth": {"depth", "tiefe", "profondeur", "profundidad", "diepte", "profondita", "profundidade"},
    "u": {"velocity", "vel", "mean velocity", "mean vel", "meanv", "vitesse", "geschwindigkeit"}
    | {"fliessgeschwindigkeit", "average velocity", "avg velocity", "velocity mean", "velocity avg", "velocidad"}
    | {"vitesse moyenne", "velocidad media", "snelheid", "gemiddelde snelheid", "velocita", "velocita media"},
}
# What errors and scatters are of, and so in the unit of where they state none.
VALUES_OF = {
    "u_se": ("u", "east_velocity"),
    "v_se": ("v", "north_velocity"),
    "u_std": ("u", "east_velocity"),
    "speed_se": ("speed",),
    "level_se": ("level",),
    "discharge_se": ("discharge",),
}
# What a place has one of.
MEASURED_ROLES = {"x", "y", "u", "v", "east_velocity", "north_velocity", "speed", "direction", "level", "discharge"}
NO_DEGREES = "degrees; convert longitudes and latitudes to metres on a map, such as UTM or the national grid."
NAMES_OF_EAST = {"e", "east", "easting", "rechtswert", "utm x", "utm e"}


def columns_of_table(path: Path, table: LooseTable, words: FileWords) -> dict[str, int]:
    """The place of the column of each role: of two the first, unless its name says less than that of the other.

    Errors: InputError for one that the site file names and that is not there, and for two of one name.
    """
    found = _named_in_site_file(path, table, words)
    for place, heading in enumerate(table.headings):
        known = role_of(heading)
        if known is None or _is_passed_over(heading, known[0], table.headings, words):
            continue
        if known[0] not in found and place not in found.values():
            found[known[0]] = place
    _refuse_doubles(path, table, found, words)
    if "v" not in words.columns and _is_the_speed(found, table.headings):
        found["u"] = found.pop("v")
    if "u" not in words.columns and _has_direction(found, table):
        found["speed"] = found.pop("u")
    if "u_se" not in words.columns and (kind := _only_kind(found)) and not _of_one(table.headings[found["u_se"]]):
        found.setdefault(f"{kind}_se", found.pop("u_se"))
    # One error for a velocity, not for a component of it, is that of both.
    across = next((role for role in ("v", "north_velocity") if role in found), None)
    if across and "v_se" not in found and "u_se" in found and not _of_one(table.headings[found["u_se"]]):
        found["v_se"] = found["u_se"]
    return found


def _named_in_site_file(path: Path, table: LooseTable, words: FileWords) -> dict[str, int]:
    """The places of the columns that the site file names, with or without their unit.

    Errors: InputError where one is not there, or is of two.
    """
    found: dict[str, int] = {}
    for role, named in words.columns.items():
        alike = [one for one in table.headings if named in names_without_unit(one)]
        heading = alike[0] if named not in table.headings and len(alike) == 1 else named
        if heading not in table.headings:
            raise InputError(
                f"{shown_path(path)}: expected the column {heading!r} for {role}, got {', '.join(table.headings)}; "
                f"correct `columns` of this file."
            )
        place = table.headings.index(heading)
        if place in found.values():
            other = next(name for name, taken in found.items() if taken == place)
            raise InputError(
                f"{shown_path(path)}: expected a column of its own for {role}, got {heading!r}, which is that of "
                f"{other}; correct `columns` of this file."
            )
        found[role] = place
    return found


def _refuse_doubles(path: Path, table: LooseTable, found: Mapping[str, int], words: FileWords) -> None:
    """Errors: InputError for a second column of the same name: a table beside another, or a column for each place.

    The same reading in two units is one.
    """
    for role in sorted(MEASURED_ROLES & found.keys() - words.columns.keys()):
        first = table.headings[found[role]]
        alike = [one for one in table.headings if (known_name(one) or ("",))[0] == (known_name(first) or (None,))[0]]
        units = {unit_stated(one, ROLES[role].quantity) for one in alike}
        if len(alike) > max(len(units), 1):
            raise InputError(
                f"{shown_path(path)}: expected one column of {role}, got {listed([repr(one) for one in alike])}; put "
                "their values below one another, each row with its own place, or give all but one another heading."
            )


def _is_passed_over(heading: str, role: str, headings: Sequence[str], words: FileWords) -> bool:
    """Whether a column holds rather something else: N the number of samples, where nothing is called east."""
    names = [known[0] for known in map(known_name, headings) if known is not None]
    own = (known_name(heading) or ("", None))[0]
    others = [name for name in names if name != own and name in ROLES[role].names]
    if (role, own) == ("y", "n"):
        x = words.columns.get("x")
        east = bool(NAMES_OF_EAST & set(names)) or (x is not None and role_of(x) is None)
        return "e" not in names and (bool(others) or not east)
    if own in NAMES_OF_GAUGES and not any(name in SECTIONS_PROPER for name in names):
        roles = [*words.columns, *(known[0] for known in map(role_of, headings) if known is not None)]
        return "level" not in roles or any(ROLES[one].quantity == "velocity" for one in roles if one != "u_se")
    less = LESS_SAID.get(role, set())
    return own in less and any(name not in less for name in others)


def _is_the_speed(found: Mapping[str, int], headings: Sequence[str]) -> bool:
    """Whether a column V stands for the velocity: there is no other, and its name says no direction."""
    alone = not any(ROLES[role].quantity == "velocity" for role in found if role not in ("v", "u_se", "u_std"))
    return "v" in found and alone and not WORDS_FOR_ACROSS & set(words_of(headings[found["v"]]).split())


def _has_direction(found: Mapping[str, int], table: LooseTable) -> bool:
    """Whether a velocity, whose name says no component, has a direction beside it, and so is a speed."""
    if not {"u", "direction"} <= found.keys() or {"v", "speed"} & found.keys():
        return False
    known = any(is_number(row[found["direction"]]) for _, row in table.rows)
    return known and not WORDS_FOR_ALONG & set(words_of(table.headings[found["u"]]).split())


def _only_kind(found: Mapping[str, int]) -> str | None:
    """What a column headed SE is of where no component of velocity stands beside it."""
    kinds = [role for role in ("speed", "level", "discharge") if role in found]
    alone = not {"u", "v", "east_velocity", "north_velocity"} & found.keys()
    return kinds[0] if "u_se" in found and alone and len(kinds) == 1 else None


def _of_one(heading: str) -> bool:
    """Whether the heading of a standard error names a component, `u_se`."""
    return "u" in words_of(heading).split()


def unit_of_column(path: Path, table: LooseTable, columns: Mapping[str, int], role: str, words: FileWords) -> str:
    """By the site file, the row of units, the heading; else, of an error or a scatter, that of its values; else SI.

    columns: place of the column of each role. Errors: InputError for a unit not known.
    """
    quantity, place = ROLES[role].quantity, columns[role]
    if role in words.units:
        return unit_named(words.units[role], quantity) or words.units[role]
    heading = table.headings[place]
    if role in ("x", "y") and is_in_degrees(heading):
        raise InputError(f"{shown_path(path)}: expected lengths in column {heading!r} for {role}, got {NO_DEGREES}")
    stated = _unit_in_table(table, place, quantity)
    if not stated:
        values = next((one for one in VALUES_OF.get(role, ()) if one in columns), None)
        return unit_of_column(path, table, columns, values, words) if values else next(iter(UNITS[quantity]))
    unit = unit_named(stated, quantity)
    if unit is None:
        raise InputError(
            f"{shown_path(path)}: column {heading!r} is headed {stated!r}, which is no unit of "
            f"{quantity} known here ({', '.join(UNITS[quantity])}); say it in `units.{role}` of this file, or by "
            "`columns` which column holds what."
        )
    return unit


def taken_as_si(table: LooseTable, columns: Mapping[str, int], words: FileWords) -> list[str]:
    """Roles of velocities, lengths and discharges whose unit nobody states: neither the site file nor the table.

    Errors and scatters are left out: they go with their values.
    """
    measured = [role for role in columns if ROLES[role].quantity in ("velocity", "length", "discharge")]
    open_ones = [role for role in measured if role not in words.units and role not in VALUES_OF]
    return [role for role in open_ones if not _unit_in_table(table, columns[role], ROLES[role].quantity)]


def _unit_in_table(table: LooseTable, place: int, quantity: str) -> str:
    """What the row of units or the heading of a column states; '' where neither does."""
    heading = table.headings[place]
    known = role_of(heading)
    by_heading = (known[1] if known else None) or unit_stated(heading, quantity) or _bracketed(heading)
    return table.units[place].strip("[]() ") or by_heading


def _bracketed(heading: str) -> str:
    """What stands in brackets at the end of a heading, in round ones only where it is like a unit of something."""
    unit = bracketed(heading)
    return unit if heading.rstrip().endswith("]") or is_like_unit(unit) else ""
