"""A diagnosis as a value: the verdict, the effects that explain the misfit, where it lies, and all numbers.

Causes stand in causes.py, the verdict in verdict.py; diagnosis_file.py lays it out in diagnosis.h5.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.measurements.kinds import stations_in_short
from vegglue.plain_json import plain
from vegglue.results.causes import (
    CandidateEffect,
    CandidateLaws,
    FaultyInstrument,
    FieldFound,
    FieldMapKept,
    LocalAnomaly,
    ModelErrorUsed,
    PlaceMap,
    Step,
)
from vegglue.results.verdict import ChiSquare, EstimatedErrors, Verdict
from vegglue.wording.numbers import in_short, in_short_html, interval_in_short
from vegglue.wording.sentences import phrase, tagged


@dataclass(frozen=True)
class Misfit:
    """chi2 = |W (y - f)|^2 of the first and of the last model.

    Attributes
    ----------
    chi2_first, chi2 : float
        [-]
    freedom : int
        Degrees of freedom of the last.
    p : float
        Chance of a chi2 as large under errors alone [-].
    zones : DataFrame
        Mean misfit of the first model by experiment, section and zone [errors of the last].
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
        return phrase("degrees_of_freedom", self.freedom)

    @property
    def size(self) -> ChiSquare:
        """chi2 of the last model without the zones."""
        return ChiSquare(self.chi2, self.freedom, self.p)


@dataclass(frozen=True)
class FirstScreening:
    """Score tests of the first model.

    Attributes
    ----------
    threshold : float
        Score that errors alone reach at the false-alarm rate of effects [standard errors].
    scores : dict of float
        By name [standard errors].
    compared : tuple of str
        The strongest effects, c of them.
    cosine : ndarray (c, c)
        Between their fingerprints [-].
    """

    threshold: float
    scores: dict[str, float]
    compared: tuple[str, ...]
    cosine: Array


