"""The part of the page about a diagnosis as values: candidate effects, places, instruments, excluded stations."""

from dataclasses import dataclass

import numpy as np

from vegglue.measurements.kinds import kind_of
from vegglue.pages.headline import VerdictFit, candidate_status, verdict_fit
from vegglue.results.causes import CandidateEffect, effects_among
from vegglue.results.diagnosis import Diagnosis

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
    """What the page has of a diagnosis beside its pictures; doubtful: whether all of it holds only if the measurements
    turn out to be right.
    """

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
    """Everything the page writes about a diagnosis; its first candidates are those worth reading first, none if the
    verdict doubts the data.
    """
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
