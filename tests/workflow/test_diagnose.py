"""A diagnosis that is there stands for its picture and its best place, too, whenever the command was killed."""

from pathlib import Path

import pandas as pd
import pytest
from diagnoses import a_diagnosis
from reach import COARSE, write_reach

import vegglue
from vegglue.effects.library import library
from vegglue.errors import InputError
from vegglue.workflow import diagnose as verb


def test_a_diagnosis_is_written_after_all_that_belongs_to_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case, order = vegglue.load_case(write_reach(tmp_path, COARSE)), list[str]()
    monkeypatch.setattr(verb, "diagnose_model", lambda *given: a_diagnosis())
    monkeypatch.setattr(verb, "keep_best_fit", lambda *given: order.append("best fit"))
    monkeypatch.setattr(verb, "write_diagnosis", lambda *given: order.append("diagnosis"))
    monkeypatch.setattr("vegglue.pages.diagnosis_figures.save_diagnosis_figure", lambda *given: order.append("picture"))
    vegglue.diagnose(case, runs=tmp_path / "runs", jobs=1)
    assert order == ["picture", "best fit", "diagnosis"]


def test_a_fingerprint_is_drawn_without_what_was_set_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A probe that its diagnosis had found to be off still bent the place at which it was drawn."""
    case, aside, seen = vegglue.load_case(write_reach(tmp_path, COARSE)), pd.DataFrame({"x": [1.0]}), list[object]()

    def calibrated(run: object, aside: object) -> None:
        seen.append(aside)
        raise InputError("enough is known")

    monkeypatch.setattr(verb, "excluded_in", lambda run: aside)
    monkeypatch.setattr(verb, "calibrated", calibrated)
    with pytest.raises(InputError, match="enough is known"):
        verb.draw_fingerprint_of(case, library()["wind"], runs=tmp_path / "runs")
    assert seen == [aside]
