"""A place that is likelier than every effect is a rival of `next`, too."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from diagnoses import NOTHING, a_location, a_suspect
from verdicts import step

from vegglue.case.config import load_case
from vegglue.results.diagnosis import Step
from vegglue.workflow import next_measurement as verb
from vegglue.workflow.next_measurement import next_measurement

PLACE = a_location()
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
    suspects = (a_suspect("inflow_skew"), a_suspect("wind"))
    given: list[list[str]] = []

    def worth(*rest: object) -> list[list[object]]:
        questions = rest[-1]
        assert isinstance(questions, list)
        given.extend(sorted(candidate.name for candidate, _, _ in rivals) for rivals in questions)
        return [[] for _ in questions]

    base = SimpleNamespace(model=None, noise=None, fitted=SimpleNamespace(point=SimpleNamespace(z=None)))
    monkeypatch.setattr(verb, "diagnose", lambda *_, **__: replace(NOTHING, steps=(one,), suspects=suspects))
    monkeypatch.setattr(verb, "worth_of_measurements", worth)
    monkeypatch.setattr(verb, "excluded_by", lambda *_: None)
    monkeypatch.setattr(verb, "calibrated", lambda *_: base)
    case = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
    assert [question.tells_apart for question in next_measurement(case, runs=tmp_path)] == ([asked] if asked else [])
    assert given == ([sorted(asked.split(" from "))] if asked else [])
