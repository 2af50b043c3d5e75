"""The tables of a diagnosis, of the error ladder, and of measurements to be made, as they are printed."""

from collections.abc import Sequence

import numpy as np

from vegglue.cli.output import console, print_table
from vegglue.diagnosis.comparison import exclusion_in_words, held_out_rmse, improvement
from vegglue.measurements.kinds import KINDS, STREAMWISE, WATER_LEVEL, Kind
from vegglue.measurements.section_discharge import CarriedDischarge
from vegglue.pages.homogeneity_words import REJECTED_BELOW
from vegglue.results.causes import CandidateEffect
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.model_comparison import ModelScore
from vegglue.results.open_questions import Question
from vegglue.wording.numbers import in_digits, range_in_digits, so_many
from vegglue.workflow.compare import Comparison

# Said where parameters differ between experiments, as `infer` may say of the same that they do not.
UNDER_STATED_ERRORS = (
    "These differences are under the errors as stated, with those of grid and model; where experiments calibrated "
    "alone miss by more, `vegglue infer` makes the errors larger, and fewer differ."
)
# Columns of the ladder that are left out last where a window is narrow: errors of what no calibration saw go first.
FIRST_OF_LADDER = ("held out (section)", "validation", "RMSE", "held out (exp.)", "chi2 / n")
# Said instead of the table where the verdict doubts the data.
HELD_BACK = (
    "No table of effects: with these measurements it would only tell what makes up for what is wrong with them. Mend "
    "them, or find them right, first; the page of the run (`vegglue report`) has the table, as far as it goes."
)
# Suspects in the table, the strongest: they fit on a screen with what is said of them, and the page has all.
SUSPECTS_SHOWN = 10


def show_diagnosis(found: Diagnosis) -> None:
    """The verdict and its sentence, remarks, the ten strongest suspects as a table, stations set aside.

    No table where the verdict doubts the data: effects would only make up for what is wrong with them.
    """
    console().print(found.verdict.kind, style="bold", end=": ")
    console().print(found.verdict.sentence)
    for remark in found.verdict.remarks:
        console().print(f"- {remark}")
    if found.verdict.doubts_the_data:
        console().print(HELD_BACK)
    else:
        _show_suspects(found)
    for off in found.instruments:
        at = ", ".join(f"{name} = {value:g}" for name, value in (("x", off.x), ("y", off.y)) if np.isfinite(value))
        console().print(f"- set aside: the {off.kind} at {at} m, {so_many(len(off.stations), 'reading')}")
    of_instruments = {row for off in found.instruments for row in off.stations}
    for row in [row for row in found.errors.flagged if row not in of_instruments]:
        station = found.predictions.station.iloc[row]
        place = f"{station['experiment']} {station['section']} x = {station['x']:g}, y = {station['y']:g} m"
        console().print(f"- set aside: {place}, measured {station['value']:g}")


def _show_suspects(found: Diagnosis) -> None:
    rows = [_suspect_cells(found, one) for one in found.candidate_effects[:SUSPECTS_SHOWN]]
    headings = "effect", "chance", "amplitude", "95 % interval", "score", "p (family)", "visible", "detectable from"
    print_table(headings, rows, headings[1:5])


def _suspect_cells(found: Diagnosis, one: CandidateEffect) -> tuple[str, ...]:
    """An effect's row of the table. Its score before anything was accepted, and after; of what was refitted, only the
    former, as its amplitude says the rest.
    """
    amplitude, detectability = one.amplitude, one.detectability
    scores = (found.first_score(one), found.last_score(one))
    p = found.p_of_score(one)
    unit = amplitude.unit.removesuffix("-")
    low, high = amplitude.interval95
    return (
        one.name,
        f"{found.chances[one.name]:.0%}" if one.name in found.chances else "",
        f"{in_digits(amplitude.value)} {unit}".strip(),
        f"{in_digits(low)} .. {in_digits(high)}" if low < high else "at its end",
        " -> ".join(f"{score:+.1f}" for score in scores if np.isfinite(score)),
        "" if np.isnan(p) else f"< {p:.1g}" if p < 5e-4 else f"{p:.2g}",
        f"{detectability.visibility:.2f}",
        in_digits(detectability.smallest, 2) if detectability.ever else "never",
    )


