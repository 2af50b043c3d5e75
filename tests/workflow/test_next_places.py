"""A place that is likelier than every effect is a rival of `next`, too."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
from diagnoses import NOTHING, a_candidate_effect, a_diagnosis, an_anomaly
from verdicts import step

from vegglue.calibration.candidates import place_candidate, with_effect
from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import theta_at
from vegglue.case.resolved_config import case_hash
from vegglue.effects.library import library
from vegglue.engine.interface import Model
from vegglue.engine.newton import NEWTON
from vegglue.errors import InputError
from vegglue.results.causes import Step
from vegglue.results.diagnosis import ParameterEstimates
from vegglue.results.loop_results import ProposedMeasurement, Question, RivalEffects, write_questions
from vegglue.workflow import next_measurement as verb
from vegglue.workflow.case_run import folder_of
from vegglue.workflow.next_measurement import next_measurement

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
