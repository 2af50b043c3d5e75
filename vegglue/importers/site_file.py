"""The site file of a field team: every key, in which unit, between which bounds; read and checked whole."""

import difflib
import json
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from vegglue.case.config import read_tree
from vegglue.case.messages import dotted, expected_in_words, shown_value
from vegglue.case.site_schema import CentrelineShape, Frame, Interval, Number, Polygon, Positive
from vegglue.case.size_limits import LARGEST_CONFIG
from vegglue.case.text_files import read_text, unprintable
from vegglue.errors import InputError, shown_path
from vegglue.importers.column_names import UNITS, in_si
from vegglue.importers.config_parts import VISCOSITY_FACTOR
from vegglue.importers.coordinate_systems import known_in_metres
from vegglue.importers.import_notes import CountedStems, SiteAssumptions, ThickStems, UnreadHoldout, UnreadKeys
from vegglue.measurements.plausibility import is_mark_anywhere

# Name of the file of measurements that no calibration sees, whatever its ending.
HELD_OUT = "holdout"
ONE_DIRECTION = "either `angle` or `towards: [east, north]`"


def _printable(name: str) -> str:
    if (sign := unprintable(name)) is not None:
        raise ValueError(f"a name without the sign {sign!a}")
    return name


def _with_unit(quantity: str) -> Callable[[Any], Any]:
    """A text such as `42 l/s` as a number in SI; what is no text is left to the checks of numbers."""

    def converted(value: Any) -> Any:
        if isinstance(value, list | dict) and quantity == "discharge":
            raise ValueError("one number, of the inflow upstream (add others by `inflows` in the config made of it)")
        if not isinstance(value, str):
            return value
        try:
            return in_si(value, quantity, "")
        except InputError:
            units = f" with a unit among {', '.join(UNITS[quantity])}" if any(map(str.isdigit, value)) else ""
            raise ValueError(f"a number{units}") from None

    return converted


def _accepting(wanted: str, is_right: Callable[[Any], bool]) -> AfterValidator:
    """The check of a value that is right or not: what is wanted stands in the refusal."""

    def checked(value: Any) -> Any:
        if not is_right(value):
            raise ValueError(wanted)
        return value

    return AfterValidator(checked)


# Bounds far beyond any stream; what lies outside is a slip of the pen or of the unit.
PrintableName = Annotated[str, AfterValidator(_printable)]
Length = Annotated[Number, Field(gt=0, le=1e6)]
UNMARKED = _accepting("a measured value, not a mark for none", lambda value: not is_mark_anywhere(value))
Level = Annotated[Number, Field(ge=-1e4, le=1e4), UNMARKED]
Coordinate = Annotated[Number, BeforeValidator(_with_unit("length"))]
MeasuredDischarge = Annotated[Number, Field(gt=0, le=1e6), UNMARKED]


def _refuse_lacking(given: Mapping[str, Any], *keys: str, part: str = "") -> None:
    """ValidationError for the first of the keys that is not given, in that part of the site."""
    for key in keys:
        if given.get(key) is None:
            place = (part, key) if part else (key,)
            raise ValidationError.from_exception_data("site", [{"type": "missing", "loc": place, "input": given}])


