"""The schema of a config: its keys, their units, and which of them must agree. Nothing is read here."""

import math
import re
import shlex
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from vegglue.case.site_schema import (
    BedLayer,
    Frame,
    Friction,
    GridExtent,
    Inflow,
    Interval,
    Number,
    Outlet,
    Part,
    Plants,
    Positive,
    Value,
    VegetationOverride,
    exactly,
    rising,
)
from vegglue.case.size_limits import MOST_MEMBERS
from vegglue.wording.numbers import in_short, so_many
from vegglue.wording.sentences import phrase

# What a word of the command may name in braces beside the files: the Python that runs vegglue.
PYTHON = "python"
_PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
# Words that only a shell understands: a program would be given them as they stand.
_OF_A_SHELL = ("|", "||", "&", "&&", ";", "<", ">", ">>", "2>", "2>&1")


class CommandEngine(Part):
    """A command that is started once for each member, in a folder of its own: see docs/own_engine.md."""

    command: str = Field(description="program and its words, without a shell; {name} stands for one of `files`")
    files: dict[str, Path] = Field(default_factory=dict, description="files and folders that the command needs")
    # An hour: a steady flow of a reach takes minutes with the codes this is made for.
    timeout: Positive = Field(default=3600.0, description="time after which a run is stopped and has failed [s]")
    keep: Literal["failed", "all"] = Field(default="failed", description="which folders are kept after a run")
    # A tenth of a standard deviation. Predictions rounded to 1 mm/s then give slopes to 2 % where a standard deviation
    # moves them by 0.1 m/s, and central differences leave a thousandth of the curvature of the third order.
    step: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.1, description="step of differences [standard deviations of the prior]"
    )
    most_runs: Annotated[int, Field(strict=True, gt=0)] = Field(
        default=100, description="largest number of runs for a posterior by `method: surrogate`"
    )

    @model_validator(mode="after")
    def _words_that_are_known(self) -> Self:
        known = [*self.files, PYTHON]
        if PYTHON in self.files:
            raise ValueError(f"another name than `{PYTHON}` in `files`: it stands for the Python that runs vegglue")
        try:
            words = shlex.split(self.command)
        except ValueError as error:
            raise ValueError(f"a `command` with quotes in pairs ({error})") from None
        if not words:
            raise ValueError("a `command` with the name of a program")
        for word in words:
            if word in _OF_A_SHELL:
                raise ValueError(f"a `command` without {word!r}, as no shell reads it; put it into a script of `files`")
        for name in _PLACEHOLDER.findall(self.command):
            if name not in known:
                raise ValueError(f"a `command` in which {{{name}}} names one of `files`: {', '.join(known)}")
        return self

    def words(self, python: str) -> tuple[str, ...]:
        """The program and its words, with the path of each file that is named; python: what stands for {python}."""
        paths = {name: str(path) for name, path in self.files.items()} | {PYTHON: python}
        return tuple(_PLACEHOLDER.sub(lambda found: paths[found[1]], word) for word in shlex.split(self.command))


class FinishedResult(Part):
    """A finished run of another model: its flow predicts instead of the solver's, see docs/own_engine.md."""

    code: str = Field(default="", description="program that made it")
    files: dict[str, Path] = Field(
        min_length=1, description="by experiment, a CSV with x, y, bed, depth [m], u, v [m/s] on the grid of the case"
    )
    parameters: dict[str, Number] = Field(
        default_factory=dict, description="values that it was run with; of others the median of the prior is taken"
    )


# Numbers of a prior lie between 10^-30 and 10^30, whatever their unit: their squares and products are still numbers.
SMALLEST_IN_PRIOR, LARGEST_IN_PRIOR = 1e-30, 1e30
# Width of a prior over its size [-]: a thinner one is a number, whose digits end at 10^-16.
THINNEST = 1e-9
# Standard deviations from the mean to the nearer bound [-]: beyond lies a share of 10^-12.
FARTHEST_BOUND = 7.0
# Spread of the logarithm [-]: twice it, either way, is a factor of 10^17.
WIDEST_LOG = 20.0


