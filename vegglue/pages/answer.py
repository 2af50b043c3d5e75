"""The answer first, as values: verdict, error ladder, sections before and after, and what to do next.

`answer_of` collects them; the macro `answer` of answer.html.j2 shows them, on the page of one run and of several.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from vegglue.effects.identity import EffectIdentity
from vegglue.effects.library import library
from vegglue.errors import shell_line
from vegglue.inference.statements import UNBELIEVED, parameters_at_bounds
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.measurements.section_discharge import DischargeMismatch, discharge_mismatches, mismatched_discharges
from vegglue.pages.findings import MASS_LIMIT, failed_of_weighed, largest_mass_error, too_many_failed
from vegglue.pages.headline import Headline, WorstZone, suspects_a_law_only, worst_zone
from vegglue.pages.ladder_figure import draw_errors
from vegglue.pages.parameters import posterior_verdict, symbols_of
from vegglue.pages.run import Run, accepted_causes, published_picture
from vegglue.pages.sections import SectionPanels, section_panels
from vegglue.pages.style import Picture
from vegglue.results.causes import CandidateLaws
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.loop_results import HiddenEffect, ModelComparison, Question
from vegglue.results.verdict import MisfitTooSmall, is_too_small

# Ways of judging a model, the most telling first: fields of a step of the ladder.
JUDGED_ON = ("unseen", "held_out_sections", "held_out_experiments", "in_sample")
# Measurements named beside the answer, at most.
QUESTIONS_SHOWN = 3


@dataclass(frozen=True)
class LawLeft:
    laws: CandidateLaws | None


@dataclass(frozen=True)
class SubjectModel:
    """Which model a page is about if another one was diagnosed: the first of its ladder and what was added."""

    first: str
    added: tuple[str, ...]


@dataclass(frozen=True)
class NotReliable:
    """Why the verdict or the parameters cannot be relied on yet; what is None or empty is sound.

    misfit: of the last model is larger than the errors allow; few: effective sample size and members; failed: of
    members; mass: share of its discharge that a member loses or gains.
    """

    verdict: bool
    parameters: bool
    misfit: bool
    discharges: tuple[DischargeMismatch, ...]
    few: tuple[float, int] | None
    heavy_tail: bool
    failed: tuple[int, int] | None
    mass: float | None


@dataclass(frozen=True)
class ErrorFall:
    """How far the error of velocity falls from the first model to the last [m/s], judged in the most telling way.

    judged: of JUDGED_ON, '' without velocities; added: in words; unclear: additions whose part of the fall is not
    significant; all_unclear: whether that is the whole fall.
    """

    judged: str
    models: int
    added: str
    before: float
    after: float
    measurement_error: float
    unclear: tuple[str, ...]
    all_unclear: bool
    reason: object


@dataclass(frozen=True)
class Purpose:
    """What a measurement is for: to test an effect that calibration of a parameter hides, or to distinguish effects."""

    what: str
    title: str
    hidden_by: str


@dataclass(frozen=True)
class NextStep:
    """Something to do next.

    action: diagnose, discover, extend, extend-again, go-on, compare, mend, next, measure, no-measurement, done,
    done-here, none-proposed or check-instrument; config: of the case, quoted for a shell; model: its config and page.
    """

    action: str
    config: str = ""
    model: tuple[str, str] | None = None
    measurement: object = None
    purposes: tuple[Purpose, ...] = ()
    instrument: object = None


@dataclass(frozen=True)
class CaseAnswer:
    """What the top of a page states of one case, as values.

    lines: of the headline, the verdict first; subject: which model the page is about; warning: what forbids using it;
    in_full: the whole verdict; where: the model misses most; stand_in: whether its parameters may compensate for what
    is missing. None of what there is not.
    """

    name: str
    lines: list[object]
    subject: SubjectModel | None
    warning: NotReliable | None
    in_full: object
    falls: bool
    ladder: Picture | None
    error_fall: ErrorFall | None
    to_compare: str
    next_steps: list[NextStep]
    where: WorstZone | None
    sections: SectionPanels
    stand_in: bool


def answer_of(run: Run) -> CaseAnswer:
    """The answer of a run; its pictures are written to run.folder/figures. run.flow is not used."""
    ladder, fall = run.loop.ladder, None if run.loop.ladder is None else error_fall(run.loop.ladder, causes_of(run))
    picture = None
    if ladder is not None and fall is not None and fall.judged:
        picture = published_picture(run, draw_errors(ladder), "ladder", "caption_ladder", ladder)
    return CaseAnswer(
        name=run.case.name,
        lines=headline_lines(run),
        subject=subject_model(run),
        warning=not_reliable(run),
        in_full=run.behind.verdict if run.behind else "",
        falls=ladder is not None and len(ladder.steps) > 1,
        ladder=picture,
        error_fall=fall,
        to_compare=quoted_config(run),
        next_steps=next_steps(run),
        where=None if run.behind is None else worst_zone(run.behind),
        sections=section_panels(run),
        stand_in=bool(run.diagnosis and (run.diagnosis.places or run.diagnosis.steps)),
    )


def quoted_config(run: Run) -> str:
    """Name of the config, quoted for a shell."""
    return shell_line([run.case.source.name])


def headline_lines(run: Run) -> list[object]:
    """A sentence or two in each line: the verdict, what the model still requires, and what limits both; of a model that
    was extended, what was missing before and what is now.
    """
    before, own, posterior = run.before, run.diagnosis, run.posterior
    if before is None and run.behind is None:
        return [posterior_verdict(run.case, posterior)]
    lines = [] if before is None else _stated(before, before.name, True)
    if own is not None:
        law_left = bool(lines) and suspects_a_law_only(own)
        lines += [LawLeft(own.verdict.laws)] if law_left else _stated(own, "", False)
    elif before is None and run.behind is not None:
        lines += _stated(run.behind, run.behind.name, True)
    last, refined = own or run.behind, posterior.refinement
    if last is not None and last.verdict.doubts_the_data:
        return lines
    if bounds := parameters_at_bounds(posterior, symbols_of(run.case)):
        lines.append(bounds)
    if refined is not None and refined.error_model.errors == "stated":
        chi2, freedom = refined.misfit.chi2, refined.misfit.freedom
        lines += [MisfitTooSmall(chi2, freedom)] if is_too_small(chi2, freedom) else []
    return lines


def _stated(found: Diagnosis, model: str, past: bool) -> list[object]:
    return [Headline(found.verdict, model, past), *found.verdict.remaining]


def subject_model(run: Run) -> SubjectModel | None:
    """Which model the page is about; None if it is the one that was diagnosed."""
    ladder = run.loop.ladder
    if ladder is None or (run.before is None and run.behind is run.diagnosis):
        return None
    added = tuple(name for step in ladder.steps for name in step.added if name in run.case.effects)
    return SubjectModel(ladder.steps[0].name, added)


def not_reliable(run: Run) -> NotReliable | None:
    """What forbids using the answer; None if nothing does."""
    posterior, ensemble, found = run.posterior, run.ensemble, run.diagnosis or run.behind
    mismatched = discharge_mismatches(mismatched_discharges(run.case, run.site, run.observations.table))
    law_only = found is not None and found.laws and not (found.places or found.steps)  # the misfit is without the law
    misfit = found is not None and not law_only and found.misfit.p < UNBELIEVED
    misfit = misfit and found is not None and found.verdict.kind != "cannot-tell"
    of_verdict = found is not None and found.verdict.doubts_the_data
    discharges = tuple(mismatched) if found is None or of_verdict else ()
    stated = run.behind is None and not posterior.claimed  # by the headline
    size, members = max(posterior.weighting.effective_size, 1.0), posterior.sample.members
    few = None if stated or posterior.claimed else (size, members)
    tail = posterior.claimed and posterior.weighting.pareto_k > TRUSTED_K_HAT
    failed = failed_of_weighed(ensemble, posterior) if too_many_failed(ensemble, posterior) else None
    mass = None
    if ensemble is not None and not ensemble.by_command and largest_mass_error(ensemble) >= MASS_LIMIT:
        mass = largest_mass_error(ensemble)
    verdict = misfit or bool(discharges and of_verdict)
    parameters = bool((discharges and not of_verdict) or few or tail or failed or mass is not None)
    found_any = verdict or parameters
    return NotReliable(verdict, parameters, misfit, discharges, few, tail, failed, mass) if found_any else None


def error_fall(ladder: ModelComparison, causes: str = "") -> ErrorFall:
    """How far the error falls from the first model to the last; causes: what was added, in words, if that is known."""
    first, last = ladder.steps[0], ladder.steps[-1]
    judged = next((name for name in JUDGED_ON if math.isfinite(getattr(last, name))), "")
    added = list(dict.fromkeys(name for step in ladder.steps[1:] for name in step.added))
    whole = {EffectIdentity.parse(name).key for name in ladder.unclear} >= set(added)
    before, after = (getattr(one, judged) if judged else math.nan for one in (first, last))
    return ErrorFall(
        judged, len(ladder.steps), causes or " and ".join(added) or last.name, before, after, last.noise_floor,
        ladder.unclear, whole, ladder.reason,
    )  # fmt: skip


def causes_of(run: Run) -> str:
    """What the diagnosis of the ladder's first model accepted, in words, if the ladder adds exactly that; else ''."""
    ladder = run.loop.ladder
    known = [one for one in (run.loop.behind, run.diagnosis) if one is not None]
    found = next((one for one in known if ladder and one.name == ladder.steps[0].name), None)
    if ladder is None or found is None:
        return ""
    effects = {EffectIdentity.parse(step.accepted).key for step in found.steps}
    places = {EffectIdentity.at_place(one.effect, one.x, one.y).key for one in found.places}
    added = {name for step in ladder.steps[1:] for name in step.added}
    return accepted_causes(found) if effects | places == added else ""


