"""site.json of a field team, read and checked whole: what stands there, in which unit, and between which bounds."""

import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from vegglue.case.messages import dotted
from vegglue.case.parts import Interval, Number
from vegglue.case.size_limits import LARGEST_CONFIG
from vegglue.case.text_files import read_text, unprintable
from vegglue.errors import InputError, shown_path


def _one_or_more(experiments: dict[str, Any]) -> dict[str, Any]:
    if not experiments:
        raise ValueError("one or more, those that were measured")
    return experiments


def _printable(name: str) -> str:
    if (sign := unprintable(name)) is not None:
        raise ValueError(f"a name without the sign {sign!a}")
    return name


# Bounds far beyond any stream; what lies outside is a slip of the pen or of the unit.
PrintableName = Annotated[str, AfterValidator(_printable)]
Length = Annotated[Number, Field(gt=0, le=1e6)]
Level = Annotated[Number, Field(ge=-1e4, le=1e4)]


class _Said(BaseModel):
    """What the parts of a site share: keys that mean nothing here are notes."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Channel(_Said):
    """A straight trapezoid; z = 0 on the floor at x = 0, y = 0 on the axis."""

    length_m: Length
    bottom_width_m: Annotated[Number, Field(gt=0, le=1e4)]
    bank_slope_v_per_h: Annotated[Number, Field(ge=0.001, le=100)]
    bed_slope: Annotated[Number, Field(gt=-1, lt=1)]


class PlantedPatch(_Said):
    """A rectangle of plants."""

    x: Interval
    y: Interval
    stems_per_m2: Annotated[Number, Field(gt=0, le=1e7)] = 1.0


class MeasuredFlow(_Said):
    """One experiment."""

    discharge_m3_s: Annotated[Number, Field(gt=0, le=1e6)]
    downstream_level_m: Level


class FieldSite(_Said):
    """All that site.json says; SI."""

    channel: Channel
    experiments: Annotated[dict[PrintableName, MeasuredFlow], AfterValidator(_one_or_more)]
    holdout: dict[PrintableName, MeasuredFlow] = {}
    patches: tuple[PlantedPatch, ...] = ()
    canopy_height_guess_m: Annotated[Number, Field(ge=0.01, le=100)] = 0.8
    eddy_viscosity_m2_s: Annotated[Number, Field(gt=0, le=1e3)] = 0.01


def read_site(path: Path) -> FieldSite:
    """The site in a file. Errors: InputError, naming file and key, for what is missing, no number or beyond bounds."""
    text = read_text(path, LARGEST_CONFIG, "a folder to import has one")
    try:
        return FieldSite.model_validate(json.loads(text))
    except ValidationError as error:
        raise InputError(f"{shown_path(path)}: {_sentence(error)}") from None
    except RecursionError:
        raise InputError(f"{shown_path(path)}: keys stand within keys too often: write them flatter.") from None
    except ValueError as error:
        raise InputError(f"{shown_path(path)} is not valid JSON: {error}; correct it there.") from None


def _sentence(error: ValidationError) -> str:
    problem = error.errors()[0]
    place = dotted(tuple(key for key in problem["loc"] if key != "[key]")) or "site.json"
    if problem["type"] == "missing":
        return f"`{place}` is missing; add it."
    expected = problem["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    for said, meant in (("valid number", "number"), ("valid dictionary or instance of", "keys and values of")):
        expected = expected.replace(said, meant)
    return f"`{place}` expected {expected}, got {repr(problem['input'])[:80]}; correct it."
