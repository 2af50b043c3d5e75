"""What was found, in words: effects, places, fields, instruments, each with its size, and the model's own error."""

from collections.abc import Mapping, Sequence

import numpy as np

from vegglue.calibration.candidates import Instrument
from vegglue.calibration.fingerprints import EFFECT_AT_PLACE
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.search_state import SearchState, Undecided
from vegglue.results.causes import FAULT_WORDS, UNIT_OF_FIELD, CandidateLaws
from vegglue.results.diagnosis import (
    CandidateEffect,
    EstimatedErrors,
    FaultyInstrument,
    FieldFound,
    LocalAnomaly,
    ModelErrorUsed,
    Step,
)
from vegglue.wording.numbers import in_digits, listed, range_in_digits

# Chance of what is named, below which it is stated: above, it would be told as 100 %.
STATED_BELOW = 0.995
# Standard error of a place [m] below which its digits say enough.
TOLD_ERROR = 0.3
# Terms whose size is part of what acts, in words.
TOLD_BY_SIZE = ("bed", "inflow")
# Hypotheses that are told where none is surely it, and effects that stand out beside what was accepted.
UNDECIDED_TOLD, STANDING_OUT_TOLD = 3, 3
# p below which it is one over the number of draws: none of them was as large.
LEAST_P_TOLD = 5e-4


def causes_in_words(found: SearchState, candidate_effects: Sequence[CandidateEffect]) -> str:
    """Places, then effects."""
    places = [_place_words(one) for one in found.places]
    return "; and ".join([*places, *(_step_words(step, candidate_effects) for step in found.steps)])


def _place_words(place: LocalAnomaly) -> str:
    low, high = place.interval95
    at = f"x = {place.x:.1f}{_give_or_take(place.x_error)}, y = {place.y:.1f}{_give_or_take(place.y_error)} m"
    range95 = range_in_digits((low, high))
    size = f"{in_digits(place.amplitude)} {place.unit}"
    told = f"{range95} {place.unit}" if place.term in TOLD_BY_SIZE else f"{size}, {range95}"
    what = _what_acts(place.term, place.amplitude)
    return f"at {at} it acts as if {what} ({'; '.join([told, *_against(place)])})"


def _against(place: LocalAnomaly) -> list[str]:
    """Odds against the nearest other term, and against what is known where that is near."""
    nearest = sorted(place.odds.items(), key=lambda one: one[1])
    terms = [one for one in nearest if one[0] in EFFECT_AT_PLACE][:1]
    most = 1.0 / constants().rival_share
    known = [(name, odds) for name, odds in nearest if name not in EFFECT_AT_PLACE and odds < most][:1]
    return [f"{_odds(odds)} against {FAULT_WORDS.get(name, name)}" for name, odds in (*terms, *known)]


def _what_acts(term: str, amplitude: float) -> str:
    return {
        "drag": "something holds the flow back" if amplitude > 0 else "something lets the flow pass or pushes it on",
        "bed": f"the bed lies {abs(amplitude):.2f} m {'higher' if amplitude > 0 else 'lower'}",
        "inflow": f"water {'enters' if amplitude > 0 else 'leaves'}, {in_digits(abs(amplitude))} m3/s",
        "viscosity": f"the water mixes {'more' if amplitude > 0 else 'less'}",
    }[term]


def _give_or_take(error: float) -> str:
    """(give or take 4 m), where that is more than is told by a digit."""
    return f" (give or take {error:.1f})" if error > TOLD_ERROR else ""


def _odds(odds: float) -> str:
    """30 to 1, or 1 to 3 of what was taken all the same once it was followed further."""
    if odds < 1.0:
        return f"1 to {1.0 / odds:.0f}" if odds > 0.001 else "1 to over 1,000"
    return "over 1,000 to 1" if odds > 1000 else f"{odds:.0f} to 1"


def field_sentence(field: FieldFound) -> str:
    """What varies, over which distance, and where most surely."""
    what = {"friction": "friction", "bed": "the bed level", "viscosity": "viscosity", "inflow": "water that enters"}
    value = f"{field.value:+.0%}" if field.term == "friction" else f"{field.value:+.3g} {UNIT_OF_FIELD[field.term]}"
    along, across = (in_digits(2 * size, 2) for size in (field.length, field.width))
    return (
        f"it acts like {what[field.term]} that differs from place to place over some {along} m along "
        f"and {across} m across, most surely around x = {field.x:.1f}, y = {field.y:.1f} m ({value})"
    )