class _SitePart(BaseModel):
    """What the parts of a site share: keys without a meaning here are notes."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Channel(_SitePart):
    """A trapezoid, or with `walls` its floor alone; without a length as long as its centreline."""

    length_m: Length | None = None
    bottom_width_m: Annotated[Number, Field(gt=0, le=1e4)]
    bank_slope_v_per_h: Annotated[Number, Field(ge=0.001, le=100)] | None = None
    bed_slope: Annotated[Number, Field(gt=-1, lt=1)]
    floor_level_m: Annotated[Level, BeforeValidator(_with_unit("length"))] = 0.0  # at x = 0


class FlumeWalls(_SitePart):
    """Vertical walls along both sides of the grid, as of a flume.

    n: Manning's, about as known; glass 0.010, wood 0.012 (Chow 1959, table 5-6) [s m^(-1/3)].
    """

    n: Annotated[Number, Field(ge=0.001, le=0.1)] = 0.011


def _walls(given: Any) -> Any:
    """`walls: true` as walls of a usual n, false as none, and a number as their coefficient."""
    if isinstance(given, bool):
        return {} if given else None
    return {"n": given} if isinstance(given, int | float) else given


class PlantedPatch(_SitePart):
    """A rectangle of plants, or a polygon, in the channel; or a file of polygons."""

    x: Interval | None = None
    y: Interval | None = None
    polygon: Polygon | None = None
    file: PrintableName | None = None
    name: PrintableName | None = None
    columns: Annotated[
        dict[str, str],
        _accepting(
            "the headings of `stems` and `name`, such as `{stems: HEADING}`",
            lambda columns: columns.keys() <= {"stems", "name"},
        ),
    ] = {}
    stems_per_m2: Annotated[Number, Field(gt=0, le=1e7)] = 1.0

    @model_validator(mode="before")
    @classmethod
    def _one_shape(cls, given: Any) -> Any:
        """Errors: ValidationError of a rectangle that lacks a side, unless it is another shape."""
        if isinstance(given, dict) and not given.keys() & {"polygon", "file"}:
            _refuse_lacking(given, "x", "y")
        if isinstance(given, dict) and "columns" in given and "file" not in given:
            raise ValueError("a `file` beside `columns`")
        return given


class MeasuredFlow(_SitePart):
    """One experiment; its numbers may go by the names without a unit, and then hold one, such as 42 l/s."""

    discharge_m3_s: Annotated[MeasuredDischarge, BeforeValidator(_with_unit("discharge"))]
    downstream_level_m: Annotated[Level, BeforeValidator(_with_unit("length"))]

    @model_validator(mode="before")
    @classmethod
    def _by_either_name(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        names = {"discharge": "discharge_m3_s", "level": "downstream_level_m"}
        return {long: given[short] for short, long in names.items() if short in given} | given


class FileOfSite(_SitePart):
    """A file of the folder; other keys are options of its reader."""

    model_config = ConfigDict(frozen=True, extra="allow")

    file: PrintableName


def _centreline(given: Any) -> Any:
    """A centreline in a file, as a list of points, or as a case describes one."""
    if isinstance(given, list):
        return CentrelineShape.model_validate({"points": given})
    if isinstance(given, dict):
        return (FileOfSite if "file" in given else CentrelineShape).model_validate(given)
    if given is not None:
        raise ValueError("`points`, `parts` or a `file`")
    return None


class SiteGrid(_SitePart):
    """The grid of the model, as far as it is not made of channel or survey, and the line that it follows; SI."""

    x: Interval | None = None
    y: Interval | None = None
    cell: tuple[Positive, Positive] | None = None
    centreline: Annotated[FileOfSite | CentrelineShape | None, BeforeValidator(_centreline)] = None


class SiteFrame(_SitePart):
    """Where the model lies on the map: its origin, and the angle of its x axis or a point further down that axis."""

    origin: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    angle: Annotated[Number, BeforeValidator(_with_unit("angle"))] | None = None
    towards: tuple[Coordinate, Coordinate] | None = None
    crs: Annotated[PrintableName, AfterValidator(known_in_metres)] | None = None

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


class ResultEntry(_SitePart):
    """A finished result of another model, one for each experiment in `files`.

    law: of the roughness in the file; manning: n of all, if the file has none; parameters: others that it was run with.
    """

    file: PrintableName | None = None
    files: dict[PrintableName, PrintableName] = {}
    law: Literal["manning", "strickler", "chezy", "nikuradse"] | None = None
    manning: Annotated[Number, Field(ge=0.001, le=1.0)] | None = None
    parameters: dict[str, Number] = {}

    @model_validator(mode="before")
    @classmethod
    def _of_one_file(cls, given: Any) -> Any:
        return {"file": given} if isinstance(given, str) else given


class FieldSite(_SitePart):
    """All that a site file states; SI."""

    channel: Channel | None = None
    bed: FileOfSite | None = None
    grid: SiteGrid | None = None
    frame: SiteFrame | None = None
    classes: FileOfSite | None = None
    result: ResultEntry | None = None
    walls: Annotated[FlumeWalls | None, BeforeValidator(_walls)] = None
    files: dict[PrintableName, dict[str, Any] | None] = {}
    experiments: Annotated[dict[PrintableName, MeasuredFlow], _accepting("one or more, those that were measured", bool)]
    holdout: dict[PrintableName, MeasuredFlow] = {}
    patches: Annotated[
        tuple[PlantedPatch, ...], BeforeValidator(lambda given: [given] if isinstance(given, dict) else given)
    ] = ()
    canopy_height_guess_m: Annotated[Number, Field(ge=0.01, le=100)] = 0.8
    eddy_viscosity_m2_s: Annotated[Number, Field(gt=0, le=1e3)] = 0.01
    eddy_viscosity_factor: Annotated[Number, Field(ge=1, le=100)] | None = None
    exclude: dict[PrintableName, str] = {}

    @property
    def viscosity_factor(self) -> float:
        """Factor to within which the eddy viscosity is known; one that is stated alone is taken for right."""
        if self.eddy_viscosity_factor is not None:
            return self.eddy_viscosity_factor
        return 1.0 if "eddy_viscosity_m2_s" in self.model_fields_set else VISCOSITY_FACTOR

    @model_validator(mode="before")
    @classmethod
    def _whole_ground(cls, given: Any) -> Any:
        """ValidationError for a channel or a frame that lacks what its site needs."""
        if not isinstance(given, dict):
            return given
        channel, frame, grid = (given.get(key) for key in ("channel", "frame", "grid"))
        straight = not (isinstance(grid, dict) and grid.get("centreline"))
        if "bed" not in given:
            _refuse_lacking(given, "channel")
        if isinstance(channel, dict):
            banked = not given.get("walls")
            needed = ["bottom_width_m", *["length_m"] * straight, *["bank_slope_v_per_h"] * banked]
            _refuse_lacking(channel, *needed, part="channel")
        if straight and isinstance(frame, dict):
            _refuse_lacking(frame, "origin", part="frame")
            if (frame.get("angle") is None) == (frame.get("towards") is None):
                both = {"error": ValueError(ONE_DIRECTION)}
                raise ValidationError.from_exception_data(
                    "site", [{"type": "value_error", "loc": ("frame",), "input": frame, "ctx": both}]
                )
        return given


SITE_PARTS: dict[str, type[BaseModel]] = {
    "channel": Channel, "grid": SiteGrid, "frame": SiteFrame, "walls": FlumeWalls, "result": ResultEntry,
}  # fmt: skip
# Keys of an experiment, each by either name.
OF_FLOW = (("discharge", "discharge_m3_s"), ("level", "downstream_level_m"))
# How alike two words are that are one misspelt [-], and letters of a word cut short: `stems` for `stems_per_m2`.
MISSPELT, CUT_SHORT = 0.8, 4

# Other names of keys, in a config of a case or elsewhere.
OTHER_WORDS = {
    "plants": "patches", "vegetation": "patches", "density": "stems_per_m2", "stem_density": "stems_per_m2",
    "canopy_height": "canopy_height_guess_m", "q": "discharge", "width": "bottom_width_m", "slope": "bed_slope",
    "viscosity": "eddy_viscosity_m2_s",
}  # fmt: skip


# What is wrong with a text that is no JSON, by the messages of Python's parser, which has no other names for it.
JSON_PROBLEMS = {
    "Expecting property name": "key", "Expecting ':'": "colon", "Expecting ','": "comma", "Expecting value": "value",
    "Extra data": "end", "Unterminated string": "quote", "Invalid control character": "line", "Invalid \\": "backslash",
    "Illegal trailing comma": "last-comma",
}  # fmt: skip


def site_file(folder: Path) -> Path:
    """The site file of a folder: site.yaml if it is there, else site.json, which need not be."""
    return folder / "site.yaml" if (folder / "site.yaml").is_file() else folder / "site.json"


def held_out_files(folder: Path) -> list[Path]:
    """The files of measurements that a folder holds out: holdout.csv first, then other tables of that name."""
    found = (path for path in folder.iterdir() if path.is_file() and path.stem.lower() == HELD_OUT)
    return sorted(found, key=lambda path: (path.name != "holdout.csv", path.name))


def read_site(path: Path, completed: Any = None) -> FieldSite:
    """The site in a file.

    Parameters
    ----------
    completed : mapping, optional
        Its keys and values with those of a finished result.

    Raises
    ------
    InputError
        Which names file and key, for what is missing, no number or beyond bounds.
    """
    if completed is None and not path.exists():
        what = "no site file" if path.parent.is_dir() else "a file" if path.parent.exists() else "no such folder"
        raise InputError(
            f"{shown_path(path.parent)}: expected a folder with site.yaml, or site.json, and tables of measurements, "
            f"got {what}; `vegglue new NAME` makes an example."
        )
    given = read_keys(path) if completed is None else completed
    for place, key, missing in _unknown_keys(given):  # the first that is all but a known one which is not given
        close = next(iter(difflib.get_close_matches(key, missing, n=1, cutoff=MISSPELT)), None)
        if close is None and OTHER_WORDS.get(key.lower()) in missing:
            close = OTHER_WORDS[key.lower()]
        if close is None and len(key) >= CUT_SHORT:
            close = next((known for known in missing if known.startswith(key)), None)
        if close is not None:
            raise InputError(f"{shown_path(path)}: `{place + key}` is not a known key: did you mean `{close}`?")
    try:
        site = FieldSite.model_validate(given)
    except ValidationError as error:
        raise site_refusal(path, error) from None
    counted = ["stems_per_m2" in one.model_fields_set for one in site.patches if one.file is None]
    if any(counted) and not all(counted):  # the others would seem all but bare
        raise InputError(
            f"{shown_path(path)}: expected `stems_per_m2` of every patch or of none, got none of "
            f"`patches[{counted.index(False)}]`; add it there."
        )
    return site


def site_refusal(path: Path, error: ValidationError, *above: str) -> InputError:
    """The error about the first of pydantic's problems with a site file, or with the part of it below some keys."""
    problem = error.errors()[0]
    place = dotted((*above, *(key for key in problem["loc"] if key != "[key]"))) or "site.json"
    if problem["type"] == "missing":  # `experiments.May.level`: as it may be written with a unit of its own
        before, dot, last = place.rpartition(".")
        short = {long: name for name, long in OF_FLOW}.get(last, last)
        return InputError(f"{shown_path(path)}: `{before}{dot}{short}` is missing; add it.")
    expected = expected_in_words(problem).replace("valid string", "text in quotes")
    return InputError(
        f"{shown_path(path)}: `{place}` expected {expected}, got {shown_value(problem['input'])}; correct it."
    )


