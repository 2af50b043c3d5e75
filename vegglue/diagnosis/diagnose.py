"""From misfit to missing effect.

The model is calibrated, and its residual is screened by score tests of all that could be missing (Rao 1948,
doi:10.1017/S0305004100023987). While an alarm is sounded (`evidence`), listed effects, places and instruments
compete by their evidence (`competition`), and the best is taken into the model or its data set aside; what was accepted
earlier and is no longer needed is dropped; and the residual is screened again. The verdict is drawn from what was found
and from the last screening.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, kept_baseline, log_evidence
from vegglue.calibration.candidates import Instrument, candidate_in_case, error_columns
from vegglue.calibration.fit import chi2, fit, interval95
from vegglue.calibration.noise import with_unknown_errors
from vegglue.calibration.residual_screening import Screening, screen
from vegglue.calibration.score_test import alarm_p
from vegglue.decision_constants import constants
from vegglue.diagnosis.candidate_effects import candidate_effects_of, laws_beside
from vegglue.diagnosis.competition import (
    Hypothesis,
    What,
    chance_of_a_place,
    chances_of,
    chosen_hypothesis,
    hypotheses_of,
    nearly_as_likely,
    tempered_probabilities,
)
from vegglue.diagnosis.conclusion import assemble_diagnosis
from vegglue.diagnosis.refits import Refit, calibrated_with, pruned
from vegglue.diagnosis.search_state import (
    PriorWeight,
    SearchState,
    Undecided,
    anomaly_found,
    followed_further,
    instrument_found,
    place_followed_further,
    refitted,
    step_found,
    undecided_of,
    with_rivals_again,
)
from vegglue.engine.interface import Model
from vegglue.engine.model import with_compilation
from vegglue.errors import InputError
from vegglue.measurements.plausibility import implausible_values
from vegglue.parallel import in_threads, submit
from vegglue.progress import Progress, Watch, silent
from vegglue.results.causes import CandidateEffect, Step
from vegglue.results.diagnosis import Diagnosis
from vegglue.wording.sentences import sentence

# Effects and places that are accepted at most, and instruments.
MOST_ACCEPTED, MOST_INSTRUMENTS = 3, 6


@dataclass(frozen=True)
class SearchBranch:
    """What is found with one hypothesis more, what that is, the model that follows, and its screening where it is at
    hand.
    """

    what: What
    found: SearchState
    base: Baseline
    screening: Screening | None = None


def diagnose_model(model: Model, watch: Watch = silent, unseen: Model | None = None) -> Diagnosis:
    """Find out what a calibrated model lacks, from a start that hangs on nothing but the case and its data.

    unseen: the model at measurements that no calibration sees, which silence has to agree with.
    Errors: InputError when the model finds no flow, or a station has no standard error.
    """
    watch(Progress(with_compilation("calibrating the model as it is")))
    implausible = tuple(implausible_values(model.case, model.site, model.station))
    try:
        base = kept_baseline(model)
    except InputError as error:
        if not implausible:
            raise
        why = " ".join(map(sentence, implausible))
        raise InputError(f"{model.case.name}: no flow comes near what was measured. {why}") from error
    watch(Progress("looking for what is missing"))
    first = screening = screen(base)
    found, candidate_effects = SearchState(implausible=implausible), dict[str, CandidateEffect]()
    laws = partial(laws_beside, first) if implausible else submit(laws_beside, first)
    while True:
        tested = candidate_effects_of(screening)
        candidate_effects = tested | _kept(candidate_effects, tested)
        found = _with_alarm(screening, found)
        if found.implausible or not found.alarmed:
            break
        hypotheses = hypotheses_of(screening, watch)
        candidate_effects |= refitted(hypotheses, tested)
        branch = _best_branch(screening, hypotheses, found, watch)
        if isinstance(branch, Undecided):
            found = replace(found, undecided=branch)
            break
        found, base = branch.found, branch.base
        if branch.what == "instrument":  # amplitudes that were calibrated with these readings are no longer true
            candidate_effects = tested | {step.accepted: candidate_effects[step.accepted] for step in found.steps}
        newest = 1 if branch.what == "effect" else 0
        earlier, last = found.steps[: len(found.steps) - newest], found.steps[len(found.steps) - newest :]
        base, again, candidate_effects = with_rivals_again(base, earlier, found.flagged, candidate_effects, watch)
        found = _with_steps(found, (*again, *last))
        watch(Progress("looking for what is missing with it"))
        at_hand = branch.screening if base is branch.base else None
        screening = at_hand or screen(base, found.flagged)
        for step in found.steps:
            candidate_effects[step.accepted] = _in_model(candidate_effects[step.accepted], screening.base)
    return assemble_diagnosis(first, screening, found, candidate_effects, unseen, laws)


def _with_alarm(screening: Screening, found: SearchState) -> SearchState:
    rate = constants().false_alarm_rate * (
        constants().later_alarm_share if found.accepted or found.instruments else 1.0
    )
    return replace(found, p=alarm_p(screening.kinds, screening.errors, 1, found.slack), rate=rate)


def _best_branch(
    screening: Screening, hypotheses: Sequence[Hypothesis], found: SearchState, watch: Watch
) -> SearchBranch | Undecided:
    """What is found with the likeliest hypothesis, and the model that follows; undecided when it leads to nothing.

    Those that are nearly as likely are followed one step further, on the case's own grid and with the best that could
    come next, see `hypothesis_choice`.
    """
    rivals = nearly_as_likely(hypotheses)
    branches = in_threads(_branch, [(screening, hypotheses, j, found, watch) for j in rivals])
    possible = [(j, one) for j, one in zip(rivals, branches, strict=True) if one is not None]
    if len(possible) < 2:
        return possible[0][1] if possible else Undecided(tuple(hypotheses), tuple(chances_of(hypotheses)))
    ends = in_threads(_screened, [(one,) for _, one in possible])
    score = np.array([_prospect(one, found) for one in ends]) - log_evidence(screening.base)
    followed = [hypotheses[j] for j, _ in possible]
    undecided = undecided_of(hypotheses, [one.name for one in followed], tempered_probabilities(score))
    at_a_place = chance_of_a_place(hypotheses, undecided.chances)
    best = chosen_hypothesis([one.what for one in ends], score, at_a_place)
    return undecided if best is None else _told_beside(ends[best], followed, best, score)


def _told_beside(branch: SearchBranch, followed: Sequence[Hypothesis], taken: int, evidence: Array) -> SearchBranch:
    """What was taken: a listed effect with the chances of all that was followed, a place with its odds against them.

    evidence (k,): ln of that of each that was followed [-].
    """
    found = branch.found
    if branch.what == "effect":
        *earlier, step = found.steps
        step = followed_further(step, [one.name for one in followed], tempered_probabilities(evidence))
        return replace(branch, found=replace(found, steps=(*earlier, step)))
    if branch.what == "place":
        *before, place = found.places
        place = place_followed_further(place, followed, taken, evidence)
        return replace(branch, found=replace(found, places=(*before, place)))
    return branch


def _screened(one: SearchBranch) -> SearchBranch:
    return replace(one, screening=screen(one.base, one.found.flagged))


def _prospect(one: SearchBranch, found: SearchState) -> float:
    """ln evidence of a model and of the best that could come next, to first order, less that of the prior so far; of a
    place as it competed, without the error of its shape, which is there for what is found beside it.
    """
    assert one.screening is not None
    further = 0.0
    if _with_alarm(one.screening, one.found).alarmed:
        further = max(0.0, *(kind.total for kind in one.screening.kinds))
    before = found.log_prior + found.of_shape
    return log_evidence(one.base) + one.found.log_prior + one.found.of_shape - before + further


def _branch(
    screening: Screening, hypotheses: Sequence[Hypothesis], j: int, found: SearchState, watch: Watch
) -> SearchBranch | None:
    """What is found with one hypothesis, and the model that follows; None when there are enough, or no flow with it."""
    one = hypotheses[j]
    if isinstance(one.what, Instrument):
        enough = len(found.instruments) == MOST_INSTRUMENTS
        return None if enough else _without_instrument(screening, one, one.what, found, watch)
    return None if found.accepted == MOST_ACCEPTED else _with_accepted(screening, hypotheses, j, one.what, found, watch)


def _without_instrument(
    screening: Screening, best: Hypothesis, instrument: Instrument, found: SearchState, watch: Watch
) -> SearchBranch | None:
    """One instrument set aside, and the model calibrated without what its readings share; None when it explains less
    than nothing does.
    """
    if best.log_evidence < 0.0:
        return None
    watch(Progress(f"setting aside a {best.kind} that is off"))
    base, readings = screening.base, instrument.readings
    noise = with_unknown_errors(base.noise, error_columns(instrument, base.noise.value))
    flagged = (*found.flagged, *(row for row in readings if row not in found.flagged))
    faulty = (*found.instruments, instrument_found(screening, best, instrument))
    branch = replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))
    # Its errors are all but free in the covariance: their prior is charged here, as it was in the competition.
    charge = PriorWeight(best.name, 0.0, best.log_evidence - (log_evidence(branch) - log_evidence(base)))
    found = replace(found, instruments=faulty, flagged=flagged, prior_weights=(*found.prior_weights, charge))
    return SearchBranch("instrument", found, branch)


def _with_accepted(
    screening: Screening, hypotheses: Sequence[Hypothesis], j: int, refit: Refit, found: SearchState, watch: Watch
) -> SearchBranch | None:
    """An effect or place accepted, and the model with it; None when it explains less than nothing does, has so many
    rivals that they say nothing, or no flow is found with it.
    """
    one = hypotheses[j]
    if one.log_evidence < 0.0:
        return None
    watch(Progress(f"calibrating with {one.name}"))
    further = calibrated_with(screening.base, refit)
    if further is None:
        return None
    before = chi2(screening.base.noise, screening.base.fitted.point)
    log_prior = one.log_evidence - refit.log_factor
    if one.kind != "effect":
        charge = PriorWeight(one.name, before - further.fitted.chi2, log_prior)
        lost = _without_error_of_shape(screening.base, further) - log_evidence(further)
        places = (*found.places, anomaly_found(screening, hypotheses, j, refit))
        found = replace(
            found, places=places, prior_weights=(*found.prior_weights, charge), of_shape=found.of_shape + lost
        )
        return SearchBranch("place", found, further)
    step = step_found(screening, hypotheses, j, further, found.p)
    if found.accepted and len(step.groups) > constants().most_groups:
        return None
    further, unneeded = pruned(further, found.effects, watch)
    return SearchBranch("effect", _with_step(found, step, unneeded, before - further.fitted.chi2, log_prior), further)


def _with_steps(found: SearchState, steps: tuple[Step, ...]) -> SearchState:
    """The same steps with other rivals in the model, which keep the prior_weights of those that they replace."""
    now = {before.accepted: after.accepted for before, after in zip(found.steps, steps, strict=True)}
    prior_weights = tuple(replace(one, name=now.get(one.name, one.name)) for one in found.prior_weights)
    return replace(found, steps=steps, prior_weights=prior_weights)


def _with_step(
    found: SearchState, step: Step, unneeded: Sequence[str], explained: float, log_prior: float
) -> SearchState:
    """A listed effect more, which explains besides what those explained that it makes unneeded."""
    kept = tuple(one for one in found.steps if one.accepted not in unneeded)
    prior_weights = [one for one in found.prior_weights if one.name not in unneeded]
    earlier = sum(one.explained for one in found.prior_weights if one.name in unneeded)
    charge = PriorWeight(step.accepted, explained + earlier, log_prior)
    return replace(found, steps=(*kept, step), prior_weights=(*prior_weights, charge))


def _without_error_of_shape(before: Baseline, further: Baseline) -> float:
    """ln evidence of a model with a place more under the errors that the model had before."""
    fitted = fit(further.model, before.noise, further.fitted.point)
    return log_evidence(replace(further, noise=before.noise, fitted=fitted))


def _kept(
    candidate_effects: Mapping[str, CandidateEffect], tested: Mapping[str, CandidateEffect]
) -> dict[str, CandidateEffect]:
    """Those of which earlier rounds say more than the last test: refitted, or accepted and so tested no more."""
    return {name: one for name, one in candidate_effects.items() if one.amplitude.refitted or name not in tested}


def _in_model(candidate_effect: CandidateEffect, base: Baseline) -> CandidateEffect:
    """An accepted candidate_effect with its amplitude in the model as it is now."""
    one = candidate_in_case(base.model.case, candidate_effect.name)
    value, low, high = interval95(base.model, base.fitted, one.parameter)
    return replace(candidate_effect, amplitude=replace(candidate_effect.amplitude, value=value, interval95=(low, high)))
