"""Rivals of effects accepted earlier, compared again with what was accepted later in the model.

Where the data could not tell two effects apart while something else was missing too, they may now. Their evidence is
that of `competition`, and the settings of an effect are charged as there. What is not compared keeps the chance that it
had: a rival of which no flow is found, and what else it may be, a place or an instrument.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import logsumexp

from vegglue.calibration.baseline import Baseline, SearchModel, search_model
from vegglue.calibration.model_error import unlisted_in
from vegglue.diagnosis.refits import RefitTrial, calibrated_with, refits_of, start_with, without_effect
from vegglue.diagnosis.rivals import shared_anew, with_chances
from vegglue.diagnosis.tempered_chances import tempered_chances
from vegglue.engine.interface import responses
from vegglue.progress import Progress, Watch
from vegglue.results.diagnosis import Step, Suspect
from vegglue.screening import score_test
from vegglue.screening.candidates import Candidate, candidate_in_case, candidates_of, cause_of
from vegglue.screening.evidence import log_factors


def with_rivals_again(
    base: Baseline, steps: Sequence[Step], suspects: Mapping[str, Suspect], watch: Watch
) -> tuple[Baseline, tuple[Step, ...]]:
    """The model with the best rival of every step, and the steps with the chances as they are now.

    steps: of effects that were accepted before what was last, be that an effect or something at a place.
    """
    kept: list[Step] = []
    for step in steps:
        found = _again(base, step, suspects, watch) if len(step.rivals) > 1 else None
        base, step = found or (base, step)
        kept.append(step)
    return base, tuple(kept)


def _again(base: Baseline, step: Step, suspects: Mapping[str, Suspect], watch: Watch) -> tuple[Baseline, Step] | None:
    """One step; None when no flow is found without its effect, or with it again."""
    watch(Progress(f"comparing {', '.join(step.rivals)} again"))
    less = without_effect(base, candidate_in_case(base.model.case, step.accepted))
    if less is None:
        return None
    search, trials = search_model(less), _trials_of_rivals(less, step, suspects)
    found = {one.candidate.name: one for one in refits_of(search, trials) if one is not None}
    if step.accepted not in found:
        return None
    evidence = np.array([one.log_factor + settings_charge(search, one.candidate) for one in found.values()])
    before = {one.candidate.name: step.chance[one.candidate.name] for one in trials} | _others_left(base, step)
    told = shared_anew(before, [*found], tempered_chances(evidence))
    best, whole = [*found][int(np.argmax(evidence))], sum(told.values())
    again = with_chances(step, best, {name: p / whole for name, p in told.items()})
    if best == step.accepted:
        return base, again
    further = calibrated_with(less, found[best])
    return None if further is None else (further, again)


def _others_left(base: Baseline, step: Step) -> dict[str, float]:
    """The chances of what else it may be, by name: of places while nothing acts at a place by the same term, and of
    instruments while none is set aside, which may be what was accepted since.
    """
    acting, aside = {one.term for one in unlisted_in(base.model.case)}, bool(base.noise.unknown.size)
    gone = {name for name in step.others if (step.places[name].term in acting if name in step.places else aside)}
    return {name: chance for name, chance in step.others.items() if name not in gone}


def _trials_of_rivals(less: Baseline, step: Step, suspects: Mapping[str, Suspect]) -> list[RefitTrial]:
    """The rivals, each from the size it had, in the model without the effect that was accepted.

    A rival that a later step accepted acts already, and is none any more.
    """
    case, z = less.model.case, less.fitted.point.z
    possible = {one.name: one for one in candidates_of(case, less.model.station)}
    trials = []
    for name in step.rivals:
        if name not in possible:
            continue
        one, suspect = possible[name], suspects[name]
        gain = one.amplitude.gain(suspect.amplitude.value)
        trials.append(RefitTrial(one, suspect.shapes, (start_with(case, one, suspect.shapes, z, gain),)))
    return trials


def settings_charge(search: SearchModel, one: Candidate) -> float:
    """ln of the mean over the settings of an effect of B, over the largest [-]: what their choice costs, to first order
    as in `competition`; at least -ln of their number.
    """
    settings = one.settings()
    if len(settings) == 1:
        return 0.0
    model, noise, point = search.model, search.noise, search.point
    traces = responses(model, point, [cause_of(model.case, one, shapes) for shapes in settings])
    slope, residual = noise.whiten(noise.used(point.slope)), noise.whiten(noise.residual(point.prediction))
    projected = score_test.project(slope, residual, point.z, noise.whiten(noise.used(traces)))
    score = score_test.scores(projected, np.full(len(settings), one.amplitude.only_sign))
    factors = log_factors(score, one.amplitude.plausible_gain * projected.length)
    return float(logsumexp(factors) - factors.max() - np.log(len(settings)))
