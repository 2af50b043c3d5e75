"""Which column of a table holds what, in which unit and as which numbers: by the site file, else by its heading."""

import math
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import (
    NAMES_OF_GAUGES,
    ROLES,
    UNITS,
    bracketed_unit,
    is_in_degrees,
    known_name,
    names_without_unit,
    role_of,
    scale_of_column,
    unit_named,
    unit_stated,
    words_of,
)
from vegglue.importers.file_options import FileOptions
from vegglue.importers.import_notes import FileNote, ImportNote, Noted
from vegglue.importers.table_parser import MOST_ROWS_NAMED, ParsedTable, is_number
from vegglue.measurements.plausibility import MARKS_OR_VALUES, is_mark_anywhere, is_of_nines
from vegglue.wording.numbers import listed

# Words of a heading that mean across; V alone means none, and may be the velocity.
WORDS_FOR_ACROSS = {"vy", "uy", "y", "transverse", "lateral", "cross"}
NAMES_OF_BED = {*ROLES["z_bed"].names}
# Words of a heading of u that mean along; one without them is that of a speed if a direction stands beside it.
WORDS_FOR_ALONG = {"u", "ux", "vx", "umean", "x", "streamwise"}
# Names that stand for a role only if no other column has it: beside z of a point there may be the bed, beside Vx the
# magnitude of the velocity, and beside the depth of the water that of a point.
SECTIONS_PROPER = {*ROLES["section"].names} - {*NAMES_OF_GAUGES}
VAGUE_NAMES = {
    "section": {*NAMES_OF_GAUGES},
    "depth": {"depth", "tiefe", "profondeur", "profundidad", "diepte", "profondita", "profundidade"},
    "u": {"velocity", "vel", "mean velocity", "mean vel", "meanv", "vitesse", "geschwindigkeit"}
    | {"fliessgeschwindigkeit", "average velocity", "avg velocity", "velocity mean", "velocity avg", "velocidad"}
    | {"vitesse moyenne", "velocidad media", "snelheid", "gemiddelde snelheid", "velocita", "velocita media"},
}
OF_A_MEAN = re.compile(r"\b(mean|average|avg|mittlere|moyenne|media|gemiddelde)|meanv")
# What errors and scatters are of, and so in the unit of if they state none.
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
NAMES_OF_EAST = {"e", "east", "easting", "rechtswert", "utm x", "utm e"}
# Headings of a flag, and what in it marks a row as no measurement; by numbers, those of IOC and QARTOD: 3 suspect, 4
# failed, 9 missing. Of 0 and 1 the heading decides which is good.
OF_FLAGS = re.compile(
    r"(data )?(quality|qc|qa|qaqc|flags?|valid|ok|use|used|status|good|bad|reject|rejected|outlier)"
    r"( (flags?|code|check|control|qc))*"
)
BAD = re.compile(
    r"(bad|reject|fail|invalid|discard|outlier|exclude|suspect|questionable|doubtful|spike|unusable"
    r"|not? (ok|good|use|valid)|do not use|schlecht|ungültig|verworfen|mauvais|rejet|malo|mala|slecht|ongeldig|x$)",
    re.IGNORECASE,
)
NO = {"no", "n", "false", "0", "nein", "non", "nee", "f"}
BAD_CODES, GOOD_CODES = {3.0, 4.0, 9.0}, {1.0, 2.0}
OF_CODES = {"flag", "flags", "qc", "qa", "qaqc"}  # words of a heading above such numbers; others may be ratings
MEANS_GOOD = {"valid", "ok", "use", "used", "good"}
MEANS_BAD = {"bad", "reject", "rejected", "outlier"}
SCALED_MARKS = (32.768, 327.68, 3276.8)  # -32768 mm/s of a boat in m/s, dm/s and cm/s
FEWEST_NINES = 3  # in a mark; 0.9 and 99 are measured
# What no reading of a quantity or a role exceeds [SI]: no stream among plants runs at 7 m/s, a direction is less than
# two turns, plants grow in no 50 m of water, and no river lies 7 km above the sea. 7777 mm is a level in a flume, 7777
# ft one in the mountains. Places along and across, times and discharges have no such bound.
LARGEST_OF = {
    "velocity": 7.0, "angle": 720.0, "depth": 50.0, "height": 50.0, "below": 50.0, "level_se": 50.0, "level": 7e3,
    "z": 7e3, "z_bed": 7e3,
}  # fmt: skip


