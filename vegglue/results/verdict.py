"""The verdict of a diagnosis as a value; its words stand in wording/templates/verdict.j2, a macro for each class."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from dataclasses import field as by_default
from typing import Any, Literal, get_args

from scipy.special import chdtr

from vegglue.decision_constants import constants
from vegglue.effects.identity import EffectIdentity
from vegglue.measurements.plausibility import ImplausibleOutlet, ImplausibleValues
from vegglue.measurements.section_discharge import DischargeMismatch
from vegglue.results.causes import CandidateLaws, FaultyInstrument, FieldFound, LocalAnomaly, ModelErrorUsed, Rival
from vegglue.wording.sentences import sentence, sentences

# instrument: some readings are off. Whether more is missing states `Verdict.clears_the_model`.
VerdictKind = Literal["nothing-missing", "identified", "one-of", "none-of-these", "instrument", "cannot-tell"]
# Chance of a chi2 as small under errors alone [-], below which it is noted. Chosen: as rare as what is called missing.
TOO_SMALL = 0.001


@dataclass(frozen=True)
class ChiSquare:
    """chi2 = |W (y - f)|^2 of a model, with W'W the inverse covariance of the errors of y - f.

    Attributes
    ----------
    value : float
        chi2 [-].
    freedom : int
        Its degrees of freedom.
    p : float
        Chance of a chi2 as large under errors alone [-], NaN where it was not asked for.
    """

    value: float
    freedom: int
    p: float = float("nan")


@dataclass(frozen=True)
class EstimatedErrors:
    """The errors as estimated from the residuals.

    Attributes
    ----------
    correlation : float
        Of neighbours [-].
    scale : float
        True over stated errors [-].
    grid_error : float
        Root mean square error of the grid in velocities [m/s], NaN without any.
    flagged : tuple of int
        Rows of the stations rejected as outliers.
    """

    correlation: float
    scale: float
    grid_error: float
    flagged: tuple[int, ...]

    @property
    def clearly_larger(self) -> bool:
        """Whether they are larger than stated by more than the error of stating them."""
        return self.scale > constants().largest_scale


# Reasons: why no more is known. The first three are about the measurements: DischargeMismatch, ImplausibleOutlet and
# ImplausibleValues of `measurements`.


@dataclass(frozen=True)
class MisfitBeyondErrors:
    """The model misses by `ratio` times the errors, root mean square [-], with all that was found."""

    ratio: float


@dataclass(frozen=True)
class ParameterFarFromPrior:
    """A parameter replaces a cause: it lies so many standard deviations from the middle of its prior; without: the
    section without which it does not lie too far, and how far then.
    """

    parameter: str
    deviations: float
    without: tuple[str, float] | None = None


@dataclass(frozen=True)
class AmplitudeAtBound:
    """Effects, by name, whose amplitudes lie at an end of their support."""

    effects: tuple[str, ...]


@dataclass(frozen=True)
class AmplitudeBeyondPlausible:
    """An effect, or something at a place, of so many times a plausible size [-]: something else is missing."""

    effect: str
    times: float


@dataclass(frozen=True)
class NameHangsOnSection:
    """Without the readings of one section in one experiment another effect leads the accepted one."""

    effect: str
    section: str
    instead: str


@dataclass(frozen=True)
class OneSection:
    """All measurements are of one section in one experiment: how the water arrives there explains them as well."""

    section: str


@dataclass(frozen=True)
class NeighboursExcluded:
    """Readings side by side are excluded, which one bad probe does not explain."""


@dataclass(frozen=True)
class TooManyGroups:
    """More groups of effects than a set may have, with the probability of each effect among those calibrated [-]."""

    effects: tuple[Rival, ...]


@dataclass(frozen=True)
class NoneLeads:
    """Hypotheses compete and none of them leads clearly: they stand in `Verdict.undecided`."""


@dataclass(frozen=True)
class MisfitUnexplained:
    """The misfit is larger than the errors allow, and no effect and no place is significant."""


@dataclass(frozen=True)
class ErrorsLargerThanStated:
    """Only errors `scale` times the stated ones explain the misfit [-]."""

    scale: float


@dataclass(frozen=True)
class CorrelatedErrors:
    """Only errors of neighbours with this correlation explain the misfit [-]."""

    correlation: float


@dataclass(frozen=True)
class ModelErrorExceeded:
    """The model needs `ratio` times its allowed error [-]; allowed: relative error of friction [-]."""

    ratio: float
    allowed: float


@dataclass(frozen=True)
class NoFlowHeldOut:
    """The model finds no steady flow in the held-out experiments."""


@dataclass(frozen=True)
class HeldOutMissed:
    """The held-out measurements are missed by `ratio` times the expected errors [-]."""

    ratio: float


@dataclass(frozen=True)
class UncertainBetweenSections:
    """Halfway between the sections the model may miss by `ratio` times the errors of the data [-]."""

    ratio: float


@dataclass(frozen=True)
class FewTestable:
    """So few of the effects would be seen at twice a plausible size; counts in `Verdict.tested`."""


@dataclass(frozen=True)
class CommandDiffers:
    """The command of `engine` differs from its linear model by `errors` standard errors, root mean square [-]."""

    errors: float


@dataclass(frozen=True)
class CommandNotSettled:
    """The search for the best parameters of the command did not settle: differences in these are mostly noise."""

    parameters: tuple[str, ...]


OfTheData = DischargeMismatch | ImplausibleOutlet | ImplausibleValues
Reason = (
    OfTheData | MisfitBeyondErrors | ParameterFarFromPrior | AmplitudeAtBound | AmplitudeBeyondPlausible |
    NameHangsOnSection | OneSection | NeighboursExcluded | TooManyGroups | NoneLeads | MisfitUnexplained |
    ErrorsLargerThanStated | CorrelatedErrors | ModelErrorExceeded | NoFlowHeldOut | HeldOutMissed |
    UncertainBetweenSections | FewTestable | CommandDiffers | CommandNotSettled
)  # fmt: skip


@dataclass(frozen=True)
class EffectFound:
    """An accepted effect, and what it may be instead.

    Attributes
    ----------
    name, title : str
        Its name, with the place or instrument that it is limited to, and its title.
    amplitude : float
        [unit]
    interval95 : (float, float)
        Of the amplitude [unit].
    probability : float
        Of it and of those alike together, among all that was tried [-].
    alike : tuple of str
        Effects that leave the same trace in these data.
    rivals : tuple of Rival
        Others with their probabilities, the likeliest first.
    likelier : LocalAnomaly or None
        A place that is likelier than every group of effects.
    likelier_probability : float
        Of that place [-], NaN without one.
    """

    name: str
    title: str
    amplitude: float
    interval95: tuple[float, float]
    unit: str
    probability: float
    alike: tuple[str, ...] = ()
    rivals: tuple[Rival, ...] = ()
    likelier: LocalAnomaly | None = None
    likelier_probability: float = float("nan")

    @property
    def effect(self) -> str:
        """Name in the library, without the place or instrument that it is limited to."""
        return EffectIdentity.parse(self.name).name


@dataclass(frozen=True)
class EffectsTested:
    """How many effects were tested.

    Attributes
    ----------
    effects : int
        How many.
    candidates : int
        As how many: one effect in one experiment, section, device or patch each.
    testable : int
        Effects that would be seen at twice a plausible size.
    """

    effects: int
    candidates: int
    testable: int


# What the model still lacks with all that was accepted.


@dataclass(frozen=True)
class ErrorsStillLarger:
    """Even so the errors are `scale` times the stated ones [-]."""

    scale: float


@dataclass(frozen=True)
class EffectsStillSignificant:
    """Effects that are significant and were not accepted.

    Attributes
    ----------
    effects : tuple of (str, float)
        Names with the family-wise p of each [-], the clearest first.
    remainder : bool
        Whether they may be a remainder of what was accepted.
    """

    effects: tuple[tuple[str, float], ...]
    remainder: bool


Remaining = ErrorsStillLarger | EffectsStillSignificant

# Notes: what else should be known beside the verdict. DischargeMismatch and ModelErrorUsed are notes as well.


@dataclass(frozen=True)
class MisfitTooSmall:
    """chi2 is far smaller than its degrees of freedom: errors are too large, or readings are no separate ones."""

    chi2: float
    freedom: int

    @property
    def ratio(self) -> float:
        """chi2 over its degrees of freedom [-]."""
        return self.chi2 / self.freedom

    @property
    def errors(self) -> float:
        """Errors that would fit over those used [-]."""
        return math.sqrt(self.ratio)


@dataclass(frozen=True)
class ImplausibleAmplitude:
    """An accepted effect is `times` what is plausible [-]."""

    effect: str
    times: float


@dataclass(frozen=True)
class EstimateAtBound:
    """A calibrated parameter within PRESSES of an end of its prior: the bound decides its value.

    Attributes
    ----------
    value : float
        As calibrated [unit].
    low, high : float
        The ends of its prior [unit].
    lower : bool
        Whether it is the lower one.
    """

    parameter: str
    value: float
    unit: str
    low: float
    high: float
    lower: bool


@dataclass(frozen=True)
class BeyondHandbook:
    """A calibrated parameter beyond what a handbook has.

    Attributes
    ----------
    value : float
        As calibrated [unit].
    low, high : float
        The range of the handbook [unit].
    source : str
        Which handbook, and for what.
    """

    parameter: str
    value: float
    unit: str
    low: float
    high: float
    source: str


@dataclass(frozen=True)
class InflowDevelops:
    """An accepted fault of the probes of a section near the inflow, where the profile over the depth may develop.

    Attributes
    ----------
    effect : str
        The fault.
    distance, depths : float
        Of the section behind the inflow [m], and over the depth [-].
    length : float
        Over which the profile develops [depths].
    """

    effect: str
    distance: float
    depths: float
    length: float


@dataclass(frozen=True)
class CellsTooCoarse:
    """Error of the cells in velocities, larger than that of the readings, both as root mean squares [m/s]."""

    grid_error: float
    data_error: float


@dataclass(frozen=True)
class ShearLayer:
    """More mixing at x, y [m] where the water is shallow on one side and deep on the other [m]."""

    x: float
    y: float
    shallow: float
    deep: float


@dataclass(frozen=True)
class EstimateOffPrior:
    """A calibrated parameter some standard deviations from the middle of its prior, at `value` [unit]."""

    parameter: str
    value: float
    unit: str
    deviations: float


@dataclass(frozen=True)
class EffectsNotExcluded:
    """Effects, the likeliest first, among which one that is there undetected is; beside: besides what was accepted."""

    effects: tuple[str, ...]
    beside: bool


@dataclass(frozen=True)
class EffectsExcluded:
    """Effects that cannot act at the site, by name with the reason of each; they were not tested."""

    effects: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class LawStandsOut:
    """Laws that are significant; instead_of: the accepted effects."""

    laws: CandidateLaws
    instead_of: tuple[str, ...]


@dataclass(frozen=True)
class NeighboursCorrelated:
    """Correlation of the errors of neighbours, which is allowed for [-]."""

    correlation: float


@dataclass(frozen=True)
class StatedErrorsTooSmall:
    """The stated errors are too small by a factor, which is allowed for [-]."""

    scale: float


@dataclass(frozen=True)
class InstrumentExcluded:
    """An instrument whose readings are excluded.

    Attributes
    ----------
    instrument : FaultyInstrument
        Which, and by how much it is off.
    clear : bool
        Whether by more than `least`.
    least : float
        What chance or the model may make [standard errors].
    """

    instrument: FaultyInstrument
    clear: bool
    least: float


@dataclass(frozen=True)
class EffectsUntestable:
    """Effects that these data cannot show.

    Attributes
    ----------
    groups : tuple of (str, tuple of str)
        Their names by the parameter whose change leaves their trace, '' for none.
    effects, candidates : int
        How many there are.
    also : bool
        Whether others that are named elsewhere are untestable, too.
    """

    groups: tuple[tuple[str, tuple[str, ...]], ...]
    effects: int
    candidates: int
    also: bool


@dataclass(frozen=True)
class PlacesOnMap:
    """x, y in the model and east, north on the map [m] of what is named at places."""

    places: tuple[tuple[float, float, float, float], ...]


@dataclass(frozen=True)
class BedCorrected:
    """A spot in which flow and survey put the bed elsewhere than the survey alone.

    Attributes
    ----------
    x, y, x_error, y_error : float
        Middle with its standard errors [m].
    length, width : float
        Half length and half width [m].
    change : float
        Mean rise of the bed [m].
    interval95 : (float, float)
        Of the change [m].
    log_factor : float
        ln of the Bayes factor against no mean error there [-].
    local_log_factor : float
        ln of that of a local error beside all that the survey leaves open [-].
    between : (float, float)
        x of the surveyed lines on both sides [m], NaN beyond the last.
    """

    x: float
    y: float
    x_error: float
    y_error: float
    length: float
    width: float
    change: float
    interval95: tuple[float, float]
    log_factor: float
    local_log_factor: float
    between: tuple[float, float]


@dataclass(frozen=True)
class MeasuredStretch:
    """Velocities lie in a stretch of the model only.

    Attributes
    ----------
    low, high : float
        Least and largest x of them [m].
    length : float
        Of the model [m].
    effects : tuple of str
        Of the case, those that act along the channel.
    """

    low: float
    high: float
    length: float
    effects: tuple[str, ...]


@dataclass(frozen=True)
class TooShallow:
    """No place and no law was searched for: the water is nowhere deeper than `depth` [m]."""

    depth: float


@dataclass(frozen=True)
class MisfitRemains:
    """The misfit with all that was accepted is still larger than the errors allow."""

    misfit: ChiSquare


@dataclass(frozen=True)
class CommandCompared:
    """How the linear model of a command of `engine` was made, and how far it is from the command.

    Attributes
    ----------
    repeated : int
        How often its differences were taken.
    parameters : int
        How many there are.
    errors : float
        Root mean square difference at the last parameters [standard errors], NaN when unknown.
    failure : str
        Why the command gave nothing, '' when it did.
    rough : tuple of str
        Parameters whose differences are mostly noise.
    settled : bool
        Whether the search for the best place settled.
    careful : bool
        Whether sizes and chances have to be taken with care.
    """

    repeated: int
    parameters: int
    errors: float
    failure: str
    rough: tuple[str, ...]
    settled: bool
    careful: bool


@dataclass(frozen=True)
class ResultCompared:
    """The flow of a finished run of another model beside that of the built-in engine, over wet cells.

    Attributes
    ----------
    code : str
        The program.
    velocity_share, level_share : float
        Root mean square difference of the velocity vector over its mean size, and of the level over the mean depth
        [-].
    area_share : float
        Cells that are wet in one flow only, over those wet in theirs [-].
    velocity, level : float
        The root mean square differences [m/s, m].
    beyond_mesh : float
        Cells wet in ours where they have no mesh, over those wet in theirs [-].
    discharge_spread : float
        Standard deviation of their discharge along the channel over its mean [-].
    measured : float
        Root mean square difference of theirs, as it is, from the measured velocities [m/s], NaN without any.
    alike : bool
        Whether all shares are within their limits, so that a diagnosis may use slopes of the built-in engine.
    limits : (float, float, float)
        Of the three shares [-].
    """

    code: str
    velocity_share: float
    level_share: float
    area_share: float
    velocity: float
    level: float
    beyond_mesh: float
    discharge_spread: float
    measured: float
    alike: bool
    limits: tuple[float, float, float]


Note = (
    DischargeMismatch | MisfitTooSmall | ImplausibleAmplitude | EstimateAtBound | BeyondHandbook | InflowDevelops |
    CellsTooCoarse | ShearLayer | EstimateOffPrior | EffectsNotExcluded | EffectsExcluded | ModelErrorUsed |
    LawStandsOut | NeighboursCorrelated | StatedErrorsTooSmall | InstrumentExcluded | EffectsUntestable | BedCorrected |
    PlacesOnMap | MeasuredStretch | TooShallow | MisfitRemains | CommandCompared | ResultCompared
)  # fmt: skip


Conclusion = Literal[
    "measurements_to_correct", "law_beside_instrument", "law_in_doubt", "law", "law_rather_than_effects",
    "law_or_effects", "law_possible", "field", "several_possible", "too_many_possible", "named", "best_explanation",
    "instrument", "nothing_missing", "misfit_unexplained", "few_testable", "silence_in_doubt",
]  # fmt: skip


@dataclass(frozen=True)
class Verdict:
    """The verdict: its kind, what was found, and why no more is known.

    Attributes
    ----------
    kind
        One of the six kinds.
    misfit
        chi2 of the last model, with all effects and places in it.
    effects, places
        All that was accepted into the model, in the order it was found. Whether the kind names them as missing depends
        on `reasons`: with a reason they only explain most of the misfit.
    undecided
        The likeliest hypotheses if none of them leads clearly.
    instruments
        Faulty instruments that the verdict names; others stand in `notes`.
    field, laws
        A smooth field, or laws, that the verdict names.
    bed
        Where the bed differs from the surveyed one, of a verdict without doubt that names no other place.
    reasons
        Why no more is known; empty for a verdict without doubt.
    tested
        Counts of the tested effects.
    clears_the_model
        Whether nothing is missing in the model, whether or not an instrument is off.
    may_explain
        Sections that carry another discharge than stated, for which what was found may be the reason.
    remaining
        What the model with all that was accepted still lacks.
    notes
        What else should be known, the most important first.
    not_excluded
        Groups of effects among which one that is there undetected, besides what was accepted, is nine times of ten.
    significant_effects
        Effects that are significant in the last model and were not accepted, with the family-wise p of each [-].
    distrust
        Why the numbers of a command of `engine` cannot be believed; None for any other model.
    """

    kind: VerdictKind
    misfit: ChiSquare
    effects: tuple[EffectFound, ...] = ()
    places: tuple[LocalAnomaly, ...] = ()
    undecided: tuple[Rival, ...] = ()
    instruments: tuple[FaultyInstrument, ...] = ()
    field: FieldFound | None = None
    laws: CandidateLaws | None = None
    bed: BedCorrected | None = None
    reasons: tuple[Reason, ...] = ()
    tested: EffectsTested = EffectsTested(0, 0, 0)
    clears_the_model: bool = False
    may_explain: tuple[DischargeMismatch, ...] = ()
    remaining: tuple[Remaining, ...] = ()
    notes: tuple[Note, ...] = ()
    not_excluded: tuple[tuple[str, ...], ...] = ()
    significant_effects: Mapping[str, float] = by_default(default_factory=dict)
    distrust: Reason | None = None

    @property
    def doubts_the_data(self) -> bool:
        """Whether the measurements have to be corrected before anything is known of the model."""
        return any(isinstance(one, get_args(OfTheData)) for one in self.reasons)

    @property
    def carries_other_discharges(self) -> bool:
        """Whether what is wrong with the measurements is the discharge that sections carry."""
        return bool(self.reasons) and isinstance(self.reasons[0], DischargeMismatch)

    @property
    def conclusion(self) -> Conclusion:
        """What the first sentence states; each conclusion has a template of its own."""
        reason = self.reasons[0] if self.reasons else None
        if self.doubts_the_data:
            return "measurements_to_correct"
        if self.laws is not None:
            if self.effects:
                return "law_rather_than_effects" if self.kind == "none-of-these" else "law_or_effects"
            if self.kind == "instrument":
                return "law_beside_instrument"
            if reason is not None:
                return "law_in_doubt"
            return "law" if self.kind == "none-of-these" else "law_possible"
        if self.field is not None:
            return "field"
        if self.undecided:
            return "several_possible"
        if isinstance(reason, TooManyGroups):
            return "too_many_possible"
        if self.kind in ("identified", "one-of", "none-of-these"):
            return "named"
        if self.places or self.effects:
            return "best_explanation"
        if self.instruments:
            return "instrument"
        if self.kind == "nothing-missing":
            return "nothing_missing"
        if isinstance(reason, MisfitUnexplained):
            return "misfit_unexplained"
        return "few_testable" if isinstance(reason, FewTestable) else "silence_in_doubt"

    @property
    def tells_laws(self) -> bool:
        """Whether the verdict names laws."""
        return self.laws is not None

    @property
    def anomaly(self) -> LocalAnomaly | None:
        """The first place that was accepted."""
        return self.places[0] if self.places else None

    @property
    def where(self) -> dict[str, Any] | None:
        """The place that the verdict names: something unlisted, a surveyed line, or where the bed differs."""
        if self.anomaly is not None:
            return asdict(self.anomaly)
        for line in (one for one in self.instruments if one.kind == "line"):
            of_line = {"x": line.x, "y": line.y, "amplitude": line.offset}
            return {"term": "line", **of_line, "interval95": line.interval95, "unit": line.unit}
        if self.bed is None:
            return None
        return {"term": "bed", "amplitude": self.bed.change, "unit": "m", **asdict(self.bed)}

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        return sentence(self)

    @property
    def remarks(self) -> tuple[str, ...]:
        """The notes in words."""
        return sentences(self.notes)

    @property
    def left_over(self) -> str:
        """What the model still lacks, in words; '' for nothing."""
        return " ".join(sentences(self.remaining))


def is_too_small(chi2: float, freedom: int) -> bool:
    """Whether P(chi2_f <= chi2) of a misfit with f degrees of freedom is below TOO_SMALL; False without any."""
    return freedom > 0 and bool(chdtr(freedom, chi2) < TOO_SMALL)
