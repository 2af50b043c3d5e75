"""The next measurement where places, laws, or more than two effects are rivals."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
from diagnoses import IMPLAUSIBLE, NOTHING, a_candidate_effect, a_diagnosis, an_anomaly, candidate_laws_of
from verdicts import step

from vegglue.calibration.candidates import place_candidate, with_effect
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import theta_at
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.next_measurement import MeasurementWorth, least_distances
from vegglue.effects.library import library
from vegglue.engine.interface import Model
from vegglue.engine.newton import NEWTON
from vegglue.errors import InputError
from vegglue.results.causes import CandidateLaws, Step
from vegglue.results.diagnosis import ParameterEstimates
from vegglue.results.loop_results import OneOfRivals, ProposedMeasurement, Question, RivalEffects, write_questions
from vegglue.workflow import next_measurement as verb
from vegglue.workflow.case_run import folder_of
from vegglue.workflow.next_measurement import (
    laws_to_tell_apart,
    next_measurement,
    questions_about,
    rivals_of,
    what_is_open,
)

PLACE = an_anomaly()
AT = f"{PLACE.effect}[x{PLACE.x:g},y{PLACE.y:g}]"


def with_place(one: Step, chance: float) -> Step:
    return replace(one, places={"drag": PLACE}, others={"drag": chance})


@pytest.mark.parametrize(
    ("one", "asked"),
    [
        (with_place(step("inflow_skew"), 0.99), f"inflow_skew from {AT}"),
        (with_place(step("wind", "inflow_skew"), 0.99), f"wind from inflow_skew from {AT}"),
        (with_place(step("wind", "inflow_skew"), 0.01), "wind from inflow_skew"),
        (with_place(step("inflow_skew"), 0.01), ""),
        (step("inflow_skew"), ""),
    ],
)
def test_next_asks_what_tells_a_place_from_an_effect(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, one: Step, asked: str
) -> None:
    suspects = (a_candidate_effect("inflow_skew"), a_candidate_effect("wind"))
    given: list[list[str]] = []

    def worth(*rest: object) -> list[list[object]]:
        questions = rest[-1]
        assert isinstance(questions, list)
        given.extend(sorted(candidate.name for candidate, _, _ in rivals) for rivals in questions)
        return [[] for _ in questions]

    base = SimpleNamespace(model=None, noise=None, fitted=SimpleNamespace(point=SimpleNamespace(z=None)))
    monkeypatch.setattr(verb, "diagnose", lambda *_, **__: replace(NOTHING, steps=(one,), candidate_effects=suspects))
    monkeypatch.setattr(verb, "worth_of_measurements", worth)
    monkeypatch.setattr(verb, "excluded_by", lambda *_: None)
    monkeypatch.setattr(verb, "calibrated", lambda *_: base)
    case = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
    assert [question.tells_apart for question in next_measurement(case, runs=tmp_path)] == ([asked] if asked else [])
    assert given == ([sorted(asked.split(" from "))] if asked else [])


def test_what_hides_beside_a_place_is_asked_of_the_model_that_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The diagnosis calls it untestable there; without the place the trace of helical_flow was 200 times weaker."""
    case = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
    base: Any = SimpleNamespace(model=Model(case, build_site(case), pd.DataFrame(), NEWTON))
    name = next(iter(with_effect(case, place_candidate(library()[PLACE.effect], PLACE.shapes), {}).effects))
    middle = theta_at(case, np.zeros(len(case.parameters)))
    last = {one: (float(value[0]), 0.0, 1.0) for one, value in middle.items()} | {f"{name}_drag": (0.4, 0.3, 0.5)}
    found = replace(NOTHING, places=(PLACE,), parameters=ParameterEstimates({}, last))
    monkeypatch.setattr(verb, "baseline", lambda model, known: (model, known))
    monkeypatch.setattr(verb, "for_prediction", lambda made: made)
    model, known = cast("tuple[Model, np.ndarray]", verb.with_places(base, found))
    assert model.case.effects[name].values["x"] == PLACE.x
    assert known == pytest.approx([0.0] * len(case.parameters) + [0.4 / PLACE.plausible], abs=1e-6)
    assert verb.with_places(base, NOTHING) is base


