"""Results as they are printed for a reader: values laid out by `wording/templates/terminal.j2`, and tables."""

import re
import textwrap
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vegglue.case.schema import Case
from vegglue.cli.terminal import command_line, console, print_table
from vegglue.diagnosis.comparison import exclusion_in_words, held_out_rmse, improvement
from vegglue.errors import shown_path
from vegglue.flow.status import FAILED, SOLVED_BY_MARCHING, members_with
from vegglue.inference.homogeneity import differing
from vegglue.inference.statements import (
    CalibrationDiffers,
    correlations,
    fit_statements,
    misfit_tested,
    off_its_prior,
    parameters_at_bounds,
    pressed_bounds,
    sample_statements,
    stations_standing_out,
    surrogate_statements,
    transfer_verdict,
    weight_statements,
)
from vegglue.measurements.kinds import KINDS, STREAMWISE, WATER_LEVEL
from vegglue.measurements.section_discharge import CarriedDischarge
from vegglue.pages.headline import Headline, VerdictFit, WhatDataCannotShow, verdict_fit, what_data_cannot_show
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import Ensemble
from vegglue.results.loop_results import Question
from vegglue.results.plan import FieldPlan
from vegglue.results.posterior import Posterior
from vegglue.wording.numbers import FIRM, in_digits, range_in_digits, so_many
from vegglue.wording.sentences import lines_of, phrase, sentence
from vegglue.workflow.check import CheckedCase
from vegglue.workflow.compare import Comparison
from vegglue.workflow.discover import DiscoveredCase
from vegglue.workflow.extend import StepwiseExtension

# A verdict fits a part of a terminal as it opens, an inference the whole of it [lines, letters].
TERMINAL_WIDTH, VERDICT_LINES, POSTERIOR_LINES = 80, 15, 24
# Spaces at which a line is not broken: before a unit, within `x = 3` and `10 ± 2`.
KEPT_TOGETHER = re.compile(r"(?<=\d) (?=(?:%|m|s|m/s|m2/s|m3/s|1/m)(?![\w/]))|(?<=[=±]) | (?=[=±])")
# Parameters in the table and pairs named, at most, so that the fit and its limits still have room.
MOST_PARAMETERS, MOST_PAIRS = 10, 3
# Candidates in the table of `--details`, the strongest: the page has all.
CANDIDATES_SHOWN = 10
# Columns of the ladder that are left out last in a narrow window: errors of what no calibration used go first.
FIRST_OF_LADDER = ("section left out", "validation", "RMSE", "exp. left out", "chi2 / n")


@dataclass(frozen=True)
class VerdictOnTerminal:
    """A verdict on one part of a screen; details: the command that prints the rest."""

    name: str
    headline: Headline
    remaining: tuple[object, ...]
    fit: VerdictFit
    hidden: WhatDataCannotShow
    excluded: int
    remarks: int
    details: str


@dataclass(frozen=True)
class PosteriorOnTerminal:
    """How a posterior was found; modes: None of weighed members."""

    members: int
    failed: int
    modes: int | None
    effective_size: float
    used: int
    stations: int


def show(case: Case, runs: Path, result: Any, details: bool = False, more: str = "") -> None:
    """Print a result of a case: what a verb returns, or a sentence as it is; details, more: of a diagnosis, whether all
    of it is printed, and the command that prints that.
    """
    folder = runs / case.name
    match result:
        case str():
            print(result)
        case CheckedCase():
            show_check(case, result)
        case Diagnosis() if details:
            show_diagnosis(result)
            print(phrase("files_of_diagnosis", folder))
        case Diagnosis():
            more = more or command_line("diagnose", shown_path(case.source), "--details", runs=runs)
            for line in (*verdict_lines(result, more, VERDICT_LINES - 2), phrase("files_of_diagnosis", folder)):
                print(line)
        case DiscoveredCase():
            print(sentence(result.found.sentence))
            for first, *further in result.found.ranked:
                print("\n".join([f"- {sentence(first)}", *(f"  {sentence(line)}" for line in further)]))
            if result.aside:
                print(f"- {sentence(result.aside)}")
            if result.child is not None and result.effect_file is not None:
                print(f"Effect file: {shown_path(result.effect_file)}\nChild config: {shown_path(result.child.source)}")
        case StepwiseExtension():
            show_ladder(result.comparison)
            print(sentence(result.sentence))
            print(sentence(result.reason))
            print(f"Last config: {shown_path(result.cases[-1].source)}")
        case FieldPlan():
            show_plan(result, details, more)
            print(phrase("files_of_plan", folder / "plan", bool(result.pieces)))
        case Comparison():
            show_ladder(result)
            print(f"Drawn in {folder / 'ladder.png'}")
        case list():
            show_questions(case.name, result)
        case Ensemble():
            failed, marched = (members_with(result.status, number) for number in (FAILED, SOLVED_BY_MARCHING))
            mass = None if result.by_command else result.mass_error[result.status != FAILED].max(initial=0.0)
            reasons = Counter(result.reason[result.status == FAILED].astype(str)).most_common(1)
            found = phrase("ensemble_solved", len(result.status), marched, failed, mass, reasons)
            print(f"{folder / 'ensemble.h5'}: {found}")
        case Posterior():
            command = command_line("report", shown_path(case.source), runs=folder.parent)
            for line in posterior_lines(result, f"{folder / 'posterior.h5'}", command):
                print(line)
        case Path():
            print(f"Report: {result.resolve()}")


