"""A field is so free that it has to beat all else clearly, and a place is measured by what it competed with."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from vegglue.diagnosis import diagnose
from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.conclusion import field_goes_first
from vegglue.diagnosis.search_state import PriorWeight, SearchState
from vegglue.progress import silent
from vegglue.results.causes import Step


@pytest.mark.parametrize(("log_factor", "gained", "first"), [
    (3.7, 0.0, False), (1.8, -2.0, False), (6.0, 0.0, True), (30.0, 26.0, False), (30.0, 10.0, True),
])  # fmt: skip
def test_a_field_beats_the_rest_by_a_hundred_to_one(log_factor: float, gained: float, first: bool) -> None:
    """The first two were told on sites of the blind study on which nothing is hidden."""
    assert field_goes_first(log_factor, gained) == first


@pytest.mark.parametrize(("kind", "gained"), [("effect", -6.0), ("bed", 10.0)])
def test_the_error_of_its_shape_takes_nothing_from_what_a_place_explained(
    monkeypatch: pytest.MonkeyPatch, kind: str, gained: float
) -> None:
    """As the bar of open-i: ln B 21 where it competed, 5 with the error of its shape in the covariance, -11 for its
    prior.
    """
    after = SimpleNamespace(fitted=SimpleNamespace(chi2=225.0), log_evidence=5.0)
    before = SimpleNamespace(fitted=SimpleNamespace(point=None), noise=None, log_evidence=0.0)
    monkeypatch.setattr(diagnose, "calibrated_with", lambda *_: after)
    monkeypatch.setattr(diagnose, "log_evidence", lambda base: base.log_evidence)
    monkeypatch.setattr(diagnose, "_without_error_of_shape", lambda *_: 21.0)
    monkeypatch.setattr(diagnose, "chi2", lambda *_: 287.0)
    monkeypatch.setattr(diagnose, "anomaly_found", lambda *_: SimpleNamespace())
    monkeypatch.setattr(diagnose, "step_found", lambda *_: SimpleNamespace(accepted="a", groups=()))
    what: Any = SimpleNamespace(log_factor=21.0)
    screening: Any = SimpleNamespace(base=before)
    following = diagnose._branch(screening, [Hypothesis(kind, "a", 10.0, 0, what)], 0, SearchState(), silent)
    assert following is not None
    assert following.found.gained(0.0, 5.0) == pytest.approx(gained)


def test_an_instrument_that_explains_less_than_nothing_is_not_set_aside() -> None:
    one = Hypothesis("reading", "reading", -0.1, 0, SimpleNamespace())
    screening: Any = SimpleNamespace(base=None)
    assert diagnose._without_instrument(screening, one, cast("Any", one.what), SearchState(), silent) is None


def step_of(name: str) -> Step:
    return Step(name, (name,), (1.0,), ((name,),), 200.0, 5.0, 1e-4)


def test_an_effect_explains_what_those_did_that_it_makes_unneeded() -> None:
    prior_weights = (
        PriorWeight("wind", 40.0, -6.0),
        PriorWeight("reading", 0.0, -3.0),
        PriorWeight("elder", 9.0, -5.0),
    )
    found = SearchState(steps=(step_of("wind"), step_of("elder")), prior_weights=prior_weights)
    assert (found.explained, found.log_prior) == (49.0, -14.0)
    more = diagnose._with_step(found, step_of("undergrowth"), ["wind"], 11.0, -7.0)
    assert [one.accepted for one in more.steps] == ["elder", "undergrowth"]
    assert (more.explained, more.log_prior) == (60.0, -15.0)


def test_a_rival_keeps_the_charge_of_the_effect_that_it_replaces() -> None:
    found = SearchState(
        steps=(step_of("wind"),), prior_weights=(PriorWeight("wind", 40.0, -6.0), PriorWeight("gauge", 0.0, -1.0))
    )
    again = diagnose._with_steps(found, (step_of("elder"),))
    assert [one.name for one in again.prior_weights] == ["elder", "gauge"]
    assert diagnose._with_step(again, step_of("undergrowth"), ["elder"], 1.0, -7.0).log_prior == -8.0
