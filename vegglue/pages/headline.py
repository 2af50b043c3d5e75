"""A diagnosis in short, as values: the verdict, its fit, and what its data cannot show, for terminal and page."""

from dataclasses import dataclass

import numpy as np

from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.measurements.kinds import KINDS, STREAMWISE, WATER_LEVEL
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.verdict import Verdict


@dataclass(frozen=True)
class Headline:
    """The verdict on a model in short; model: its name, '' for this one; past: of a model before it was extended."""

    verdict: Verdict
    model: str = ""
    past: bool = False


@dataclass(frozen=True)
class VerdictFit:
    """RMSE in sample of velocities [m/s] and levels [m] (NaN without), of the first and of the last model; chi2 of both
    with the degrees of freedom of the last; scale: of the stated errors.
    """

    changed: bool
    velocity: tuple[float, float]
    level: tuple[float, float]
    chi2: tuple[float, float]
    freedom: int
    p: float
    scale: float


@dataclass(frozen=True)
class WhatDataCannotShow:
    """Effects that may be there undetected: groups that cannot be excluded, and those untestable of all candidates."""

    not_excluded: tuple[tuple[str, ...], ...]
    untestable: int
    candidates: int


@dataclass(frozen=True)
class WorstZone:
    """The zone that the first model misses most, by so many standard errors; after: whether a cause was accepted."""

    section: str
    zone: str
    experiment: str
    size: float
    scale: float
    of_kind: bool
    after: bool


def suspects_a_law_only(found: Diagnosis) -> bool:
    """Whether the verdict names a law and nothing that was calibrated in."""
    return found.verdict.kind == "none-of-these" and found.verdict.laws is not None and not found.places


def verdict_fit(found: Diagnosis) -> VerdictFit:
    """How well the first and the last model fit what they were calibrated to."""
    both, misfit = (found.predictions.first, found.predictions.last), found.misfit
    velocity = rms_residual(found, both[0], STREAMWISE), rms_residual(found, both[1], STREAMWISE)
    level = rms_residual(found, both[0], WATER_LEVEL), rms_residual(found, both[1], WATER_LEVEL)
    chi2 = misfit.chi2_first, misfit.chi2
    return VerdictFit(found.changed, velocity, level, chi2, misfit.freedom, misfit.p, found.errors.scale)


def rms_residual(found: Diagnosis, prediction: np.ndarray, kind: str = STREAMWISE) -> float:
    """Root mean square of measured minus predicted over the stations that count [unit of the kind], NaN without."""
    station = found.predictions.station
    counted = station["used"].to_numpy() & (station["kind"] == kind).to_numpy()
    counted[list(found.errors.flagged)] = False
    return root_mean_square((station["value"].to_numpy(float) - prediction)[counted])


def what_data_cannot_show(found: Diagnosis) -> WhatDataCannotShow:
    """Effects that these data would not show if they were there."""
    untestable = sum(candidate_status(found, one.name) == "untestable" for one in found.candidate_effects)
    return WhatDataCannotShow(found.verdict.not_excluded, untestable, len(found.candidate_effects))


def candidate_status(found: Diagnosis, name: str) -> str:
    """'accepted', 'rival' (may be missing instead of an accepted one), 'significant' in the last model, 'less likely',
    'no sign' or 'untestable'.
    """
    one = found.candidate_effect(name)
    if name in [step.accepted for step in found.steps]:
        return "accepted"
    if name in found.set:
        return "rival"
    if name in found.verdict.significant_effects:
        return "significant"
    if not one.detectability.testable:
        return "untestable"
    return "less likely" if abs(found.first_score(one)) > found.first_screening.threshold else "no sign"


def worst_zone(found: Diagnosis) -> WorstZone | None:
    """The zone that the first model misses most; None if none is known."""
    if found.misfit.worst is None:
        return None
    worst, size = found.misfit.worst
    after = bool(found.places or found.steps)
    zone = str(worst["zone"])
    return WorstZone(
        str(worst["section"]), zone, str(worst["experiment"]), size, found.errors.scale, zone in KINDS, after
    )