def wrapped(paragraphs: Iterable[str]) -> list[str]:
    """Each paragraph in lines of TERMINAL_WIDTH, all but its first indented; names, and numbers with what belongs to
    them, stay whole.
    """
    look: dict[str, Any] = {"subsequent_indent": "  ", "break_long_words": False, "break_on_hyphens": False}
    kept = (KEPT_TOGETHER.sub(FIRM, text) for text in paragraphs)
    return [line.replace(FIRM, " ") for text in kept for line in textwrap.wrap(text, TERMINAL_WIDTH, **look)]


def verdict_lines(found: Diagnosis, details: str, most: int) -> list[str]:
    """A verdict in at most so many lines: the answer, the fit, what these data cannot show, and where the rest is."""
    excluded, remarks = len(set(found.errors.flagged)), len(found.verdict.notes)
    value = VerdictOnTerminal(
        found.name, Headline(found.verdict), found.verdict.remaining, verdict_fit(found), what_data_cannot_show(found),
        excluded, remarks, details,
    )  # fmt: skip
    *texts, last = [line for line in lines_of(value) if line]
    body, room, shown = [wrapped([text]) for text in texts], most - 1, list[str]()
    for number, lines in enumerate(body):
        left = room - len(shown)
        after = len(body) - number - 1  # each of the others gets a line at least
        fits = max(left - after, 1)
        shown += lines if len(lines) <= fits else [*lines[: fits - 1], f"{lines[fits - 1][: TERMINAL_WIDTH - 4]} ..."]
    return [*shown[:room], last]


def show_diagnosis(found: Diagnosis) -> None:
    """The whole verdict, remarks, the strongest candidates as a table, excluded stations.

    No table if the verdict doubts the data: effects would only compensate for what is wrong with them.
    """
    console().print(found.verdict.kind, style="bold", end=": ")
    console().print(sentence(found.verdict))
    for remark in found.verdict.notes:
        console().print(f"- {sentence(remark)}")
    if found.verdict.doubts_the_data:
        console().print(phrase("no_table_of_effects"))
    else:
        headings = (
            "effect", "probability", "amplitude", "95 % interval", "score", "p (family)", "visible", "detectable from"
        )  # fmt: skip
        rows = []
        for one in found.candidate_effects[:CANDIDATES_SHOWN]:
            # Its score before anything was accepted, and after; of what was refitted only the former.
            amplitude, detect, p = one.amplitude, one.detectability, found.p_of_score(one)
            scores = (found.first_score(one), found.last_score(one))
            low, high = amplitude.interval95
            rows.append((
                one.name,
                f"{found.chances[one.name]:.0%}" if one.name in found.chances else "",
                f"{in_digits(amplitude.value)} {amplitude.unit.removesuffix('-')}".strip(),
                f"{in_digits(low)} .. {in_digits(high)}" if low < high else "at its end",
                " -> ".join(f"{score:+.1f}" for score in scores if np.isfinite(score)),
                "" if np.isnan(p) else f"< {p:.1g}" if p < 5e-4 else f"{p:.2g}",
                f"{detect.visibility:.2f}",
                in_digits(detect.smallest, 2) if detect.ever else "never",
            ))  # fmt: skip
        print_table(headings, rows, headings[1:5])
    for off in found.instruments:
        console().print(f"- {phrase('readings_of_instrument', off)}")
    of_instruments = {row for off in found.instruments for row in off.stations}
    for row in [row for row in found.errors.flagged if row not in of_instruments]:
        console().print(f"- {phrase('station_excluded', found.predictions.station.iloc[row].to_dict())}")


