"""Chances of what competes: as often true as told, tempered by what fingerprints may be wrong, and told anew."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from coarse_twin import CASE

from vegglue.calibration import score_test
from vegglue.case.case_effects import effect_named
from vegglue.diagnosis import place_search
from vegglue.diagnosis.competition import worth_refitting
from vegglue.diagnosis.odds import tempered_odds, tempered_probabilities
from vegglue.diagnosis.place_search import found_extent
from vegglue.diagnosis.search_state import followed_further, with_chances
from vegglue.results.causes import Step

ROWS, SLOPES, PRINTS = 60, 3, 8


def test_the_likeliest_rival_is_true_as_often_as_told() -> None:
    """Eight effects that look alike, fingerprints without error, lengths from 3 to 9: told 0.79, true 0.81.

    With half or twice the exponent 0.62 and 0.89 are told.
    """
    random = np.random.default_rng(5)
    slopes, fingerprints = 3.0 * random.standard_normal((ROWS, SLOPES)), random.standard_normal((ROWS, PRINTS))
    random, tries = np.random.default_rng(12), 2000
    fingerprints = fingerprints[:, :1] + 0.6 * fingerprints
    projected = score_test.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), fingerprints)
    told, right = 0.0, 0
    for _ in range(tries):
        true, length = int(random.integers(PRINTS)), random.uniform(3.0, 9.0)
        residual = length * projected.units[:, true] + random.standard_normal(ROWS + SLOPES)
        chance = tempered_probabilities(0.5 * (projected.units.T @ residual) ** 2, trace_error=0.0)
        told, right = told + chance.max(), right + (int(np.argmax(chance)) == true)
    assert told == pytest.approx(right, abs=0.03 * tries)


def test_a_long_trace_may_be_as_wrong_as_its_length_says() -> None:
    """15 % of a fingerprint of 40 standard errors are 6: a misfit 37 larger proves as little as 1 for a short one."""
    assert tempered_probabilities(0.5 * np.array([1637.0, 1600.0]))[1] == pytest.approx(0.378, abs=0.001)
    assert tempered_probabilities(0.5 * np.array([1.0, 0.0]))[1] == pytest.approx(0.378, abs=0.001)
    assert tempered_probabilities(0.5 * np.array([46.0, 9.0]))[1] < 1e-5


def test_odds_are_those_of_the_chances_of_two() -> None:
    one, other = tempered_probabilities(np.array([46.0, 39.0]))
    assert tempered_odds(46.0, 39.0) == pytest.approx(one / other)
    assert tempered_odds(39.0, 46.0) == pytest.approx(other / one)
    assert np.isfinite(tempered_odds(1e5, 0.0))


STEP = Step("a", ("a", "b"), (0.6, 0.3), (("a", "b"),), 900.0, 300.0, 1e-3, {"a place": 0.1})


def test_chances_of_what_was_followed_are_shared_anew() -> None:
    told = followed_further(STEP, ["a", "a place"], np.array([0.25, 0.75]))
    assert told.chance == pytest.approx({"b": 0.3, "a": 0.175})
    assert told.others == pytest.approx({"a place": 0.525})
    assert sum(told.chances) + sum(told.others.values()) == pytest.approx(1.0)


def test_what_has_become_negligible_is_no_rival_any_more() -> None:
    told = followed_further(STEP, ["a", "a place"], np.array([1.0 - 1e-4, 1e-4]))
    assert (told.rivals, told.groups, told.others) == (("a", "b"), (("a", "b"),), {})


def test_what_was_accepted_on_trial_stands_in_its_set() -> None:
    """Else there would be no words for it."""
    told = with_chances(STEP, "c", {"a": 0.6, "b": 0.37, "c": 0.03})
    assert (told.accepted, told.rivals, told.groups) == ("c", ("a", "b", "c"), (("a", "b"), ("c",)))


def test_effects_are_refitted_while_they_are_within_reach_of_what_is_kept() -> None:
    """To first order a promises 20, b 3 and c -30. If a keeps less, or has no flow, b is within reach, and c never."""
    promised = np.array([20.0, 3.0, -30.0])
    assert worth_refitting(promised, 20.0) == [0]
    assert worth_refitting(promised, 18.0) == [0]
    assert worth_refitting(promised, 3.0) == [0, 1]
    assert worth_refitting(promised, 100.0) == [0], "one at least"
    assert worth_refitting(np.zeros(0), -np.inf) == []


@pytest.mark.parametrize(("lengths", "log_sd"), [([2.0, 6.0], 0.5 * np.log(3.0)), ([2.0, 2.0], 0.7)])
def test_an_extent_has_a_prior_where_only_spots_of_one_length_fit(
    monkeypatch: pytest.MonkeyPatch, lengths: list[float], log_sd: float
) -> None:
    """A reach shorter than 3.6 widths has no room for long spots of viscosity."""
    tried: list[Any] = []
    monkeypatch.setattr(place_search, "refits_of", lambda _, trials: tried.extend(trials) or [None for _ in trials])
    place = {"x": 12.0, "y": 0.5, "length": 2.0, "width": 0.5}
    places: Any = SimpleNamespace(
        x=np.array([10.0, 14.0]), y=np.array([0.0, 1.0]), length=np.array(lengths), width=np.array([0.5, 0.5]),
        plausible=0.01,
    )  # fmt: skip
    spot: Any = SimpleNamespace(
        candidate=SimpleNamespace(effect=effect_named(CASE, "unlisted_viscosity"), above_off=False), amplitude=0.01,
        fitted=SimpleNamespace(point=SimpleNamespace(z=np.zeros(3))), shapes=place,
    )  # fmt: skip
    nothing: Any = None
    kind: Any = SimpleNamespace(log_prior=np.zeros(2))
    assert found_extent(nothing, places, kind, spot, place, -np.inf) is None
    assert [dict(one.candidate.fitted)["length"].log_sd for one in tried] == pytest.approx([log_sd, log_sd])
