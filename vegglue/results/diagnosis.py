"""What a diagnosis says, as values: the verdict, the effects that explain the misfit, where it lies, and all numbers.

What is no effect of the library stands in causes.py, one effect of it in candidate_effect.py.
How they lie in diagnosis.h5 is said in diagnosis_file.py, the object of `diagnose --json` in diagnosis_json.py.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.decision_constants import constants
from vegglue.measurements.kinds import stations_in_short
from vegglue.results.candidate_effect import CandidateEffect, counted_in_words
from vegglue.results.causes import (
    CandidateLaws,
    FaultyInstrument,
    FieldFound,
    FieldMapKept,
    LocalAnomaly,
    ModelErrorUsed,
    PlaceMap,
)
from vegglue.wording.numbers import in_short, interval_in_short, so_many

# instrument: some readings are off. Whether more is missing says `Verdict.clears_the_model`.
VerdictKind = Literal["nothing-missing", "identified", "one-of", "none-of-these", "instrument", "cannot-tell"]


@dataclass(frozen=True)
class Step:
    """One round of the search: what was accepted, what it may be instead, chi2 before and after.

    rivals: the effects that together hold 95 % of the chances, the accepted one among them; chances: of each, were it
    one of all that were tried, of every kind; others: of the best of each other kind, by its name, where it is not
    negligible; places: those of them that are something at a place. p_family: chance that errors alone sound the alarm
    as loudly [-], counted, see `evidence.alarm_p`.
    """

    accepted: str
    rivals: tuple[str, ...]
    chances: tuple[float, ...]
    groups: tuple[tuple[str, ...], ...]
    chi2_before: float
    chi2_after: float
    p_family: float
    others: dict[str, float] = field(default_factory=dict)
    places: dict[str, LocalAnomaly] = field(default_factory=dict)

    @property
    def chance(self) -> dict[str, float]:
        """Of each rival by its name."""
        return dict(zip(self.rivals, self.chances, strict=True))

    @property
    def likelier_place(self) -> str:
        """The place that is likelier than every group of effects that the data cannot tell apart; '' without."""
        best = max(self.places, key=self.others.__getitem__, default="")
        groups = [sum(self.chance[name] for name in group) for group in self.groups]
        return best if best and self.others[best] > max(groups) else ""


# How a sentence begins that tells of measurements which no flow of the case can show, or of sections that carry another
# discharge than stated.
BEFORE_ALL_ELSE = "Before anything can be said of the model: "


@dataclass(frozen=True)
class Verdict:
    """What was concluded. anomaly: of something that no listed effect explains, None without; not_excluded: groups
    of effects among which one that is there undetected, besides what was accepted, is nine times of ten.
    clears_the_model: whether nothing is missing in the model, an instrument or none being off; tells_laws: whether the
    sentence tells of laws that stand out. left_over: its part that says what the model with all that was accepted still
    asks for, '' for nothing; significant_effects: effects that stand out in it, and were not accepted, with the
    family-wise p of each [-].
    """

    kind: VerdictKind
    sentence: str
    remarks: tuple[str, ...]
    anomaly: LocalAnomaly | None
    not_excluded: tuple[tuple[str, ...], ...]
    clears_the_model: bool
    tells_laws: bool
    left_over: str = ""
    significant_effects: dict[str, float] = field(default_factory=dict)

    @property
    def doubts_the_data(self) -> bool:
        """Whether doubts about the measurements stand before all else."""
        return self.sentence.startswith(BEFORE_ALL_ELSE)


@dataclass(frozen=True)
class Misfit:
    """chi2 = |W (y - f)|^2 of the first and of the last model [-]; freedom: degrees of the last; p: chance of a chi2 as
    large under errors alone; zones: mean misfit of the first by experiment, section and zone, in errors of the last.
    """

    chi2_first: float
    chi2: float
    freedom: int
    p: float
    zones: pd.DataFrame

    @property
    def worst(self) -> tuple[pd.Series, float] | None:
        """The zone that is missed most, and by how many standard errors in the root mean square; None without any."""
        if self.zones.empty:
            return None
        size = np.sqrt(np.nan_to_num(self.zones["chi2"] / self.zones["stations"]))
        return self.zones.iloc[int(np.argmax(size))], float(size.max())

    @property
    def of_freedom(self) -> str:
        """Its degrees of freedom, in words."""
        degrees = f"for {so_many(self.freedom, 'degree')} of freedom"
        return degrees if self.freedom > 0 else "with no more readings than parameters"

    @property
    def told(self) -> str:
        """`chi2 is 234 for 244 degrees of freedom`."""
        return f"chi2 is {self.chi2:.0f} {self.of_freedom}"


@dataclass(frozen=True)
class EstimatedErrors:
    """What the errors were taken to be: correlation of neighbours [-], true over stated errors [-], root mean square
    error of the grid in velocities [m/s], NaN without any, and rows of the stations rejected as outliers.
    """

    correlation: float
    scale: float
    grid_error: float
    flagged: tuple[int, ...]

    @property
    def clearly_larger(self) -> bool:
        """Whether they are larger than stated by more than can pass for the errors of stating them."""
        return self.scale > constants().largest_scale


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
class Diagnosis:
    """Everything a diagnosis found in the case `name`, by which version; field_map: where there is a field; laws:
    where they stand out.
    """

    name: str
    version: str
    verdict: Verdict
    candidate_effects: tuple[CandidateEffect, ...]
    steps: tuple[Step, ...]
    misfit: Misfit
    errors: EstimatedErrors
    first_screening: FirstScreening
    parameters: ParameterEstimates
    predictions: Predictions
    place_map: PlaceMap
    places: tuple[LocalAnomaly, ...] = ()
    instruments: tuple[FaultyInstrument, ...] = ()
    field: FieldFound | None = None
    model_error: ModelErrorUsed | None = None
    field_map: FieldMapKept | None = None
    laws: CandidateLaws | None = None

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

    @property
    def law_stands_out(self) -> bool:
        """Whether a law is worth a search: where the verdict cannot tell, only if no other cause is told before it."""
        return self.laws is not None and (self.verdict.kind != "cannot-tell" or self.verdict.tells_laws)

    @property
    def changed(self) -> bool:
        """Whether anything was taken into the model or set aside."""
        return bool(self.steps or self.places or self.instruments)

    def first_score(self, candidate_effect: CandidateEffect) -> float:
        """The score of an effect before any was accepted [standard errors]."""
        return self.first_screening.scores.get(candidate_effect.name, candidate_effect.test.score)

    def last_score(self, candidate_effect: CandidateEffect) -> float:
        """The score of an effect in the last model [standard errors]; NaN where it is the first, or was refitted."""
        return candidate_effect.test.score if self.changed and not candidate_effect.amplitude.refitted else float("nan")

    def p_of_score(self, candidate_effect: CandidateEffect) -> float:
        """The family-wise p [-] of the score that is told last; NaN where it is of another score, and a refit tells."""
        told = (
            self.last_score(candidate_effect)
            if np.isfinite(self.last_score(candidate_effect))
            else self.first_score(candidate_effect)
        )
        return candidate_effect.test.p_family if candidate_effect.test.score == told else float("nan")

    def candidate_effect(self, name: str) -> CandidateEffect:
        """The effect of that name; KeyError without."""
        return {one.name: one for one in self.candidate_effects}[name]

    def __repr__(self) -> str:
        misfit, sizes = self.misfit, [(name, self.candidate_effect(name).amplitude) for name in self.set]
        tested = f"{counted_in_words(self.candidate_effects)} tested, vegglue {self.version}"
        return in_short(
            f"Diagnosis of {self.name}: {self.verdict.kind}",
            [
                self.verdict.sentence,
                *(interval_in_short(name, one.value, *one.interval95, one.unit) for name, one in sizes),
                f"chi2 {misfit.chi2:.0f} {misfit.of_freedom} (p = {misfit.p:.2g}), {tested}",
                stations_in_short(self.predictions.station),
            ],
        )
