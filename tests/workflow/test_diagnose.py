"""A diagnosis that is there stands for its picture and its best place, too, whenever the command was killed."""

from pathlib import Path

import pytest
from diagnoses import a_diagnosis
from reach import COARSE, write_reach

import vegglue
from vegglue.workflow import diagnose as verb


def test_a_diagnosis_is_written_after_all_that_belongs_to_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case, order = vegglue.load_case(write_reach(tmp_path, COARSE)), list[str]()
    monkeypatch.setattr(verb, "diagnose_model", lambda *given: a_diagnosis())
    monkeypatch.setattr(verb, "remember_place", lambda *given: order.append("place"))
    monkeypatch.setattr(verb, "write_diagnosis", lambda *given: order.append("diagnosis"))
    monkeypatch.setattr(
        "vegglue.report_page.diagnosis_pictures.save_diagnosis_figure", lambda *given: order.append("picture")
    )
    vegglue.diagnose(case, runs=tmp_path / "runs", jobs=1)
    assert order == ["picture", "place", "diagnosis"]
