"""Of three rivals and more, what tells one from all others is proposed where nothing tells all apart."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnoses import IMPLAUSIBLE, a_diagnosis

from vegglue.diagnosis.next_measurement import MeasurementWorth, least_distances
from vegglue.results.loop_results import OneOfRivals, RivalEffects
from vegglue.workflow.next_measurement import questions_about, what_is_open


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
