"""Which of the effects that a diagnosis names a model keeps, by errors at what was held out.

Those are the only judges: measurements for validation are never asked. An effect of one experiment, or of one section,
is not known where that is left out: errors there do not judge it.

Tried are the effects and places that a diagnosis found, and places that are likelier.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import Candidate
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_at, candidate_named, spread_over_its_error
from vegglue.diagnosis.comparison import By, held_out_rmse, improvement, model_score
from vegglue.diagnosis.errors_elsewhere import acts_elsewhere
from vegglue.diagnosis.refits import is_near_off
from vegglue.results.causes import LocalAnomaly
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.model_comparison import ModelScore

# Fall of the held-out squares, over its standard error, from which it is clear: 19 times of 20 it is no chance.
CLEAR = 2.0
WAYS: tuple[By, ...] = ("sections", "experiments")


@dataclass(frozen=True)
class Nominee:
    """An effect that was named: its parameter, and the value of it that does nothing; instead_of: what is known, where
    this is something vaguer that may be it instead; only_in: the one experiment or section in which it acts.
    """

    name: str
    parameter: str
    off: float
    instead_of: str = ""
    only_in: Mapping[By, str] = field(default_factory=dict)


Names = tuple[str, ...]
# Why each of what is not in the model is not, by name.
Reasons = dict[str, str]
# Sections and experiments that do not judge.
Untold = Mapping[By, set[str]]
# The model with some of the nominees, in the order they were named; None where it finds no flow.
ScoreWith = Callable[[Names], ModelScore | None]


@dataclass(frozen=True)
class Choice:
    """stages: names in the model, from none to the last, each with all of those before; refused: why, by name; unclear:
    by how much held-out errors fall with those of the last model whose fall cannot be told from none, in words.
    """

    stages: tuple[Names, ...]
    refused: Reasons
    unclear: Mapping[str, str] = field(default_factory=dict)


def chosen(named: Sequence[Nominee], score_with: ScoreWith, clearly: bool = False) -> Choice:
    """Each is tried in the order named, those that do not help by themselves then together; what the last model does
    not need is dropped again, and what is vaguer has to be clearly better than what is known. clearly: errors must fall
    by CLEAR standard errors.
    """
    order = [one.name for one in named]

    def better(kept: Names, more: Names) -> tuple[Names, str]:
        both = tuple(name for name in order if name in {*kept, *more})
        before = score_with(kept)
        assert before is not None
        return both, why_not_kept(
            before, score_with(both), clearly, _untold([one for one in named if one.name in more])
        )

    stages, refused = _together(*_one_by_one(order, better), better)
    kept, refused = _needed_of({one.name: one for one in named}, stages[-1], refused, score_with)
    kept, refused = _known_of(named, kept, refused, score_with)
    earlier = [stage for stage in stages if set(stage) < set(kept)]
    return Choice((*earlier, kept), refused, _unclear_of(named, kept, score_with))


Better = Callable[[Names, Names], tuple[Names, str]]
# Names in the model after each step, and why others are not.
Stages = tuple[tuple[Names, ...], Reasons]


def _one_by_one(order: Sequence[str], better: Better) -> Stages:
    """What helps by itself, and why the others do not."""
    stages: tuple[Names, ...] = ((),)
    refused: Reasons = {}
    for name in order:
        both, why = better(stages[-1], (name,))
        if why:
            refused = {**refused, name: why}
        else:
            stages = (*stages, both)
    return stages, refused


def _together(stages: tuple[Names, ...], refused: Reasons, better: Better) -> Stages:
    """What helps with the next of those that do not by themselves, too; what is kept is no longer refused."""
    group: Names = ()
    for name in refused:
        group = (*group, name)
        both, why = better(stages[-1], group)
        if why:
            refused = {**refused, name: why}
        else:
            refused = _without(refused, *group)
            stages, group = (*stages, both), ()
    return stages, refused


def _without(refused: Reasons, *names: str) -> Reasons:
    """The reasons, but for those of some names."""
    return {name: why for name, why in refused.items() if name not in names}


def _needed_of(
    named: dict[str, Nominee], kept: Names, refused: Reasons, score_with: ScoreWith
) -> tuple[Names, Reasons]:
    """What is left when all that the model does not need is dropped, and why each of the others is not in it."""
    for name in kept:
        fewer = tuple(one for one in kept if one != name)
        if why := _why_dropped(named[name], score_with(()), score_with(fewer), score_with(kept)):
            return _needed_of(named, fewer, {**refused, name: why}, score_with)
    return kept, refused


def _known_of(named: Sequence[Nominee], kept: Names, refused: Reasons, score_with: ScoreWith) -> tuple[Names, Reasons]:
    """What is left when what is vaguer makes room for what is known and helps hardly less, and why not the others."""
    for one in named:
        known = one.instead_of
        if one.name not in kept or not known or known in kept:
            continue
        fewer = tuple(name for name in kept if name != one.name)
        both = tuple(each.name for each in named if each.name in {*fewer, known})
        without, with_known, vaguer = score_with(fewer), score_with(both), score_with(kept)
        assert without is not None
        assert vaguer is not None
        untold = _untold([each for each in named if each.name in (known, one.name)])
        if with_known is None or why_not_kept(without, with_known, False, untold):
            continue
        if not all(gain > CLEAR * error for gain, error in _gains(with_known, vaguer, untold).values()):
            why = f"with {known}, which is known, held-out errors are not clearly higher"
            kept, refused = both, {**_without(refused, known), one.name: why}
    return kept, refused


def _unclear_of(named: Sequence[Nominee], kept: Names, score_with: ScoreWith) -> Reasons:
    """By how much held-out errors fall with each that is kept, in words, where neither way that is CLEAR.

    Not of what the model finds no flow without.
    """
    falls: Reasons = {}
    for one in (each for each in named if each.name in kept):
        without, last = score_with(tuple(name for name in kept if name != one.name)), score_with(kept)
        if without is None or last is None:
            continue
        gains = _gains(without, last, _untold([one]))
        if not any(gain > CLEAR * error for gain, error in gains.values()):
            falls[one.name] = ", ".join(f"{_fall_in_words(*gain)} by {by}" for by, gain in gains.items())
    return falls


def _fall_in_words(gain: float, error: float) -> str:
    """`20 ± 400`, of squares in (mm/s)^2; without an error where one section alone was held out."""
    fall = f"{1e6 * gain:.2g}"
    return f"{fall} ± {1e6 * error:.1g}" if np.isfinite(error) else fall


def _why_dropped(one: Nominee, parent: ModelScore | None, without: ModelScore | None, last: ModelScore | None) -> str:
    """Why a model does not need an effect, '' when it does, or when it would be worse than its parent without."""
    if parent is None or without is None or last is None:
        return ""
    untold = _untold([one])
    if without is not parent and any(gain < 0.0 for gain, _ in _gains(parent, without, untold).values()):
        return ""
    if is_off(one, last):
        return "its amplitude is compatible with none"
    gains = _gains(without, last, untold)
    return "" if any(gain > 0.0 for gain, _ in gains.values()) else "held-out errors are no higher without it"


def is_off(one: Nominee, score: ModelScore) -> bool:
    """Whether the amplitude lies within NEEDED standard errors of the value that does nothing."""
    return is_near_off(score.values[one.parameter], one.off)


def why_not_kept(before: ModelScore, after: ModelScore | None, clearly: bool, untold: Untold) -> str:
    """Why a model is not better than one before it, '' when it is: held-out errors fall by sections or by experiments
    and rise by neither, but for those that do not judge, and the misfit with all that was seen falls. They may rise one
    way where that is not clear, and less than they fall the other.
    """
    if after is None:
        return "the model finds no steady flow with it"
    gains = _gains(before, after, untold)
    if not gains:
        where = "one section in one experiment" if after.held_out.velocity.any() else "no velocity"
        return f"there is nothing to hold out: {where}"
    together = sum(gain for gain, _ in gains.values())
    for by, (gain, error) in gains.items():
        if gain < 0.0 and not (together > 0.0 and gain >= -CLEAR * error):
            was, now = (held_out_rmse(one, by, untold.get(by, ())) for one in (before, after))
            return f"errors of held-out {by} rose from {was:.4f} to {now:.4f} m/s"
        if clearly and not gain > CLEAR * error:
            return (
                f"the diagnosis is in doubt, and errors of held-out {by} fell by less than {CLEAR:.0f} standard errors"
            )
    if not any(gain > 0.0 for gain, _ in gains.values()):
        return "held-out errors did not fall"
    # Held-out errors are those of a linear step: where the misfit with everything seen rises, it led astray.
    return "" if after.in_sample.chi2 < before.in_sample.chi2 else "the misfit with what was seen rose"


def _untold(tried: Sequence[Nominee]) -> Untold:
    """Experiments and sections without which something that is tried is not known."""
    return {by: {one.only_in[by] for one in tried if by in one.only_in} for by in WAYS}


def _gains(before: ModelScore, after: ModelScore, untold: Untold) -> dict[By, tuple[float, float]]:
    """Fall of the held-out squares and its standard error, where anything can be held out."""
    gains = {by: improvement(before, after, by, untold.get(by, ())) for by in WAYS}
    return {by: one for by, one in gains.items() if np.isfinite(one[0])}


Addition = tuple[Candidate, Mapping[str, float]]  # an effect, and values of its shapes


def found_additions(case: Case, found: Diagnosis) -> list[Addition]:
    """Effects and places of a diagnosis in the order they were found, places spread over where they may lie; none that
    is at work in the case already.
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
    """What was found, and after each effect the place that is likelier than it: errors at what is held out decide, and
    where they are the same, what is known.
    """
    likelier = _likelier_places(found)
    tried: list[Addition] = []
    for one in found_additions(case, found):
        place = likelier.get(one[0].name)
        tried += [one, (candidate_at(case, place), place.shapes)] if place else [one]
    return tried


