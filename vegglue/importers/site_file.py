"""The site file of a field team, read and checked whole: what stands there, in which unit, between which bounds."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from vegglue.case.config import read_tree
from vegglue.case.frame import Frame
from vegglue.case.messages import dotted
from vegglue.case.parts import Interval, Number, Polygon, Positive
from vegglue.case.site_schema import CentrelineShape
from vegglue.case.size_limits import LARGEST_CONFIG
from vegglue.case.text_files import read_text, unprintable
from vegglue.errors import InputError, shown_path
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


# What the file of measurements is called that no calibration sees, whatever its ending.
HELD_OUT = "holdout"
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
    """`walls: true` as walls of which nothing else is known, and false as none."""
    return ({} if given else None) if isinstance(given, bool) else given


class PlantedPatch(_Said):
    """A rectangle of plants, or a polygon, in the channel; or a file of polygons."""

    x: Interval | None = None
    y: Interval | None = None
    polygon: Polygon | None = None
    file: PrintableName | None = None
    name: PrintableName | None = None
    stems_per_m2: Annotated[Number, Field(gt=0, le=1e7)] = 1.0

    @model_validator(mode="before")
    @classmethod
    def _one_shape(cls, given: Any) -> Any:
        """Errors: ValidationError of a rectangle that lacks a side, unless it is another shape."""
        if isinstance(given, dict) and not given.keys() & {"polygon", "file"}:
            _Rectangle.model_validate(given)
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
    crs: PrintableName | None = None

    @model_validator(mode="after")
    def _one_direction(self) -> Self:
        if self.angle is not None and self.towards is not None:
            raise ValueError(ONE_DIRECTION)
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


def site_file(folder: Path) -> Path:
    """The site file of a folder: site.yaml if it is there, else site.json, which need not be."""
    return folder / "site.yaml" if (folder / "site.yaml").is_file() else folder / "site.json"


def held_out_file(folder: Path) -> Path | None:
    """The file of measurements that a folder holds out: holdout.csv, else the first other table of that name."""
    found = sorted(path for path in folder.iterdir() if path.is_file() and path.stem.lower() == HELD_OUT)
    return next((path for path in found if path.name == "holdout.csv"), next(iter(found), None))


def read_site(path: Path) -> FieldSite:
    """The site in a file. Errors: InputError, naming file and key, for what is missing, no number or beyond bounds."""
    try:
        site = FieldSite.model_validate(read_tree(path) if path.suffix == ".yaml" else _of_json(path))
    except InputError:
        raise
    except ValidationError as error:
        raise InputError(f"{shown_path(path)}: {_sentence(error)}") from None
    except RecursionError:
        raise InputError(f"{shown_path(path)}: keys stand within keys too often: write them flatter.") from None
    except ValueError as error:
        raise InputError(f"{shown_path(path)} is not valid JSON: {error}; correct it there.") from None
    _refuse_some_uncounted(path, site)
    return site


def _refuse_some_uncounted(path: Path, site: FieldSite) -> None:
    """Errors: InputError when stems were counted in some patches only: the others would seem all but bare."""
    counted = ["stems_per_m2" in one.model_fields_set for one in site.patches if one.file is None]
    if any(counted) and not all(counted):
        raise InputError(
            f"{shown_path(path)}: expected `stems_per_m2` of every patch or of none, got none of "
            f"`patches[{counted.index(False)}]`; add it there."
        )


def left_open(folder: Path) -> list[str]:
    """What the site file of a folder does not say and `import` assumes, and what it says that nobody reads.

    Errors: InputError as those of `read_site`.
    """
    path = site_file(folder)
    site, given = read_site(path), read_tree(path) if path.suffix == ".yaml" else _of_json(path)
    assumed = []
    if "eddy_viscosity_m2_s" not in site.model_fields_set:
        within = f", to within a factor of {site.viscosity_factor:g}" if site.viscosity_factor > 1 else ""
        assumed.append(f"eddy_viscosity_m2_s {site.eddy_viscosity_m2_s:g}{within}")
    if site.patches and "canopy_height_guess_m" not in site.model_fields_set:
        assumed.append(f"canopy_height_guess_m {site.canopy_height_guess_m:g}")
    if site.patches and not any("stems_per_m2" in one.model_fields_set for one in site.patches if one.file is None):
        assumed.append("plants equally dense in all patches that have no file")
    if not site.patches:
        assumed.append("no plants")
    unread = [str(key) for key in given if key not in FieldSite.model_fields]
    parts: dict[str, type[BaseModel]] = {"channel": Channel, "grid": SiteGrid, "frame": SiteFrame}
    for name, part in parts.items():
        unread += [f"{name}.{key}" for key in given.get(name) or {} if key not in part.model_fields]
    if site.walls is not None and site.channel is not None and site.channel.bank_slope_v_per_h is not None:
        unread.append("channel.bank_slope_v_per_h, as there are walls")
    told = [f"{path.name} does not say, and so is assumed: {', '.join(assumed)}."] if assumed else []
    told += [f"{path.name}: taken as notes, and not read: {', '.join(unread)}."] if unread else []
    if (held_out := held_out_file(folder)) is not None and not site.holdout:
        told.append(f"{held_out.name} is not read: {path.name} names no experiment under `holdout`.")
    return told


def _of_json(path: Path) -> Any:
    return json.loads(read_text(path, LARGEST_CONFIG, "a folder to import has one"))


def _sentence(error: ValidationError) -> str:
    problem = error.errors()[0]
    place = dotted(tuple(key for key in problem["loc"] if key != "[key]")) or "site.json"
    if problem["type"] == "missing":
        return f"`{place}` is missing; add it."
    expected = problem["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    for said, meant in (("valid number", "number"), ("valid dictionary or instance of", "keys and values of")):
        expected = expected.replace(said, meant)
    return f"`{place}` expected {expected}, got {repr(problem['input'])[:80]}; correct it."
