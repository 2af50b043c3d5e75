"""Laws that a diagnosis suspects are rivals of `next` as effects are."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from diagnoses import NOTHING, candidate_laws_of

from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.results.causes import CandidateLaws
from vegglue.workflow import next_measurement as verb
from vegglue.workflow.next_measurement import laws_to_tell_apart, next_measurement, rivals_of

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
