"""What the site file of a field team says: every key, in which unit, between which bounds."""

import math
from collections.abc import Callable
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from vegglue.case.frame import Frame, in_metres
from vegglue.case.parts import Interval, Number, Polygon, Positive
from vegglue.case.site_schema import CentrelineShape
from vegglue.case.text_files import unprintable
from vegglue.errors import InputError
from vegglue.importers.config_parts import VISCOSITY_FACTOR
from vegglue.importers.unit_words import UNITS, in_si


def _one_or_more(experiments: dict[str, Any]) -> dict[str, Any]:
    if not experiments:
        raise ValueError("one or more, those that were measured")
    return experiments


def _printable(name: str) -> str:
    if (sign := unprintable(name)) is not None:
        raise ValueError(f"a name without the sign {sign!a}")
    return name


def _with_unit(quantity: str) -> Callable[[Any], Any]:
    """A text such as `42 l/s` as a number in SI; what is no text is left to the checks of numbers."""

    def converted(value: Any) -> Any:
        if not isinstance(value, str):
            return value
        try:
            return in_si(value, quantity, "")
        except InputError:
            units = f" with a unit among {', '.join(UNITS[quantity])}" if any(map(str.isdigit, value)) else ""
            raise ValueError(f"a number{units}") from None

    return converted


# Bounds far beyond any stream; what lies outside is a slip of the pen or of the unit.
PrintableName = Annotated[str, AfterValidator(_printable)]
Length = Annotated[Number, Field(gt=0, le=1e6)]
Level = Annotated[Number, Field(ge=-1e4, le=1e4)]


ONE_DIRECTION = "either `angle` or `towards: [east, north]`"


