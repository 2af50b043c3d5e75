"""Laws beside everything listed: their alarm, what they are compared with, and what a diagnosis says of them."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from coarse_twin import coarse_twin
from diagnoses import IMPLAUSIBLE, an_anomaly, candidate_laws_of
from linear_baseline import CASE_OF_TWINS, at_best, measured_linearly, stations_of

from vegglue.decision_constants import constants
from vegglue.diagnosis import candidate_effects
from vegglue.diagnosis.candidate_effects import candidate_laws, laws_beside, same_as_accepted
from vegglue.diagnosis.competition import Hypothesis
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.diagnosis.refits import Refit
from vegglue.diagnosis.search_state import PriorWeight, SearchState
from vegglue.effects.grammar import LAWS
from vegglue.results.causes import CandidateLaws, Step
from vegglue.workflow.hidden_effect import measured_twin, true_place, twin_base

NAMES = ("law_bank_speed_step", "law_bank_speed_ramp", "law_floor_along_trend")


def suspected(
    found: SearchState, p: float = 1e-3, rivals: tuple[float, ...] = (0.0,), lost: float = 0.0, p_last: float = 1e-3,
    far: float = 0.0,
) -> CandidateLaws | None:  # fmt: skip
    """What is reported of three laws of ln evidence 9, 7 and 1, with this alarm, beside kinds of these ln evidences;
    lost: by how much less they have once they are calibrated; p_last: of the alarm beside all that was accepted; far:
    where a parameter lies with the likeliest of them in the model [standard deviations].
    """
    laws = [SimpleNamespace(law=LAWS[name], candidate=SimpleNamespace(amplitude=LAWS[name].effect.amplitude))
            for name in NAMES]  # fmt: skip
    prints = SimpleNamespace(
        candidates=[SimpleNamespace(name="wind"), SimpleNamespace(name="waves")], columns=[np.array([0]), np.array([1])]
    )
    cosine = np.eye(5)
    cosine[1, 2:] = 0.95  # every law looks like waves
    screening: Any = SimpleNamespace(
        p=p, of_each=lambda evidence: evidence, laws=laws, columns=[np.array([j]) for j in range(3)],
        settings=[{"reference": 0.4}] * 2 + [{}],
        kind=SimpleNamespace(log_evidence=np.array([9.0, 7.0, 1.0]), gain=np.full(3, -0.5)), of_listed=2,
        best_column=lambda law: law, listed=SimpleNamespace(fingerprints=prints), cosine=cosine,
    )  # fmt: skip
    slope, values = measured_linearly(("A",), 4, 2)
    base = at_best(CASE_OF_TWINS, stations_of(CASE_OF_TWINS, ("A",), 4), values, slope)
    last: Any = SimpleNamespace(base=base, kinds=tuple(SimpleNamespace(total=one) for one in rivals))
    kept = np.array([9.0, 7.0, 1.0]) - lost
    beside_last: Any = SimpleNamespace(p=p_last)
    fitted: Any = SimpleNamespace(point=SimpleNamespace(z=np.array([-far, *np.zeros(len(base.model.names))])))
    refit = Refit(screening.laws[0].candidate, {}, fitted, 9.0, -0.5, (-0.7, -0.3))
    calibrated = [Hypothesis("law", NAMES[0], 9.0, 0, refit)]
    return candidate_laws(
        last, last, found, lambda: screening, lambda: beside_last, lambda *given: (calibrated, kept, given[-1])
    )


def test_laws_are_told_that_hold_their_chance_together() -> None:
    laws = suspected(SearchState())
    assert laws is not None
    assert [one.name for one in laws.laws] == list(NAMES[:2])
    assert laws.chance > 0.95
    assert laws.alike == laws.laws, "of the same term and quantity"
    assert laws.laws[0].shapes == {"reference": 0.4}
    assert "|U|/0.4 m/s" in laws.laws[0].equation


def test_where_no_law_has_anything_to_act_on_none_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    last: Any = SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(case=CASE_OF_TWINS)), fingerprints=None)
    monkeypatch.setattr(candidate_effects, "law_fingerprints", lambda *_: SimpleNamespace(laws=[]))
    beside = partial(laws_beside, last)
    assert candidate_laws(last, last, SearchState(), beside, beside, lambda *_: ((), np.zeros(0), 0.0)) is None


def test_laws_compete_with_what_is_listed() -> None:
    laws = suspected(SearchState(), rivals=(0.0, 20.0))
    assert laws is not None
    assert laws.chance < 0.1
    assert not laws.clear


def test_their_alarm_keeps_its_rate() -> None:
    assert suspected(SearchState(), p=constants().law_alarm_rate) is None
    assert suspected(SearchState(implausible=(IMPLAUSIBLE,))) is None


@pytest.mark.parametrize(("gained", "lost", "reported"), [(13.0, 0.0, False), (8.0, 0.0, True), (8.0, 5.0, False)])
def test_a_law_is_named_beside_an_effect_that_is_not_clearly_likelier(
    gained: float, lost: float, reported: bool
) -> None:
    """By what it keeps once it is calibrated, and not if it is the same by another name."""
    weights = (PriorWeight("any", 0.0, gained),)
    wind, waves = (Step(name, (name,), (1.0,), ((name,),), 200.0, 5.0, 1e-4) for name in ("wind", "waves"))
    assert (suspected(SearchState(steps=(wind,), prior_weights=weights), lost=lost) is not None) == reported
    assert suspected(SearchState(steps=(waves,), prior_weights=weights), lost=lost) is None


@pytest.mark.parametrize("speed", [0.8, 0.95])  # cosine of the laws of the speed
def test_another_form_of_an_accepted_law_is_no_other_cause(speed: float) -> None:
    """Friction of the floor that changes with the depth is one cause, be it by a power or by a step; with the speed it
    is another, unless the speed goes with the depth, as in uniform flow.
    """
    names = ("law_floor_depth_step", "law_floor_speed_power", "law_floor_speed_step", "law_bank_depth_step")
    prints = SimpleNamespace(candidates=[SimpleNamespace(name="depth_dependent_bed")], columns=[np.array([0])])
    cosine = np.eye(5)
    cosine[0, 2] = speed
    screening: Any = SimpleNamespace(
        laws=[SimpleNamespace(law=LAWS[name]) for name in names], columns=[np.array([j]) for j in range(4)],
        settings=[{}] * 4, listed=SimpleNamespace(fingerprints=prints), of_listed=1, cosine=cosine,
    )  # fmt: skip
    as_depth = speed > constants().alike_cosine
    assert same_as_accepted(screening, ["depth_dependent_bed"]).tolist() == [True, as_depth, as_depth, False]
    assert not same_as_accepted(screening, ["wind"]).any()


@pytest.mark.parametrize(("forms", "reported"), [(0, True), (2, False)])
def test_an_accepted_law_has_the_evidence_of_its_likeliest_form(
    forms: int, reported: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a smooth flume friction by a power of the depth lost against the momentum that the flow carries, by a step of
    the speed; friction by a step of the depth explains more than both.
    """
    monkeypatch.setattr(candidate_effects, "same_as_accepted", lambda *_: np.arange(3) < forms)
    power = Step("depth_dependent_bed", ("depth_dependent_bed",), (1.0,), (("depth_dependent_bed",),), 200.0, 5.0, 1e-4)
    found = SearchState(steps=(power,), prior_weights=(PriorWeight("any", 0.0, -1.0),))
    assert (suspected(found) is not None) == reported


