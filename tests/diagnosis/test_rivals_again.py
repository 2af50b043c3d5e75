"""Effects accepted earlier, compared again with everything else once something later is in the model."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from coarse_twin import coarse_twin
from diagnoses import a_candidate_effect

from vegglue.calibration.baseline import Baseline, baseline
from vegglue.calibration.residual_screening import Screening, screen
from vegglue.case.parameter_space import theta_at, z_at
from vegglue.diagnosis import search_state
from vegglue.diagnosis.candidate_effects import candidate_effects_of
from vegglue.diagnosis.child_config import candidate_named, with_additions
from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.diagnosis.search_state import PriorWeight, SearchState, with_rivals_again
from vegglue.engine.interface import Model, linearise
from vegglue.progress import silent
from vegglue.results.causes import CandidateEffect, Step

# What is hidden, what was taken for the first of both, and amplitudes that are clearly seen.
TRUE, LATER, TAKEN = "viscosity", "discharge_error[high]", "edge_mixing"
HIDDEN = {TRUE: 0.02, LATER: 0.1}
# Where a probe stood in every section [m].
PROBE = -1.0


def a_step(name: str) -> Step:
    return Step(name, (name,), (1.0,), ((name,),), 200.0, 100.0, 1e-4)


def found_with(*names: str) -> SearchState:
    """What was found with these effects, one after the other."""
    weights = tuple(PriorWeight(name, 50.0, -5.0) for name in names)
    return SearchState(steps=tuple(map(a_step, names)), prior_weights=weights)


def alarmed(_: Screening, found: SearchState) -> SearchState:
    return replace(found, p=0.0, rate=1.0)


def with_effects(model: Model, *names: str) -> Model:
    return replace(
        model, case=with_additions(model.case, [(candidate_named(model.case, model.station, one), {}) for one in names])
    )


def measured_with(hidden: dict[str, float], width: float | None = None) -> Model:
    """The coarse twin at measurements of what is hidden, with errors of what is stated; width: of one effect."""
    model, _ = coarse_twin()
    true = with_effects(model, *hidden) if width is None else of_width(model, *hidden, width)
    theta = theta_at(model.case, np.zeros((1, len(model.names))))
    for name, size in hidden.items():
        theta[candidate_named(model.case, model.station, name).parameter] = np.array([size])
    point = linearise(true, z_at(true.case, theta)[0])
    assert point is not None
    error = model.station["standard_error"].to_numpy(float)
    values = point.prediction + error * np.random.default_rng(4).standard_normal(error.size)
    return replace(model, station=model.station.assign(value=values))


def of_width(model: Model, name: str, width: float) -> Model:
    one = candidate_named(model.case, model.station, name)
    return replace(model, case=with_additions(model.case, [(one, {"width": width})]))


@pytest.fixture(scope="module")
def measured() -> Model:
    return measured_with(HIDDEN)


Again = tuple[Baseline, SearchState, dict[str, CandidateEffect]]


@pytest.fixture(scope="module")
def again(measured: Model) -> Again:
    """What was taken for the first, with the second in the model, compared again."""
    base = baseline(with_effects(measured, TAKEN, LATER))
    found, known = found_with(TAKEN, LATER), candidate_effects_of(screen(baseline(measured)))
    return with_rivals_again(base, found, found.steps[:1], known, silent)


@pytest.mark.slow
def test_an_effect_that_explains_more_beside_the_later_one_takes_its_place(again: Again) -> None:
    base, found, _ = again
    step, later = found.steps
    assert (step.accepted, later.accepted) == (TRUE, LATER)
    assert TRUE in base.model.case.effects
    assert TAKEN not in base.model.case.effects
    assert (step.chi2_before, step.chi2_after) == (200.0, 100.0), "what it explained when it was accepted"


@pytest.mark.slow
def test_what_was_accepted_later_is_no_rival(again: Again) -> None:
    _, found, _ = again
    assert LATER not in found.steps[0].rivals


@pytest.mark.slow
def test_rivals_have_the_amplitudes_of_their_refits(again: Again) -> None:
    _, found, candidate_effects = again
    assert all(candidate_effects[name].amplitude.refitted for name in found.steps[0].rivals)
    assert candidate_effects[TRUE].amplitude.value == pytest.approx(HIDDEN[TRUE], rel=0.3)


@pytest.mark.slow
def test_an_effect_is_in_the_model_with_the_shapes_that_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """It stayed 1.2 m wide there, and was told, and added to the child config, with a width of 0.3 m."""
    monkeypatch.setattr(search_state, "with_alarm", alarmed)  # it is too small to be accepted
    model = measured_with({TAKEN: 0.3}, 0.3)
    known = candidate_effects_of(screen(baseline(model)))
    found = found_with(TAKEN, LATER)
    base, found, candidate_effects = with_rivals_again(
        baseline(of_width(model, TAKEN, 1.2)), found, found.steps[:1], known, silent
    )
    assert found.effects == [TAKEN, LATER]
    assert candidate_effects[TAKEN].shapes == {"width": 0.3}
    assert base.model.case.effects[TAKEN].values["width"] == 0.3


@pytest.mark.slow
def test_an_effect_that_the_later_one_makes_unneeded_is_dropped() -> None:
    """Mixing at the sides of patches stood for mixing everywhere, until that was accepted beside it."""
    model = measured_with({TRUE: 0.02})
    found, known = found_with(TAKEN, TRUE), candidate_effects_of(screen(baseline(model)))
    base = baseline(with_effects(model, TAKEN, TRUE))
    base, found, _ = with_rivals_again(base, found, found.steps[:1], known, silent)
    assert found.effects == [TRUE]
    assert found.steps[0].chi2_before == 200.0
    assert TAKEN not in base.model.case.effects


def test_what_a_dropped_effect_explained_is_explained_by_the_last() -> None:
    found = found_with(TAKEN, LATER)
    left = found.without_step(found.steps[0], 8.0)
    assert [one.name for one in left.prior_weights] == [LATER]
    assert left.explained == found.explained - 8.0
    assert left.log_prior == found.log_prior / 2.0


@pytest.mark.parametrize("lost", ["no flow without it", "no flow with it"])
def test_a_step_stays_where_no_flow_is_found(lost: str, monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: Any = SimpleNamespace(point=None)
    base = Baseline(*coarse_twin()[:1], None, fitted, None, None)
    less = None if lost == "no flow without it" else base
    monkeypatch.setattr(search_state, "candidate_in_case", lambda *_: None)
    monkeypatch.setattr(search_state, "without_effect", lambda *_: less)
    monkeypatch.setattr(search_state, "screen", lambda *_: "screening")
    monkeypatch.setattr(search_state, "chi2", lambda *_: 0.0)
    monkeypatch.setattr(search_state, "with_alarm", alarmed)
    monkeypatch.setattr(search_state, "hypotheses_of", lambda *_: [Hypothesis("probe", "probe", 1.0, 0, None)])
    found, known = found_with(TAKEN, LATER), {TAKEN: a_candidate_effect(TAKEN)}
    left, kept, again = with_rivals_again(base, found, found.steps[:1], known, silent)
    assert (left, kept, again) == (base, found, known)


@pytest.mark.slow
def test_an_instrument_that_is_set_aside_is_no_rival_of_what_went_before() -> None:
    """A probe off by four standard errors is first one of two that may be off, and then set aside beside the other."""
    model = measured_with({TRUE: 0.01})
    station = model.station
    probe = (station["kind"] == "velocity") & (station["y"] == PROBE)
    found = diagnose_model(replace(model, station=station.assign(value=station["value"] + 0.044 * probe)))
    (step,) = found.steps
    assert (step.accepted, step.others) == (TRUE, {})
    assert [one.kind for one in found.instruments] == ["probe"]
