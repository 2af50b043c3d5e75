"""A diagnosis as values for terminal and page: the verdict in short, its fit, what its data cannot show, candidate
effects, places, instruments, excluded stations.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.measurements.kinds import KINDS, STREAMWISE, WATER_LEVEL, kind_of
from vegglue.results.causes import CandidateEffect, effects_among
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


# Effects in the open table, a screen of a laptop; the others stand below it, folded.
CANDIDATES_LISTED = 8
STATUSES = ("accepted", "rival", "significant", "less likely", "no sign", "untestable")


@dataclass(frozen=True)
class CandidateRow:
    """One effect in the table; probability and confounder: None and '' unless stated; scores: of the first model and of
    the last, those that are known; p: NaN if it is of another score than the last.
    """

    effect: CandidateEffect
    status: str
    probability: float | None
    scores: tuple[float, ...]
    p: float
    confounder: str


@dataclass(frozen=True)
class ExcludedStation:
    """A station that was excluded; off: measured minus predicted in standard errors."""

    experiment: str
    section: str
    x: float
    y: float
    measured: float
    predicted: float
    off: float


@dataclass(frozen=True)
class DiagnosisSection:
    """What the page has of a diagnosis; doubtful: whether it holds only if the measurements turn out to be right."""

    found: Diagnosis
    doubtful: bool
    fit: VerdictFit
    effects_tried: int
    untestable: int
    first: list[CandidateRow]
    others: list[CandidateRow]
    excluded: list[ExcludedStation]
    odds: list[float]


def diagnosis_section(found: Diagnosis) -> DiagnosisSection:
    """Everything the page writes about a diagnosis, first what is worth reading first, unless the data are in doubt."""
    rows = candidate_rows(found)
    doubtful = found.verdict.doubts_the_data
    shown = 0 if doubtful else max(CANDIDATES_LISTED, len(found.set))
    return DiagnosisSection(
        found, doubtful, verdict_fit(found), effects_among(found.candidate_effects),
        sum(row.status == "untestable" for row in rows), rows[:shown], rows[shown:], excluded_stations(found),
        [float(np.exp(min(one.log_factor, 700.0))) for one in found.instruments],
    )  # fmt: skip


def candidate_rows(found: Diagnosis) -> list[CandidateRow]:
    """By their status, what was accepted first; within each by first score."""
    rows = []
    for one in found.candidate_effects:
        scores = tuple(score for score in (found.first_score(one), found.last_score(one)) if np.isfinite(score))
        confounder = one.detectability.confounder
        probability = found.chances.get(one.name)
        known = confounder if confounder in found.parameters.first else ""
        rows.append(
            CandidateRow(one, candidate_status(found, one.name), probability, scores, found.p_of_score(one), known)
        )
    first = {row.effect.name: abs(np.nan_to_num(found.first_score(row.effect))) for row in rows}
    return sorted(rows, key=lambda row: (STATUSES.index(row.status), -first[row.effect.name]))


def excluded_stations(found: Diagnosis) -> list[ExcludedStation]:
    """Stations that the diagnosis excludes."""
    rows = []
    for row in found.errors.flagged:
        station = found.predictions.station.iloc[row]
        value, predicted = float(station["value"]), float(found.predictions.last[row])
        section = str(station["section"]) or kind_of(str(station["kind"])).instrument
        off = (value - predicted) / float(station["standard_error"])
        place = float(station["x"]), float(station["y"])
        rows.append(ExcludedStation(str(station["experiment"]), section, *place, value, predicted, off))
    return rows