class _Said(BaseModel):
    """What the parts of a site share: keys that mean nothing here are notes."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Channel(_Said):
    """A trapezoid, or with `walls` its floor alone; z = 0 on the floor at x = 0, y = 0 on the axis.

    Without a length it is as long as its centreline.
    """

    length_m: Length | None = None
    bottom_width_m: Annotated[Number, Field(gt=0, le=1e4)]
    bank_slope_v_per_h: Annotated[Number, Field(ge=0.001, le=100)] | None = None
    bed_slope: Annotated[Number, Field(gt=-1, lt=1)]


class FlumeWalls(_Said):
    """Vertical walls along both sides of the grid, as of a flume.

    n: Manning's, about as known; glass 0.010, wood 0.012 (Chow 1959, table 5-6) [s m^(-1/3)].
    """

    n: Annotated[Number, Field(ge=0.001, le=0.1)] = 0.011


def _walled(given: Any) -> Any:
    """`walls: true` as walls of which nothing else is known, false as none, and a number as their coefficient."""
    if isinstance(given, bool):
        return {} if given else None
    return {"n": given} if isinstance(given, int | float) else given


def _of_polygons(columns: dict[str, str]) -> dict[str, str]:
    if not columns.keys() <= {"stems", "name"}:
        raise ValueError("the headings of `stems` and `name`, such as `{stems: HEADING}`")
    return columns


class PlantedPatch(_Said):
    """A rectangle of plants, or a polygon, in the channel; or a file of polygons."""

    x: Interval | None = None
    y: Interval | None = None
    polygon: Polygon | None = None
    file: PrintableName | None = None
    name: PrintableName | None = None
    columns: Annotated[dict[str, str], AfterValidator(_of_polygons)] = {}
    stems_per_m2: Annotated[Number, Field(gt=0, le=1e7)] = 1.0

    @model_validator(mode="before")
    @classmethod
    def _one_shape(cls, given: Any) -> Any:
        """Errors: ValidationError of a rectangle that lacks a side, unless it is another shape."""
        if isinstance(given, dict) and not given.keys() & {"polygon", "file"}:
            _Rectangle.model_validate(given)
        if isinstance(given, dict) and "columns" in given and "file" not in given:
            raise ValueError("a `file` beside `columns`")
        return given


class _Rectangle(_Said):
    x: Interval
    y: Interval


class MeasuredFlow(_Said):
    """One experiment; its numbers may go by the names without a unit, and then hold one, such as 42 l/s."""

    discharge_m3_s: Annotated[Number, BeforeValidator(_with_unit("discharge")), Field(gt=0, le=1e6)]
    downstream_level_m: Annotated[Level, BeforeValidator(_with_unit("length"))]

    @model_validator(mode="before")
    @classmethod
    def _by_either_name(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        names = {"discharge": "discharge_m3_s", "level": "downstream_level_m"}
        return {long: given[short] for short, long in names.items() if short in given} | given


class FileOfSite(_Said):
    """A file of the folder; what else stands there is told to its reader."""

    model_config = ConfigDict(frozen=True, extra="allow")

    file: PrintableName


def _drawn(given: Any) -> Any:
    """A centreline in a file, as a list of points, or as a case describes one."""
    if isinstance(given, list):
        return CentrelineShape.model_validate({"points": given})
    if isinstance(given, dict):
        return (FileOfSite if "file" in given else CentrelineShape).model_validate(given)
    if given is not None:
        raise ValueError("`points`, `parts` or a `file`")
    return None


class SiteGrid(_Said):
    """The grid of the model, as far as it is not made of the channel or the survey, and the line that it follows; SI.

    centreline: on the map where there is a frame.
    """

    x: Interval | None = None
    y: Interval | None = None
    cell: tuple[Positive, Positive] | None = None
    centreline: Annotated[FileOfSite | CentrelineShape | None, BeforeValidator(_drawn)] = None


class SiteFrame(_Said):
    """Where the model lies on the map: its origin, and the angle of its x axis or a point further down that axis.

    With a centreline nothing of this is needed: the line lies on the map itself.
    """

    origin: tuple[Number, Number] = (0.0, 0.0)
    angle: Annotated[Number, BeforeValidator(_with_unit("angle"))] | None = None
    towards: tuple[Number, Number] | None = None
    crs: Annotated[PrintableName, AfterValidator(in_metres)] | None = None

    @model_validator(mode="after")
    def _one_direction(self) -> Self:
        if self.angle is not None and self.towards is not None:
            raise ValueError(ONE_DIRECTION)
        if self.towards == self.origin:
            raise ValueError("`towards` a point further down the x axis, another one than `origin`")
        return self

    @property
    def frame(self) -> Frame:
        """As a case keeps it."""
        angle = self.angle
        if self.towards is not None:
            east, north = (end - begin for end, begin in zip(self.towards, self.origin, strict=True))
            angle = round(math.degrees(math.atan2(north, east)), 6)
        return Frame(origin=self.origin, angle=angle or 0.0, crs=self.crs)


def _as_list(given: Any) -> Any:
    """A single file of patches as a list of one."""
    return [given] if isinstance(given, dict) else given


class FieldSite(_Said):
    """All that a site file says; SI."""

    channel: Channel | None = None
    bed: FileOfSite | None = None
    grid: SiteGrid | None = None
    frame: SiteFrame | None = None
    classes: FileOfSite | None = None
    walls: Annotated[FlumeWalls | None, BeforeValidator(_walled)] = None
    files: dict[PrintableName, dict[str, Any] | None] = {}
    experiments: Annotated[dict[PrintableName, MeasuredFlow], AfterValidator(_one_or_more)]
    holdout: dict[PrintableName, MeasuredFlow] = {}
    patches: Annotated[tuple[PlantedPatch, ...], BeforeValidator(_as_list)] = ()
    canopy_height_guess_m: Annotated[Number, Field(ge=0.01, le=100)] = 0.8
    eddy_viscosity_m2_s: Annotated[Number, Field(gt=0, le=1e3)] = 0.01
    eddy_viscosity_factor: Annotated[Number, Field(ge=1, le=100)] | None = None

    @property
    def viscosity_factor(self) -> float:
        """To within which factor the eddy viscosity is known; one that is stated alone is taken for right."""
        if self.eddy_viscosity_factor is not None:
            return self.eddy_viscosity_factor
        return 1.0 if "eddy_viscosity_m2_s" in self.model_fields_set else VISCOSITY_FACTOR

    @model_validator(mode="before")
    @classmethod
    def _some_ground(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        if "bed" not in given:
            _Ground.model_validate(given)
        straight = not (isinstance(given.get("grid"), dict) and given["grid"].get("centreline"))
        whole: list[tuple[str, type[BaseModel]]] = [("channel", _Straight), ("frame", _StraightlyPlaced)]
        whole = (whole if straight else []) + ([] if given.get("walls") else [("channel", _Banked)])
        for key, model in whole:
            if isinstance(given.get(key), dict):
                model.model_validate(given)
        return given


class _Ground(_Said):
    channel: Channel


class _StraightChannel(_Said):
    length_m: Length


class _Straight(_Said):
    channel: _StraightChannel


class _ChannelWithBanks(_Said):
    bank_slope_v_per_h: Annotated[Number, Field(ge=0.001, le=100)]


class _Banked(_Said):
    channel: _ChannelWithBanks


class _WholeFrame(_Said):
    origin: tuple[Number, Number]
    angle: Any = None
    towards: Any = None

    @model_validator(mode="after")
    def _one_direction(self) -> Self:
        if (self.angle is None) == (self.towards is None):
            raise ValueError(ONE_DIRECTION)
        return self


class _StraightlyPlaced(_Said):
    frame: _WholeFrame