class Experiment(Part):
    """A steady flow, and what differs in it from the others."""

    discharge: dict[str, Value] = Field(description="one value, or one for each inflow [m3/s]")
    level: Value = Field(description="water level at the outlet, in the datum of the bed [m]")
    plants: bool | tuple[str, ...] = Field(default=True, description="true, false, or the names of the patches present")
    stands: dict[str, VegetationOverride] = Field(default_factory=dict, description="what differs in this experiment")
    bed: Annotated[tuple[BedLayer, ...], Field(min_length=1)] | None = Field(
        default=None, description="layers over the bed of the case, in this experiment only"
    )


class Parameter(Part):
    """p(theta): the prior of an unknown, truncated to low <= theta <= high [unit].

    uniform: constant; loguniform: 1/theta; normal: exp(-(theta - mean)^2 / (2 sd^2)); lognormal: the same of ln theta
    around ln median, with log_sd; all up to a constant.
    """

    distribution: Literal["uniform", "loguniform", "normal", "lognormal"] = Field(description="kind of prior")
    low: Number | None = Field(default=None, description="lower bound")
    high: Number | None = Field(default=None, description="upper bound")
    mean: Number | None = Field(default=None, description="mean of a normal prior, before its bounds")
    sd: Positive | None = Field(default=None, description="standard deviation of a normal prior, before its bounds")
    median: Positive | None = Field(default=None, description="median of a lognormal prior")
    log_sd: Positive | None = Field(default=None, description="standard deviation of the natural logarithm")
    unit: str = Field(description="SI unit, or -")
    symbol: str = Field(default="", description="symbol in the report")
    meaning: str = Field(default="", description="description")

    @model_validator(mode="after")
    def _complete_and_in_order(self) -> Self:
        keys = {"uniform": ("low", "high"), "normal": ("mean", "sd"), "lognormal": ("median", "log_sd")}
        bounds = ("low", "high") if self.distribution == "normal" else ()
        exactly(self, self.distribution, keys | {"loguniform": ("low", "high")}, bounds)
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ValueError("a `low` below `high`")
        if self.distribution == "loguniform" and self.low is not None and self.low <= 0:
            raise ValueError("a `low` above 0 for a loguniform prior")
        return self

    @model_validator(mode="after")
    def _can_be_drawn_from(self) -> Self:
        low, high = -math.inf if self.low is None else self.low, math.inf if self.high is None else self.high
        numbers = (self.low, self.high, self.mean, self.sd, self.median, self.log_sd)
        if any(one and not SMALLEST_IN_PRIOR <= abs(one) <= LARGEST_IN_PRIOR for one in numbers):
            raise ValueError(phrase("usable_prior", "size", (SMALLEST_IN_PRIOR, LARGEST_IN_PRIOR)))
        if self.log_sd is not None and not THINNEST < self.log_sd < WIDEST_LOG:
            raise ValueError(phrase("usable_prior", "log_sd", (THINNEST, WIDEST_LOG)))
        if self.distribution in ("uniform", "loguniform") and high - low <= THINNEST * max(abs(low), abs(high)):
            raise ValueError(phrase("usable_prior", "range"))
        if self.mean is not None and self.sd is not None:
            if self.sd < THINNEST * abs(self.mean):
                raise ValueError(phrase("usable_prior", "sd"))
            if low > self.mean + FARTHEST_BOUND * self.sd or high < self.mean - FARTHEST_BOUND * self.sd:
                raise ValueError(phrase("usable_prior", "bounds", (FARTHEST_BOUND,)))
            if high - low < THINNEST * self.sd:
                raise ValueError(phrase("usable_prior", "uniform"))
        return self