def test_what_to_measure_is_asked_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For a case as it is; what somebody asks for is asked anew."""
    case = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
    kept = (
        Question(RivalEffects(("eddies", "wind")), (ProposedMeasurement("a gauge", "June", 5.0, 1, 0.5, 0.2, 9.0),)),
    )
    write_questions(folder_of(tmp_path, case), kept, case_hash(case))
    monkeypatch.setattr(verb, "diagnose", lambda *given, **more: a_diagnosis())
    assert tuple(next_measurement(case, runs=tmp_path)) == kept
    with pytest.raises(InputError, match="is not among the effects of the diagnosis"):
        next_measurement(case, runs=tmp_path, between=["no_such"])


SPEED, DEPTH = "law_bank_speed_step", "law_bank_depth_ramp"


@pytest.fixture(scope="module")
def case() -> Case:
    return load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")


@pytest.fixture
def laws() -> CandidateLaws:
    """Two forms of the speed, and one of the depth."""
    three = candidate_laws_of(SPEED, "law_bank_speed_ramp", DEPTH)
    *speed, depth = three.laws
    return replace(three, laws=(*speed, replace(depth, quantity="the depth")))


def test_the_likeliest_law_of_each_quantity_is_told_apart(laws: CandidateLaws) -> None:
    assert laws_to_tell_apart(laws) == [SPEED, DEPTH]
    assert laws_to_tell_apart(None) == []


def test_laws_are_rivals_at_their_size(case: Case, laws: CandidateLaws) -> None:
    rivals = rivals_of(case, replace(NOTHING, laws=laws), [SPEED, DEPTH])
    assert [one.name for one, _, _ in rivals] == [SPEED, DEPTH]
    assert [(shapes, gain) for _, shapes, gain in rivals] == [({"reference": 0.4}, -0.8)] * 2


def test_next_asks_about_laws_where_one_stands_out(
    case: Case, laws: CandidateLaws, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[list[str]] = []
    base = SimpleNamespace(model=None, noise=None, fitted=SimpleNamespace(point=SimpleNamespace(z=None)))

    def worth(*given: object) -> list[list[object]]:
        questions = given[-1]
        assert isinstance(questions, list)
        asked.extend([one.name for one, _, _ in rivals] for rivals in questions)
        return [[] for _ in questions]

    monkeypatch.setattr(verb, "diagnose", lambda *_, **__: replace(NOTHING, laws=laws))
    monkeypatch.setattr(verb, "worth_of_measurements", worth)
    monkeypatch.setattr(verb, "excluded_by", lambda *_: None)
    monkeypatch.setattr(verb, "calibrated", lambda *_: base)
    (question,) = next_measurement(case, runs=tmp_path)
    assert asked == [[SPEED, DEPTH]]
    assert question.tells_apart == f"{SPEED} from {DEPTH}"
    next_measurement(case, between=[DEPTH], runs=tmp_path)
    assert asked[1:] == [[DEPTH]]
    (twice,) = next_measurement(case, between=[DEPTH, DEPTH], runs=tmp_path)
    assert twice.tells_apart == f"{DEPTH} from what calibration makes of it"  # it was to be told from itself
    with pytest.raises(InputError, match=f"--between: `wind` is not among the effects of the diagnosis: {SPEED}"):
        next_measurement(case, between=["wind"], runs=tmp_path)


def rival(name: str) -> Any:
    return SimpleNamespace(name=name), {}, 1.0


def worth(name: str, then: list[float], hours: float = 2.0) -> MeasurementWorth:
    plan: Any = SimpleNamespace(name=name, experiment="high", x=92.0, rows=np.arange(3), hours=hours)
    return MeasurementWorth(plan, np.full(len(then), 0.1), np.array(then))


THREE = [rival("depth"), rival("even"), rival("trend")]
FAR, SHALLOW = worth("a section far off", [0.2, 0.2, 9.0]), worth("a lower discharge", [5.0, 0.3, 0.3], hours=8.0)


def test_nothing_is_asked_of_data_that_are_in_doubt() -> None:
    doubted = a_diagnosis((), (), verdict={"kind": "cannot-tell", "reasons": (IMPLAUSIBLE,)})
    case: Any = SimpleNamespace()
    assert what_is_open(case, replace(doubted, steps=a_diagnosis().steps)) == []


def test_what_tells_one_rival_from_all_others_is_proposed_for_it() -> None:
    whole, *single = questions_about(RivalEffects(("depth", "even", "trend")), THREE, [SHALLOW, FAR])
    assert whole.useful == ()
    others = [OneOfRivals("depth", ("even", "trend")), OneOfRivals("trend", ("depth", "even"))]
    assert [one.about for one in single] == others
    assert [one.useful[0].name for one in single] == ["a lower discharge", "a section far off"]
    assert single[1].measurements[0].per_hour == pytest.approx(8.9 / 2.0)


def test_a_question_that_is_answered_is_one_and_so_is_one_of_two_rivals() -> None:
    (answered,) = questions_about(RivalEffects(("depth", "even", "trend")), THREE, [worth("all", [4.0, 5.0, 6.0])])
    assert answered.useful[0].then == 4.0
    assert len(questions_about("both", THREE[:2], [worth("little", [1.0, 1.0])])) == 1


def test_each_rival_is_as_far_as_from_the_nearest_either_way() -> None:
    """Traces 3, 4 and 0 standard errors long in measurements that no parameter changes, and no prior holds."""
    traces, slope = np.array([[3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]), np.zeros((2, 1))
    assert least_distances(slope, traces) == pytest.approx([0.0, 0.0, 0.0]), "the last is nothing, which each may be"
    assert least_distances(slope, traces[:, :2]) == pytest.approx([9.0, 9.0])
    assert least_distances(slope, traces[:, :1]) == pytest.approx([9.0])
