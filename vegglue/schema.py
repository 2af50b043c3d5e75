"""The schema of a case: what a YAML file may say, in which unit, and which names must agree. Nothing is read here."""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator


def _number_or_name(value: Any) -> Any:
    if isinstance(value, str) and re.fullmatch(r"[A-Za-z_]\w*", value):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError("a number or the name of an entry of `parameters`")
    return float(value)


def _rising(interval: tuple[float, float]) -> tuple[float, float]:
    if not interval[0] < interval[1]:
        raise ValueError("two numbers, the lower one first")
    return interval


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
Interval = Annotated[tuple[Number, Number], AfterValidator(_rising)]
Polygon = Annotated[tuple[tuple[Number, Number], ...], Field(min_length=3)]
Value = Annotated[Number | str, BeforeValidator(_number_or_name)]


class Part(BaseModel):
    """What all parts of a case share: they are values, and know all their keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


def _exactly(part: Part, chosen: str, wanted: Mapping[str, tuple[str, ...]], allowed: tuple[str, ...] = ()) -> None:
    """Refuse a part that lacks a key of the kind it says it is, or has one of another kind."""
    others = {key for keys in wanted.values() for key in keys} - set(wanted[chosen]) - set(allowed)
    for key in wanted[chosen]:
        if getattr(part, key) is None:
            raise ValueError(f"the key `{key}`, which {chosen} needs")
    for key in sorted(others):
        if getattr(part, key) is not None:
            raise ValueError(f"no key `{key}` together with {chosen}")


class Grid(Part):
    x: Interval = Field(description="from upstream to downstream [m]")
    y: Interval = Field(description="across [m]")
    cell: tuple[Positive, Positive] = Field(description="size of a cell along x and y [m]")

    @model_validator(mode="after")
    def _whole_cells(self) -> Self:
        for axis, (low, high), size in (("x", self.x, self.cell[0]), ("y", self.y, self.cell[1])):
            count = (high - low) / size
            if abs(count - round(count)) > 1e-6 or count < 3:
                raise ValueError(f"a whole number of at least 3 cells along {axis}, where these make {count:g}")
        return self


class Trapezoid(Part):
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


class BedLayer(Part):
    trapezoid: Trapezoid | None = Field(default=None, description="channel from design numbers")
    raster: Path | None = Field(default=None, description="ESRI ASCII grid of bed levels [m]")
    points: Path | None = Field(default=None, description="CSV of surveyed points x,y,z [m]")

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if len(self.model_fields_set) != 1:
            raise ValueError("exactly one of `trapezoid`, `raster`, `points`")
        return self


class FrictionClass(Part):
    law: Literal["manning", "keulegan", "chezy"] = Field(description="C = h^(1/6)/n, 18 log10(12 h/k_s), or given")
    n: Value | None = Field(default=None, description="Manning coefficient [s m^-1/3]")
    k_s: Value | None = Field(default=None, description="Nikuradse roughness height [m]")
    c: Value | None = Field(default=None, description="Chézy coefficient [m^1/2/s]")

    @model_validator(mode="after")
    def _coefficient_of_the_law(self) -> Self:
        _exactly(self, self.law, {"manning": ("n",), "keulegan": ("k_s",), "chezy": ("c",)})
        return self


class Zone(Part):
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
    classes: dict[str, FrictionClass] = Field(min_length=1, description="resistance laws by name")
    default: str = Field(description="friction class where no zone applies")
    zones: tuple[Zone, ...] = Field(default=(), description="rules in order, later ones win")


class Stand(Part):
    phi: Value = Field(description="plant drag C_d m D h_d at `stems` [-]")
    canopy_height: Value = Field(description="height h_d of the deflected canopy [m]")
    bare_chezy: Value = Field(default=60.0, description="Chézy coefficient C_b of the bed under the plants [m^1/2/s]")
    stems: Positive = Field(default=1.0, description="density at which phi holds [1/m2]")
    law: Literal["baptist", "huthoff", "klopstra", "luhar-nepf", "stone-shen", "yang-choi"] = Field(
        default="baptist", description="resistance law of the plants"
    )


class StandOverride(Part):
    phi: Value | None = Field(default=None, description="plant drag in this experiment [-]")
    canopy_height: Value | None = Field(default=None, description="canopy height in this experiment [m]")
    bare_chezy: Value | None = Field(default=None, description="Chézy coefficient under the plants [m^1/2/s]")


class Patch(Part):
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
    stands: dict[str, Stand] = Field(default_factory=dict, description="kinds of plants by name")
    patches: tuple[Patch, ...] = Field(default=(), description="where they stand, later ones win")


class Inflow(Part):
    side: Literal["west", "south", "north"] = Field(description="side of the grid the water enters by")
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
    range: Interval | None = Field(default=None, description="part of the east side in y, all of it when left out [m]")


class Experiment(Part):
    discharge: dict[str, Value] = Field(description="one value, or one for each inflow [m3/s]")
    level: Value = Field(description="water level at the outlet, in the datum of the bed [m]")
    plants: bool | tuple[str, ...] = Field(default=True, description="true, false, or the names of the patches present")
    stands: dict[str, StandOverride] = Field(default_factory=dict, description="what differs in this experiment")


class Parameter(Part):
    distribution: Literal["uniform", "loguniform", "normal", "lognormal"] = Field(description="kind of prior")
    low: Number | None = Field(default=None, description="lower bound")
    high: Number | None = Field(default=None, description="upper bound")
    mean: Number | None = Field(default=None, description="mean of a normal prior, before its bounds")
    sd: Positive | None = Field(default=None, description="standard deviation of a normal prior, before its bounds")
    median: Positive | None = Field(default=None, description="median of a lognormal prior")
    log_sd: Positive | None = Field(default=None, description="standard deviation of the natural logarithm")
    unit: str = Field(description="SI unit, or -")
    symbol: str = Field(default="", description="how it is written in the report")
    meaning: str = Field(default="", description="what it is, in words")

    @model_validator(mode="after")
    def _complete_and_in_order(self) -> Self:
        keys = {"uniform": ("low", "high"), "normal": ("mean", "sd"), "lognormal": ("median", "log_sd")}
        bounds = ("low", "high") if self.distribution == "normal" else ()
        _exactly(self, self.distribution, keys | {"loguniform": ("low", "high")}, bounds)
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ValueError("a `low` below `high`")
        if self.distribution == "loguniform" and self.low is not None and self.low <= 0:
            raise ValueError("a `low` above 0 for a loguniform prior")
        return self


class Working(Part):
    """An effect at work in a case; its key names it, and the effect too unless `effect` does."""

    effect: str | None = Field(default=None, description="name of the effect in the library, if the key is another")
    values: dict[str, Value] = Field(description="its amplitude and, as far as they are not left alone, its shapes")
    experiments: tuple[str, ...] | None = Field(default=None, description="where it acts, everywhere when left out")
    sections: tuple[str, ...] = Field(default=(), description="sensor effects: sections it is limited to")
    devices: tuple[str, ...] = Field(default=(), description="sensor effects: devices it is limited to")


class Offset(Part):
    x: Number = Field(default=0.0, description="added to x of the file [m]")
    y: Number = Field(default=0.0, description="added to y of the file [m]")


class Observation(Part):
    kind: Literal["adv", "velocity", "level"] = Field(description="points in the vertical, depth-averaged, or gauges")
    file: Path = Field(description="CSV file")
    experiment: str | None = Field(default=None, description="experiment of all rows, if the file has no such column")
    section: str | None = Field(default=None, description="section of all rows, if the file has no such column")
    case: str | None = Field(default=None, description="adv: rows of the file with this value in column `case`")
    average: Literal["paper", "profile"] | None = Field(default=None, description="adv: rule of depth-averaging")
    offset: Offset = Field(default_factory=Offset, description="added to the coordinates of the file [m]")
    floor: Number | None = Field(default=None, description="adv: level of the channel floor in z of the file [m]")
    surface: Number | None = Field(default=None, description="adv: measured water level in z of the file [m]")
    standard_error: Positive | None = Field(default=None, description="of all values, if the file has no such column")

    @model_validator(mode="after")
    def _keys_of_the_kind(self) -> Self:
        adv = ("experiment", "section", "case", "average", "floor", "surface")
        _exactly(self, self.kind, {"adv": adv, "velocity": (), "level": ()}, ("experiment", "section"))
        return self


class Survey(Part):
    file: Path = Field(description="CSV of the plant survey: quantity,mean,standard_deviation,samples [SI]")
    debris: bool = Field(default=False, description="true: stem diameters with the debris that hangs in them")
    spread: Literal["plants", "mean"] = Field(default="plants", description="one plant for all, or their mean")
    deflected_height: Positive | None = Field(default=None, description="height of the bent plants [m]")
    undergrowth_density: Annotated[tuple[Positive, Positive], AfterValidator(_rising)] | None = Field(
        default=None, description="assumed range, if there is any [1/m2]"
    )


class Numerics(Part):
    film_depth: Positive = Field(default=0.01, description="depth at the waterline, a tenth of it on dry land [m]")
    bank_argument_minimum: Annotated[Number, Field(gt=1)] = Field(default=1.3, description="floor of 12 h/k_s [-]")
    emergent: Literal["constant", "proportional"] = Field(
        default="constant", description="phi or phi h/h_d where h < h_d"
    )
    shear_depth: Literal["smallest"] | None = Field(
        default=None, description="shear over the smallest depth of the cells around a point; else over its own"
    )
    tolerance: Positive = Field(
        default=3e-6, description="largest correction a solved member still asks for [m, m/s], by depth in a film"
    )


class KeptFields(Part):
    x: Interval = Field(description="range along x, over the whole width of the grid [m]")


class Simulate(Part):
    members: Annotated[int, Field(strict=True, gt=0)] = Field(default=4096, description="size of the ensemble")
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(default=1, description="seed of the Sobol' sequence")
    fields: KeptFields | None = Field(default=None, description="where level, u and v of all members are kept")
    field_budget: Positive = Field(default=200.0, description="most they may take before compression [MB]")


class Infer(Part):
    method: Literal["refine", "glue"] = Field(default="refine", description="draws around the best members, or these")
    likelihood: Literal["gaussian", "nse", "inverse-variance"] = Field(
        default="gaussian", description="how residuals weigh"
    )
    sigma: Literal["best-member", "known"] = Field(
        default="best-member", description="errors estimated from what the best leaves, or known"
    )
    behavioural: Number | None = Field(default=None, description="threshold of an informal likelihood [-]")


class Validation(Part):
    """Measurements that no calibration sees: for judging a finished model only."""

    experiments: dict[str, Experiment] = Field(min_length=1, description="flows that nothing is calibrated to")
    observations: tuple[Observation, ...] = Field(min_length=1, description="what was measured in them")


class Reference(Part):
    source: str = Field(default="", description="who found these values")
    table: dict[str, Number | tuple[Number, Number]] = Field(default_factory=dict, description="[median, sd] or number")
    made_with: dict[str, Number] = Field(default_factory=dict, description="what a synthetic record was made from")


class CanopyCorrection(Part):
    stand: str = Field(description="stand whose phi is corrected")
    from_height: Positive = Field(description="canopy height the ensemble was made with [m]")
    to_height: Positive = Field(description="canopy height to correct for [m]")
    depth: Positive = Field(description="depth at which C is to stay the same [m]")


class Case(Part):
    """Everything one run depends on. Results go to runs/<name>/."""

    source: Path = Field(exclude=True, description="file the case was read from")
    name: str = Field(pattern=r"^[a-z0-9_-]+$", description="lower-case letters, digits, _ and -")
    title: str = Field(default="", description="title of the report")
    grid: Grid = Field(description="regular grid of the model")
    bed: tuple[BedLayer, ...] = Field(min_length=1, description="layers, later ones win where they have data")
    friction: Friction = Field(description="resistance laws and where they hold")
    plants: Plants = Field(default_factory=Plants, description="stands and patches")
    inflows: dict[str, Inflow] = Field(min_length=1, description="where water enters")
    outlet: Outlet = Field(default_factory=Outlet, description="where it leaves: the east side")
    experiments: dict[str, Experiment] = Field(min_length=1, description="flows that share parameters")
    eddy_viscosity: Value = Field(default=0.01, description="[m2/s]")
    effects: dict[str, Working] = Field(default_factory=dict, description="physical effects at work, see `effects`")
    effect_file: Path | None = Field(default=None, description="Python file with effects of your own, needs --trust")
    parameters: dict[str, Parameter] = Field(default_factory=dict, description="unknowns and their priors")
    observations: tuple[Observation, ...] = Field(default=(), description="measurements")
    survey: Survey | None = Field(default=None, description="plant survey")
    numerics: Numerics = Field(default_factory=Numerics, description="choices of the solver")
    simulate: Simulate = Field(default_factory=Simulate, description="size and seed of the ensemble")
    infer: Infer = Field(default_factory=Infer, description="likelihood")
    validation: Validation | None = Field(default=None, description="measurements to judge a finished model by")
    reference: Reference | None = Field(default=None, description="values of others, printed beside ours")
    canopy_correction: CanopyCorrection | None = Field(default=None, description="phi for another canopy height")
