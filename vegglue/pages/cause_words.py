"""What the report says of causes that are no listed effect: places, instruments, fields."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vegglue.pages.typography import NARROW, fixed, interval, percent, short, unit_html
from vegglue.results.causes import UNIT_OF_FIELD, FaultyInstrument, LocalAnomaly, Step
from vegglue.results.diagnosis import Diagnosis
from vegglue.wording.numbers import so_many
from vegglue.wording.sentences import phrase

# What a spot of each term means where its score is positive, and where it is negative.
TERM_SIGNS: Mapping[str, tuple[str, str]] = {
    "drag": ("more drag", "less drag"),
    "bed": ("a higher bed", "a lower bed"),
    "inflow": ("water that enters", "water that leaves"),
    "viscosity": ("more mixing", "less mixing"),
}
# Quantity and unit of a field, as they are told: what has none in %.
FIELD_WORDS: Mapping[str, tuple[str, str]] = {
    term: (words, UNIT_OF_FIELD[term].replace("-", "%"))
    for term, words in (
        ("friction", "friction"),
        ("bed", "bed level"),
        ("viscosity", "eddy viscosity"),
        ("inflow", "water that enters"),
    )
}
# Instruments that are off, as they are told, by their kind.
INSTRUMENT_WORDS = {
    "reading": "one reading",
    "position": "probe, in all experiments",
    "probe": "probe, in all sections",
    "gauge": "gauge, in all experiments",
}
# Rivals of a place whose odds are told: the nearest ones; and odds above which the figure no longer says more.
RIVALS_TOLD, TOLD_ODDS = 2, 1000.0
# Standard error of a place [m] below which one decimal says enough.
LEAST_ERROR_TOLD = 0.05


@dataclass(frozen=True)
class PlaceRow:
    """Something unlisted at a place (HTML)."""

    what: str
    x: str
    y: str
    spot: str
    size: str
    interval: str
    score: str
    odds: str
    experiments: str


@dataclass(frozen=True)
class InstrumentRow:
    """An instrument that is off (HTML)."""

    what: str
    where: str
    readings: str
    offset: str
    interval: str
    odds: str


def accepted_causes(diagnosis: Diagnosis) -> str:
    """What was taken into the model, effects and places, in words; '' for nothing."""
    places = [f"{what_at(one)} at {where(one.x, one.y)}" for one in diagnosis.places]
    return " and ".join([*places, *(step.accepted for step in diagnosis.steps)])


def what_at(place: LocalAnomaly) -> str:
    """'a higher bed', by the sign of its amplitude."""
    more, less = TERM_SIGNS[place.term]
    return more if place.amplitude > 0 else less


def where(x: float, y: float) -> str:
    """'x = 47.3 m, y = −0.3 m'; without what is NaN."""
    return ", ".join(f"{name} = {fixed(value, 1)} m" for name, value in (("x", x), ("y", y)) if np.isfinite(value))


def odds_in_words(odds: float) -> str:
    """'200 to 1', or '1 to 3' of what is less likely, two figures at most."""
    larger = max(odds, 1.0 / max(odds, 1e-300))
    told = f"over {TOLD_ODDS:,.0f}" if larger > TOLD_ODDS else short(larger, 2)
    return f"1 to {told}" if odds < 1.0 else f"{told} to 1"


def against_rivals(place: LocalAnomaly) -> str:
    """'200 to 1 against drag, 410 to 1 against streamlining': the nearest rivals, '' without."""
    nearest = sorted(place.odds.items(), key=lambda one: one[1])[:RIVALS_TOLD]
    if nearest and nearest[0][1] > TOLD_ODDS:
        return f"{odds_in_words(nearest[0][1])} against all else"
    told = [(name, odds) for name, odds in nearest if odds <= TOLD_ODDS]
    return ", ".join(f"{odds_in_words(odds)} against {phrase('instrument_kind', name)}" for name, odds in told)


def size_of(place: LocalAnomaly) -> str:
    """'0.19 m' (HTML)."""
    return f"{short(place.amplitude, 2)}{NARROW}{unit_html(place.unit)}"


def place_in_headline(place: LocalAnomaly) -> str:
    """'a lower bed by 0.19 m at x = 47.3 ± 0.4 m, y = −0.3 ± 0.1 m' (HTML); the word says the sign."""
    amount = f"{short(abs(place.amplitude), 2)}{NARROW}{unit_html(place.unit)}"
    at = ", ".join(
        f"{name} = {fixed(value, 1)}{f' ± {fixed(error, 1)}' if error >= LEAST_ERROR_TOLD else ''} m"
        for name, value, error in (("x", place.x, place.x_error), ("y", place.y, place.y_error))
    )
    return f"{what_at(place)} by {amount} at {at}"


def place_in_words(place: LocalAnomaly) -> str:
    """What, how large, where, and the odds, as below the map (HTML)."""
    told = against_rivals(place)
    return (
        f"{what_at(place)}, {size_of(place)} (95{NARROW}% in {interval(*place.interval95)}), at "
        f"{where(place.x, place.y)}, {fixed(abs(place.score), 1)} standard errors{f', {told}' if told else ''}"
    )


def likelier_place_in_words(step: Step) -> str:
    """'most likely (76 %) a lower bed of 0.3 m at x = 14.3 m, y = 1.3 m, which is in no list, or else ' (HTML); ''
    where the accepted effect is likelier.
    """
    name = step.likelier_place
    if not name:
        return ""
    place = step.places[name]
    return f"most likely ({percent(step.others[name])}) {place_in_headline(place)}, which is in no list, or else "


def instrument_at(one: FaultyInstrument) -> str:
    """'probe, in all sections, at y = 0.5 m'."""
    return f"{INSTRUMENT_WORDS[one.kind]}, at {where(one.x, one.y)}"


def instrument_in_words(one: FaultyInstrument) -> str:
    """Which, where, by how much (HTML)."""
    return f"{instrument_at(one)}, by {_offset(one)}"


def _offset(one: FaultyInstrument) -> str:
    rather = "" if np.isnan(one.factor) else f", rather by a factor of {short(one.factor, 2)}"
    return f"{short(one.offset, 2)}{NARROW}{unit_html(one.unit)}{rather}"


def place_rows(diagnosis: Diagnosis) -> list[PlaceRow]:
    """All places that were found, in the order in which they were."""
    return [
        PlaceRow(
            what=what_at(one),
            x=fixed(one.x, 1),
            y=fixed(one.y, 1),
            spot=f"{short(2 * one.length, 2)} × {short(2 * one.width, 2)}",
            size=size_of(one),
            interval=interval(*one.interval95),
            score=fixed(one.score, 1),
            odds=against_rivals(one),
            experiments=", ".join(one.experiments),
        )
        for one in diagnosis.places
    ]


def instrument_rows(diagnosis: Diagnosis) -> list[InstrumentRow]:
    """All instruments that are off and were set aside."""
    return [
        InstrumentRow(
            what=INSTRUMENT_WORDS[one.kind],
            where=where(one.x, one.y),
            readings=so_many(len(one.stations), "reading"),
            offset=_offset(one),
            interval=interval(*one.interval95),
            odds=odds_in_words(float(np.exp(min(one.log_factor, np.log(2 * TOLD_ODDS))))),
        )
        for one in diagnosis.instruments
    ]


def field_in_words(diagnosis: Diagnosis) -> str:
    """What the field is, and where it stands out most (HTML); '' without."""
    found = diagnosis.field
    if found is None:
        return ""
    scale = field_scale(found.term)
    what, unit = FIELD_WORDS[found.term]
    value, error = (
        fixed(scale * part, 0) if unit == "%" else short(scale * part, 2) for part in (found.value, found.error)
    )
    return (
        f"{what} that differs from place to place, over some {short(2 * found.length, 2)} m along and "
        f"{short(2 * found.width, 2)} m across; it stands out most at {where(found.x, found.y)}: {value} ± "
        f"{error}{NARROW}{unit_html(unit)}"
    )


def field_scale(term: str) -> float:
    """By which values of a field are multiplied before they are told: friction in %."""
    return 100.0 if FIELD_WORDS[term][1] == "%" else 1.0