def columns_of_table(path: Path, table: ParsedTable, options: FileOptions) -> dict[str, int]:
    """The column of each role: of two the first, unless its name is vaguer than that of the other.

    Parameters
    ----------
    path : Path
        For messages.
    options : FileOptions
        With the columns that the site file names.

    Returns
    -------
    dict of int
        Place of the column, by role.

    Raises
    ------
    InputError
        For a column that the site file names and that is not there, for two of one name, and for one of two roles.
    """
    headings, named = table.headings, options.columns
    found: dict[str, int] = {}
    for role, name in named.items():
        alike = [one for one in headings if name in names_without_unit(one)]
        heading = alike[0] if name not in headings and len(alike) == 1 else name
        if heading not in headings:
            raise InputError(
                f"{shown_path(path)}: expected the column {heading!r} for {role}, got {', '.join(headings)}; correct "
                "`columns` of this file."
            )
        place = headings.index(heading)
        if place in found.values():
            other = next(one for one, taken in found.items() if taken == place)
            raise InputError(
                f"{shown_path(path)}: expected a column of its own for {role}, got {heading!r}, which is that of "
                f"{other}; correct `columns` of this file."
            )
        found[role] = place
    for place, heading in enumerate(headings):
        known = role_of(heading)
        if known is None or known[0] in found or place in found.values():
            continue
        if not _is_of_something_else(heading, known[0], headings, named):
            found[known[0]] = place
    for role in sorted(MEASURED_ROLES & found.keys() - named.keys()):
        name_of_first = (known_name(headings[found[role]]) or (None,))[0]
        alike = [one for one in headings if (known_name(one) or ("",))[0] == name_of_first]
        units = {unit_stated(one, ROLES[role].quantity) for one in alike}  # the same reading in two units is one
        if len(alike) > max(len(units), 1):
            raise InputError(
                f"{shown_path(path)}: expected one column of {role}, got {listed([repr(one) for one in alike])}; put "
                "their values below one another, each row with its own place, or give all but one another heading."
            )

    def words(role: str) -> set[str]:
        return set(words_of(headings[found[role]]).split())

    velocities = {role for role in found if ROLES[role].quantity == "velocity"} - {"v", "u_se", "u_std"}
    if "v" not in named and "v" in found and not velocities and not WORDS_FOR_ACROSS & words("v"):
        found["u"] = found.pop("v")  # V alone, whose name has no direction
    if "u" not in named and {"u", "direction"} <= found.keys() and not {"v", "speed"} & found.keys():
        directed = any(map(is_number, table.texts(found["direction"])))
        if directed and not WORDS_FOR_ALONG & words("u"):  # a velocity of no named component is a speed
            found["speed"] = found.pop("u")
    of_both = "u_se" in found and "u" not in words("u_se")  # SE, no `u_se`
    if of_both and "u_se" not in named and not {"u", "v", "east_velocity", "north_velocity"} & found.keys():
        kinds = [role for role in ("speed", "level", "discharge") if role in found]
        if len(kinds) == 1:
            found.setdefault(f"{kinds[0]}_se", found.pop("u_se"))
    if of_both and "v_se" not in found and {"v", "north_velocity"} & found.keys() and "u_se" in found:
        found["v_se"] = found["u_se"]
    return found