def _percent(chance: float) -> str:
    """A chance as it is told: neither 0 nor 100%."""
    if chance < 0.01:
        return "under 1%"
    return "over 99%" if chance > 0.99 else f"{chance:.0%}"


TO_DISCOVER = "`vegglue discover` calibrates such laws beside what is listed, and writes the best one down."


def law_in_words(laws: CandidateLaws) -> str:
    """Which quantity in which term, and how likely."""
    best, chance = laws.laws[0], sum(one.chance for one in laws.alike)
    return (
        f"a law of {best.quantity} in {best.term} would explain it, with a chance of {_percent(chance)} among "
        "all that was compared to first order; errors alone make laws stand out as much in "
        f"{100 * laws.p:.1g}% of cases"
    )


def instruments_in_words(instruments: Sequence[FaultyInstrument]) -> str:
    """A sentence for each that is off."""
    return " ".join(f"{_instrument_words(one)}." for one in instruments)


def _instrument_words(one: FaultyInstrument) -> str:
    where = _where(one.x, one.y)
    what = {
        "reading": f"One reading at {where} m is off",
        "position": f"The probe at {where} m is off in all experiments",
        "probe": f"The probe at {where} m is off in all sections",
        "gauge": f"The gauge at {where} m is off in all experiments",
    }[one.kind]
    low, high = one.interval95
    rather = "" if np.isnan(one.factor) else f", rather by a factor of {one.factor:.3g} than by the same everywhere"
    return f"{what} by {in_digits(one.offset)} {one.unit} ({range_in_digits((low, high))}){rather}; it was set aside"


def _where(x: float, y: float) -> str:
    """x = 14.3, y = 1.5, without what is NaN."""
    return ", ".join(f"{name} = {in_digits(value, 4)}" for name, value in (("x", x), ("y", y)) if np.isfinite(value))


def _step_words(step: Step, candidate_effects: Sequence[CandidateEffect]) -> str:
    """A place that is likelier than every effect comes first, then the accepted effect, then what it may be instead."""
    first = step.likelier_place
    by_name = {candidate_effect.name: candidate_effect for candidate_effect in candidate_effects}
    best = by_name[step.accepted]
    low, high = best.amplitude.interval95
    unit = "" if best.amplitude.unit == "-" else f" {best.amplitude.unit}"
    size, range95 = f"{in_digits(best.amplitude.value)}{unit}", range_in_digits((low, high))
    words = f"{step.accepted} of {size} ({range95}; {best.title.lower()})"
    alike = next(group for group in step.groups if step.accepted in group)
    same = [name for name in alike if name != step.accepted]
    rest = [name for name in step.rivals if name not in alike]
    own = sum(step.chance[name] for name in alike)
    if same:
        words += f", which leaves the same trace in these data as {', '.join(same)}"
    if rest or own < STATED_BELOW:
        words += f", {'together ' if same else ''}with a chance of {_percent(own)} among all that was tried"
    instead = _instead(step, rest, [name for name in step.others if name != first])
    words += f", or else {' or '.join(instead)}" if instead else ""
    return f"{_likelier_words(step, first)}{words}" if first else words


def _instead(step: Step, effects: Sequence[str], others: Sequence[str]) -> list[str]:
    """What may be it instead, in words, the likeliest first; others: of other kinds."""
    told = [(step.chance[name], _with_its_chance(step, name)) for name in effects]
    told += [(step.others[name], _other_words(step, name)) for name in others]
    return [words for _, words in sorted(told, key=lambda one: -one[0])]


def _likelier_words(step: Step, name: str) -> str:
    chance = _percent(step.others[name])
    return f"most likely something in no list ({chance}): {_place_words(step.places[name])}; or else "


def _other_words(step: Step, name: str) -> str:
    """One of another kind with its chance; of something at a place, what it does and where; of an instrument, which."""
    chance = f"({_percent(step.others[name])})"
    if name not in step.places:
        return f"{FAULT_WORDS.get(name, name)} {chance}"
    place = step.places[name]
    return f"{_briefly(place.term, place.amplitude, place.x, place.y)} {chance}"


