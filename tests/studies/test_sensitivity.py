"""The study of constants: what is still to be run, how a constant is varied, and which verdicts count as others."""

import subprocess
import sys
from pathlib import Path

import pytest
import sensitivity
from described_constants import described

BY_NAME = {one.name: one for one in described()}


def record(constant: str, factor: float, kind: str = "identified", effects: tuple[str, ...] = ("wind",)) -> dict:
    return {"case": "open-b", "constant": constant, "factor": factor, "kind": kind, "set": list(effects), "places": [],
            "instruments": []}  # fmt: skip


def test_what_is_recorded_is_not_run_again() -> None:
    made = [record(sensitivity.AS_IS, 1.0), record("field_odds", 0.5)]
    assert sensitivity.missing("open-b", ["field_odds", "spot_drag"], made) == {
        "field_odds": (2.0,), "spot_drag": (0.5, 2.0)
    }  # fmt: skip
    assert sensitivity.missing("open-c", [], made) == {sensitivity.AS_IS: (1.0,)}


def test_a_constant_forks_when_it_is_first_read() -> None:
    read_twice = """
import os, sys
sys.path.insert(0, os.getcwd())  # which a command of the same process may have taken out (PYTHONSAFEPATH)
import sensitivity
from vegglue.decision_constants import DecisionConstants
of = sensitivity.Forking(DecisionConstants(), {"field_odds": (0.5, 2.0), "spot_drag": (2.0,), "set_chance": (0.5,)})
found = [of.field_odds, of.spot_drag, of.field_odds]
print(of.constant, of.factor, *found, sorted(of.read), flush=True)
"""
    printed = subprocess.run(
        [sys.executable, "-c", read_twice], cwd=Path(sensitivity.__file__).parent, capture_output=True, text=True
    )
    asked = "['as it is', 'field_odds', 'spot_drag']"
    assert printed.stdout.splitlines() == [
        f"field_odds 0.5 50.0 1.0 50.0 {asked}", f"field_odds 2.0 200.0 1.0 200.0 {asked}",
        f"spot_drag 2.0 100.0 2.0 100.0 {asked}", f"as it is 1.0 100.0 1.0 100.0 {asked}",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "half", "twice"),
    [("field_odds", 50.0, 200.0), ("set_chance", 0.975, 0.9), ("grid_error_correlation", 0.25, 0.99)],
)
def test_a_constant_near_one_is_varied_by_its_distance_from_it(name: str, half: float, twice: float) -> None:
    assert [sensitivity.varied(BY_NAME[name], factor) for factor in (0.5, 2.0)] == pytest.approx([half, twice])


def test_a_verdict_is_another_by_kind_or_set() -> None:
    made = [record(sensitivity.AS_IS, 1.0), record("field_odds", 0.5, effects=("bend",)), record("field_odds", 2.0),
            record("set_chance", 0.5, "one-of"), record("spot_drag", 0.5), record("spot_drag", 2.0)]  # fmt: skip
    table, alike, not_run = sensitivity.table(made).split("\n\n")
    rows = {line.split("`")[1]: line.split("|")[-3:-1] for line in table.splitlines()[2:]}
    assert set(rows) == {"field_odds", "set_chance"}
    assert "of 1 others no verdict of 1 differs" in alike
    assert alike.split("`")[1::2] == ["spot_drag"]
    assert set(not_run.split("`")[1::2]) == set(BY_NAME) - {*rows, "spot_drag"}
    assert [cell.strip()[:6] for cell in rows["field_odds"]] == ["1 of 1", "0 of 1"]
    assert "identified → one-of" in rows["set_chance"][0]