def _is_of_something_else(heading: str, role: str, headings: tuple[str, ...], named: Mapping[str, str]) -> bool:
    """Whether a column does not hold its role: N is the number of samples if nothing is called east."""
    names = [known[0] for known in map(known_name, headings) if known is not None]
    own = (known_name(heading) or ("", None))[0]
    others = [name for name in names if name != own and name in ROLES[role].names]
    if (role, own) == ("y", "n"):
        x = named.get("x")
        east = bool(NAMES_OF_EAST & set(names)) or (x is not None and role_of(x) is None)
        return "e" not in names and (bool(others) or not east)
    if own in NAMES_OF_GAUGES and not any(name in SECTIONS_PROPER for name in names):
        roles = [*named, *(known[0] for known in map(role_of, headings) if known is not None)]
        return "level" not in roles or any(ROLES[one].quantity == "velocity" for one in roles if one != "u_se")
    vague = VAGUE_NAMES.get(role, set())
    if own in vague and role == "u" and not OF_A_MEAN.search(own) and any(map(OF_A_MEAN.search, others)):
        return True  # that of a point, beside the mean of its vertical
    return own in vague and any(name not in vague for name in others)


def without_flagged(path: Path, table: ParsedTable, columns: Mapping[str, int]) -> ParsedTable:
    """The table without rows that a column of flags marks as no measurement.

    Raises
    ------
    InputError
        For a column of 0 and 1 whose heading does not say which is good.
    """
    for place, heading in enumerate(table.headings):
        words = words_of(heading)
        if place in columns.values() or not OF_FLAGS.fullmatch(words):
            continue
        texts = [text.strip() for text in table.texts(place)]
        known = {text for text in texts if text}
        codes = {float(text) for text in known if is_number(text) and "," not in text}
        if len(codes) == len(known) and codes == {0.0, 1.0} and set(words.split()) & (MEANS_GOOD | MEANS_BAD):
            good = bool(set(words.split()) & MEANS_GOOD)
            flagged = {i for i, text in enumerate(texts) if text and (float(text) != 0.0) != good}
        elif len(codes) == len(known) and codes <= BAD_CODES | GOOD_CODES and OF_CODES & set(words.split()):
            flagged = {i for i, text in enumerate(texts) if text and float(text) in BAD_CODES}
        elif len(codes) == len(known) and {0.0, 1.0} <= codes <= {0.0, 1.0, 2.0} and OF_CODES & set(words.split()):
            raise InputError(
                f"{shown_path(path)}: expected flags that say which rows are good, got 0 and 1 in column {heading!r}; "
                "head it `valid` or `bad`, or take out the bad rows and the column."
            )
        else:
            no = NO if set(words.split()) & MEANS_GOOD else set()
            yes = {"yes", "y", "true", "1", "ja", "oui", "si"} if set(words.split()) & MEANS_BAD else set()
            flagged = {i for i, text in enumerate(texts) if BAD.match(text) or text.lower() in no | yes}
        if flagged and len(flagged) < len(texts):
            rows = (str(table.row_numbers[i]) for i in sorted(flagged)[:MOST_ROWS_NAMED])
            return table.without(flagged, ImportNote(Noted.FLAGGED, len(flagged), (heading, *rows)))
    return table


def unit_of_column(path: Path, table: ParsedTable, columns: Mapping[str, int], role: str, options: FileOptions) -> str:
    """The unit of a column: by the site file, the row of units, or the heading.

    Parameters
    ----------
    path : Path
        For messages.
    columns : mapping of int
        Place of the column of each role.

    Returns
    -------
    str
        If none is stated, of an error or a scatter that of its values, else that of the SI.

    Raises
    ------
    InputError
        For an unknown unit, and for places in degrees.
    """
    quantity, place = ROLES[role].quantity, columns[role]
    if role in options.units:
        return unit_named(options.units[role], quantity) or options.units[role]
    heading = table.headings[place]
    if role in ("x", "y") and is_in_degrees(heading):
        raise InputError("places_in_degrees", where=f"{shown_path(path)}, column {heading!r}", role=role)
    stated = _stated_unit(table, place, quantity)
    if not stated:
        values = next((one for one in VALUES_OF.get(role, ()) if one in columns), None)
        return unit_of_column(path, table, columns, values, options) if values else next(iter(UNITS[quantity]))
    unit = unit_named(stated, quantity)
    if unit is None:
        raise InputError(
            f"{shown_path(path)}: column {heading!r} is headed {stated!r}, which is no unit of {quantity} known here "
            f"({', '.join(UNITS[quantity])}); state it in `units.{role}` of this file, or by `columns` which column "
            "holds what."
        )
    return unit