def show_carried(sections: Sequence[CarriedDischarge]) -> None:
    """What the velocities of each section carry beside the stated discharge; nothing without sections."""
    if not sections:
        return
    console().print("Discharges [m3/s] that the measured velocities carry, and 95 % of what they may be:")
    headings = "experiment", "section", "x [m]", "carries", "95 %", "stated", "ratio", "width measured", "level"
    print_table(headings, [_carried_cells(one) for one in sections], headings[1:7])


def _carried_cells(one: CarriedDischarge) -> tuple[str, ...]:
    return (
        one.experiment,
        one.section,
        f"{one.x:g}",
        in_digits(one.value),
        range_in_digits(one.interval95),
        range_in_digits(one.stated) if one.stated else "-",
        _error(one.ratio, ".2f"),
        f"{one.share:.0%}",
        "measured" if one.gauged else "estimated",
    )


def _error(value: float, digits: str = ".4f") -> str:
    """An error [m/s or m], or a score or share of errors; - where there is nothing that it could be of."""
    return "-" if np.isnan(value) else f"{value:{digits}}"


def _gain(before: ModelScore | None, one: ModelScore) -> str:
    """By how much held-out squares fell [(mm/s)^2]; the error of that is - where one section alone was held out."""
    gain, error = (1e6 * part for part in improvement(before, one)) if before else (float("nan"),) * 2
    return "" if np.isnan(gain) else f"{in_digits(gain, 2)} ± {'-' if np.isnan(error) else in_digits(error, 1)}"


def show_ladder(found: Comparison) -> None:
    """The error ladder as a table, what it leaves out, and which parameters differ between experiments."""
    scores, note = found.model_scores, exclusion_in_words(found.left_out)
    others, validated = _other_kinds(scores), any(np.isfinite(one.validation) for one in scores)
    headings = ("model", "parameters", "RMSE", "levels", *(f"{kind.words} [{kind.unit}]" for kind in others),
                "chi2 / n", "held out (section)", "fell by", "held out (exp.)", "log score", "in 50 %", "in 95 %",
                *(["validation"] if validated else []))  # fmt: skip
    rows = []
    for before, one in zip([None, *scores[:-1]], scores, strict=True):
        seen, held_out = one.in_sample, one.predictive
        rows.append((
            one.name, str(len(one.values)), _error(seen.rmse[STREAMWISE]), _error(seen.rmse[WATER_LEVEL]),
            *(_error(seen.rmse[kind.name]) for kind in others), f"{seen.chi2:.0f} / {seen.stations}",
            _error(held_out_rmse(one)), _gain(before, one), _error(held_out_rmse(one, "experiments")),
            _error(held_out.log_score, ".2f"), _error(held_out.inside50, ".0%"), _error(held_out.inside95, ".0%"),
            *([_error(one.validation)] if validated else []),
        ))  # fmt: skip
    print_table(headings, rows, [one for one in FIRST_OF_LADDER if one in headings])
    if scores:
        console().print(
            f"Errors in m/s (levels in m), `fell by` in (mm/s)^2 of held-out squares; noise floor "
            f"{_error(scores[-1].in_sample.noise_floor)} m/s; compare chi2 here only."
        )
    if note:
        console().print(note)
    differing = {one.name: moving for one in scores if (moving := _moving(one))}
    for name, moving in differing.items():
        console().print(f"- {name}: differs between experiments: {moving}")
    if differing:
        console().print(UNDER_STATED_ERRORS)


def _moving(one: ModelScore) -> str:
    """`n_b (p = 1e-08), k_s (p = 0.002)`: parameters that differ between experiments, '' for none."""
    compared = len(one.homogeneity)
    return ", ".join(f"{name} (p = {p:.1g})" for name, p in one.homogeneity.items() if p * compared < REJECTED_BELOW)


def _other_kinds(scores: Sequence[ModelScore]) -> list[Kind]:
    """What was measured besides velocities along x and levels."""
    others = (kind for kind in KINDS.values() if kind.name not in (STREAMWISE, WATER_LEVEL))
    return [kind for kind in others if any(np.isfinite(one.in_sample.rmse[kind.name]) for one in scores)]


def show_questions(name: str, found: Sequence[Question]) -> None:
    """For each question about a model the four best measurements, or why none would do."""
    if not found:
        console().print(
            f"{name}: no measurement is proposed: no two listed effects are left to be told apart, and what is in no "
            "list is weighed only where it is likelier than they are; or those there are have to be mended first, "
            "which its diagnosis says."
        )
    for question in found:
        console().print(repr(question))