@pytest.mark.parametrize(("p_last", "first"), [(1e-3, True), (0.3, False)])
def test_a_law_goes_before_an_effect_only_if_the_effect_leaves_it_something(p_last: float, first: bool) -> None:
    """In a smooth flume friction at one depth led friction by a power of it, beside which nothing was left."""
    wind = Step("wind", ("wind",), (1.0,), (("wind",),), 200.0, 5.0, 1e-4)
    laws = suspected(SearchState(steps=(wind,)), p_last=p_last)
    assert laws is not None
    assert laws.chance > 0.95
    assert laws.clear == laws.needed == first


def test_a_place_is_compared_with_laws_by_what_it_explained() -> None:
    """To explain more than laws it has to have gained more evidence."""
    chances = []
    for gained in (1.0, 30.0):
        laws = suspected(SearchState(places=(an_anomaly(),), prior_weights=(PriorWeight("any", 0.0, gained),)))
        assert laws is not None
        chances.append(laws.chance)
    assert chances[0] > 0.9 > 0.1 > chances[1]
    assert candidate_laws_of("a", chance=0.92).clear
    assert not candidate_laws_of("a", chance=0.9).clear


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_law_with_which_no_name_would_be_believed_is_not_clear(share: float) -> None:
    """Where a tidal river divides, a law led water that leaves there, and left the viscosity as far off its prior."""
    place = SearchState(places=(an_anomaly(),), prior_weights=(PriorWeight("any", 0.0, 1.0),))
    laws = suspected(place, far=share * constants().far_off_prior)
    assert laws is not None
    assert laws.likelier
    assert laws.clear == (share < 1.0)


@pytest.mark.slow
def test_a_law_that_is_in_no_list_is_not_nothing() -> None:
    """The example of docs/discover.md, on larger cells. `diagnose` alone once said that nothing was missing."""
    model, _ = coarse_twin("mid")
    ground = twin_base(model, true_place(len(model.names), 2))
    station, _ = measured_twin(ground, ["law_viscosity_offset_step=-1.12"], 8.0, "white", 2)
    found = diagnose_model(replace(model, station=station))
    assert found.laws is not None
    assert found.verdict.kind == "none-of-these"
    best = found.laws.laws[0]
    assert (best.term, best.quantity) == ("the eddy viscosity", "the distance from the axis")
    assert best.strength < 0.0