class EffectEntry(Part):
    """An effect at work in a case; its key names it, and the effect too unless `effect` does."""

    effect: str | None = Field(default=None, description="name of the effect in the library, if the key is another")
    values: dict[str, Value] = Field(description="its amplitude, and shapes other than their defaults")
    experiments: tuple[str, ...] | None = Field(default=None, description="where it acts, everywhere when left out")
    sections: tuple[str, ...] = Field(default=(), description="sensor effects: sections it is limited to")
    devices: tuple[str, ...] = Field(default=(), description="sensor effects: devices it is limited to")


class Offset(Part):
    """Where the origin of a file lies in the model."""

    x: Number = Field(default=0.0, description="added to x of the file [m]")
    y: Number = Field(default=0.0, description="added to y of the file [m]")


class Observation(Part):
    """Measurements of one kind in one file."""

    kind: str = Field(description="what was measured, e.g. velocity or level; adv: points in the vertical")
    file: Path = Field(description="CSV file")
    experiment: str | None = Field(default=None, description="experiment of all rows, if the file has no such column")
    section: str | None = Field(default=None, description="section of all rows, if the file has no such column")
    case: str | None = Field(default=None, description="adv: rows of the file with this value in column `case`")
    average: Literal["paper", "profile"] | None = Field(
        default=None, description="adv: depth average by `paper`, linear between points, or `profile`, of a fit"
    )
    offset: Offset = Field(default_factory=Offset, description="added to the coordinates of the file [m]")
    floor: Number | None = Field(
        default=None, description="adv: z of the file at the lowest bed; else that of the bed [m]"
    )
    surface: Number | None = Field(
        default=None, description="adv: z of the file at the water; else from levels measured [m]"
    )
    standard_error: Annotated[Number, Field(ge=1e-9, le=1e9)] | None = Field(
        default=None, description="of all values, if the file has no such column"
    )
    across: Literal[True] | None = Field(
        default=None, description="adv: true makes velocities across of column `v`, averaged like those along"
    )
    synthetic: bool = Field(default=False, description="true: computed, not measured; marked in reports and figures")

    @model_validator(mode="after")
    def _keys_of_the_kind(self) -> Self:
        adv = ("experiment", "section", "case", "average")
        exactly(self, self.kind, {self.kind: (), "adv": adv}, ("experiment", "section"))
        of_adv = [key for key in ("floor", "surface", "across") if getattr(self, key) is not None]
        if of_adv and self.kind != "adv":
            raise ValueError(f"no key `{of_adv[0]}` together with {self.kind}")
        return self


class ImportedFile(Part):
    """A file of measurements that `import` brought into the form of a case: kept so that it can be done again."""

    name: str = Field(description="name of the file in the folder that was imported")
    sha256: str = Field(description="of its content")
    taken: str = Field(description="what was taken from it, in words")
    columns: dict[str, str] = Field(default_factory=dict, description="heading of each quantity")
    units: dict[str, str] = Field(default_factory=dict, description="unit of each quantity in the file")


class Survey(Part):
    """A survey of the plants, from which phi is known before any flow is measured."""

    file: Path = Field(description="CSV of the plant survey: quantity,mean,standard_deviation,samples [SI]")
    debris: bool = Field(default=False, description="true: stem diameters with the debris that hangs in them")
    spread: Literal["plants", "mean"] = Field(default="plants", description="one plant for all, or their mean")
    deflected_height: Positive | None = Field(default=None, description="height of the bent plants [m]")
    undergrowth_density: Annotated[tuple[Positive, Positive], AfterValidator(rising)] | None = Field(
        default=None, description="assumed range, if there is any [1/m2]"
    )