def assumptions_of_site(folder: Path, site: FieldSite) -> list[object]:
    """What `import` assumes because the site file does not state it, and what in the folder is not read.

    Raises
    ------
    InputError
        As `read_site`.
    """
    path = site_file(folder)
    given = read_keys(path) if path.is_file() else {}
    here = [one for one in site.patches if one.file is None]
    stated = site.model_fields_set
    found: list[object] = [
        SiteAssumptions(
            file=path.name,
            viscosity=None if "eddy_viscosity_m2_s" in stated else site.viscosity_factor,
            canopy=site.canopy_height_guess_m if site.patches and "canopy_height_guess_m" not in stated else None,
            alike=bool(here) and not any("stems_per_m2" in one.model_fields_set for one in here),
            bare=not site.patches,
        )
    ]
    unread = tuple(place + key for place, key, _ in _unknown_keys(given))
    walled = site.walls is not None and site.channel is not None and site.channel.bank_slope_v_per_h is not None
    found += [UnreadKeys(path.name, unread, walled)] if unread or walled else []
    of_patches = [key.rpartition(".")[2].lower() for key in unread if key.startswith("patches")]
    if any("diam" in word or "thick" in word for word in of_patches):
        found.append(ThickStems())
    if any("stem" in word and ("number" in word or "count" in word) for word in of_patches):
        found.append(CountedStems())
    held_out = held_out_files(folder)
    if held_out and not site.holdout:
        found.append(UnreadHoldout(held_out[0].name, path.name))
    return [*found, *(UnreadHoldout(other.name, path.name, held_out[0].name) for other in held_out[1:])]