@dataclass(frozen=True)
class ParameterEstimates:
    """Calibrated parameters by name.

    Attributes
    ----------
    first : dict of float
        Of the first model.
    last : dict of (float, float, float)
        Of the last model: value and 95 % interval.
    """

    first: dict[str, float]
    last: dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class Predictions:
    """Predictions at the stations.

    Attributes
    ----------
    station : DataFrame
        The table of stations.
    first, last : ndarray (station,)
        Of the first and of the last model [unit of the kind].
    error : ndarray (station,)
        Standard errors of the readings, NaN if not used.
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
    """All results of a diagnosis of the case `name`.

    Attributes
    ----------
    name, version
        Of the case and of vegglue.
    steps : tuple of Step
        Rounds of the search.
    field, field_map
        A field, if one is significant.
    bed_map : FieldMapKept or None
        What measurements change a surveyed bed by [m].
    laws : CandidateLaws or None
        Laws, if they are significant.
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
    bed_map: FieldMapKept | None = None
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
        """Of effects that the data cannot separate, over all steps."""
        return [list(group) for step in self.steps for group in step.groups]

    @property
    def law_stands_out(self) -> bool:
        """Whether a law is worth a search: of a verdict "cannot-tell", only if it names one."""
        return self.laws is not None and (self.verdict.kind != "cannot-tell" or self.verdict.tells_laws)

    @property
    def changed(self) -> bool:
        """Whether anything was taken into the model or excluded."""
        return bool(self.steps or self.places or self.instruments)

    def first_score(self, one: CandidateEffect) -> float:
        """The score of an effect before any was accepted [standard errors]."""
        return self.first_screening.scores.get(one.name, one.test.score)

    def last_score(self, one: CandidateEffect) -> float:
        """The score of an effect in the last model [standard errors]; NaN if it is the first, or was refitted."""
        return one.test.score if self.changed and not one.amplitude.refitted else float("nan")

    def p_of_score(self, one: CandidateEffect) -> float:
        """The family-wise p [-] of the last known score; NaN if it belongs to another score."""
        last = self.last_score(one)
        return one.test.p_family if one.test.score == (last if np.isfinite(last) else self.first_score(one)) else np.nan

    def candidate_effect(self, name: str) -> CandidateEffect:
        """The effect of that name; KeyError without."""
        return {one.name: one for one in self.candidate_effects}[name]

    def __repr__(self) -> str:
        misfit, sizes = self.misfit, [(name, self.candidate_effect(name).amplitude) for name in self.set]
        tested = f"{phrase('effects_tested', self.verdict.tested)} tested, vegglue {self.version}"
        return in_short(
            f"Diagnosis of {self.name}: {self.verdict.kind}",
            [
                self.verdict.sentence,
                *(interval_in_short(name, one.value, *one.interval95, one.unit) for name, one in sizes),
                f"chi2 {misfit.chi2:.0f} {misfit.of_freedom} (p = {misfit.p:.2g}), {tested}",
                stations_in_short(self.predictions.station),
            ],
        )

    def _repr_html_(self) -> str:
        return in_short_html(repr(self))


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Every number of a diagnosis that is printed.

    Returns
    -------
    dict
        SI; amplitudes in the unit of their effect.
    """
    verdict, misfit, errors = diagnosis.verdict, diagnosis.misfit, diagnosis.errors
    tree = {
        "verdict": verdict.kind,
        "sentence": verdict.sentence,
        "left_over": verdict.left_over,
        "verdict_value": tagged(verdict),
        "standing_out": verdict.significant_effects,
        "set": diagnosis.set,
        "groups": diagnosis.groups,
        "not_excluded": verdict.not_excluded,
        "where": verdict.where,
        "effects": [*map(candidate_effect_json, diagnosis.candidate_effects)],
        "steps": [asdict(step) for step in diagnosis.steps],
        "remarks": verdict.remarks,
        "chi2": {"first": misfit.chi2_first, "last": misfit.chi2, "freedom": misfit.freedom, "p": misfit.p},
        "threshold": diagnosis.first_screening.threshold,
        "noise": {"correlation": errors.correlation, "scale": errors.scale, "grid_error": errors.grid_error},
        "flagged": [
            {name: str(row[name]) for name in ("experiment", "kind", "section")}
            | {name: float(row[name]) for name in ("x", "y", "value")}
            for _, row in diagnosis.predictions.station.iloc[list(errors.flagged)].iterrows()
        ],
        "parameters": diagnosis.parameters.last,
        "first_parameters": diagnosis.parameters.first,
        "places": [asdict(one) for one in diagnosis.places],
        "instruments": [asdict(one) for one in diagnosis.instruments],
        "field": None if diagnosis.field is None else asdict(diagnosis.field),
        "model_error": None if diagnosis.model_error is None else asdict(diagnosis.model_error),
        "laws": None if diagnosis.laws is None else asdict(diagnosis.laws),
        "zones": misfit.zones.to_dict("records"),
    }
    return {name: plain(value) for name, value in tree.items()}


def candidate_effect_json(one: CandidateEffect) -> dict[str, Any]:
    """All numbers of an effect by the names they have in JSON and in diagnosis.h5."""
    amplitude, test, detectability = one.amplitude, one.test, one.detectability
    return {
        "name": one.name,
        "title": one.title,
        "unit": amplitude.unit,
        "amplitude": amplitude.value,
        "interval95": amplitude.interval95,
        "score": test.score,
        "p_family": test.p_family,
        "visibility": detectability.visibility,
        "smallest_detectable": detectability.smallest,
        "testable": detectability.testable,
        "refitted": amplitude.refitted,
        "objective": amplitude.objective,
        "mimicked_by": detectability.confounder,
        "likeness": detectability.cosine,
        "shapes": one.shapes,
        "off": amplitude.off,
        "scale": amplitude.scale,
        "support": amplitude.support,
    }