def choice_among(case: Case, found: Diagnosis, base_with: Callable[[Names], Baseline | None]) -> Choice:
    """Which of what is tried a model keeps, see `stepwise_choice`; no place that acts mostly where nobody measured.

    base_with: the calibrated model with some of what is tried, by name; None where it finds no flow.
    """
    scores: dict[Names, ModelScore | None] = {}

    def score_with(names: Names) -> ModelScore | None:
        if names not in scores:
            base = base_with(names)
            scores[names] = None if base is None else model_score(base)
        return scores[names]

    tried = nominees(case, found)
    elsewhere = _acting_elsewhere(case, found, [one.name for one in tried], base_with)
    choice = chosen([one for one in tried if one.name not in elsewhere], score_with, in_doubt(found))
    return replace(choice, refused=elsewhere | choice.refused)


def _acting_elsewhere(
    case: Case, found: Diagnosis, tried: Sequence[str], base_with: Callable[[Names], Baseline | None]
) -> dict[str, str]:
    """Why a place is not added, by its name, for it acts mostly where nobody measured."""
    parent, places = base_with(()), {candidate_at(case, place).name for place in places_tried(found)}
    alone = {name: base_with((name,)) for name in tried if name in places}
    told = {
        name: acts_elsewhere(parent, base) for name, base in alone.items() if parent is not None and base is not None
    }
    return {name: why for name, why in told.items() if why}