def posterior_lines(posterior: Posterior, kept_in: str, command: str) -> list[str]:
    """At most POSTERIOR_LINES lines: how it was found, parameters, fit, what limits its use, and where all of it is.

    command: that makes the report, on one line however long it is, as it is copied.
    """
    sample, fit, marginals, refined = posterior.sample, posterior.fit, posterior.marginals, posterior.refinement
    modes = None if refined is None else refined.modes.mode_chi2.size
    size, stations = posterior.weighting.effective_size, len(posterior.station)
    found = PosteriorOnTerminal(sample.members, sample.failed, modes, size, fit.used, stations)
    rows = [("parameter", "median", "sd", "95 % range", "of prior", "")]
    for name in posterior.parameters[:MOST_PARAMETERS]:
        low, high = (in_digits(float(value)) for value in marginals.quantiles[name][[0, -1]])
        unit, share = f" {sample.unit[name]}".removesuffix(" -"), f"{100 * marginals.width_ratio[name]:.0f} %"
        unknown = posterior.claimed and not marginals.identified[name]
        odd = phrase("parameter_odd", unknown, pressed_bounds(posterior, name), off_its_prior(posterior, name))
        middle = in_digits(marginals.median[name]), in_digits(marginals.sd[name], 2)
        rows.append((f"{name}{unit}", *middle, f"{low} .. {high}", share, odd))
    left = len(posterior.parameters) - MOST_PARAMETERS
    head = wrapped([sentence(found)]) + columns(rows) + ([phrase("more_parameters", left)] if left > 0 else [])
    body = [*surrogate_statements(posterior), *fit_statements(posterior)]
    if (tested := misfit_tested(posterior)) is not None:
        body.append(tested)
    elif refined is not None:
        body.append(list(sample_statements(posterior))[-1 if refined.error_model.correlation == 0.0 else -2])
    pairs = list(correlations(posterior))
    limits = [*list(weight_statements(posterior))[1:], *pairs[:MOST_PAIRS]]
    if posterior.transfer is not None:
        verdict = transfer_verdict(posterior, posterior.transfer)
        limits += [verdict] if isinstance(verdict, CalibrationDiffers) else []
    texts = [*map(sentence, body), *(f"- {sentence(one)}" for one in (*limits, *stations_standing_out(posterior)))]
    foot = [phrase("kept_in", kept_in), f"  {command}"]
    room, shown, parts = POSTERIOR_LINES - len(head) - len(foot) - 1, [], [wrapped([text]) for text in texts]
    while parts and len(parts[0]) <= room:
        room -= len(parts[0])
        shown += parts.pop(0)
    return [*head, *shown, *([phrase("more_in_report", len(parts))] if parts else []), *foot]


def last_of(results: Sequence[tuple[Case, Any]], kind: type) -> tuple[Case, Any]:
    """The last result of a kind, with its case."""
    return [(case, one) for case, one in results if isinstance(one, kind)][-1]


def summary_lines(extension: StepwiseExtension, results: Sequence[tuple[Case, Any]]) -> list[str]:
    """A run in short: the verdict, what was added, laws, the verdict on the last model, parameters at bounds."""
    first = next(one for _, one in results if isinstance(one, Diagnosis))
    last, found = last_of(results, Diagnosis)
    bounds = [parameters_at_bounds(one) for _, one in results if isinstance(one, Posterior)][-1:]
    laws = [one.found.sentence for _, one in results if isinstance(one, DiscoveredCase)]
    after = [Headline(found.verdict, last.name)] if found.name != first.name else []
    values = [Headline(first.verdict, first.name), extension.reason, *laws, *after, *bounds]
    return ["In short:", *wrapped(f"- {sentence(one)}" for one in values if one)]


