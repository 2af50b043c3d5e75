"""What a diagnosis says, as values: the verdict, the effects that explain the misfit, where it lies, and all numbers.

How they lie in diagnosis.h5 is said in diagnosis_file.py, the object of `diagnose --json` in diagnosis_json.py.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pandas as pd

from vegglue.arrays import Array

# instrument: nothing is missing but that some readings are off.
VerdictKind = Literal["nothing-missing", "identified", "one-of", "none-of-these", "instrument", "cannot-tell"]


@dataclass(frozen=True)
class AmplitudeEstimate:
    """How large an effect is, in the unit of its amplitude.

    value, interval95: from its own refit when there was one (refitted), else to first order. off, scale: where the
    amplitude does nothing, and how far from there is plausible; support: within which it must lie. objective: the least
    sum of squares with the effect, |W (y - f)|^2 + |z|^2 [-], predicted where it was not refitted.
    """

    value: float
    interval95: tuple[float, float]
    unit: str
    off: float
    scale: float
    refitted: bool
    objective: float
    support: tuple[float, float] = (-np.inf, np.inf)

    @property
    def relative_size(self) -> float:
        """|value - off| / scale [-]."""
        return abs(self.value - self.off) / self.scale


@dataclass(frozen=True)
class ScoreTest:
    """Score T of an effect [standard errors], and the chance that errors alone make any effect score as high [-].

    p_family: counted among bootstrap draws, never below one over their number; see `score_test.family_p`.
    """

    score: float
    p_family: float


@dataclass(frozen=True)
class Detectability:
    """Whether these data could show an effect.

    visibility: share of its fingerprint that calibration cannot mimic [-]. smallest: distance of the amplitude from off
    that is detected 19 times of 20; testable: that is less than twice a plausible one. confounder: the parameter whose
    slope is most like the fingerprint; cosine: between both [-].
    """

    visibility: float
    smallest: float
    testable: bool
    confounder: str
    cosine: float


@dataclass(frozen=True)
class Suspect:
    """One effect as the data see it, in the last model in which it was tested; shapes: at which it scores best."""

    name: str
    title: str
    shapes: dict[str, float]
    amplitude: AmplitudeEstimate
    test: ScoreTest
    detectability: Detectability


@dataclass(frozen=True)
class Step:
    """One round of the search: what was accepted, what it may be instead, chi2 before and after.

    rivals: the effects that together hold 95 % of the chances, the accepted one among them; chances: of each, were it
    one of all that were tried, of every kind; others: of the best of each other kind, by its name, where it is not
    negligible. p_family: chance that errors alone sound the alarm as loudly [-], counted, see `evidence.alarm_p`.
    """

    accepted: str
    rivals: tuple[str, ...]
    chances: tuple[float, ...]
    groups: tuple[tuple[str, ...], ...]
    chi2_before: float
    chi2_after: float
    p_family: float
    others: dict[str, float] = field(default_factory=dict)

    @property
    def chance(self) -> dict[str, float]:
        """Of each rival by its name."""
        return dict(zip(self.rivals, self.chances, strict=True))


@dataclass(frozen=True)
class Location:
    """Where [m] something unlisted changes a term of the equations: middle x, y, half length, half width of the spot,
    and standard errors of x and y over all spots that could be it.

    effect: that stands for it in the library; amplitude [unit] with its 95 % interval; score of its fingerprint
    [standard errors]; experiments that point at it. odds: how much likelier it is than the best hypothesis of each
    other kind, by its name.
    """

    x: float
    y: float
    length: float
    width: float
    term: str
    effect: str
    amplitude: float
    interval95: tuple[float, float]
    unit: str
    score: float
    experiments: tuple[str, ...]
    odds: dict[str, float]
    x_error: float = 0.0
    y_error: float = 0.0

    @property
    def shapes(self) -> dict[str, float]:
        """The shapes of the effect there."""
        return {"x": self.x, "y": self.y, "length": self.length, "width": self.width}


@dataclass(frozen=True)
class FaultyInstrument:
    """An instrument found to be off, whose readings were set aside: a reading, a position, a probe or a gauge.

    x, y: where it stood [m], NaN where it stood at several; stations: rows of its readings; offset: what it shows too
    much, with the 95 % interval [unit of its kind]; log_factor: ln of the Bayes factor against none [-].
    """

    kind: str
    x: float
    y: float
    stations: tuple[int, ...]
    offset: float
    interval95: tuple[float, float]
    unit: str
    log_factor: float


@dataclass(frozen=True)
class FieldFound:
    """A smooth field of a term that would close the misfit: its standard deviation [unit of the term], half length and
    half width of its bumps [m], ln of its Bayes factor against none [-], and where it stands out most: value there, its
    standard error, x and y [m].
    """

    term: str
    size: float
    length: float
    width: float
    log_factor: float
    value: float
    error: float
    x: float
    y: float


@dataclass(frozen=True)
class ModelErrorUsed:
    """The model's own error: relative error of friction [-] and error of the bed [m] as allowed, and the share of both
    that the last residual asks for most [-], with the ln of its likelihood ratio against what is allowed.
    """

    friction: float
    bed: float
    needed: float
    log_ratio: float


@dataclass(frozen=True)
class Verdict:
    """What was concluded. location: of drag that no listed effect explains, None without; not_excluded: where nothing
    was detected, groups of effects among which one that is there undetected is, nine times of ten.
    """

    kind: VerdictKind
    sentence: str
    remarks: tuple[str, ...]
    location: Location | None
    not_excluded: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Misfit:
    """chi2 = |W (y - f)|^2 of the first and of the last model [-]; freedom: degrees of the last; p: chance of a chi2 as
    large under errors alone; zones: mean misfit of the first by experiment, section and zone.
    """

    chi2_first: float
    chi2: float
    freedom: int
    p: float
    zones: pd.DataFrame


@dataclass(frozen=True)
class EstimatedErrors:
    """What the errors were taken to be: correlation of neighbours [-], true over stated errors [-], root mean square
    error of the grid, and rows of the stations rejected as outliers.
    """

    correlation: float
    scale: float
    grid_error: float
    flagged: tuple[int, ...]


@dataclass(frozen=True)
class FirstScreening:
    """Score tests of the first model. threshold: score that errors alone reach at the false-alarm rate of effects;
    scores: by name [standard errors]; cosine (c, c): between the fingerprints of the strongest effects `compared` (c,).
    """

    threshold: float
    scores: dict[str, float]
    compared: tuple[str, ...]
    cosine: Array


@dataclass(frozen=True)
class ParameterEstimates:
    """Calibrated parameters by name: of the first model, and of the last one with their 95 % intervals."""

    first: dict[str, float]
    last: dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class Predictions:
    """The table of stations, what the first and the last model predict there, and the standard errors of what was
    measured, NaN where it was not used; (station,) each [m/s or m].
    """

    station: pd.DataFrame
    first: Array
    last: Array
    error: Array

    @property
    def table(self) -> pd.DataFrame:
        """Stations with columns prediction_first, prediction and error."""
        return self.station.assign(prediction_first=self.first, prediction=self.last, error=self.error)


@dataclass(frozen=True)
class PlaceMap:
    """Scores [standard errors] of a spot of one term at x, y [m], (spot,) each: of the model in which a location was
    found, else of drag in the first.
    """

    term: str
    x: Array
    y: Array
    score: Array


@dataclass(frozen=True)
class Diagnosis:
    """Everything a diagnosis found in the case `name`, by which version."""

    name: str
    version: str
    verdict: Verdict
    suspects: tuple[Suspect, ...]
    steps: tuple[Step, ...]
    misfit: Misfit
    errors: EstimatedErrors
    first_screening: FirstScreening
    parameters: ParameterEstimates
    predictions: Predictions
    place_map: PlaceMap
    places: tuple[Location, ...] = ()
    instruments: tuple[FaultyInstrument, ...] = ()
    field: FieldFound | None = None
    model_error: ModelErrorUsed | None = None

    @property
    def set(self) -> list[str]:
        """Names of all effects that may be missing, those of the first step first."""
        return list(self.chances)

    @property
    def chances(self) -> dict[str, float]:
        """Chance of each effect of the set, in the step that accepted it or the first that names it."""
        own = {step.accepted: step.chance[step.accepted] for step in self.steps}
        first = {name: chance for step in reversed(self.steps) for name, chance in step.chance.items()}
        of_each = first | own
        return {name: of_each[name] for step in self.steps for name in step.rivals}

    @property
    def groups(self) -> list[list[str]]:
        """Of effects that the data cannot tell apart, over all steps."""
        return [list(group) for step in self.steps for group in step.groups]

    def suspect(self, name: str) -> Suspect:
        """The effect of that name; KeyError without."""
        return {one.name: one for one in self.suspects}[name]
