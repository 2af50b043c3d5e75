"""What the report says of a diagnosis: status of each effect, tables, key numbers (HTML)."""

import html
from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.inference.weighted_statistics import root_mean_square
from vegglue.measurements.kinds import STREAMWISE, kind_of
from vegglue.pages.cause_words import InstrumentRow, PlaceRow, instrument_rows, place_rows
from vegglue.pages.key_numbers import KeyNumber
from vegglue.pages.typography import NARROW, as_given, fixed, interval, percent, short, unit_html
from vegglue.results.causes import CandidateEffect, effects_among
from vegglue.results.diagnosis import Diagnosis

# Effects in the open table, a screen of a laptop; the others stand below it, folded.
SUSPECTS_LISTED = 8
# Said below a verdict that doubts the data.
AS_THEY_STAND = (
    "All that follows here was found with the measurements as they stand: it tells what makes up for what is wrong "
    "with them, and means something of the flow only if they turn out to be right."
)


@dataclass(frozen=True)
class SuspectRow:
    """One effect in the table of a report (HTML)."""

    name: str
    title: str
    status: str
    chance: str
    amplitude: str
    interval: str
    p_family: str
    score: str
    visibility: str
    detectable: str
    looks_like: str


@dataclass(frozen=True)
class FlaggedRow:
    """A station that was set aside (text)."""

    experiment: str
    section: str
    x: str
    y: str
    measured: str
    predicted: str
    score: str


@dataclass(frozen=True)
class DiagnosisSection:
    """The part of the page about a diagnosis, without its pictures; sentence, condition and remarks are text, the rest
    is HTML. condition: under which all but the sentence holds, '' for none.
    """

    sentence: str
    condition: str
    remarks: tuple[str, ...]
    numbers: list[KeyNumber]
    suspects: list[SuspectRow]
    other_suspects: list[SuspectRow]
    rescored: bool
    flagged: list[FlaggedRow]
    places: list[PlaceRow]
    instruments: list[InstrumentRow]


def diagnosis_section(diagnosis: Diagnosis) -> DiagnosisSection:
    """Everything the page writes about a diagnosis; its first suspects are those worth reading first."""
    first, others = _suspect_rows(diagnosis)
    flagged = [_flagged(diagnosis, row) for row in diagnosis.errors.flagged]
    verdict, numbers = diagnosis.verdict, _numbers(diagnosis)
    return DiagnosisSection(
        sentence=verdict.sentence,
        condition=AS_THEY_STAND if verdict.doubts_the_data else "",
        remarks=verdict.remarks,
        numbers=numbers,
        suspects=first,
        other_suspects=others,
        rescored=diagnosis.changed,
        flagged=flagged,
        places=place_rows(diagnosis),
        instruments=instrument_rows(diagnosis),
    )


def suspect_status(diagnosis: Diagnosis, suspect: CandidateEffect) -> str:
    """'accepted', 'rival' (may stand in place of an accepted one), 'stands out' in the last model, whatever size these
    data would show, 'less likely', 'no sign' or 'untestable'.
    """
    if suspect.name in [step.accepted for step in diagnosis.steps]:
        return "accepted"
    if suspect.name in diagnosis.set:
        return "rival"
    if suspect.name in diagnosis.verdict.significant_effects:
        return "stands out"
    if not suspect.detectability.testable:
        return "untestable"
    threshold = diagnosis.first_screening.threshold
    return "less likely" if abs(diagnosis.first_score(suspect)) > threshold else "no sign"


def ranked_suspects(diagnosis: Diagnosis) -> list[CandidateEffect]:
    """By their status, what was accepted first; within each by first score."""
    order = ("accepted", "rival", "stands out", "less likely", "no sign", "untestable")
    return sorted(
        diagnosis.candidate_effects,
        key=lambda one: (order.index(suspect_status(diagnosis, one)), -abs(np.nan_to_num(diagnosis.first_score(one)))),
    )


def standard_errors(diagnosis: Diagnosis) -> str:
    """Whose standard errors a misfit is told in: those of the data, or these made larger, as the residual asks for."""
    scale = diagnosis.errors.scale
    return "standard errors" if scale <= 1.0 else f"standard errors (each {fixed(scale, 1)} times as large as stated)"


