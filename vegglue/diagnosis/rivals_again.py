"""Effects accepted earlier, compared again with everything else once something later is in the model.

Where two things are missing, what explains the first may depend on the second: an effect that seemed sure is one of
several, or another leads. The whole competition is held again without the effect, with what was accepted since.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import candidate_in_case, effect_entry
from vegglue.calibration.residual_screening import screen
from vegglue.case.schema import Case
from vegglue.diagnosis.competition import Hypothesis, hypotheses_of
from vegglue.diagnosis.refits import Refit, calibrated_with, without_effect
from vegglue.diagnosis.rivals import step_found
from vegglue.progress import Progress, Watch
from vegglue.results.causes import CandidateEffect, Step

# The model, the steps and the candidate_effects, as they are now.
Again = tuple[Baseline, tuple[Step, ...], dict[str, CandidateEffect]]


def with_rivals_again(
    base: Baseline,
    steps: Sequence[Step],
    flagged: tuple[int, ...],
    candidate_effects: Mapping[str, CandidateEffect],
    watch: Watch,
) -> Again:
    """The model with the best rival of every step, the steps with the chances as they are now, and the effects with the
    amplitudes of their refits.

    steps: of effects that were accepted before what was last: an effect, something at a place, an instrument; flagged:
    readings set aside, indices among the used stations.
    """
    kept, known = list[Step](), dict(candidate_effects)
    for step in steps:
        base, step, hypotheses = _again(base, step, flagged, watch)
        known |= refitted(hypotheses, known)
        kept.append(step)
    return base, tuple(kept), known


def refitted(
    hypotheses: Sequence[Hypothesis], candidate_effects: Mapping[str, CandidateEffect]
) -> dict[str, CandidateEffect]:
    """The listed effects that were refitted, with the amplitudes of their refits."""
    return {
        one.name: one.what.of(candidate_effects[one.name])
        for one in hypotheses
        if one.kind == "effect" and one.name in candidate_effects and isinstance(one.what, Refit)
    }


def _again(
    base: Baseline, step: Step, flagged: tuple[int, ...], watch: Watch
) -> tuple[Baseline, Step, Sequence[Hypothesis]]:
    """One step and what competed, the best at the values of its shapes that it competed with; as it was where no flow
    is found without its effect, or with any.
    """
    watch(Progress(f"comparing {step.accepted} again with all else"))
    less = without_effect(base, candidate_in_case(base.model.case, step.accepted))
    if less is None:
        return base, step, ()
    screening = screen(less, flagged)
    hypotheses = hypotheses_of(screening, watch)
    listed = [j for j, one in enumerate(hypotheses) if one.kind == "effect"]
    if step.accepted not in [hypotheses[j].name for j in listed]:
        return base, step, ()
    best = hypotheses[listed[0]].what
    assert isinstance(best, Refit)
    if not _is_at_work(base.model.case, best):
        further = calibrated_with(less, best)
        if further is None:
            return base, step, ()
        base = further
    again = step_found(screening, hypotheses, listed[0], base, step.p_family)
    return base, replace(again, chi2_before=step.chi2_before, chi2_after=step.chi2_after), hypotheses


def _is_at_work(case: Case, refit: Refit) -> bool:
    """Whether an effect acts in the case as it was refitted: at other values of its shapes it is another."""
    one = refit.candidate
    return case.effects.get(one.key) == effect_entry(one, one.parameter, refit.shapes)