class Numerics(Part):
    """Choices of the solver."""

    film_depth: Positive = Field(default=0.01, description="depth at the waterline, a tenth of it on dry land [m]")
    bank_argument_minimum: Annotated[Number, Field(gt=1)] = Field(default=1.3, description="floor of 12 h/k_s [-]")
    emergent: Literal["constant", "proportional"] = Field(
        default="constant", description="phi or phi h/h_d where h < h_d"
    )
    shear_depth: Literal["smallest"] | None = Field(
        default=None, description="shear over the smallest depth of the cells around a point; else over its own"
    )
    march_step: Positive | None = Field(
        default=None, description="step of marching where Newton fails, 0.5 when left out [s]"
    )
    march_span: Positive | None = Field(
        default=None, description="flow time after which a marched member has failed, 2400 when left out [s]"
    )
    # A centimetre, or a centimetre a second, is what is measured: a member that far off is not solved.
    tolerance: Annotated[Number, Field(gt=0, le=0.01)] = Field(
        default=3e-6, description="largest remaining correction of a solved member [m, m/s], by depth in a film"
    )


class KeptFields(Part):
    """The stretch of which the fields of all members are kept."""

    x: Interval = Field(description="range along x, over the whole width of the grid [m]")


class Simulate(Part):
    """The ensemble: how many members are drawn from the priors, and what of them is kept."""

    members: Annotated[int, Field(strict=True, gt=0, le=MOST_MEMBERS)] = Field(
        default=4096, description="size of the ensemble"
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] = Field(
        default=1, description="seed of the Sobol' sequence"
    )
    fields: KeptFields | None = Field(default=None, description="where level, u and v of all members are kept")
    field_budget: Positive = Field(default=200.0, description="largest size before compression [MB]")


class Infer(Part):
    """How the posterior is found, and how measurements weigh in it."""

    method: Literal["refine", "surrogate", "glue"] = Field(
        default="refine", description="how the posterior is computed"
    )
    likelihood: Literal["gaussian", "nse", "inverse-variance"] = Field(
        default="gaussian", description="how residuals are weighted"
    )
    sigma: Literal["best-member", "known"] = Field(
        default="best-member", description="standard errors: stated with the data, or estimated from the best member"
    )
    behavioural: Number | None = Field(default=None, description="threshold of an informal likelihood [-]")


class ModelError(Part):
    """Errors of the model and of what is known of its site; 0 unless stated."""

    friction: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="relative error of friction [-]")
    bed: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="error of the surveyed bed [m]")
    stems: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="relative error of the stems of a patch [-]")
    edges: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="error of where patches end [m]")
    probes: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="error across of where probes stood [m]")
    discharge: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="relative error of discharges [-]")


class Validation(Part):
    """Measurements that no calibration sees: for judging a finished model only."""

    experiments: dict[str, Experiment] = Field(min_length=1, description="flows that no calibration uses")
    observations: tuple[Observation, ...] = Field(min_length=1, description="measurements in them")


class Reference(Part):
    """Values of others for the same site."""

    source: str = Field(default="", description="origin of these values")
    table: dict[str, Number | tuple[Number, Number]] = Field(default_factory=dict, description="[median, sd] or number")
    made_with: dict[str, Number] = Field(default_factory=dict, description="what a synthetic record was made from")


class CanopyCorrection(Part):
    """phi of a stand for another height of the canopy, with C kept at one depth."""

    stand: str = Field(description="stand whose phi is corrected")
    from_height: Positive = Field(description="canopy height the ensemble was made with [m]")
    to_height: Positive = Field(description="canopy height to correct for [m]")
    depth: Positive = Field(description="depth at which C is to stay the same [m]")


class PlannedTransect(Part):
    """Verticals along a line across the channel."""

    x: Number = Field(description="where it crosses the channel [m]")
    spacing: Positive = Field(description="distance between its verticals [m]")
    y: Interval | None = Field(default=None, description="from where to where; all of the water when left out [m]")
    experiments: tuple[str, ...] | None = Field(default=None, description="in which; in all when left out")


class PlannedPoint(Part):
    """A single vertical."""

    x: Number = Field(description="of a vertical, such as one among plants [m]")
    y: Number = Field(description="[m]")
    experiments: tuple[str, ...] | None = Field(default=None, description="in which; in all when left out")


class PlannedGauge(Part):
    """A water level."""

    x: Number = Field(description="[m]")
    y: Number | None = Field(default=None, description="in the middle of the channel when left out [m]")
    experiments: tuple[str, ...] | None = Field(default=None, description="in which; in all when left out")


