"""case -> what to measure next: which section, gauge or discharge would separate what the data at hand cannot."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vegglue.calibration.baseline import Baseline, baseline, for_prediction
from vegglue.calibration.candidates import Candidate
from vegglue.calibration.detection import detected_length
from vegglue.case.parameter_space import z_at
from vegglue.case.schema import Case
from vegglue.decision_constants import constants
from vegglue.diagnosis.child_config import candidate_at, candidate_named, with_additions
from vegglue.diagnosis.comparison import excluded_by
from vegglue.diagnosis.next_measurement import Explanation, MeasurementWorth, worth_of_measurements
from vegglue.effects.grammar import LAWS
from vegglue.engine.model import with_compilation
from vegglue.errors import InputError
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.causes import CandidateEffect, CandidateLaw, CandidateLaws
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.loop_results import (
    HiddenEffect,
    HiddenLaw,
    OneOfRivals,
    ProposedMeasurement,
    Question,
    RivalEffects,
    Subject,
    questions_that_fit,
    write_questions,
)
from vegglue.wording.phases import WEIGHING
from vegglue.workflow.case_run import CaseRun, calibrated, case_run
from vegglue.workflow.diagnose import diagnose

# Effects hidden behind calibration that measurements are proposed for.
HIDDEN = 4
# Rivals from which on each is also a question by itself: of two, one is separated from the other as the other from it.
FEWEST_PARTED = 3
# Laws that one question is about at most: of more, two that are alike decide what no measurement answers.
MOST_LAWS = 3


@one_thread()
def next_measurement(
    case: Case | CaseRun,
    *,
    between: Sequence[str] = (),
    runs: Path | str = "runs",
    jobs: int = -1,
    watch: Watch = silent,
) -> list[Question]:
    """Rank what could be measured next by what it gains for an hour of field work.

    Questions that follow from the diagnosis are kept in questions.json, and read there for exactly this case.

    Parameters
    ----------
    case : Case or CaseRun
    between : sequence of str
        Effects or laws to separate. If empty: what the diagnosis could not separate, step by step, and a place that is
        more probable; the laws that it could be, if a law stands out; or the strongest effects that it could not test,
        each at a plausible size, if it found nothing.
    runs : Path or str
        Folder that holds the folders of runs.
    jobs : int
        Processes, -1 for one on each core. Results do not depend on it.
    watch : callable
        Gets a `Progress` at each step.

    Returns
    -------
    list of Question
        Empty if nothing is left to separate.

    Raises
    ------
    InputError
        For a name that is not in the diagnosis.
    """
    run = case_run(case, runs, jobs, watch)
    case, wanted = run.case, run.config_hash
    found = diagnose(run)
    # Hours and errors that are planned are in no hash: with them questions are weighed again.
    kept = None if between or case.planned is not None else questions_that_fit(run.folder, wanted)
    if kept is not None:
        return [*kept]
    by_name = [one.name for one in found.candidate_effects]
    possible = [*by_name, *_laws_by_name(found)]
    unknown = [name for name in between if name not in possible]
    if unknown:
        raise InputError(f"--between: `{unknown[0]}` is not among the effects of the diagnosis: {', '.join(possible)}.")
    asked = _asked(case, found, list(dict.fromkeys(between))) if between else what_is_open(case, found)
    questions: list[Question] = []
    if asked:
        with at_most(run.jobs):
            run.watch(Progress(with_compilation(f"calibrating {case.name}")))
            base = with_places(calibrated(run, excluded_by(found)), found)
            run.watch(Progress(WEIGHING))
            worths = worth_of_measurements(base.model, base.noise, base.fitted.point, [one for _, one in asked])
        # D^2 of an effect that passes the alarm over all effects 19 times of 20.
        seen = _detected_length(found) ** 2
        for (about, rivals), worth in zip(asked, worths, strict=True):
            answers = questions_about(about, rivals, worth)
            questions += [replace(one, seen_from=seen) if isinstance(about, HiddenEffect) else one for one in answers]
    if not between:
        write_questions(run.folder, questions, wanted)
    return questions


def _detected_length(found: Diagnosis) -> float:
    """Length of a trace that passes the alarm over all effects 19 times of 20 [standard errors]."""
    return float(detected_length(np.array(found.first_screening.threshold), constants().detected_chance))


def with_places(base: Baseline, found: Diagnosis) -> Baseline:
    """The calibrated model with the places that its diagnosis found, as that calls untestable what hides beside them.

    Parameters
    ----------
    found : Diagnosis
        From where it ended the model is calibrated.

    Returns
    -------
    Baseline
        The same without places.
    """
    if not found.places:
        return base
    case = base.model.case
    child = with_additions(case, [(candidate_at(case, place), place.shapes) for place in found.places])
    known = z_at(child, {name: np.array([found.parameters.last[name][0]]) for name in child.parameters})[0]
    return for_prediction(baseline(replace(base.model, case=child), known))


def questions_about(
    about: Subject, rivals: Sequence[Explanation], worths: Sequence[MeasurementWorth]
) -> list[Question]:
    """A question with what could be measured for it.

    Parameters
    ----------
    rivals : sequence of (Candidate, dict of float, float)
        Effect, values of its shapes, gain.
    worths : sequence of MeasurementWorth
        Of these rivals.

    Returns
    -------
    list of Question
        If nothing answers it and there are FEWEST_PARTED rivals or more, those that something separates from all others
        follow.
    """
    whole = Question(about, _ranked(_proposed(one, one.now.min(), one.then.min()) for one in worths))
    if whole.useful or len(rivals) < FEWEST_PARTED:
        return [whole]
    names = [candidate.name for candidate, _, _ in rivals]
    single = [
        Question(
            OneOfRivals(name, tuple(other for other in names if other != name)),
            _ranked(_proposed(one, one.now[i], one.then[i]) for one in worths),
        )
        for i, name in enumerate(names)
    ]
    return [whole, *(one for one in single if one.useful)]


def _ranked(proposed: Iterable[ProposedMeasurement]) -> tuple[ProposedMeasurement, ...]:
    return tuple(sorted(proposed, key=lambda one: -one.per_hour))


def _proposed(one: MeasurementWorth, now: float, then: float) -> ProposedMeasurement:
    plan = one.plan
    return ProposedMeasurement(plan.name, plan.experiment, plan.x, plan.rows.size, plan.hours, float(now), float(then))


def what_is_open(case: Case, found: Diagnosis) -> list[tuple[Subject, list[Explanation]]]:
    """What a diagnosis leaves open.

    Returns
    -------
    list of (Subject, list of (Candidate, dict of float, float))
        The rivals of each question; none of data that it doubts.
    """
    if found.verdict.doubts_the_data:
        return []
    questions: list[tuple[Subject, list[Explanation]]] = []
    for step in (one for one in found.steps if len(one.rivals) > 1 or one.likelier_place):
        names, rivals = [*step.rivals], rivals_of(case, found, step.rivals)
        if step.likelier_place:
            place = step.places[step.likelier_place]
            unlisted = candidate_at(case, place)
            names.append(unlisted.name)
            rivals.append((unlisted, place.shapes, unlisted.effect.amplitude.gain(place.amplitude)))
        questions.append((RivalEffects(tuple(names)), rivals))
    if found.steps:
        return questions
    laws = laws_to_tell_apart(found.laws)
    if len(laws) > 1:
        return _asked(case, found, laws)

    def raw_trace(one: CandidateEffect) -> float:
        """Length of the trace of a plausible amplitude before projection [standard errors]."""
        amplitude = candidate_named(case, found.predictions.station, one.name).effect.amplitude
        gain = amplitude.gain(amplitude.off + one.detectability.smallest)
        return _detected_length(found) * amplitude.plausible_gain / gain / max(one.detectability.visibility, 1e-6)

    # What calibration hides best, of all that would leave a trace without it.
    seen = found.verdict.significant_effects
    hidden = [one for one in found.candidate_effects if not one.detectability.testable and one.name not in seen]
    strongest = sorted(hidden, key=lambda one: -raw_trace(one))[:HIDDEN]
    return [question for one in strongest for question in _asked(case, found, [one.name])]


def _asked(case: Case, found: Diagnosis, names: Sequence[str]) -> list[tuple[Subject, list[Explanation]]]:
    """One question: to separate effects, or one of a plausible size from what calibration absorbs."""
    if len(names) > 1:
        return [(RivalEffects(tuple(names)), rivals_of(case, found, names))]
    if names[0] in _laws_by_name(found):
        return [(HiddenLaw(names[0]), rivals_of(case, found, names))]
    single = next(one for one in found.candidate_effects if one.name == names[0])
    return [(HiddenEffect(single.name, single.detectability.confounder), rivals_of(case, found, names, plausible=True))]


def laws_to_tell_apart(laws: CandidateLaws | None) -> list[str]:
    """Laws that could be missing, the likeliest of each term and quantity: traces of its other forms hardly differ."""
    likeliest: dict[tuple[str, str], str] = {}
    for one in () if laws is None else laws.laws:
        likeliest.setdefault((one.term, one.quantity), one.name)
    return list(likeliest.values())[:MOST_LAWS]


def _laws_by_name(found: Diagnosis) -> dict[str, CandidateLaw]:
    return {} if found.laws is None else {one.name: one for one in found.laws.laws}


def rivals_of(case: Case, found: Diagnosis, names: Sequence[str], plausible: bool = False) -> list[Explanation]:
    """Effects and laws of a diagnosis as explanations.

    Parameters
    ----------
    plausible : bool
        Whether effects have a plausible size, else the one that was found; laws have that to first order.

    Returns
    -------
    list of (Candidate, dict of float, float)
        Effect, values of its shapes [unit of each], gain (amplitude - off)^power.
    """
    rivals: list[Explanation] = []
    for candidate_effect in (one for one in found.candidate_effects if one.name in names):
        candidate = candidate_named(case, found.predictions.station, candidate_effect.name)
        amplitude = candidate.effect.amplitude
        gain = amplitude.plausible_gain if plausible else amplitude.gain(candidate_effect.amplitude.value)
        rivals.append((candidate, candidate_effect.shapes, gain))
    for name, law in _laws_by_name(found).items():
        if name in names:
            rivals.append((Candidate(LAWS[name].effect, scale=law.scale), law.shapes, law.strength))
    return rivals