def taken_as_si(table: ParsedTable, columns: Mapping[str, int], options: FileOptions) -> list[str]:
    """Roles of velocities, lengths and discharges without a stated unit; errors and scatters go with their values."""
    measured = [role for role in columns if ROLES[role].quantity in ("velocity", "length", "discharge")]
    unstated = [role for role in measured if role not in options.units and role not in VALUES_OF]
    return [role for role in unstated if not _stated_unit(table, columns[role], ROLES[role].quantity)]


def _stated_unit(table: ParsedTable, place: int, quantity: str) -> str:
    """The unit in the row of units or in the heading of a column; '' if neither has one."""
    heading = table.headings[place]
    known = role_of(heading)
    by_heading = (known[1] if known else None) or unit_stated(heading, quantity) or bracketed_unit(heading)
    return table.units[place].strip("[]() ") or by_heading


def numbers_of_column(
    path: Path, table: ParsedTable, place: int, role: str, unit: str, missing: tuple[float, ...]
) -> tuple[Array, list[FileNote]]:
    """A column of a role in SI, and what was left out or kept that may be a mark.

    Sevens and eights mark no value if no reading is so large; nines if they are negative, as 99 m may be a level.

    Parameters
    ----------
    path : Path
        For messages.
    place : int
        Of the column.
    missing : tuple of float
        Marks beside those of any column [unit].

    Returns
    -------
    ndarray (rows,)
        [SI], NaN for no value.
    list of FileNote

    Raises
    ------
    InputError
        For an error or a scatter below 0.
    """
    quantity, heading = ROLES[role].quantity, table.headings[place]
    factor = scale_of_column(unit, quantity, shown_path(path))
    largest = LARGEST_OF.get(role, LARGEST_OF.get(quantity, math.inf))
    scaled = SCALED_MARKS if quantity == "velocity" else ()
    marks = [sign * mark for mark in (*MARKS_OR_VALUES, *scaled) if mark * factor > largest for sign in (1.0, -1.0)]
    values = table.numbers(path, place)
    marked = np.isin(values, [*missing, *marks]) | np.array([*map(is_mark_anywhere, values.tolist())], dtype=bool)
    values = np.where(marked, np.nan, values)
    if role.endswith(("_se", "_std")) and (values < 0.0).any():
        row = int(np.argmax(values < 0.0))
        raise InputError(
            f"{shown_path(path)}, row {table.row_numbers[row]}: expected 0 or above in column {heading}, got "
            f"{table.rows[row][place]}; correct it, or write `missing: [{values[row]:g}]` of this file if it marks no "
            "value."
        )
    notes: list[FileNote] = []
    if quantity == "velocity":
        kept = sorted({f"{value:g}" for value in values.tolist() if value > 0.0 and is_of_nines(value)})
        notes += [
            ImportNote(Noted.KEPT_NINES, names=(number, heading))
            for number in kept
            if number.count("9") >= FEWEST_NINES
        ]
    empty = sum(not text.strip() for text in table.texts(place))
    absent = int(np.isnan(values).sum()) - empty
    notes += [ImportNote(Noted.MARKS, absent, (heading,))] if absent else []
    notes += [ImportNote(Noted.EMPTY, empty, (heading,))] if empty else []
    return values * factor, notes