def _briefly(term: str, amplitude: float, x: float, y: float) -> str:
    return f"something in no list, as if {_what_acts(term, amplitude)} at x = {x:.1f}, y = {y:.1f} m"


def left_over_in_words(errors: EstimatedErrors, significant_effects: Mapping[str, float], remainder: bool) -> str:
    """What the model with all that was accepted still asks for: larger errors than stated, and which effects stand out
    in it; '' for neither. remainder: whether these may be what is left of what was accepted.
    """
    asked = f"Even so the model asks for errors {errors.scale:.1f} times as large as stated"
    larger = f"{asked}; chi2 and intervals are under these."
    return " ".join([*([larger] if errors.clearly_larger else []), *_significant_words(significant_effects, remainder)])


def _significant_words(significant_effects: Mapping[str, float], remainder: bool) -> list[str]:
    """A sentence on the effects that stand out, the clearest first."""
    ranked = sorted(significant_effects.items(), key=lambda one: one[1])
    told = [f"{name} ({p_in_words(p)})" for name, p in ranked[:STANDING_OUT_TOLD]]
    left = len(ranked) - len(told)
    names = listed([*told, *([f"{left} more"] if left else [])])
    verbs = "stands out among all effects, but was" if len(ranked) == 1 else "stand out among all effects, but were"
    why = ": a remainder of what was, which no model has quite right, may look like that" if remainder else ""
    return [f"Beside it {names} {verbs} not accepted{why}."] if told else []


def p_in_words(p: float) -> str:
    """`p = 0.008`, or that it is below the least that draws can count."""
    return f"p < {p:.1g}" if p < LEAST_P_TOLD else f"p = {p:.1g}"


def undecided_in_words(undecided: Undecided) -> str:
    """The likeliest hypotheses with their chances among all of them."""
    return " or ".join(f"{_hypothesis_words(one)} ({_percent(chance)})" for one, chance in _told_of(undecided))


def places_told(found: SearchState) -> list[tuple[float, float]]:
    """x and y [m] of what the sentence on causes tells at places outside the list."""
    rivals = [one.what for one, _ in _told_of(found.undecided) if one.kind != "effect"] if found.undecided else []
    of_rivals = [(one.shapes["x"], one.shapes["y"]) for one in rivals if not isinstance(one, Instrument)]
    return [(one.x, one.y) for one in found.places] or of_rivals


def _told_of(undecided: Undecided) -> list[tuple[Hypothesis, float]]:
    pairs = zip(undecided.hypotheses, undecided.chances, strict=True)
    return sorted(pairs, key=lambda one: -one[1])[:UNDECIDED_TOLD]


def _hypothesis_words(one: Hypothesis) -> str:
    """The name of an effect, what something unlisted does and where, or which instrument is off."""
    if isinstance(one.what, Instrument):
        return f"{FAULT_WORDS[one.what.kind]} at {_where(one.what.x, one.what.y)} m"
    if one.kind == "effect":
        return one.name
    return _briefly(one.kind, one.what.amplitude, one.what.shapes["x"], one.what.shapes["y"])


def with_their_chances(step: Step, names: Sequence[str]) -> list[str]:
    """Names with their chances."""
    return [_with_its_chance(step, name) for name in names]


def _with_its_chance(step: Step, name: str) -> str:
    return f"{name} ({_percent(step.chance[name])})"


def model_error_in_words(used: ModelErrorUsed) -> str:
    """The model may be wrong by 5 % of its friction everywhere; the misfit asks for 60 % of that. Where it asks for
    more than all of that, and not beyond doubt, the doubt is told.
    """
    allowed = f"by {used.friction:.0%} of its friction and {100 * used.bed:.2g} cm of its bed everywhere"
    asked = f"{'none' if used.needed == 0.0 else f'{used.needed:.0%}'} of that"
    if used.needed > 1.0 and not used.asks_for_more:
        asked += ", though what is allowed explains it nearly as well"
    return f"The model may be wrong {allowed}, and its site as the config says; the misfit asks for {asked}."
