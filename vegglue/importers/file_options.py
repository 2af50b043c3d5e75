"""What a site file states about one file of measurements: its columns, its units, and what stands in no column."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Literal

from vegglue.case.messages import nearest
from vegglue.errors import InputError
from vegglue.importers.column_names import ROLES, UNITS, in_si, scale_of_column

# Keys of one length or angle each.
LENGTHS_AND_ANGLES = {"x": "length", "floor": "length", "surface": "length", "draft": "length", "declination": "angle"}

LARGEST_FACTOR = 2.0  # mean velocity of a vertical over that of any of its points [-]


@dataclass(frozen=True)
class FileOptions:
    """One entry of `files`.

    Attributes
    ----------
    columns, units
        Heading of the column, and unit, of each role.
    missing
        Numbers that mark no value; given as none, `[]`, a velocity of 0 counts as measured.
    experiment, section
        Of all rows.
    standard_error
        By the SI unit of the values that it is of.
    coordinates, directions
        Whether places and components of velocity are those of the map or of the channel; None for those of the map if
        the site has a frame.
    flip
        Coordinates that run the other way.
    zero
        Where in the channel the coordinates of the file are 0, after `flip` [m].
    x
        Of all rows of a table without a column of it [m].
    line
        Ends of a tape, first its zero, for tables along one [m].
    start
        Where a boat started [m].
    position
        Of a probe whose record holds no place [m].
    sheet
        Of a workbook.
    floor, surface
        z of the file at the lowest bed and at the water [m].
    draft
        Depth of a raw ADCP in the water, None for that in the file [m].
    declination
        Of its compass: how far magnetic north lies east of true north [degrees].
    factor
        Mean velocity of the vertical over the one measured, such as 0.85 for velocities of the surface [-].
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    missing: tuple[float, ...] | None = None
    experiment: str | None = None
    section: str | None = None
    standard_error: Mapping[str, float] = field(default_factory=dict)
    coordinates: Literal["map", "channel"] | None = None
    directions: Literal["map", "channel"] | None = None
    flip: tuple[str, ...] = ()
    zero: tuple[float, float] | None = None
    x: float | None = None
    line: tuple[tuple[float, float], tuple[float, float]] | None = None
    start: tuple[float, float] | None = None
    position: tuple[float, float, float] | None = None
    sheet: str | None = None
    floor: float | None = None
    surface: float | None = None
    draft: float | None = None
    declination: float = 0.0
    factor: float | None = None


def read_file_options(given: Any, where: str) -> FileOptions:
    """The options in one entry of `files`. InputError, which begins with `where`, for what makes no sense."""
    if not isinstance(given, Mapping):
        raise InputError(f"{where} expected keys and values, such as `experiment: low`, got {given!r}.")
    known = FileOptions.__dataclass_fields__
    for key in given:
        if key not in known:
            raise InputError(f"{where} does not know `{key}`: {nearest(str(key), known)}")
    found: dict[str, Any] = {key: str(given[key]) for key in ("experiment", "section", "sheet") if key in given}
    for key in ("columns", "units"):
        entries = given.get(key, {})
        if not isinstance(entries, Mapping):
            raise InputError(f"{where}.{key} expected entries such as `u: V_mean`, got {entries!r}.")
        for name, value in entries.items():
            if name not in ROLES and str(value) in ROLES:
                raise InputError(
                    f"{where}.{key} expected what is measured first, `{value}: {name}`, got `{name}: {value}`."
                )
            if name not in ROLES:
                raise InputError(f"{where}.{key} does not know `{name}`: {nearest(str(name), ROLES)}")
        found[key] = {str(name): str(value) for name, value in entries.items()}
    for role, unit in found["units"].items():
        scale_of_column(unit, ROLES[role].quantity or "length", f"{where}.units.{role}")
    for key, quantity in LENGTHS_AND_ANGLES.items():
        if key in given:
            found[key] = in_si(given[key], quantity, f"{where}.{key}")
    if "factor" in given:
        factor = given["factor"]
        if isinstance(factor, bool) or not isinstance(factor, int | float) or not 0.0 < factor <= LARGEST_FACTOR:
            raise InputError(f"{where}.factor expected a number above 0, up to {LARGEST_FACTOR:g}, got {factor!r}.")
        found["factor"] = float(factor)
    if "standard_error" in given:
        found["standard_error"] = _errors_by_unit(given["standard_error"], f"{where}.standard_error")
    for key, count in (("zero", 2), ("start", 2), ("position", 3)):
        if key in given:
            found[key] = _lengths(given[key], count, f"{where}.{key}")
    if "line" in given:
        ends = given["line"]
        if not isinstance(ends, list | tuple) or len(ends) != 2:
            raise InputError(f"{where}.line expected two points [[x, y], [x, y]], got {ends!r}.")
        found["line"] = tuple(_lengths(end, 2, f"{where}.line") for end in ends)
        if found["line"][0] == found["line"][1]:
            raise InputError(
                f"{where}.line expected two points, one at each end of the tape, got {ends!r}; correct it."
            )
    for key in {"coordinates", "directions"} & set(given):
        found[key] = _one_of(given[key], ("map", "channel"), f"{where}.{key}")
    if "zero" in given and found.setdefault("coordinates", "channel") != "channel":
        raise InputError(f"{where} expected either `zero`, a place in the channel, or `coordinates: map`, got both.")
    marks = given.get("missing", None)
    marks = marks if isinstance(marks, list | tuple) or marks is None else [marks]
    if not all(isinstance(mark, int | float) and not isinstance(mark, bool) for mark in marks or ()):
        raise InputError(f"{where}.missing expected a number or a list of numbers, got {marks!r}.")
    found["missing"] = tuple(float(mark) for mark in marks) if marks is not None else None
    flip = given.get("flip", ())
    flip = flip if isinstance(flip, list | tuple) else [flip]
    found["flip"] = tuple(_one_of(axis, ("x", "y"), f"{where}.flip") for axis in flip)
    return FileOptions(**found)


def _errors_by_unit(given: Any, where: str) -> dict[str, float]:
    """A standard error by the SI unit of the values that it is of: a bare number is of all, 1 cm/s of velocities."""
    units = {quantity: next(iter(UNITS[quantity])) for quantity in ("velocity", "length", "discharge")}
    found: dict[str, float] = {}
    if not isinstance(given, str):
        found = dict.fromkeys(units.values(), in_si(given, "velocity", where))
    for quantity, unit in units.items() if not found else ():
        with suppress(InputError):
            found = found or {unit: in_si(given, quantity, where)}
    if not found:
        raise InputError(
            f"{where} expected a number and a unit of velocity, length or discharge, such as `1 cm/s`, got {given!r}; "
            "correct it."
        )
    if min(found.values()) < 0.0:
        raise InputError(f"{where} expected a number of 0 or above, got {given!r}; correct it.")
    return found


def _lengths(given: Any, count: int, where: str) -> tuple[float, ...]:
    if isinstance(given, list | tuple) and len(given) == count:
        return tuple(in_si(one, "length", where) for one in given)
    raise InputError(f"{where} expected {count} numbers in m, got {given!r}.")


def _one_of(word: Any, known: tuple[str, ...], where: str) -> Any:
    if word not in known:
        raise InputError(f"{where} expected one of {', '.join(known)}, got {word!r}.")
    return word
