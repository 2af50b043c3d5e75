"""The part of the schema that describes a site: grid, bed, friction, plants, inflows, outlet, and its frame on the map;
and what all parts of a case are made of: numbers, ranges, polygons, and values that may be parameters.
"""

import inspect
import math
import re
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from vegglue.case.size_limits import MOST_CELLS


def _number_or_name(value: Any) -> Any:
    if isinstance(value, str) and re.fullmatch(r"[A-Za-z_]\w*", value):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError("a number or the name of an entry of `parameters`")
    return float(value)


def rising(interval: tuple[float, float]) -> tuple[float, float]:
    """The interval as it is. Errors: ValueError, of which the schema makes a sentence, if its ends are not in order."""
    if not interval[0] < interval[1]:
        raise ValueError("two numbers, the lower one first")
    return interval


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Interval = Annotated[tuple[Number, Number], AfterValidator(rising)]
Polygon = Annotated[tuple[tuple[Number, Number], ...], Field(min_length=3)]
Value = Annotated[Number | str, BeforeValidator(_number_or_name)]


class Part(BaseModel):
    """What all parts of a case share: they are values, know all their keys, and describe them in their docstring."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **_keywords: Any) -> None:
        """Add what the keys mean to the docstring, as numpydoc has the attributes of a class."""
        keys = [f"{name}\n    {key.description}" for name, key in cls.model_fields.items() if key.description]
        cls.__doc__ = "\n".join([inspect.cleandoc(cls.__doc__ or ""), "", "Attributes", "----------", *keys])


def exactly(part: Part, chosen: str, wanted: Mapping[str, tuple[str, ...]], allowed: tuple[str, ...] = ()) -> None:
    """Check that a part has the keys of its kind and none of another.

    Parameters
    ----------
    chosen : str
        The kind.
    wanted : mapping of tuple of str
        The keys of each kind.
    allowed : tuple of str
        Keys that any kind may have.

    Raises
    ------
    ValueError
        Naming the key.
    """
    others = {key for keys in wanted.values() for key in keys} - set(wanted[chosen]) - set(allowed)
    for key in wanted[chosen]:
        if getattr(part, key) is None:
            raise ValueError(f"the key `{key}`, which {chosen} needs")
    for key in sorted(others):
        if getattr(part, key) is not None:
            raise ValueError(f"no key `{key}` together with {chosen}")


# Systems whose coordinates are degrees, the usual ones; WGS 84 alone may be the datum of one in metres.
IN_DEGREES = {"EPSG:4326", "EPSG:4258", "EPSG:4269", "OGC:CRS84", "CRS84"}


def in_metres(crs: str) -> str:
    """The system, refused where its coordinates are degrees."""
    if crs.strip().upper() in IN_DEGREES:
        raise ValueError("a projected system, with coordinates in metres, such as EPSG:2056")
    return crs


class Frame(Part):
    """Takes and gives floats, or arrays of them: nothing of numpy is needed to read a case.

    x = (E - E_0) cos a + (N - N_0) sin a, y = (N - N_0) cos a - (E - E_0) sin a [m].
    """

    origin: tuple[Number, Number] = Field(description="east and north of x = y = 0 on the map [m]")
    angle: Number = Field(description="from east to the x axis, which runs downstream, anticlockwise [degrees]")
    crs: Annotated[str, AfterValidator(in_metres)] | None = Field(
        default=None, description="coordinate system of the map, such as EPSG:2056"
    )

    def to_model(self, east: Any, north: Any) -> tuple[Any, Any]:
        """x and y of places on the map [m]."""
        return self.turned_to_model(east - self.origin[0], north - self.origin[1])

    def to_map(self, x: Any, y: Any) -> tuple[Any, Any]:
        """East and north of places in the model [m]."""
        east, north = self.turned_to_map(x, y)
        return east + self.origin[0], north + self.origin[1]

    def turned_to_model(self, east: Any, north: Any) -> tuple[Any, Any]:
        """Components along and across of a vector whose components east and north are given."""
        cosine, sine = self._direction()
        return east * cosine + north * sine, north * cosine - east * sine

    def turned_to_map(self, along: Any, across: Any) -> tuple[Any, Any]:
        """Components east and north of a vector whose components along and across are given."""
        cosine, sine = self._direction()
        return along * cosine - across * sine, along * sine + across * cosine

    def _direction(self) -> tuple[float, float]:
        return math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))


# Bounds far beyond any stream, within which the geometry of a centreline has its digits; a hundred turns.
_Run = Annotated[Number, Field(ge=1e-3, le=1e6)]
_Turn = Annotated[Number, Field(ge=-36000.0, le=36000.0)]
_OnMap = Annotated[Number, Field(ge=-1e9, le=1e9)]
# Points of a centreline nearer than this are one, and an arc shorter than this is none [m].
NEAREST_POINTS = 1e-3


class Stretch(Part):
    """A straight part of a centreline, or an arc."""

    length: _Run | None = Field(default=None, description="length of a straight part [m]")
    radius: _Run | None = Field(default=None, description="radius of an arc [m]")
    angle: _Turn | None = Field(default=None, description="turn of an arc, positive to the left [degrees]")

    @model_validator(mode="after")
    def _straight_or_arc(self) -> Self:
        exactly(self, "an arc" if self.length is None else "a straight part", STRETCHES)
        if self.angle == 0.0:
            raise ValueError("an `angle` that is not 0; a straight part has a `length`")
        if self.run < NEAREST_POINTS:
            raise ValueError("an arc of at least 1 mm")
        return self

    @property
    def run(self) -> float:
        """Length along it [m]: given, or radius times angle."""
        return (self.radius or 0.0) * math.radians(abs(self.angle or 0.0)) if self.length is None else self.length


STRETCHES = {"a straight part": ("length",), "an arc": ("radius", "angle")}


class CentrelineShape(Part):
    """The line that x runs along: points on the map, or parts one after the other."""

    points: Annotated[tuple[tuple[_OnMap, _OnMap], ...], Field(min_length=2)] | None = Field(
        default=None, description="x, y on the map, upstream first, a smooth curve passes through them [m]"
    )
    parts: Annotated[tuple[Stretch, ...], Field(min_length=1)] | None = Field(
        default=None, description="straight parts and arcs, upstream first"
    )
    start: tuple[_OnMap, _OnMap] = Field(default=(0.0, 0.0), description="x, y where `parts` begin [m]")
    heading: _Turn = Field(default=0.0, description="where `parts` head first, from x towards y [degrees]")

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.points is None) == (self.parts is None):
            raise ValueError("either `points` or `parts`")
        if self.points is not None and any(math.dist(*pair) < NEAREST_POINTS for pair in pairwise(self.points)):
            raise ValueError("`points` that differ from the one before")
        return self


class GridExtent(Part):
    """The regular grid of the model: nx ny cells of dx by dy."""

    x: Interval = Field(description="from upstream to downstream [m]")
    y: Interval = Field(description="across [m]")
    cell: tuple[Positive, Positive] = Field(description="size of a cell along x and y [m]")
    filter_width: Positive | None = Field(
        default=None,
        description="[m] below which eddies are not resolved, of `smagorinsky`; else the root of the area of a cell",
    )
    centreline: CentrelineShape | None = Field(default=None, description="line that x runs along and y across")

    @model_validator(mode="after")
    def _whole_cells(self) -> Self:
        columns, rows = ((high - low) / size for (low, high), size in zip((self.x, self.y), self.cell, strict=True))
        if not columns * rows <= MOST_CELLS:
            raise ValueError(f"at most {MOST_CELLS:,} cells instead of {columns * rows:.3g}")
        for axis, (low, high), size in (("x", self.x, self.cell[0]), ("y", self.y, self.cell[1])):
            count = (high - low) / size
            if abs(count - round(count)) > 1e-6 or count < 3:
                raise ValueError(f"a whole number of at least 3 cells along {axis} instead of {count:g}")
        return self


class Trapezoid(Part):
    """A channel by its numbers: z = level - bed_slope (x - x_0) on the floor, rising by bank_slope beside it."""

    axis: Number = Field(description="y of the channel axis [m]")
    bottom_width: Positive = Field(description="width of the floor [m]")
    top_width: Positive | None = Field(default=None, description="width between the tops of the banks, flat beyond [m]")
    bank_slope: Positive = Field(description="rise over run of the banks [-]")
    bed_slope: Number = Field(description="fall of the floor per length along x [-]")
    level: Number = Field(description="level of the floor at the upstream edge of the grid [m]")

    @model_validator(mode="after")
    def _wider_at_the_top(self) -> Self:
        if self.top_width is not None and self.top_width <= self.bottom_width:
            raise ValueError("a `top_width` above `bottom_width`")
        return self


class CovarianceOfBed(Part):
    """How far the bed may lie from its mean cross-section, and over which lengths."""

    chance: Annotated[Number, Field(gt=0, le=1)] = Field(description="chance of it among all [-]")
    rough: bool = Field(default=False, description="whether the bed is rough along, not smooth")
    along: Positive = Field(description="length along [m]")
    across: Positive = Field(description="length across [m]")
    sd: Positive = Field(description="standard deviation from the mean cross-section [m]")
    point_error: Positive = Field(description="standard error of a point [m]")


class LinesLeftOut(Part):
    """How well lines of a survey are predicted from all others."""

    count: Annotated[int, Field(strict=True, gt=0)] = Field(description="how many lines, or points in no line")
    error: NotNegative = Field(description="root mean square error of their prediction from all others [m]")
    stated: Positive = Field(description="the same as the covariance states it [m]")
    straight: NotNegative = Field(description="the same of straight lines between the neighbours [m]")
    most: NotNegative = Field(description="largest error of a line over its stated one [-]")
    most_at: Number = Field(description="x of that line [m]")
    offset: Number = Field(default=0.0, description="by how much the line that is furthest off lies too high [m]")
    offset_error: NotNegative = Field(default=0.0, description="its standard error [m]")
    offset_at: Number = Field(default=0.0, description="x of that line [m]")


class SurveyOfBed(Part):
    """The survey that the levels of a layer come from."""

    file: Path = Field(description="CSV of surveyed points x,y,z,line in the frame of the grid [m]; line -1 for none")
    covariances: Annotated[tuple[CovarianceOfBed, ...], Field(min_length=1)] = Field(
        description="of the bed around its mean cross-section, see case/survey_error.py"
    )
    left_out: LinesLeftOut | None = Field(default=None, description="how well lines are predicted that are left out")
    loose: tuple[Annotated[int, Field(strict=True, ge=0)], ...] = Field(
        default=(), description="numbers of lines without whose level the bed was made; their shape counts"
    )
    relevelled: tuple[Annotated[int, Field(strict=True, ge=0)], ...] = Field(
        default=(), description="numbers of lines whose level is taken out of the bed again; their shape counts"
    )


class BedLayer(Part):
    """Levels of the bed from one source."""

    trapezoid: Trapezoid | None = Field(default=None, description="channel from design numbers")
    raster: Path | None = Field(default=None, description="ESRI ASCII grid of bed levels [m]")
    points: Path | None = Field(default=None, description="CSV of surveyed points x,y,z [m]")
    survey: SurveyOfBed | None = Field(
        default=None, description="survey the levels come from, which states their error"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if len(self.model_fields_set - {"survey"}) != 1:
            raise ValueError("exactly one of `trapezoid`, `raster`, `points`")
        if self.survey is not None and self.trapezoid is not None:
            raise ValueError("no key `survey` together with `trapezoid`")
        return self


# The key of a friction class that holds the coefficient of each law; the laws are those of `bed_laws`.
COEFFICIENT_OF = {"manning": "n", "keulegan": "k_s", "chezy": "c"}


class FrictionClass(Part):
    """C of a bed [m^1/2/s]: h^(1/6) / n, 18 log10(12 h / k_s), or a value."""

    law: Literal["manning", "keulegan", "chezy"] = Field(description="resistance law of the bed")
    n: Value | None = Field(default=None, description="Manning coefficient [s m^-1/3]")
    k_s: Value | None = Field(default=None, description="Nikuradse roughness height [m]")
    c: Value | None = Field(default=None, description="Chézy coefficient [m^1/2/s]")

    @model_validator(mode="after")
    def _coefficient_of_the_law(self) -> Self:
        exactly(self, self.law, {law: (key,) for law, key in COEFFICIENT_OF.items()})
        return self

    @property
    def coefficient(self) -> Value:
        """The coefficient of its law, a number or the name of a parameter."""
        value: Value = getattr(self, COEFFICIENT_OF[self.law])
        return value


class Zone(Part):
    """Where a friction class holds, by one rule."""

    friction_class: str | None = Field(default=None, alias="class", description="friction class of the zone")
    steeper_than: Positive | None = Field(default=None, description="cells where |grad z_b| is above this [-]")
    beyond_slope_break: Positive | None = Field(
        default=None, description="from the lowest cell of a cross-section outward, all from the first one steeper [-]"
    )
    polygon: Polygon | None = Field(default=None, description="corners x, y [m]")
    x: Interval | None = Field(default=None, description="range along x, alone or with y [m]")
    y: Interval | None = Field(default=None, description="range along y, alone or with x [m]")
    raster: Path | None = Field(default=None, description="ESRI ASCII grid of class numbers")
    values: dict[int, str] | None = Field(default=None, description="class of each number in the raster")

    @model_validator(mode="after")
    def _one_rule(self) -> Self:
        rules = self.model_fields_set & {"steeper_than", "beyond_slope_break", "polygon", "raster"}
        if len(rules) + bool(self.model_fields_set & {"x", "y"}) != 1:
            raise ValueError("one of `steeper_than`, `beyond_slope_break`, `polygon`, `raster`, or a range `x`, `y`")
        if (self.raster is None) != (self.values is None) or (self.raster is None) == (self.friction_class is None):
            raise ValueError("a `class`, or for a raster its `values` instead")
        return self


class Friction(Part):
    """Resistance of the bed and of walls."""

    classes: dict[str, FrictionClass] = Field(min_length=1, description="resistance laws by name")
    default: str = Field(description="friction class where no zone applies")
    zones: tuple[Zone, ...] = Field(default=(), description="in order; a later one replaces earlier ones")
    walls: FrictionClass | None = Field(
        default=None,
        description="vertical walls along the south and north side of the grid, and on steps of the bed that are "
        "steeper than 1:1 between two rows of cells; smooth when left out",
    )


class VegetationType(Part):
    """Plants of one kind."""

    phi: Value = Field(description="plant drag C_d m D h_d at `stems` [-]")
    canopy_height: Value = Field(description="height h_d of the deflected canopy [m]")
    bare_chezy: Value = Field(default=60.0, description="Chézy coefficient C_b of the bed under the plants [m^1/2/s]")
    stems: Positive = Field(default=1.0, description="density at which phi holds [1/m2]")
    law: Literal["baptist", "huthoff", "klopstra", "luhar-nepf", "stone-shen", "yang-choi"] = Field(
        default="baptist", description="resistance law of the plants"
    )


class VegetationOverride(Part):
    """What differs of plants in one experiment."""

    phi: Value | None = Field(default=None, description="plant drag in this experiment [-]")
    canopy_height: Value | None = Field(default=None, description="canopy height in this experiment [m]")
    bare_chezy: Value | None = Field(default=None, description="Chézy coefficient under the plants [m^1/2/s]")


class Patch(Part):
    """Where plants of one kind stand."""

    name: str = Field(description="name of the patch")
    stand: str = Field(description="stand growing in it")
    stems: Positive = Field(default=1.0, description="density of the patch [1/m2]")
    x: Interval | None = Field(default=None, description="range along x, with y [m]")
    y: Interval | None = Field(default=None, description="range along y, with x [m]")
    polygon: Polygon | None = Field(default=None, description="corners x, y [m]")

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        if (self.x is None) != (self.y is None) or (self.x is None) == (self.polygon is None):
            raise ValueError("either both `x` and `y`, or a `polygon`")
        return self


class Plants(Part):
    """All plants of the site."""

    stands: dict[str, VegetationType] = Field(default_factory=dict, description="kinds of plants by name")
    patches: tuple[Patch, ...] = Field(default=(), description="patches; a later one replaces earlier ones")


class Inflow(Part):
    """Where water enters."""

    side: Literal["west", "south", "north"] = Field(description="side of the grid through which water enters")
    range: Interval | None = Field(default=None, description="part of that side, all of it when left out [m]")
    spread: Literal["conveyance", "uniform"] = Field(default="conveyance", description="by h^(5/3), or evenly")
    angle: Annotated[Number, Field(gt=0, lt=180)] | None = Field(
        default=None, description="south, north: from downstream to where the water heads, 90 if not given [degrees]"
    )

    @model_validator(mode="after")
    def _straight_from_the_west(self) -> Self:
        if self.side == "west" and self.angle is not None:
            raise ValueError("no `angle` for an inflow from the west, which enters along x")
        return self


class Outlet(Part):
    """Where water leaves: at the east side."""

    range: Interval | None = Field(default=None, description="part of the east side in y, all of it when left out [m]")