def rms_residual(diagnosis: Diagnosis, prediction: Array, kind: str = STREAMWISE) -> float:
    """Root mean square of measured minus predicted over the stations that count [unit of the kind], NaN without."""
    station = diagnosis.predictions.station
    counted = station["used"].to_numpy() & (station["kind"] == kind).to_numpy()
    counted[list(diagnosis.errors.flagged)] = False
    return root_mean_square((station["value"].to_numpy(float) - prediction)[counted])


def _suspect_rows(diagnosis: Diagnosis) -> tuple[list[SuspectRow], list[SuspectRow]]:
    """The effects worth reading first, none where the verdict doubts the data, and all others."""
    rows = [_row(diagnosis, suspect) for suspect in ranked_suspects(diagnosis)]
    shown = 0 if diagnosis.verdict.doubts_the_data else max(SUSPECTS_LISTED, len(diagnosis.set))
    return rows[:shown], rows[shown:]


def _row(diagnosis: Diagnosis, suspect: CandidateEffect) -> SuspectRow:
    estimate, detectability = suspect.amplitude, suspect.detectability
    unit = unit_html(estimate.unit)
    unit = f'{NARROW}<span class="unit">{unit}</span>' if unit else ""
    scores = diagnosis.first_score(suspect), diagnosis.last_score(suspect)
    alike = detectability.looks_like
    return SuspectRow(
        name=html.escape(suspect.name),
        title=html.escape(suspect.title),
        status=suspect_status(diagnosis, suspect),
        chance=percent(diagnosis.chances[suspect.name]) if suspect.name in diagnosis.chances else "",
        amplitude=short(estimate.value, 3) + unit,
        interval=interval(*estimate.interval95),
        p_family=p_value_html(diagnosis.p_of_score(suspect)),
        score=" → ".join(fixed(score, 1) for score in scores if np.isfinite(score)),
        visibility=fixed(detectability.visibility, 2),
        detectable=short(detectability.smallest, 2) + unit if detectability.ever else "never",
        looks_like=html.escape(alike) if alike in diagnosis.parameters.first else "",
    )


def p_value_html(p: float) -> str:
    """A p-value (HTML), no more precise than a bootstrap of some thousands can make it; '' for NaN."""
    return "" if np.isnan(p) else f"&lt;{NARROW}0.001" if p < 0.001 else short(p, 2)


def _flagged(diagnosis: Diagnosis, row: int) -> FlaggedRow:
    station = diagnosis.predictions.station.iloc[row]
    predicted = float(diagnosis.predictions.last[row])
    value = float(station["value"])
    return FlaggedRow(
        experiment=str(station["experiment"]),
        section=str(station["section"]) or kind_of(str(station["kind"])).instrument,
        x=as_given(station["x"]),
        y=as_given(station["y"]),
        measured=fixed(value, 3),
        predicted=fixed(predicted, 3),
        score=fixed((value - predicted) / float(station["standard_error"]), 1),
    )


def _numbers(diagnosis: Diagnosis) -> list[KeyNumber]:
    """How much the misfit fell, and what the errors were taken to be."""
    misfit, errors = diagnosis.misfit, diagnosis.errors
    before, after = (
        rms_residual(diagnosis, each) for each in (diagnosis.predictions.first, diagnosis.predictions.last)
    )
    fell = diagnosis.changed
    arrow = f"{short(before, 2)} → {short(after, 2)}" if fell else short(after, 2)
    chi2 = f"{misfit.chi2_first:,.0f} → {misfit.chi2:,.0f}" if fell else f"{misfit.chi2:,.0f}"
    apart = sum(suspect_status(diagnosis, one) == "untestable" for one in diagnosis.candidate_effects)
    untestable = f"as {len(diagnosis.candidate_effects)} candidates, {apart} of them untestable with these data"
    return [
        KeyNumber("chi², correlated errors", chi2, misfit.of_freedom),
        KeyNumber("velocity error", f"{arrow}{NARROW}m/s", "root mean square, in sample"),
        KeyNumber("effects tried", f"{effects_among(diagnosis.candidate_effects)}", untestable),
        KeyNumber("correlation of neighbours", fixed(errors.correlation, 2), "of the errors along a section"),
        *([] if errors.scale <= 1.0 else [_errors_made_larger(errors.scale)]),
        KeyNumber("error of the grid", f"{short(1000 * errors.grid_error, 2)}{NARROW}mm/s", "counted as an error"),
    ]


def _errors_made_larger(scale: float) -> KeyNumber:
    return KeyNumber("errors of the data", f"{fixed(scale, 1)} times", "those stated, as the last residual asks for")
