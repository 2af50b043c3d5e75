"""Child configs: what they add, what is read back, what cannot be added."""

from pathlib import Path

import pytest
from reach import said_to

from vegglue.case.config import load_case
from vegglue.diagnosis.child_config import candidate_named
from vegglue.measurements.observations import read_observations
from vegglue.screening.candidates import candidates_in_case, candidates_of, with_effect
from vegglue.workflow.extend import write_child

ROOT = Path(__file__).parents[2]


def test_a_child_says_what_it_adds_and_reads_back(tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    station = read_observations(case).table
    added = [(candidate_named(case, station, "discharge_error[high]"), {})]
    child = write_child(case, tmp_path / "child.yaml", added)
    assert child.name == "twin-discharge_error_high"
    assert child.effects["discharge_error_high"].experiments == ("high",)
    assert set(child.parameters) - set(case.parameters) == {"discharge_error_high_relative_error"}
    assert child.observations == case.observations


def test_an_entry_of_a_case_says_which_candidate_it_was() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    station = read_observations(case).table
    every = candidates_of(case, station)
    assert {one.effect.each for one in every} >= {"case", "experiment", "section"}
    for one in every:
        assert candidates_in_case(with_effect(case, one, {})) == {one.key: one}
        assert candidate_named(case, station, one.name) == one


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--add", "streamlning"), "did you mean `streamlining`?"),
        (("--add", "discharge_error[none]"), "acts nowhere"),
        (("--add", "streamlining", "--shape", "width=2"), "`width` is no shape"),
        ((), "either --auto or --add"),
    ],
)
def test_what_cannot_be_added_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    said: str,
) -> None:
    code, error = said_to(monkeypatch, capsys, "extend", ROOT / "configs" / "twin.yaml", *arguments, "--runs", tmp_path)
    assert code == 2
    assert said in error