class PlannedDischarge(Part):
    """A gauging of a cross-section."""

    x: Number = Field(description="of the cross-section that is gauged [m]")
    experiments: tuple[str, ...] | None = Field(default=None, description="in which; in all when left out")


class PlannedErrors(Part):
    """Standard errors of measurements that are planned; those of `measurements/kinds.py` when left out."""

    velocity: Positive | None = Field(default=None, description="of the mean of a vertical [m/s]")
    level: Positive | None = Field(default=None, description="of a gauge [m]")
    discharge: Positive | None = Field(default=None, description="of a gauging [m3/s]")
    survey: Positive = Field(default=0.01, description="of a surveyed bed level [m]")


class PlannedHours(Part):
    """Hours of field work. Chosen: of a party of two with a current meter and a level."""

    vertical: Positive = Field(default=0.3, description="a vertical [h]")
    transect: Positive = Field(default=0.5, description="a transect beside its verticals [h]")
    gauge: Positive = Field(default=0.5, description="a gauge, read in one flow [h]")
    gauging: Positive = Field(default=1.0, description="a discharge measured for itself [h]")
    survey_line: Positive = Field(default=1.0, description="a line of bed levels across the channel [h]")
    discharge: Positive = Field(default=4.0, description="each flow beside the first [h]")


class Planned(Part):
    """Measurements that are planned, for `vegglue plan`; `next` uses its errors and hours."""

    hours: Positive = Field(default=16.0, description="hours of field work for a proposal [h]")
    transects: tuple[PlannedTransect, ...] = Field(default=(), description="lines of verticals across the channel")
    points: tuple[PlannedPoint, ...] = Field(default=(), description="single verticals")
    gauges: tuple[PlannedGauge, ...] = Field(default=(), description="water levels")
    discharges: tuple[PlannedDischarge, ...] = Field(default=(), description="gaugings of a cross-section")
    errors: PlannedErrors = Field(default_factory=PlannedErrors, description="usual errors of the instruments")
    costs: PlannedHours = Field(default_factory=PlannedHours, description="hours of each piece of work")

    @property
    def pieces(self) -> tuple[PlannedTransect | PlannedPoint | PlannedGauge | PlannedDischarge, ...]:
        return (*self.transects, *self.points, *self.gauges, *self.discharges)


