"""What a search has found so far, and how the winner of a competition becomes a step, a place or an instrument.

Where two things are missing, what explains the first may depend on the second: an effect that seemed sure is one of
several, or another leads. The whole competition is then repeated without the effect, with what was accepted since. If
that explains all by itself, and no alarm is sounded, the effect is dropped: what is accepted does not depend on the
order in which it was found.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import Instrument, candidate_in_case, effect_entry, error_columns
from vegglue.calibration.fit import chi2
from vegglue.calibration.residual_screening import Screening, screen
from vegglue.calibration.score_test import alarm_p, kind_named, prior_shrinkage
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import Hypothesis, chances_of, evidence_under_larger_errors, hypotheses_of
from vegglue.diagnosis.odds import tempered_odds
from vegglue.diagnosis.refits import Refit, calibrated_with, without_effect
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.plausibility import ImplausibleOutlet, ImplausibleValues
from vegglue.normal_range import NORMAL95
from vegglue.progress import Progress, Watch
from vegglue.results.causes import CandidateEffect, FaultyInstrument, LocalAnomaly, Rival, Step
from vegglue.wording.phases import COMPARING_AGAIN


@dataclass(frozen=True)
class PriorWeight:
    """What one finding brought and cost.

    Attributes
    ----------
    explained : float
        Fall of chi2 with it [-].
    log_prior : float
        ln of its chance before the data [-].
    """

    name: str
    explained: float
    log_prior: float


@dataclass(frozen=True)
class Undecided:
    """Hypotheses that competed last and led to nothing.

    Attributes
    ----------
    hypotheses : tuple of Hypothesis
        The most evidence first.
    chances : tuple of float
        Of each [-].
    """

    hypotheses: tuple[Hypothesis, ...]
    chances: tuple[float, ...]


def rivals_in(undecided: Undecided) -> tuple[Rival, ...]:
    """Hypotheses of which none was accepted, as values.

    Returns
    -------
    tuple of Rival
        The likeliest first, with their probabilities; without what cannot be.
    """
    rivals = []
    for one, chance in zip(undecided.hypotheses, undecided.chances, strict=True):
        if np.isinf(one.log_evidence):  # what cannot be
            continue
        if isinstance(one.what, Instrument):
            rivals.append(Rival(one.name, one.what.kind, chance, one.what.x, one.what.y))
        elif one.kind == "effect":
            rivals.append(Rival(one.name, "effect", chance))
        else:
            shapes = one.what.shapes
            rivals.append(Rival(one.name, one.kind, chance, shapes["x"], shapes["y"], one.what.amplitude))
    return tuple(sorted(rivals, key=lambda one: -one.probability))


@dataclass(frozen=True)
class SearchState:
    """What a search has accepted so far.

    Attributes
    ----------
    steps : tuple of Step
        Accepted effects.
    prior_weights : tuple of PriorWeight
        Of all that is held.
    flagged : tuple of int
        Excluded readings, indices among the used stations.
    of_shape : float
        ln evidence of places as they competed, less that in the model, whose covariance holds the error of their
        shape.
    p, rate : float
        Of the last alarm, and the rate below which it is sounded [-].
    undecided : Undecided or None
        What competed last and led to nothing.
    implausible : tuple of ImplausibleOutlet or ImplausibleValues
        Values that no flow of the case can have.
    """

    steps: tuple[Step, ...] = ()
    places: tuple[LocalAnomaly, ...] = ()
    instruments: tuple[FaultyInstrument, ...] = ()
    prior_weights: tuple[PriorWeight, ...] = ()
    flagged: tuple[int, ...] = ()
    of_shape: float = 0.0
    p: float = 1.0
    rate: float = 0.0
    undecided: Undecided | None = None
    implausible: tuple[ImplausibleOutlet | ImplausibleValues, ...] = ()

    @property
    def alarmed(self) -> bool:
        return self.p < self.rate

    @property
    def explained(self) -> float:
        """Fall of chi2 by effects and places."""
        return sum(one.explained for one in self.prior_weights)

    @property
    def slack(self) -> float:
        """By how much a remainder of what was accepted may make others score higher [standard errors]."""
        return constants().misplaced_share * float(max(self.explained, 0.0) ** 0.5)

    @property
    def log_prior(self) -> float:
        """ln of the chance of all that was found before the data."""
        return sum(one.log_prior for one in self.prior_weights)

    def gained(self, before: float, after: float) -> float:
        """ln evidence of all that was found together, as it competed, from those of the first and the last model."""
        return after - before + self.log_prior + self.of_shape

    @property
    def effects(self) -> list[str]:
        """Names of the effects that were accepted."""
        return [step.accepted for step in self.steps]

    @property
    def accepted(self) -> int:
        """How many effects and places."""
        return len(self.steps) + len(self.places)

    def with_place(self, place: LocalAnomaly, weight: PriorWeight, lost: float) -> "SearchState":
        """Something at a place more; lost: ln evidence that the error of its shape takes."""
        weights = (*self.prior_weights, weight)
        return replace(self, places=(*self.places, place), prior_weights=weights, of_shape=self.of_shape + lost)

    def with_step(self, step: Step, unneeded: Sequence[str], explained: float, log_prior: float) -> "SearchState":
        """A listed effect more, which explains besides what those explained that it makes unneeded."""
        kept = tuple(one for one in self.steps if one.accepted not in unneeded)
        weights = [one for one in self.prior_weights if one.name not in unneeded]
        earlier = sum(one.explained for one in self.prior_weights if one.name in unneeded)
        weight = PriorWeight(step.accepted, explained + earlier, log_prior)
        return replace(self, steps=(*kept, step), prior_weights=(*weights, weight))

    def without_step(self, step: Step, lost: float) -> "SearchState":
        """Without an effect that what was accepted since makes unneeded; lost: rise of chi2 without it.

        What it explained is explained by the last that was accepted, and the effect after it begins where it did.
        """
        left = [one for one in self.steps if one is not step]
        after = self.steps.index(step)
        if after < len(left):
            left[after] = replace(left[after], chi2_before=step.chi2_before)
        explained = sum(one.explained for one in self.prior_weights if one.name == step.accepted) - lost
        weights = [one for one in self.prior_weights if one.name != step.accepted]
        if weights:
            weights[-1] = replace(weights[-1], explained=weights[-1].explained + explained)
        return replace(self, steps=tuple(left), prior_weights=tuple(weights))

    def with_steps(self, steps: tuple[Step, ...]) -> "SearchState":
        """The same steps with other rivals in the model, which keep the prior weights of those that they replace."""
        now = {before.accepted: after.accepted for before, after in zip(self.steps, steps, strict=True)}
        weights = tuple(replace(one, name=now.get(one.name, one.name)) for one in self.prior_weights)
        return replace(self, steps=steps, prior_weights=weights)


# Share of the squared fingerprint of a spot above which an experiment is reported to point at it.
POINTS_AT_IT = 0.1


def step_found(
    screening: Screening, hypotheses: Sequence[Hypothesis], accepted: int, further: Baseline, p: float
) -> Step:
    """One hypothesis, a listed effect, as a step, with the rivals that are not negligible.

    Parameters
    ----------
    accepted : int
        Which of them.
    further : Baseline
        The model with it.
    p : float
        Of the alarm [-].
    """
    chance = chances_of(hypotheses)
    found, groups = _groups_of_rivals(screening, hypotheses)
    base, least = screening.base, constants().rival_share * chance.max()
    # Of other kinds what is not negligible against the best.
    others = {
        one.name: float(p) for one, p in zip(hypotheses, chance, strict=True) if one.kind != "effect" and p >= least
    }
    terms = {one.term for one in screening.fingerprints.places}
    places = {
        one.name: anomaly_found(screening, hypotheses, j, one.what)
        for j, one in enumerate(hypotheses)
        if one.name in others and one.kind in terms and isinstance(one.what, Refit)
    }
    step = Step(
        accepted=hypotheses[accepted].name,
        rivals=tuple(found),
        chances=tuple(found.values()),
        groups=groups,
        chi2_before=chi2(base.noise, base.fitted.point),
        chi2_after=further.fitted.chi2,
        p_family=p,
        others=others,
        places=places,
    )
    # What is accepted on trial may lie outside the set of the likeliest.
    return with_chances(step, step.accepted, found | others | {step.accepted: float(chance[accepted])})


def _groups_of_rivals(
    screening: Screening, hypotheses: Sequence[Hypothesis]
) -> tuple[dict[str, float], tuple[tuple[str, ...], ...]]:
    """`rivals_among` the listed effects of the hypotheses."""
    chance = chances_of(hypotheses)
    listed = [j for j, one in enumerate(hypotheses) if one.kind == "effect"]
    names = [hypotheses[j].name for j in listed]
    columns = [hypotheses[j].column for j in listed]
    cosine = score_test.cosines(screening.projected)[np.ix_(columns, columns)]
    return rivals_among(names, chance[listed], cosine)


def _shared_anew(told: Mapping[str, float], followed: Sequence[str], chance: Array) -> dict[str, float]:
    """Chances by name, once some have been followed further: the chances that they have together are shared anew.

    chance (k,): of each that was followed, were it one of them.
    """
    together = sum(told.get(name, 0.0) for name in followed)
    return {**told, **{name: float(p) * together for name, p in zip(followed, chance, strict=True)}}


def followed_further(step: Step, followed: Sequence[str], chance: Array) -> Step:
    """The step once some hypotheses have been followed further, see `_shared_anew`; the accepted one is among them."""
    return with_chances(step, step.accepted, _shared_anew(step.chance | step.others, followed, chance))


def place_followed_further(
    place: LocalAnomaly, followed: Sequence[Hypothesis], taken: int, evidence: Array
) -> LocalAnomaly:
    """The place, which was taken, with its tempered odds against the others that have been followed.

    Parameters
    ----------
    taken : int
        Which of them the place is.
    evidence : ndarray (k,)
        ln, of each followed [-].
    """
    odds = {
        _rival_name(one): tempered_odds(float(evidence[taken]), float(of_one))
        for one, of_one in zip(followed, evidence, strict=True)
        if one.kind != place.term
    }
    return replace(place, odds=place.odds | odds)


def _rival_name(one: Hypothesis) -> str:
    """The name of a rival of a place: an effect by its own, another by its kind."""
    return one.name if one.kind == "effect" else one.kind


def undecided_of(hypotheses: Sequence[Hypothesis], followed: Sequence[str], chance: Array) -> Undecided:
    """All hypotheses, none of them surely it, once some have been followed further.

    Parameters
    ----------
    followed : sequence of str
        Names.
    chance : ndarray (k,)
        Of each followed, were it one of them [-]; together they keep the chance that they had.
    """
    told = dict(zip([one.name for one in hypotheses], map(float, chances_of(hypotheses)), strict=True))
    told = _shared_anew(told, followed, chance)
    return Undecided(tuple(hypotheses), tuple(told[one.name] for one in hypotheses))


def with_chances(step: Step, accepted: str, told: Mapping[str, float]) -> Step:
    """A step with an accepted rival and other chances, without what has become negligible against the largest of them.

    Parameters
    ----------
    accepted : str
        An effect; in a group of its own if it is in none.
    told : mapping of float
        Chances by name [-].

    Returns
    -------
    Step
        With the rivals above rival_share of the largest chance, and the accepted one, the likeliest first.
    """
    least = constants().rival_share * max(told.values())
    possible = sorted({accepted, *(name for name in told if told[name] >= least)}, key=lambda name: -told[name])
    rivals = tuple(name for name in possible if name in step.rivals or name == accepted)
    groups = [group for old in step.groups if (group := tuple(name for name in old if name in rivals))]
    if not any(accepted in group for group in groups):
        groups.append((accepted,))
    others = {name: told[name] for name in step.others if name in possible and name not in rivals}
    chances = tuple(told[name] for name in rivals)
    places = {name: place for name, place in step.places.items() if name in others}
    return replace(
        step, accepted=accepted, rivals=rivals, chances=chances, groups=tuple(groups), others=others, places=places
    )


def anomaly_found(screening: Screening, hypotheses: Sequence[Hypothesis], which: int, refit: Refit) -> LocalAnomaly:
    """One hypothesis, something at a place, as a local anomaly.

    Parameters
    ----------
    refit : Refit
        Of that hypothesis.

    Returns
    -------
    LocalAnomaly
        With the experiments that have more than POINTS_AT_IT of its squared fingerprint, and odds against all else.
    """
    best = hypotheses[which]
    places = next(one for one in screening.fingerprints.places if one.term == best.kind)
    kind = kind_named(screening.kinds, best.kind)
    noise, column = screening.base.noise, places.fingerprints[:, best.column : best.column + 1]
    white = noise.whiten(noise.used(column))[:, 0] ** 2
    names = screening.base.model.station["experiment"].to_numpy()[noise.rows]
    share = {str(name): float(white[names == name].sum() / white.sum()) for name in dict.fromkeys(names)}
    # What was not worth a refit counts to first order.
    evidence = {of.name: of.total for of in screening.kinds if of.name != "effect"}
    evidence |= {_rival_name(one): one.log_evidence for one in reversed(hypotheses)}
    return LocalAnomaly(
        **{name: refit.shapes[name] for name in ("x", "y", "length", "width")},
        x_error=best.errors[0],
        y_error=best.errors[1],
        x_spread=best.spread[0],
        y_spread=best.spread[1],
        term=best.kind,
        effect=refit.candidate.effect.name,
        amplitude=refit.amplitude,
        interval95=refit.interval95,
        unit=refit.candidate.amplitude.unit,
        score=float(kind.scores[best.column]),
        experiments=tuple(name for name, part in share.items() if part > POINTS_AT_IT),
        odds={name: tempered_odds(best.log_evidence, other) for name, other in evidence.items() if name != best.kind},
        plausible=refit.candidate.amplitude.scale,
        outline=best.outline,
    )


def instrument_found(screening: Screening, best: Hypothesis, one: Instrument) -> FaultyInstrument:
    """s^2 o' C^-1 r / (1 + s^2 o' C^-1 o): an instrument with its offset, o 1 in its readings.

    Parameters
    ----------
    best : Hypothesis
        Of a surveyed line the offset is that of the model without its level.
    one : Instrument
        Of that hypothesis.

    Returns
    -------
    FaultyInstrument
        With the factor of a probe if that explains its readings strong_odds times better than an offset, else NaN.
    """
    noise = screening.base.noise
    kind = kind_named(screening.kinds, best.kind)
    length, score = float(kind.projected.length[best.column]), float(kind.scores[best.column])
    shrunk = float(prior_shrinkage(kind.size[best.column]))
    offset, spread = shrunk * score / length, np.sqrt(shrunk) / length
    if best.without is not None:
        offset, spread = best.without.offset, best.without.error
    stations = noise.rows[list(one.readings)]
    factor = float("nan")  # what a probe reads over what is there, unless an offset explains it as well
    if one.line is None and (columns := error_columns(one, noise.value)).shape[1] > 1:
        point = screening.base.fitted.point
        residual, both = noise.whiten(noise.residual(point.prediction)), noise.whiten(columns)
        projected = score_test.project(screening.whitened_slopes, residual, point.z, both)
        by_offset, by_factor = score_test.scores(projected, np.zeros(2))
        if 0.5 * (by_factor**2 - by_offset**2) >= np.log(constants().strong_odds):
            factor = float(1.0 / (1.0 - by_factor / projected.length[1]))
    return FaultyInstrument(
        kind=one.kind,
        x=one.x,
        y=one.y,
        stations=tuple(map(int, stations)),
        offset=offset,
        interval95=(offset - NORMAL95 * spread, offset + NORMAL95 * spread),
        unit="m" if one.line else kind_of(str(screening.base.model.station["kind"].iloc[stations[0]])).unit,
        log_factor=best.log_evidence,
        factor=factor,
    )


def rivals_among(
    names: Sequence[str], chance: Array, cosine: Array
) -> tuple[dict[str, float], tuple[tuple[str, ...], ...]]:
    """The fewest groups of effects alike that hold set_chance of what listed effects have together.

    Parameters
    ----------
    names : sequence of str (k,)
    chance : ndarray (k,)
        Of each [-].
    cosine : ndarray (k, k)
        Between projected fingerprints [-].

    Returns
    -------
    dict of float
        Chance by name, the likeliest first [-].
    tuple of tuple of str
        The groups.
    """
    near = chance >= constants().rival_share * chance.max()
    alike = np.where(near & near[:, None], cosine, 0.0)
    kept = score_test.fewest_groups(
        score_test.alike_groups(range(len(names)), alike), chance, constants().set_chance * float(chance.sum())
    )
    likeliest = sorted((j for group in kept for j in group), key=lambda j: -chance[j])
    return {names[j]: float(chance[j]) for j in likeliest}, tuple(tuple(names[j] for j in group) for group in kept)


def with_alarm(screening: Screening, found: SearchState) -> SearchState:
    """What was found, with the alarm that anything else is missing.

    Parameters
    ----------
    screening : Screening
        Of the model with all that was found.

    Returns
    -------
    SearchState
        With p of the alarm, and the rate below which it is sounded.
    """
    later = constants().later_alarm_share if found.accepted or found.instruments else 1.0
    p = alarm_p(screening.kinds, screening.errors, 1, found.slack)
    return replace(found, p=p, rate=constants().false_alarm_rate * later)


def with_rivals_again(
    base: Baseline, found: SearchState, steps: Sequence[Step], effects: Mapping[str, CandidateEffect], watch: Watch
) -> tuple[Baseline, SearchState, dict[str, CandidateEffect]]:
    """The model with the best rival of every step, each compared again without it in the model.

    A step without which no alarm is sounded is dropped, and those that are left are compared again. A step stays as it
    is if no flow is found without its effect, or with any.

    Parameters
    ----------
    steps : sequence of Step
        Of effects that were accepted before what was last: an effect, something at a place, an instrument.
    effects : mapping of CandidateEffect
        By name.
    watch : callable
        Is called with each step.

    Returns
    -------
    Baseline, SearchState, dict of CandidateEffect
        The model with the rivals at the values of their shapes that they competed with, what was found with the chances
        as they are now, and the effects with the amplitudes of their refits.
    """
    known, waiting = dict(effects), list(steps)
    while waiting:
        step = waiting.pop(0)
        watch(Progress(COMPARING_AGAIN.format(step.accepted)))
        less = without_effect(base, candidate_in_case(base.model.case, step.accepted))
        if less is None:
            continue
        screening = screen(less, found.flagged)
        without = found.without_step(step, chi2(less.noise, less.fitted.point) - chi2(base.noise, base.fitted.point))
        if not with_alarm(screening, without).alarmed:
            base, found = less, without
            waiting = list(found.steps)
            continue
        hypotheses = hypotheses_of(screening, watch)
        listed = [j for j, one in enumerate(hypotheses) if one.kind == "effect"]
        if step.accepted not in [hypotheses[j].name for j in listed] or np.isinf(hypotheses[listed[0]].log_evidence):
            continue
        lead = leading_refit(screening, hypotheses)
        best = hypotheses[lead].what
        assert isinstance(best, Refit)
        one = best.candidate
        # At other values of its shapes than those in the case an effect is another.
        if base.model.case.effects.get(one.key) != effect_entry(one, one.parameter, best.shapes):
            further = calibrated_with(less, best)
            if further is None:
                continue
            base = further
        again = step_found(screening, hypotheses, lead, base, step.p_family)
        again = replace(again, chi2_before=step.chi2_before, chi2_after=step.chi2_after)
        found = found.with_steps(tuple(again if other is step else other for other in found.steps))
        known |= refitted(hypotheses, known)
    return base, found, known


def leading_refit(screening: Screening, hypotheses: Sequence[Hypothesis]) -> int:
    """The listed effect of the trace of the most likely one that leads by `evidence_under_larger_errors`.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        The most evidence first, a listed effect among them.

    Returns
    -------
    int
        Its index.
    """
    first = next(one.name for one in hypotheses if one.kind == "effect")
    _, groups = _groups_of_rivals(screening, hypotheses)
    group = next((one for one in groups if first in one), (first,))
    alike = [j for j, one in enumerate(hypotheses) if one.kind == "effect" and one.name in group]
    return alike[int(np.argmax(evidence_under_larger_errors(screening, [hypotheses[j] for j in alike])))]


def refitted(hypotheses: Sequence[Hypothesis], effects: Mapping[str, CandidateEffect]) -> dict[str, CandidateEffect]:
    """The listed effects that were refitted, with the amplitudes of their refits.

    Parameters
    ----------
    effects : mapping of CandidateEffect
        By name.

    Returns
    -------
    dict of CandidateEffect
        By name, those that were refitted alone.
    """
    return {
        one.name: one.what.of(effects[one.name])
        for one in hypotheses
        if one.kind == "effect" and one.name in effects and isinstance(one.what, Refit)
    }
