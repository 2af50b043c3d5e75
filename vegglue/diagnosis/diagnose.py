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
from vegglue.diagnosis.competition import (
    Contender,
    chances_of,
    contenders_of,
    tempered_chances,
)
from vegglue.diagnosis.conclusion import concluded
from vegglue.diagnosis.contender_choice import What, chance_of_a_place, chosen_contender, nearly_as_likely
from vegglue.diagnosis.findings import Charge, Findings, Undecided
from vegglue.diagnosis.refits import Refit, calibrated_with, pruned
from vegglue.diagnosis.rivals import (
    followed_further,
    instrument_found,
    location_found,
    place_followed_further,
    step_found,
    undecided_of,
)
from vegglue.diagnosis.rivals_again import refitted, with_rivals_again
from vegglue.diagnosis.suspects import suspects_of
from vegglue.diagnosis.unlisted_laws import laws_beside
from vegglue.engine.first_use import with_compilation
from vegglue.engine.interface import Model
from vegglue.errors import InputError
from vegglue.measurements.plausibility import implausible_values
from vegglue.parallel import begun, in_threads
from vegglue.progress import Progress, Watch, silent
from vegglue.results.diagnosis import Diagnosis, Step, Suspect
from vegglue.wording.sentences import sentence

# Effects and places that are accepted at most, and instruments.
MOST_ACCEPTED, MOST_INSTRUMENTS = 3, 6


@dataclass(frozen=True)
class Following:
    """What is found with one contender more, what that is, the model that follows, and its screening where it is at
    hand.
    """

    what: What
    found: Findings
    base: Baseline
    screening: Screening | None = None


def diagnose_model(model: Model, watch: Watch = silent, unseen: Model | None = None) -> Diagnosis:
    """Find out what a calibrated model lacks, from a start that hangs on nothing but the case and its data.

    unseen: the model at measurements that no calibration sees, which silence has to agree with.
    Errors: InputError when the model finds no flow, or a station has no standard error.
    """
    watch(Progress(with_compilation("calibrating the model as it is")))
    absurd = tuple(map(sentence, implausible_values(model.case, model.site, model.station)))
    base = _calibrated_unless_absurd(model, absurd)
    watch(Progress("looking for what is missing"))
    first = screening = screen(base)
    found, suspects = Findings(absurd=absurd), dict[str, Suspect]()
    laws = partial(laws_beside, first) if absurd else begun(laws_beside, first)
    while True:
        tested = suspects_of(screening)
        suspects = tested | _kept(suspects, tested)
        found = _with_alarm(screening, found)
        if found.absurd or not found.alarmed:
            break
        contenders = contenders_of(screening, watch)
        suspects |= refitted(contenders, tested)
        following = _following(screening, contenders, found, watch)
        if isinstance(following, Undecided):
            found = replace(found, undecided=following)
            break
        found, base = following.found, following.base
        if following.what == "instrument":  # amplitudes that were calibrated with these readings are no longer true
            suspects = tested | {step.accepted: suspects[step.accepted] for step in found.steps}
        newest = 1 if following.what == "effect" else 0
        earlier, last = found.steps[: len(found.steps) - newest], found.steps[len(found.steps) - newest :]
        base, again, suspects = with_rivals_again(base, earlier, found.flagged, suspects, watch)
        found = _with_steps(found, (*again, *last))
        watch(Progress("looking for what is missing with it"))
        at_hand = following.screening if base is following.base else None
        screening = at_hand or screen(base, found.flagged)
        for step in found.steps:
            suspects[step.accepted] = _in_model(suspects[step.accepted], screening.base)
    return concluded(first, screening, found, suspects, unseen, laws)


def _calibrated_unless_absurd(model: Model, absurd: Sequence[str]) -> Baseline:
    """The calibrated model. Errors: InputError, which tells of absurd values first: no flow may come near them."""
    try:
        return kept_baseline(model)
    except InputError as error:
        if not absurd:
            raise
        raise InputError(f"{model.case.name}: no flow comes near what was measured. {' '.join(absurd)}") from error


def _with_alarm(screening: Screening, found: Findings) -> Findings:
    rate = constants().false_alarm_rate * (
        constants().later_alarm_share if found.accepted or found.instruments else 1.0
    )
    return replace(found, p=alarm_p(screening.kinds, screening.errors, 1, found.slack), rate=rate)


def _following(
    screening: Screening, contenders: Sequence[Contender], found: Findings, watch: Watch
) -> Following | Undecided:
    """What is found with the likeliest contender, and the model that follows; undecided when it leads to nothing.

    Those that are nearly as likely are followed one step further, on the case's own grid and with the best that could
    come next, see `contender_choice`.
    """
    rivals = nearly_as_likely(contenders)
    branches = in_threads(_branch, [(screening, contenders, j, found, watch) for j in rivals])
    possible = [(j, one) for j, one in zip(rivals, branches, strict=True) if one is not None]
    if len(possible) < 2:
        return possible[0][1] if possible else Undecided(tuple(contenders), tuple(chances_of(contenders)))
    ends = in_threads(_screened, [(one,) for _, one in possible])
    score = np.array([_prospect(one, found) for one in ends]) - log_evidence(screening.base)
    followed = [contenders[j] for j, _ in possible]
    undecided = undecided_of(contenders, [one.name for one in followed], tempered_chances(score))
    at_a_place = chance_of_a_place(contenders, undecided.chances)
    best = chosen_contender([one.what for one in ends], score, at_a_place)
    return undecided if best is None else _told_beside(ends[best], followed, best, score)


