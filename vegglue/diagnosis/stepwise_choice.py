"""Which of the effects that a diagnosis names a model keeps, by errors at what was held out.

Those are the only judges: measurements for validation are never asked. An effect of one experiment, or of one section,
is not known where that is left out: errors there do not judge it.

Tried are the effects and places that a diagnosis found, and places that may be there instead of an effect.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import Candidate
from vegglue.case.schema import Case
from vegglue.decision_constants import constants
from vegglue.diagnosis.child_config import candidate_at, candidate_named, spread_over_its_error
from vegglue.diagnosis.comparison import ActsElsewhere, By, acts_elsewhere, held_out_rmse, improvement, model_score
from vegglue.diagnosis.refits import is_near_off
from vegglue.results.causes import LocalAnomaly
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.loop_results import ModelScore

WAYS: tuple[By, ...] = ("sections", "experiments")


@dataclass(frozen=True)
class Nominee:
    """An effect that was named.

    Attributes
    ----------
    name, parameter : str
        The effect, and the parameter of its amplitude.
    off : float
        The value that does nothing, NaN if that alone shows nothing [unit of the amplitude].
    instead_of : str
        What is known, if this is something vaguer that may be it instead.
    only_in : mapping of str
        The one section or experiment in which it acts, by "sections" or "experiments".
    """

    name: str
    parameter: str
    off: float
    instead_of: str = ""
    only_in: Mapping[By, str] = field(default_factory=dict)


Names = tuple[str, ...]
# Sections and experiments that do not judge.
NotJudging = Mapping[By, set[str]]
# The model with some of the nominees, in the order they were named; None where it finds no flow.
ScoreWith = Callable[[Names], ModelScore | None]


@dataclass(frozen=True)
class NoFlowWithIt:
    """The model finds no steady flow with what is tried."""


@dataclass(frozen=True)
class NothingToHoldOut:
    """Held-out errors need velocities of more than one section and experiment; velocities: whether there are any."""

    velocities: bool


@dataclass(frozen=True)
class HeldOutErrorsRose:
    """Root mean square errors of held-out sections or experiments rose [m/s]."""

    by: By
    before: float
    after: float


@dataclass(frozen=True)
class FallNotClear:
    """The diagnosis is in doubt, and held-out errors fell by less than so many standard errors."""

    by: By
    least: float


@dataclass(frozen=True)
class HeldOutErrorsDidNotFall:
    """Held-out errors did not fall either way."""


@dataclass(frozen=True)
class MisfitRose:
    """The misfit with the calibrated measurements rose."""


@dataclass(frozen=True)
class AmplitudeNearOff:
    """The amplitude is compatible with no effect."""


@dataclass(frozen=True)
class NotNeeded:
    """Held-out errors are no higher without it."""


@dataclass(frozen=True)
class KnownInstead:
    """Held-out errors are not clearly higher with a known effect instead."""

    known: str


NotKept = (
    NoFlowWithIt | NothingToHoldOut | HeldOutErrorsRose | FallNotClear | HeldOutErrorsDidNotFall | MisfitRose |
    AmplitudeNearOff | NotNeeded | KnownInstead | ActsElsewhere
)  # fmt: skip


@dataclass(frozen=True)
class UnclearFall:
    """Fall of held-out squares and its standard error [(m/s)^2], NaN for one section, by what was held out."""

    falls: tuple[tuple[By, float, float], ...]


@dataclass(frozen=True)
class Choice:
    """What a model keeps.

    Attributes
    ----------
    stages : tuple of tuple of str
        Names in the model, from none to the last, each with all of those before.
    refused : dict
        Why, by name.
    unclear : mapping of UnclearFall
        By how much held-out errors fall with those of the last model whose fall is not clear, by name.
    """

    stages: tuple[Names, ...]
    refused: dict[str, NotKept]
    unclear: Mapping[str, UnclearFall] = field(default_factory=dict)


def chosen(named: Sequence[Nominee], score_with: ScoreWith, clearly: bool = False) -> Choice:
    """Each is tried in the order named, those that do not help by themselves then together; see `why_not_kept`.

    What the last model does not need is dropped again, and what is vaguer has to be clearly better than what is known.

    Parameters
    ----------
    score_with : callable
        Names -> score of the model with these, None if no flow is found.
    clearly : bool
        Whether errors must fall by clear_fall standard errors.
    """
    order = [one.name for one in named]

    def better(kept: Names, more: Names) -> tuple[Names, NotKept | None]:
        both = tuple(name for name in order if name in {*kept, *more})
        before = score_with(kept)
        assert before is not None
        judging = _not_judging([one for one in named if one.name in more])
        return both, why_not_kept(before, score_with(both), clearly, judging)

    stages: tuple[Names, ...] = ((),)
    refused: dict[str, NotKept] = {}
    for name in order:  # by itself
        both, why = better(stages[-1], (name,))
        if why is None:
            stages = (*stages, both)
        else:
            refused[name] = why
    group: Names = ()
    for name in list(refused):  # together with the next of those that do not help by themselves
        group = (*group, name)
        both, why = better(stages[-1], group)
        if why is None:
            refused = {other: reason for other, reason in refused.items() if other not in group}
            stages, group = (*stages, both), ()
        elif not isinstance(why, NoFlowWithIt):  # beside others: by itself it may have one
            refused[name] = why
    kept, refused = _needed_of({one.name: one for one in named}, stages[-1], refused, score_with)
    kept, refused = _known_of(named, kept, refused, score_with)
    unclear: dict[str, UnclearFall] = {}
    for one in (each for each in named if each.name in kept):
        without, last = score_with(tuple(name for name in kept if name != one.name)), score_with(kept)
        if without is None or last is None:
            continue
        gains = _gains(without, last, _not_judging([one]))
        if not any(gain > constants().clear_fall * error for gain, error in gains.values()):
            unclear[one.name] = UnclearFall(tuple((by, *gain) for by, gain in gains.items()))
    earlier = [stage for stage in stages if set(stage) < set(kept)]
    return Choice((*earlier, kept), refused, unclear)


def _needed_of(
    named: dict[str, Nominee], kept: Names, refused: dict[str, NotKept], score_with: ScoreWith
) -> tuple[Names, dict[str, NotKept]]:
    """What is left once all that the model does not need is dropped, and why each of the others is not in it; nothing
    is dropped if the model would be worse than its parent without it.
    """
    for name in kept:
        fewer = tuple(one for one in kept if one != name)
        parent, without, last, judging = (
            score_with(()),
            score_with(fewer),
            score_with(kept),
            _not_judging([named[name]]),
        )
        if parent is None or without is None or last is None:
            continue
        if without is not parent and any(gain < 0.0 for gain, _ in _gains(parent, without, judging).values()):
            continue
        if is_near_off(last.values[named[name].parameter], named[name].off):
            return _needed_of(named, fewer, {**refused, name: AmplitudeNearOff()}, score_with)
        if not any(gain > 0.0 for gain, _ in _gains(without, last, judging).values()):
            return _needed_of(named, fewer, {**refused, name: NotNeeded()}, score_with)
    return kept, refused


def _known_of(
    named: Sequence[Nominee], kept: Names, refused: dict[str, NotKept], score_with: ScoreWith
) -> tuple[Names, dict[str, NotKept]]:
    """What is left once what is vaguer makes room for what is known and helps hardly less, and why not the others."""
    for one in named:
        known = one.instead_of
        if one.name not in kept or not known or known in kept:
            continue
        fewer = tuple(name for name in kept if name != one.name)
        both = tuple(each.name for each in named if each.name in {*fewer, known})
        without, with_known, vaguer = score_with(fewer), score_with(both), score_with(kept)
        assert without is not None
        assert vaguer is not None
        judging = _not_judging([each for each in named if each.name in (known, one.name)])
        if with_known is None or why_not_kept(without, with_known, False, judging):
            continue
        clear = constants().clear_fall
        if not all(gain > clear * error for gain, error in _gains(with_known, vaguer, judging).values()):
            others = {name: why for name, why in refused.items() if name != known}
            kept, refused = both, {**others, one.name: KnownInstead(known)}
    return kept, refused


def why_not_kept(
    before: ModelScore, after: ModelScore | None, clearly: bool, not_judging: NotJudging
) -> NotKept | None:
    """Why a model is not better than one before it.

    Held-out errors have to fall by sections or by experiments and rise by neither, and the misfit with all that was
    calibrated has to fall. They may rise one way if that is not clear, and less than they fall the other.

    Parameters
    ----------
    after : ModelScore or None
        None if no flow is found.
    clearly : bool
        Whether errors must fall by clear_fall standard errors.
    not_judging : mapping of set of str
        Sections and experiments that do not count.

    Returns
    -------
    NotKept or None
        None if it is better.
    """
    if after is None:
        return NoFlowWithIt()
    gains = _gains(before, after, not_judging)
    if not gains:
        return NothingToHoldOut(bool(after.held_out.velocity.any()))
    together = sum(gain for gain, _ in gains.values())
    for by, (gain, error) in gains.items():
        if gain < 0.0 and not (together > 0.0 and gain >= -constants().clear_fall * error):
            was, now = (held_out_rmse(one, by, not_judging.get(by, ())) for one in (before, after))
            return HeldOutErrorsRose(by, was, now)
        if clearly and not gain > constants().clear_fall * error:
            return FallNotClear(by, constants().clear_fall)
    if not any(gain > 0.0 for gain, _ in gains.values()):
        return HeldOutErrorsDidNotFall()
    # Held-out errors are those of a linear step: where the misfit with everything seen rises, it led astray.
    return None if after.in_sample.chi2 < before.in_sample.chi2 else MisfitRose()


def _not_judging(tried: Sequence[Nominee]) -> NotJudging:
    """Experiments and sections without which something that is tried is not known."""
    return {by: {one.only_in[by] for one in tried if by in one.only_in} for by in WAYS}


def _gains(before: ModelScore, after: ModelScore, not_judging: NotJudging) -> dict[By, tuple[float, float]]:
    """Fall of the held-out squares and its standard error, where anything can be held out."""
    gains = {by: improvement(before, after, by, not_judging.get(by, ())) for by in WAYS}
    return {by: one for by, one in gains.items() if np.isfinite(one[0])}


Addition = tuple[Candidate, Mapping[str, float]]  # an effect, and values of its shapes


def found_additions(case: Case, found: Diagnosis) -> list[Addition]:
    """Effects and places of a diagnosis in the order they were found.

    Returns
    -------
    list of (Candidate, mapping of float)
        Each with values of its shapes [unit of each], places spread over where they may lie; none that is at work in
        the case already.
    """
    station = found.predictions.station
    added: list[Addition] = [
        (candidate_named(case, station, step.accepted), found.candidate_effect(step.accepted).shapes)
        for step in found.steps
    ]
    spread = [spread_over_its_error(place) for place in found.places]
    added += [(candidate_at(case, place), place.shapes) for place in spread]
    # The last model of the diagnosis holds the parameters of what was found in that order.
    order = {name: position for position, name in enumerate(found.parameters.last)}
    added = [one for one in added if one[0].key not in case.effects]
    return sorted(added, key=lambda one: order.get(one[0].parameter, len(order)))


def tried_additions(case: Case, found: Diagnosis) -> list[Addition]:
    """What was found, and after each effect the places that may be there instead, see `_rival_places`.

    Held-out errors decide between both, and if they are the same, what is known is kept.

    Returns
    -------
    list of (Candidate, dict of float)
        Each with values of its shapes [unit of each]; places are spread over where they may lie.
    """
    rivals, tried = _rival_places(found), list[Addition]()
    for one in found_additions(case, found):
        instead = [place for effect, place in rivals if effect == one[0].name]
        tried += [one, *((candidate_at(case, place), place.shapes) for place in instead)]
    return tried


def choice_among(case: Case, found: Diagnosis, base_with: Callable[[Names], Baseline | None]) -> Choice:
    """Which of what is tried a model keeps, see `chosen`; no place that acts mostly away from the measurements.

    Parameters
    ----------
    base_with : callable
        Names of some of what is tried -> the calibrated model with these, None if no flow is found.
    """
    scores: dict[Names, ModelScore | None] = {}

    def score_with(names: Names) -> ModelScore | None:
        if names not in scores:
            base = base_with(names)
            scores[names] = None if base is None else model_score(base)
        return scores[names]

    tried, parent = nominees(case, found), base_with(())
    at_places = {candidate_at(case, place).name for place in places_tried(found)}
    elsewhere: dict[str, NotKept] = {}
    for one in tried:
        alone = base_with((one.name,)) if one.name in at_places else None
        if parent is not None and alone is not None and (why := acts_elsewhere(parent, alone)):
            elsewhere[one.name] = why
    choice = chosen([one for one in tried if one.name not in elsewhere], score_with, in_doubt(found))
    return replace(choice, refused=elsewhere | choice.refused)


def nominees(case: Case, found: Diagnosis) -> list[Nominee]:
    """What `tried_additions` adds, as `chosen` takes it."""
    known = {candidate_at(case, place).name: effect for effect, place in _rival_places(found)}
    named = []
    for one, _ in tried_additions(case, found):
        groups: dict[By, tuple[str, ...]] = {"experiments": one.experiments, "sections": one.sections}
        only_in = {by: names[0] for by, names in groups.items() if len(names) == 1}
        off = float("nan") if one.has_further_amplitudes else one.amplitude.off
        named.append(Nominee(one.name, one.parameter, off, known.get(one.name, ""), only_in))
    return named


def places_tried(found: Diagnosis) -> list[LocalAnomaly]:
    """Places that were found and those that may be there instead of an effect, spread over where they may lie."""
    return [*(spread_over_its_error(place) for place in found.places), *(place for _, place in _rival_places(found))]


def _rival_places(found: Diagnosis) -> list[tuple[str, LocalAnomaly]]:
    """Accepted effects and places that may be there instead, spread over where they may lie: one that is likelier, and
    in doubt each that is not negligible, as then all that is kept has to help clearly.
    """
    rivals = {
        name: (step.accepted, spread_over_its_error(place))
        for step in found.steps
        for name, place in step.places.items()
        if in_doubt(found) or name == step.likelier_place
    }
    return list(rivals.values())


def values_tried(case: Case, found: Diagnosis) -> dict[str, float]:
    """`values_found`, and the sizes of places that may be there instead of effects.

    Returns
    -------
    dict of float
        By parameter [its unit].
    """
    rivals = {candidate_at(case, one).parameter: one.amplitude for _, one in _rival_places(found)}
    return values_found(case, found) | rivals


def values_found(case: Case, found: Diagnosis) -> dict[str, float]:
    """Parameters of the last model of a diagnosis.

    Returns
    -------
    dict of float
        By name [its unit]; sizes of places are those of places spread over where they may lie.
    """
    values = {name: three[0] for name, three in found.parameters.last.items()}
    for place in found.places:
        share = spread_over_its_error(place).plausible / place.plausible
        values[candidate_at(case, place).parameter] *= share
    return values


def in_doubt(found: Diagnosis) -> bool:
    """Whether what was found may stand in for something else: then held-out errors must fall clearly."""
    return found.verdict.kind == "cannot-tell" or found.field is not None