def columns(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Rows of a table aligned, the first column and the last to the left."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    last = len(widths) - 1
    return [
        "  ".join(
            cell.ljust(width) if place in (0, last) else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def show_check(case: Case, found: CheckedCase) -> None:
    """Discharges of each section as a table, remarks, and how much was read."""
    show_carried(found.carried)
    for remark in found.remarks:
        for line in wrapped([f"- {sentence(remark)}"]):
            print(line)
    print(
        f"{case.name}: {so_many(len(case.experiments), 'experiment')}, {found.cells:,} cells, {found.used_stations} of "
        f"{found.stations} stations in use, {so_many(len(found.remarks), 'remark')}. Channel drawn in {found.picture}"
    )


def show_carried(sections: Sequence[CarriedDischarge]) -> None:
    """What the velocities of each section carry beside the stated discharge, and which exclude it by less than a remark
    needs; nothing without sections.
    """
    if not sections:
        return
    console().print(phrase("heading_of_discharges"))
    headings = "experiment", "section", "x [m]", "carries", "95 %", "stated", "ratio", "width measured", "level"
    rows = [
        (one.experiment, one.section, f"{one.x:g}", in_digits(one.value), range_in_digits(one.interval95),
         range_in_digits(one.stated) if one.stated else "-", error(one.ratio, ".2f"), f"{one.share:.0%}",
         "measured" if one.gauged else "estimated")
        for one in sections
    ]  # fmt: skip
    print_table(headings, rows, headings[1:7])
    if off := [one for one in sections if one.excludes_stated and not one.clearly_off]:
        for line in wrapped([str(phrase("excluded_discharges", off))]):
            print(line)


def error(value: float, digits: str = ".4f") -> str:
    """An error [m/s or m], or a score or share of errors; - if there is nothing that it could be of."""
    return "-" if np.isnan(value) else f"{value:{digits}}"


def show_ladder(found: Comparison) -> None:
    """The error ladder as a table, what it leaves out, and which parameters differ between experiments."""
    scores = found.model_scores
    others = [
        kind for kind in KINDS.values()
        if kind.name not in (STREAMWISE, WATER_LEVEL)
        and any(np.isfinite(one.in_sample.rmse[kind.name]) for one in scores)
    ]  # fmt: skip
    validated = ["validation"] if any(np.isfinite(one.validation) for one in scores) else []
    banded = ["validation in 95 %"] if any(np.isfinite(one.validation_inside95) for one in scores) else []
    headings = ("model", "parameters", "RMSE", "levels", *(f"{kind.words} [{kind.unit}]" for kind in others),
                "chi2 / n", "section left out", "reduction", "exp. left out", "log score", "in 50 %", "in 95 %",
                *validated, *banded)  # fmt: skip
    rows, heterogeneous = [], []
    for before, one in zip([None, *scores[:-1]], scores, strict=True):
        seen, held = one.in_sample, one.predictive
        # By what share held-out squares fell; the error of that is unknown if one section alone was held out.
        gain, of_gain = np.array(improvement(before, one)) / held_out_rmse(before) ** 2 if before else (np.nan, np.nan)
        known = "" if np.isnan(of_gain) else f" ± {in_digits(100.0 * of_gain, 1)}"
        rows.append((
            one.name, str(len(one.values)), error(seen.rmse[STREAMWISE]), error(seen.rmse[WATER_LEVEL]),
            *(error(seen.rmse[kind.name]) for kind in others), f"{seen.chi2:.0f} / {seen.stations}",
            error(held_out_rmse(one)), "" if np.isnan(gain) else f"{100.0 * gain:.0f}{known} %",
            error(held_out_rmse(one, "experiments")), error(held.log_score, ".2f"), error(held.inside50, ".0%"),
            error(held.inside95, ".0%"), *([error(one.validation)] if validated else []),
            *([error(one.validation_inside95, ".0%")] if banded else []),
        ))  # fmt: skip
        if moves := differing(one.homogeneity):
            heterogeneous.append((one.name, {name: p for name, p in one.homogeneity.items() if name in moves}))
    print_table(headings, rows, [one for one in FIRST_OF_LADDER if one in headings])
    if scores:
        console().print(phrase("units_of_ladder", scores[-1].in_sample.noise_floor))
    if note := exclusion_in_words(found.left_out):
        console().print(sentence(note))
    for name, moving in heterogeneous:
        console().print(f"- {phrase('differs_between_experiments', name, moving)}")
    if heterogeneous:
        console().print(phrase("differences_under_stated_errors"))


def show_questions(name: str, found: Sequence[Question]) -> None:
    """For each question about a model the best measurements, or why none would do."""
    if not found:
        print("\n".join(wrapped([phrase("no_question", name)])))
    for question in found:
        print("\n".join(wrapped(repr(question).splitlines())))


def show_plan(plan: FieldPlan, details: bool, more: str) -> None:
    """Print what a plan would show, its parameters, and what to add; details: all effects in a table."""
    for line in lines_of(plan):
        print(textwrap.fill(line, TERMINAL_WIDTH, subsequent_indent="  " if line.startswith("-") else ""))
    if not details:
        print(phrase("more_of_plan", more))
        return
    rows = [
        [
            one.name,
            in_digits(one.smallest, 2) if np.isfinite(one.smallest) else phrase("never_detected"),
            in_digits(one.plausible, 2),
            one.unit,
            f"{100 * one.chance_plausible:.0f} %",
            ", ".join(other.name for other in one.confused[:2]),
        ]
        for one in plan.effects
    ]
    headings = ["effect", "detected from", "plausible", "unit", "chance", "similar"]
    print_table(headings, rows, ["detected from", "chance"])
