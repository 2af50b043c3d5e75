"""Which hypothesis is taken, of made-up evidence."""

import numpy as np
import pytest

from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import (
    MOST_FOLLOWED,
    Hypothesis,
    What,
    chance_of_a_place,
    chosen_hypothesis,
    nearly_as_likely,
)
from vegglue.diagnosis.odds import log_odds_taken, odds_against_nothing, under_larger_errors


def followed(**evidence: float) -> list[str]:
    """Kinds of those followed, of hypotheses by their kinds, most evidence first."""
    hypotheses = [Hypothesis(kind, kind, log, 0, None) for kind, log in evidence.items()]
    return [hypotheses[j].kind for j in nearly_as_likely(hypotheses)]


def test_what_is_nearly_as_likely_is_followed() -> None:
    assert followed(effect=1.0, drag=-1.2, bed=-1.4) == ["effect", "drag"]


def test_no_more_are_followed_than_are_worth_it() -> None:
    assert len(followed(drag=1.0, bed=0.9, inflow=0.8, viscosity=0.7)) == MOST_FOLLOWED
    known = followed(drag=1.0, bed=0.9, inflow=0.8, viscosity=0.7, gauge=0.6, effect=0.5)
    assert known == ["drag", "bed", "gauge"], "what is known is among them"


@pytest.mark.parametrize(
    ("what", "odds", "expected"),
    [
        (("effect", "place"), (1.0, 1.1), 0),  # what is known is the likeliest
        (("place", "effect"), (1.0, 1.1 * constants().known_first_odds), 0),  # what is vague leads by enough
        (("place", "effect"), (1.0, 0.9 * constants().known_first_odds), 1),  # and by too little
        (("place", "effect", "effect"), (1.0, 8.0, 8.0), None),  # by enough of each, and not of both
        (("place", "instrument"), (1.0, 3.0), None),
        (("place", "place"), (1.0, 1.1), 0),  # both say the same: none of what is known
        (("place", "place", "effect"), (1.0, 1.1, 9.0), 0),
        (("place", "place", "instrument"), (1.0, 4.0, 9.0), 0),
        (("place", "place", "effect"), (1.0, 1.1, 2.0), 2),
        (("instrument", "place"), (1.0, 2.0), 0),
    ],
)
def test_what_is_vague_has_to_lead_what_is_known(
    what: tuple[What, ...], odds: tuple[float, ...], expected: int | None
) -> None:
    """odds: of the likeliest against each; little evidence, so that it is not tempered."""
    likely = 1.0 / np.array(odds)
    at_a_place = likely[[one == "place" for one in what]].sum() / likely.sum()
    assert chosen_hypothesis(what, np.log(likely), at_a_place) == expected


def test_chances_of_places_count_together() -> None:
    kinds = ("drag", "effect", "bed", "probe")
    hypotheses = [Hypothesis(kind, kind, 0.0, 0, None) for kind in kinds]
    assert chance_of_a_place(hypotheses, (0.5, 0.2, 0.2, 0.1)) == pytest.approx(0.7)


def test_hypotheses_compete_with_nothing_too() -> None:
    """An alarm of odds of two to one named foliage, a deposit and drag on reaches with nothing hidden."""
    even, none = np.log([0.5, 0.5]), np.array([-9.0])
    assert odds_against_nothing(even) == pytest.approx(1.0)
    assert odds_against_nothing(none) == pytest.approx(np.exp(-9.0))
    strong = np.array([np.log(5.0), -9.0])
    assert odds_against_nothing(strong) > constants().missing_odds > odds_against_nothing(even)


@pytest.mark.parametrize(
    ("left", "share"),
    [
        (200.0, 0.0),  # errors as stated
        (230.0, 0.0),  # more than their mean, as errors alone may leave
        (400.0, 0.5),  # twice as much: errors are 2^(1/2) times as large
    ],
)
def test_what_is_explained_counts_less_beside_a_misfit_that_nothing_explains(left: float, share: float) -> None:
    evidence, explained = np.array([8.0, 5.0]), np.array([16.0, 10.0])
    found = under_larger_errors(evidence, left + 32.0 - 2.0 * explained, left + 32.0, 200)
    assert found == pytest.approx(evidence - share * explained)


def test_of_one_trace_the_likelier_size_leads_where_errors_are_too_small() -> None:
    """A size of 3.4 standard deviations leads one of 1.6 by 14 in chi2, and not where all errors are too small."""
    prior = -0.5 * np.array([3.4, 1.6]) ** 2
    for least, leading in ((180.0, 0), (600.0, 1)):
        left = np.array([least, least + 14.0])
        assert np.argmax(under_larger_errors(prior - 0.5 * left, left, left.max(), 200)) == leading


def test_a_place_beside_a_misfit_that_nothing_explains_does_not_lead_nothing() -> None:
    """One drag of A2 in docs/measured.md: E is 3.8 with 16 of likelihood, and 465 of 285 readings are left."""
    at_stated = np.array([3.8])
    found = under_larger_errors(at_stated, np.array([465.0]), 497.0, 285)
    assert odds_against_nothing(found) < 1.0 < constants().missing_odds < odds_against_nothing(at_stated)


def test_only_what_would_be_taken_counts_beside_a_rival() -> None:
    """What is followed a step further has the evidence of all that would be taken then, and of nothing else."""

    def next_to(*evidence: float) -> float:
        return log_odds_taken(np.array(evidence))

    least = np.log(constants().missing_odds)
    assert next_to(least - 0.1) == next_to(-np.inf, -1.0) == 0.0
    assert next_to(least + 0.1) == pytest.approx(least + 0.1)
    assert next_to(2.0, 2.0) == pytest.approx(2.0 + np.log(2.0))