def read_keys(path: Path) -> Any:
    """Keys and values of a site file, not checked.

    Raises
    ------
    InputError
        If it cannot be read, or is neither YAML nor JSON.
    """
    if path.suffix == ".yaml":
        return read_tree(path)
    text = read_text(path, LARGEST_CONFIG, "site")

    def each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        for number, (key, _) in enumerate(pairs):
            if key in dict(pairs[:number]):  # json keeps the last one and says nothing
                raise InputError(f"{shown_path(path)}: expected the key `{key}` once, got it twice; take one out.")
        return dict(pairs)

    try:
        return json.loads(text, object_pairs_hook=each_once)
    except RecursionError:
        raise InputError(f"{shown_path(path)}: expected parts nested less deeply; use fewer levels.") from None
    except json.JSONDecodeError as error:
        found = next((one for start, one in JSON_PROBLEMS.items() if error.msg.startswith(start)), None)
        raise InputError("invalid_json", file=path, line=error.lineno, column=error.colno, problem=found) from None
    except InputError:
        raise
    except ValueError:  # of Python's limit of digits
        raise InputError(f"{shown_path(path)}: expected numbers, got one of thousands of digits; correct it.") from None


def _unknown_keys(given: Any) -> Iterator[tuple[str, str, list[str]]]:
    """Of each unknown key: the place it stands at, its name, and the known keys that are not given there."""
    if not isinstance(given, dict):
        return

    def names(model: type[BaseModel]) -> list[tuple[str, ...]]:
        return [(name,) for name in model.model_fields]

    # The parts of a site file: where each stands, what is given there, and its known keys, each by all its names.
    parts: list[tuple[str, Any, list[tuple[str, ...]]]] = [("", given, names(FieldSite))]
    parts += [(f"{name}.", given.get(name), names(model)) for name, model in SITE_PARTS.items()]
    for name in ("experiments", "holdout"):
        flows = given.get(name)
        for experiment, flow in flows.items() if isinstance(flows, dict) else ():
            parts.append((f"{name}.{experiment}.", flow, [*OF_FLOW]))
    patches = given.get("patches")
    if isinstance(patches, dict):
        parts.append(("patches.", patches, names(PlantedPatch)))
    for number, patch in enumerate(patches) if isinstance(patches, list) else ():
        parts.append((f"patches[{number}].", patch, names(PlantedPatch)))
    for place, part, known in parts:
        if isinstance(part, dict):
            missing = [name for names_ in known if not set(names_) & part.keys() for name in names_]
            of_part = {name for names_ in known for name in names_}
            yield from ((place, str(key), missing) for key in part if key not in of_part)