class Case(Part):
    """Everything one run depends on. Results go to runs/<name>/."""

    source: Path = Field(exclude=True, description="file the case was read from")
    name: str = Field(pattern=r"^[a-z0-9_-]+$", description="lower-case letters a to z, digits, _ and -")
    title: str = Field(default="", description="title of the report")
    grid: GridExtent = Field(description="regular grid of the model")
    bed: tuple[BedLayer, ...] = Field(
        min_length=1, description="layers; a later one replaces earlier ones where it has data"
    )
    friction: Friction = Field(description="resistance laws and where they hold")
    plants: Plants = Field(default_factory=Plants, description="stands and patches")
    inflows: dict[str, Inflow] = Field(min_length=1, description="where water enters")
    outlet: Outlet = Field(default_factory=Outlet, description="where it leaves: the east side")
    experiments: dict[str, Experiment] = Field(min_length=1, description="flows that share parameters")
    eddy_viscosity: Value = Field(default=0.01, description="[m2/s]")
    effects: dict[str, EffectEntry] = Field(default_factory=dict, description="physical effects at work, see `effects`")
    exclude: dict[str, Annotated[str, Field(min_length=1)]] | None = Field(
        default=None, description="effects that cannot act at this site, each with the reason"
    )
    effect_file: Path | None = Field(default=None, description="Python file with effects of your own, needs --trust")
    engine: CommandEngine | None = Field(default=None, description="a command instead of the solver, needs --trust")
    finished_result: FinishedResult | None = Field(default=None, description="a finished run of another model")
    parameters: dict[str, Parameter] = Field(default_factory=dict, description="unknowns and their priors")
    observations: tuple[Observation, ...] = Field(default=(), description="measurements")
    planned: Planned | None = Field(default=None, description="measurements that `plan` evaluates and extends")
    frame: Frame | None = Field(default=None, description="where the grid lies on the map")
    imported: tuple[ImportedFile, ...] | None = Field(default=None, description="files that `import` made it from")
    survey: Survey | None = Field(default=None, description="plant survey")
    numerics: Numerics = Field(default_factory=Numerics, description="choices of the solver")
    simulate: Simulate = Field(default_factory=Simulate, description="size and seed of the ensemble")
    infer: Infer = Field(default_factory=Infer, description="likelihood")
    model_error: ModelError = Field(default_factory=ModelError, description="errors of the model and its site")
    validation: Validation | None = Field(default=None, description="flows and measurements that no calibration uses")
    reference: Reference | None = Field(default=None, description="published values, shown in the report")
    canopy_correction: CanopyCorrection | None = Field(default=None, description="phi for another canopy height")

    @model_validator(mode="before")
    @classmethod
    def _surrogate_of_a_command(cls, given: object) -> object:
        """With an `engine`, `infer.method` is `surrogate` unless it is given: a run may take minutes."""
        if not isinstance(given, dict) or given.get("engine") is None:
            return given
        infer = given.get("infer") or {}
        return given | {"infer": {"method": "surrogate"} | infer} if isinstance(infer, dict) else given

    @property
    def of_another_model(self) -> bool:
        """Whether predictions are those of a command or of a finished result, not of the built-in engine."""
        return self.engine is not None or self.finished_result is not None

    def __repr__(self) -> str:
        (west, east), (south, north), (dx, dy) = self.grid.x, self.grid.y, self.grid.cell
        measured = dict.fromkeys(f"{one.kind} in {one.file.name}" for one in self.observations)
        unknowns = [f"{name} [{one.unit}]" for name, one in self.parameters.items()]
        patches = so_many(len(self.plants.patches), "patch", "patches")
        return in_short(
            f"Case {self.name}: {self.title}".removesuffix(": "),
            [
                f"grid of {east - west:g} m by {north - south:g} m, cells of {dx:g} m by {dy:g} m; {patches} of plants",
                f"experiments: {', '.join(self.experiments)}",
                f"unknown: {', '.join(unknowns) or 'nothing'}; effects: {', '.join(self.effects) or 'none'}",
                f"measured: {', '.join(measured) or 'nothing'}",
                f"{so_many(self.simulate.members, 'member')}, seed {self.simulate.seed}; read from {self.source.name}",
            ],
        )

    def __str__(self) -> str:
        return repr(self)


def share_below(prior: Parameter, value: float) -> float:
    """F(value) = P(X < value) [-]; the value in the unit of the prior. `prior.probability` is the same for arrays."""
    low = -math.inf if prior.low is None else prior.low
    high = math.inf if prior.high is None else prior.high
    if value <= low or value >= high:
        return float(value >= high)
    if prior.distribution == "uniform":
        return (value - low) / (high - low)
    if prior.distribution == "loguniform":
        return math.log(value / low) / math.log(high / low)
    if prior.median is not None and prior.log_sd is not None:
        return _mass(-math.inf, math.log(value / prior.median) / prior.log_sd) if value > 0.0 else 0.0
    assert prior.mean is not None
    assert prior.sd is not None
    a, x, b = ((end - prior.mean) / prior.sd for end in (low, value, high))
    whole = _mass(a, b)
    return _mass(a, x) / whole if whole > 0.0 else 0.0


def _mass(low: float, high: float) -> float:
    """Phi(high) - Phi(low), from the tail in which both keep their digits."""
    if low > 0.0:
        low, high = -high, -low
    return 0.5 * (math.erfc(-high / math.sqrt(2.0)) - math.erfc(-low / math.sqrt(2.0)))