def nominees(case: Case, found: Diagnosis) -> list[Nominee]:
    """What is tried, as it is chosen from."""
    known = {candidate_at(case, place).name: name for name, place in _likelier_places(found).items()}
    return [
        Nominee(one.name, one.parameter, one.amplitude.off, known.get(one.name, ""), _only_in(one))
        for one, _ in tried_additions(case, found)
    ]


def _only_in(one: Candidate) -> dict[By, str]:
    """The one experiment or section in which an effect acts, if it acts in one only."""
    groups: dict[By, tuple[str, ...]] = {"experiments": one.experiments, "sections": one.sections}
    return {by: names[0] for by, names in groups.items() if len(names) == 1}


def places_tried(found: Diagnosis) -> list[LocalAnomaly]:
    """Places that were found and those that are likelier than an effect, spread over where they may lie."""
    return [*(spread_over_its_error(place) for place in found.places), *_likelier_places(found).values()]


def _likelier_places(found: Diagnosis) -> dict[str, LocalAnomaly]:
    """Places that are likelier than an accepted effect, by its name, spread over where they may lie."""
    return {
        step.accepted: spread_over_its_error(step.places[step.likelier_place])
        for step in found.steps
        if step.likelier_place
    }


def values_tried(case: Case, found: Diagnosis) -> dict[str, float]:
    """`values_found`, and the sizes of the likelier places."""
    likelier = _likelier_places(found).values()
    return values_found(case, found) | {candidate_at(case, one).parameter: one.amplitude for one in likelier}


def values_found(case: Case, found: Diagnosis) -> dict[str, float]:
    """Parameters of the last model of a diagnosis by name, sizes of places as large as they are spread."""
    values = {name: three[0] for name, three in found.parameters.last.items()}
    for place in found.places:
        share = spread_over_its_error(place).plausible / place.plausible
        values[candidate_at(case, place).parameter] *= share
    return values


def in_doubt(found: Diagnosis) -> bool:
    """Whether what was found may stand in for something else: then held-out errors must fall clearly."""
    return found.verdict.kind == "cannot-tell" or found.field is not None
