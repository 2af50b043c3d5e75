"""What the report says of a diagnosis: standing of each effect, tables, key numbers (HTML)."""

import html
from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.figures.typography import NARROW, as_given, fixed, interval, percent, short, unit_html
from vegglue.inference.likelihood import root_mean_square
from vegglue.measurements.kinds import STREAMWISE, kind_of
from vegglue.report_page.key_numbers import KeyNumber
from vegglue.results.diagnosis import Diagnosis, Suspect

# Effects in the table that is open; the others stand below it, folded.
SUSPECTS_SHOWN = 8
# Cosine above which an effect is said to look like a change of a parameter.
LOOKS_LIKE = 0.8


@dataclass(frozen=True)
class SuspectRow:
    """One effect in the table of a report (HTML)."""

    name: str
    title: str
    standing: str
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
class Told:
    """The part of a report that is about a diagnosis, but for its figures (sentences as text)."""

    sentence: str
    remarks: tuple[str, ...]
    numbers: list[KeyNumber]
    suspects: list[SuspectRow]
    others: list[SuspectRow]
    looked_again: bool
    flagged: list[FlaggedRow]


def diagnosis_in_words(diagnosis: Diagnosis) -> Told:
    """Everything the report says of a diagnosis."""
    first, others = _suspect_rows(diagnosis)
    flagged = [_flagged(diagnosis, row) for row in diagnosis.errors.flagged]
    verdict, numbers = diagnosis.verdict, _numbers(diagnosis)
    return Told(verdict.sentence, verdict.remarks, numbers, first, others, bool(diagnosis.steps), flagged)


def standing_of(diagnosis: Diagnosis, suspect: Suspect) -> str:
    """'accepted', 'rival' (may be it instead of an accepted one), 'less likely', 'no sign' or 'untestable'."""
    if suspect.name in [step.accepted for step in diagnosis.steps]:
        return "accepted"
    if suspect.name in diagnosis.set:
        return "rival"
    if not suspect.detectability.testable:
        return "untestable"
    threshold = diagnosis.first_screening.threshold
    return "less likely" if abs(first_score(diagnosis, suspect)) > threshold else "no sign"


def first_score(diagnosis: Diagnosis, suspect: Suspect) -> float:
    """Its score before anything was added [standard errors]."""
    return diagnosis.first_screening.scores.get(suspect.name, suspect.test.score)


def last_score(diagnosis: Diagnosis, suspect: Suspect) -> float:
    """Its score at the last look, NaN where that was the first or it was refitted instead."""
    return float("nan") if suspect.amplitude.refitted or not diagnosis.steps else suspect.test.score


def ranked(diagnosis: Diagnosis) -> list[Suspect]:
    """Accepted, then rivals, then the others, each by its first score; those nobody could see last."""
    order = ("accepted", "rival", "less likely", "no sign", "untestable")
    return sorted(
        diagnosis.suspects,
        key=lambda one: (order.index(standing_of(diagnosis, one)), -abs(np.nan_to_num(first_score(diagnosis, one)))),
    )


def added(diagnosis: Diagnosis) -> str:
    """The accepted effects in words, '' for none."""
    return " and ".join(step.accepted for step in diagnosis.steps)


def error_of(diagnosis: Diagnosis, prediction: Array, kind: str = STREAMWISE) -> float:
    """Root mean square of measured minus predicted over the stations that count [unit of the kind], NaN without."""
    station = diagnosis.predictions.station
    counted = station["used"].to_numpy(bool) & (station["kind"] == kind).to_numpy()
    counted[list(diagnosis.errors.flagged)] = False
    return root_mean_square((station["value"].to_numpy(float) - prediction)[counted])


def _suspect_rows(diagnosis: Diagnosis) -> tuple[list[SuspectRow], list[SuspectRow]]:
    """The effects worth reading first, and all others."""
    rows = [_row(diagnosis, suspect) for suspect in ranked(diagnosis)]
    shown = max(SUSPECTS_SHOWN, len(diagnosis.set))
    return rows[:shown], rows[shown:]


def _row(diagnosis: Diagnosis, suspect: Suspect) -> SuspectRow:
    estimate, detectability = suspect.amplitude, suspect.detectability
    unit = unit_html(estimate.unit)
    unit = f'{NARROW}<span class="unit">{unit}</span>' if unit else ""
    scores = first_score(diagnosis, suspect), last_score(diagnosis, suspect)
    parameter = detectability.confounder
    alike = abs(detectability.cosine) > LOOKS_LIKE and parameter in diagnosis.parameters.first
    return SuspectRow(
        name=html.escape(suspect.name),
        title=html.escape(suspect.title),
        standing=standing_of(diagnosis, suspect),
        chance=percent(diagnosis.chances[suspect.name]) if suspect.name in diagnosis.chances else "",
        amplitude=short(estimate.value, 3) + unit,
        interval=interval(*estimate.interval95),
        p_family=p_value(suspect.test.p_family),
        score=" → ".join(fixed(score, 1) for score in scores if np.isfinite(score)),
        visibility=fixed(detectability.visibility, 2),
        detectable=short(detectability.smallest, 2) + unit,
        looks_like=html.escape(parameter) if alike else "",
    )


def p_value(p: float) -> str:
    """A p-value, never more precise than a bootstrap of some thousands is."""
    return f"&lt;{NARROW}0.001" if p < 0.001 else short(p, 2)


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
    before, after = (error_of(diagnosis, each) for each in (diagnosis.predictions.first, diagnosis.predictions.last))
    fell = bool(diagnosis.steps)
    arrow = f"{short(before, 2)} → {short(after, 2)}" if fell else short(after, 2)
    chi2 = f"{misfit.chi2_first:,.0f} → {misfit.chi2:,.0f}" if fell else f"{misfit.chi2:,.0f}"
    apart = len(diagnosis.suspects) - sum(one.detectability.testable for one in diagnosis.suspects)
    return [
        KeyNumber("chi², correlated errors", chi2, f"for {misfit.freedom} degrees of freedom"),
        KeyNumber("velocity error", f"{arrow}{NARROW}m/s", "root mean square, in sample"),
        KeyNumber("effects tried", f"{len(diagnosis.suspects)}", f"{apart} of them untestable with these data"),
        KeyNumber("correlation of neighbours", fixed(errors.correlation, 2), "of the errors along a section"),
        KeyNumber("error of the grid", f"{short(1000 * errors.grid_error, 2)}{NARROW}mm/s", "counted as an error"),
    ]