def next_steps(run: Run) -> list[NextStep]:
    """What to do next, the first thing first."""
    config, found = quoted_config(run), run.behind
    if found is None:
        return [NextStep("diagnose", config)]
    instruments = [NextStep("check-instrument", instrument=one) for one in found.instruments]
    if found.verdict.doubts_the_data:
        return [NextStep("mend", config), *instruments]
    return [*_better_model(run, found, config), *_measurements_worth(run, found, config), *instruments]


def _better_model(run: Run, found: Diagnosis, config: str) -> Iterator[NextStep]:
    """The command that adds what is missing; once the loop has done so, the page of the model that has it."""
    ladder, own = run.loop.ladder, run.diagnosis
    is_last = ladder is None or ladder.steps[-1].name == run.case.name
    if (own or found).law_stands_out and is_last:
        yield NextStep("discover", config)
    if ladder is None:
        if found.steps or found.places:
            yield NextStep("extend", config)
        return
    if own is not None and is_last and (own.steps or own.places):
        yield NextStep("extend-again", config)
    first, last = ladder.steps[0], ladder.steps[-1]
    if len(ladder.steps) > 1 and not is_last:
        yield NextStep("go-on", model=(last.config, run.loop.pages.get(last.name, "")))
    elif len(ladder.steps) > 1 and first.name in run.loop.pages:
        yield NextStep("compare", model=(first.config, run.loop.pages[first.name]))