def _told_beside(following: Following, followed: Sequence[Contender], taken: int, evidence: Array) -> Following:
    """What was taken: a listed effect with the chances of all that was followed, a place with its odds against them.

    evidence (k,): ln of that of each that was followed [-].
    """
    found = following.found
    if following.what == "effect":
        *earlier, step = found.steps
        step = followed_further(step, [one.name for one in followed], tempered_chances(evidence))
        return replace(following, found=replace(found, steps=(*earlier, step)))
    if following.what == "place":
        *before, place = found.places
        place = place_followed_further(place, followed, taken, evidence)
        return replace(following, found=replace(found, places=(*before, place)))
    return following


def _screened(one: Following) -> Following:
    return replace(one, screening=screen(one.base, one.found.flagged))


def _prospect(one: Following, found: Findings) -> float:
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
    screening: Screening, contenders: Sequence[Contender], j: int, found: Findings, watch: Watch
) -> Following | None:
    """What is found with one contender, and the model that follows; None when there are enough, or no flow with it."""
    one = contenders[j]
    if isinstance(one.what, Instrument):
        enough = len(found.instruments) == MOST_INSTRUMENTS
        return None if enough else _without_instrument(screening, one, one.what, found, watch)
    return None if found.accepted == MOST_ACCEPTED else _with_accepted(screening, contenders, j, one.what, found, watch)


def _without_instrument(
    screening: Screening, best: Contender, instrument: Instrument, found: Findings, watch: Watch
) -> Following | None:
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
    following = replace(base, noise=noise, fitted=fit(base.model, noise, base.fitted.point))
    # Its errors are all but free in the covariance: their prior is charged here, as it was in the competition.
    charge = Charge(best.name, 0.0, best.log_evidence - (log_evidence(following) - log_evidence(base)))
    found = replace(found, instruments=faulty, flagged=flagged, charges=(*found.charges, charge))
    return Following("instrument", found, following)


def _with_accepted(
    screening: Screening, contenders: Sequence[Contender], j: int, refit: Refit, found: Findings, watch: Watch
) -> Following | None:
    """An effect or place accepted, and the model with it; None when it explains less than nothing does, has so many
    rivals that they say nothing, or no flow is found with it.
    """
    one = contenders[j]
    if one.log_evidence < 0.0:
        return None
    watch(Progress(f"calibrating with {one.name}"))
    further = calibrated_with(screening.base, refit)
    if further is None:
        return None
    before = chi2(screening.base.noise, screening.base.fitted.point)
    log_prior = one.log_evidence - refit.log_factor
    if one.kind != "effect":
        charge = Charge(one.name, before - further.fitted.chi2, log_prior)
        lost = _without_error_of_shape(screening.base, further) - log_evidence(further)
        places = (*found.places, location_found(screening, contenders, j, refit))
        found = replace(found, places=places, charges=(*found.charges, charge), of_shape=found.of_shape + lost)
        return Following("place", found, further)
    step = step_found(screening, contenders, j, further, found.p)
    if found.accepted and len(step.groups) > constants().most_groups:
        return None
    further, unneeded = pruned(further, found.effects, watch)
    return Following("effect", _with_step(found, step, unneeded, before - further.fitted.chi2, log_prior), further)


def _with_steps(found: Findings, steps: tuple[Step, ...]) -> Findings:
    """The same steps with other rivals in the model, which keep the charges of those that they replace."""
    now = {before.accepted: after.accepted for before, after in zip(found.steps, steps, strict=True)}
    charges = tuple(replace(one, name=now.get(one.name, one.name)) for one in found.charges)
    return replace(found, steps=steps, charges=charges)


def _with_step(found: Findings, step: Step, unneeded: Sequence[str], explained: float, log_prior: float) -> Findings:
    """A listed effect more, which explains besides what those explained that it makes unneeded."""
    kept = tuple(one for one in found.steps if one.accepted not in unneeded)
    charges = [one for one in found.charges if one.name not in unneeded]
    earlier = sum(one.explained for one in found.charges if one.name in unneeded)
    charge = Charge(step.accepted, explained + earlier, log_prior)
    return replace(found, steps=(*kept, step), charges=(*charges, charge))


def _without_error_of_shape(before: Baseline, further: Baseline) -> float:
    """ln evidence of a model with a place more under the errors that the model had before."""
    fitted = fit(further.model, before.noise, further.fitted.point)
    return log_evidence(replace(further, noise=before.noise, fitted=fitted))


def _kept(suspects: Mapping[str, Suspect], tested: Mapping[str, Suspect]) -> dict[str, Suspect]:
    """Those of which earlier rounds say more than the last test: refitted, or accepted and so tested no more."""
    return {name: one for name, one in suspects.items() if one.amplitude.refitted or name not in tested}


def _in_model(suspect: Suspect, base: Baseline) -> Suspect:
    """An accepted suspect with its amplitude in the model as it is now."""
    one = candidate_in_case(base.model.case, suspect.name)
    value, low, high = interval95(base.model, base.fitted, one.parameter)
    return replace(suspect, amplitude=replace(suspect.amplitude, value=value, interval95=(low, high)))
