"""A field is so free that it has to beat all else clearly, and a place is measured by what it competed with."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
from diagnoses import an_anomaly

from vegglue.calibration.candidates import Instrument
from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.conclusion import field_goes_first
from vegglue.diagnosis.diagnose import branch_with
from vegglue.diagnosis.refits import Refit
from vegglue.diagnosis.search_state import PriorWeight, SearchState
from vegglue.progress import silent
from vegglue.results.causes import Step


@pytest.mark.parametrize(("log_factor", "gained", "first"), [
    (3.7, 0.0, False), (1.8, -2.0, False), (6.0, 0.0, True), (30.0, 26.0, False), (30.0, 10.0, True),
])  # fmt: skip
def test_a_field_beats_the_rest_by_a_hundred_to_one(log_factor: float, gained: float, first: bool) -> None:
    """The first two were told on sites of the blind study on which nothing is hidden."""
    assert field_goes_first(log_factor, gained) == first


def test_the_error_of_its_shape_takes_nothing_from_what_a_place_explained() -> None:
    """As the bar of open-i: ln B 21 where it competed, 5 with the error of its shape in the covariance, -11 for its
    prior. An effect without such an error gained what the model has.
    """
    place = SearchState().with_place(an_anomaly(term="bed"), PriorWeight("a", 62.0, -11.0), 21.0 - 5.0)
    assert place.gained(0.0, 5.0) == pytest.approx(10.0)
    assert SearchState().with_step(step_of("a"), [], 62.0, -11.0).gained(0.0, 5.0) == pytest.approx(-6.0)


@pytest.mark.parametrize("kind", ["reading", "effect", "bed"])
def test_what_explains_less_than_nothing_leads_nowhere(kind: str) -> None:
    what = Instrument("reading", (1,), 1.0, 1.0) if kind == "reading" else Refit(None, {}, None, 0.0, 0.0, (0.0, 0.0))
    one, screening = Hypothesis(kind, kind, -0.1, 0, what), cast("Any", SimpleNamespace(base=None))
    assert branch_with(screening, [one], 0, SearchState(), silent) is None


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
    more = found.with_step(step_of("undergrowth"), ["wind"], 11.0, -7.0)
    assert [one.accepted for one in more.steps] == ["elder", "undergrowth"]
    assert (more.explained, more.log_prior) == (60.0, -15.0)


def test_a_rival_keeps_the_charge_of_the_effect_that_it_replaces() -> None:
    found = SearchState(
        steps=(step_of("wind"),), prior_weights=(PriorWeight("wind", 40.0, -6.0), PriorWeight("gauge", 0.0, -1.0))
    )
    again = found.with_steps((step_of("elder"),))
    assert [one.name for one in again.prior_weights] == ["elder", "gauge"]
    assert again.with_step(step_of("undergrowth"), ["elder"], 1.0, -7.0).log_prior == -8.0
