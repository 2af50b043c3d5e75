"""What a site file states about one file of measurements: its columns, its units, and what stands in no column."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import field, replace
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from vegglue.case.messages import dotted, expected_in_words, shown_value
from vegglue.case.site_schema import Number
from vegglue.errors import InputError
from vegglue.importers.column_names import ROLES, UNITS, in_si, scale_of_column

LARGEST_FACTOR = 2.0  # mean velocity of a vertical over that of any of its points [-]
# Standard errors without a unit are of all of these.
UNITS_OF_ERRORS = {quantity: next(iter(UNITS[quantity])) for quantity in ("velocity", "length", "discharge")}


def _by_role(given: Any) -> dict[str, str]:
    if not isinstance(given, Mapping):
        raise ValueError("entries such as `u: V_mean`")
    for name, value in given.items():
        if name not in ROLES and str(value) in ROLES:
            raise ValueError(f"what is measured first, `{value}: {name}`")
        if name not in ROLES:
            raise InputError("unknown_option", where="", key=str(name), known=list(ROLES))
    return {str(name): str(value) for name, value in given.items()}


def _known_units(units: dict[str, str]) -> dict[str, str]:
    for role, unit in units.items():
        scale_of_column(unit, ROLES[role].quantity or "length", f".{role}")
    return units


def _errors_by_unit(given: Any) -> dict[str, float]:
    """A standard error by the SI unit of the values that it is of: a bare number is of all, 1 cm/s of velocities."""
    if isinstance(given, Mapping) and given.keys() <= set(UNITS_OF_ERRORS.values()):
        return dict(given)
    found: dict[str, float] = {}
    if not isinstance(given, str):
        found = dict.fromkeys(UNITS_OF_ERRORS.values(), in_si(given, "velocity", ""))
    for quantity, unit in UNITS_OF_ERRORS.items() if not found else ():
        with suppress(InputError):
            found = found or {unit: in_si(given, quantity, "")}
    if not found:
        raise ValueError("a number and a unit of velocity, length or discharge, such as `1 cm/s`")
    return found


def _two_ends(line: Any) -> Any:
    if not isinstance(line, list | tuple) or len(line) != 2 or line[0] == line[1]:
        raise ValueError("two points [[x, y], [x, y]], one at each end of the tape")
    return line


def _as_list(given: Any) -> Any:
    return given if isinstance(given, list | tuple) or given is None else [given]


LengthInSI = Annotated[float, BeforeValidator(lambda value: in_si(value, "length", ""))]
AngleInSI = Annotated[float, BeforeValidator(lambda value: in_si(value, "angle", ""))]
Label = Annotated[str, BeforeValidator(str)]
ByRole = Annotated[dict[str, str], BeforeValidator(_by_role)]
PointInPlan = tuple[LengthInSI, LengthInSI]
OfMap = Literal["map", "channel"]


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class FileOptions:
    """One entry of `files`."""

    # columns, units: heading of the column, and unit, of each role
    columns: ByRole = field(default_factory=dict)
    units: Annotated[ByRole, AfterValidator(_known_units)] = field(default_factory=dict)
    # Numbers that mark no value; given as none, `[]`, a velocity of 0 counts as measured
    missing: Annotated[tuple[Number, ...] | None, BeforeValidator(_as_list)] = None
    # experiment, section: of all rows
    experiment: Label | None = None
    section: Label | None = None
    # By the SI unit of the values that it is of
    standard_error: Annotated[dict[str, Annotated[Number, Field(ge=0)]], BeforeValidator(_errors_by_unit)] = field(
        default_factory=dict
    )
    # coordinates, directions: whether places and components of velocity are those of the map or of the channel; None
    # for those of the map if the site has a frame
    coordinates: OfMap | None = None
    directions: OfMap | None = None
    flip: Annotated[tuple[Literal["x", "y"], ...], BeforeValidator(_as_list)] = ()  # coordinates that run the other way
    zero: PointInPlan | None = None  # where in the channel the coordinates of the file are 0, after `flip` [m]
    x: LengthInSI | None = None  # of all rows of a table without a column of it [m]
    # Ends of a tape, first its zero, for tables along one [m]
    line: Annotated[tuple[PointInPlan, PointInPlan], BeforeValidator(_two_ends)] | None = None
    start: PointInPlan | None = None  # where a boat started [m]
    position: tuple[LengthInSI, LengthInSI, LengthInSI] | None = None  # of a probe whose record holds no place [m]
    sheet: Label | None = None  # of a workbook
    # floor, surface: z of the file at the lowest bed and at the water [m]
    floor: LengthInSI | None = None
    surface: LengthInSI | None = None
    draft: LengthInSI | None = None  # depth of a raw ADCP in the water, None for that in the file [m]
    declination: AngleInSI = 0.0  # of its compass: how far magnetic north lies east of true north [degrees]
    # Mean velocity of the vertical over the one measured, such as 0.85 for velocities of the surface [-]
    factor: Annotated[Number, Field(gt=0, le=LARGEST_FACTOR)] | None = None


def read_file_options(given: Any, where: str) -> FileOptions:
    """The options in one entry of `files`.

    Parameters
    ----------
    given : mapping
        As the site file states them.
    where : str
        How the message begins.

    Raises
    ------
    InputError
        For an unknown key, and for what makes no sense.
    """
    if not isinstance(given, Mapping):
        raise InputError("no_options", where=where, got=repr(given))
    known = list(FileOptions.__dataclass_fields__)
    for key in given:
        if key not in known:
            raise InputError("unknown_option", where=where, key=str(key), known=known)
    try:
        options = TypeAdapter(FileOptions).validate_python(given)
    except ValidationError as error:
        problem = error.errors()[0]
        place, own = f"{where}.{dotted(problem['loc'])}", problem.get("ctx", {}).get("error")
        if isinstance(own, InputError):  # of a part of this key
            raise InputError(own.kind, **(own.values | {"where": f"{place}{own.values['where']}"})) from None
        expected, got = expected_in_words(problem), shown_value(problem["input"])
        raise InputError("unexpected_option", where=place, expected=expected, got=got) from None
    if options.zero is None:
        return options
    if options.coordinates == "map":
        raise InputError("zero_on_map", where=where)
    return replace(options, coordinates="channel")