def _measurements_worth(run: Run, found: Diagnosis, config: str) -> Iterator[NextStep]:
    """What to measure, and what no single measurement would settle."""
    questions, ladder = run.loop.questions, run.loop.ladder
    if questions is None:
        yield NextStep("next", config)
        return
    if all(one.answered for one in questions):
        # What the last model of a ladder lacks or leaves open is not known on the page of another.
        if ladder is not None and ladder.steps[-1].name != run.case.name:
            yield NextStep("done-here", model=(ladder.steps[-1].name, ""))
        elif questions == () and found.verdict.kind != "nothing-missing":
            yield NextStep("none-proposed")
        else:
            yield NextStep("done")
    settled = [one for one in questions if one.useful]
    best = list({one.useful[0].name: one.useful[0] for one in settled}.values())[:QUESTIONS_SHOWN]
    for measurement in best:
        purposes = tuple(_purpose(one) for one in settled if one.useful[0].name == measurement.name)
        yield NextStep("measure", measurement=measurement, purposes=purposes)
    left = tuple(_purpose(one) for one in questions if one not in settled and not one.answered)
    if left:
        yield NextStep("no-measurement", purposes=left)


def _purpose(question: Question) -> Purpose:
    about = question.about
    if not isinstance(about, HiddenEffect):
        return Purpose(question.tells_apart, "", "")
    known = library().get(EffectIdentity.parse(about.name).name)
    return Purpose(about.name, known.title if known is not None else "", about.parameter)
