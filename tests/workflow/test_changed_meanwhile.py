"""A data file that changes while a command reads or computes: what is kept is of the file as it was, or of none."""

import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from diagnoses import a_diagnosis
from kills import WITH_ERRORS
from reach import COARSE, write_reach

import vegglue
from vegglue.case.resolved_config import case_hash, simulation_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import excluded_by
from vegglue.errors import InputError
from vegglue.inference import solve_ensemble
from vegglue.results.result_files import stored_hash
from vegglue.workflow import case_run, compare, extend, infer, next_measurement

FEW = ("simulate: {members: 1024,", "infer: {method: glue}\nsimulate: {members: 16,")
Meanwhile = Callable[[ModuleType, str], None]


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Case:
    monkeypatch.chdir(tmp_path)
    return vegglue.load_case(write_reach(tmp_path, COARSE, FEW, WITH_ERRORS))


@pytest.fixture
def meanwhile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Meanwhile:
    """Has a measurement changed just before some function goes on."""

    def changes_before(module: ModuleType, name: str, instead: Callable[..., Any] | None = None) -> None:
        real = getattr(module, name) if instead is None else instead

        def called(*arguments: Any, **more: Any) -> Any:
            table = tmp_path / "velocities.csv"
            table.write_text(table.read_text(encoding="utf-8").replace("0.436", "0.536"), encoding="utf-8")
            return real(*arguments, **more)

        monkeypatch.setattr(module, name, called)

    return changes_before


def test_an_ensemble_is_of_the_data_that_were_read(case: Case, meanwhile: Meanwhile) -> None:
    before = simulation_hash(case)
    meanwhile(solve_ensemble, "starts_and_chunks")
    vegglue.simulate(case, jobs=1)
    assert stored_hash(Path("runs/brook/ensemble.h5")) == before != simulation_hash(case)
    with pytest.raises(InputError, match="a file it names or vegglue changed since this was made"):
        vegglue.infer(case)


def test_a_posterior_is_of_the_data_that_were_read(case: Case, meanwhile: Meanwhile) -> None:
    vegglue.simulate(case, jobs=1)
    before = case_hash(case)
    meanwhile(infer, "glue")
    vegglue.infer(case)
    assert stored_hash(Path("runs/brook/posterior.h5")) == before != case_hash(case)


def test_a_best_fit_is_of_the_data_that_were_read(case: Case, meanwhile: Meanwhile) -> None:
    before = case_hash(case)
    meanwhile(case_run, "calibrated_anew")
    run = case_run.CaseRun(case)
    case_run.calibrated(run, excluded_by())
    assert json.loads((run.folder / "best.json").read_text())["config_hash"] == before != case_hash(case)


def test_questions_are_of_the_data_that_were_read(case: Case, meanwhile: Meanwhile) -> None:
    before = case_hash(case)
    meanwhile(next_measurement, "diagnose", lambda *given, **more: a_diagnosis())
    meanwhile(next_measurement, "what_is_open", lambda *given: [])
    vegglue.next_measurement(case, jobs=1)
    assert json.loads(Path("runs/brook/questions.json").read_text())["config_hash"] == before != case_hash(case)


def test_a_ladder_is_of_the_data_that_were_read(
    case: Case, meanwhile: Meanwhile, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, kept = case_hash(case), list[Any]()
    meanwhile(compare, "model_score_of", lambda *given: None)
    monkeypatch.setattr(compare, "draw_ladder_of", lambda *given: None)
    monkeypatch.setattr(compare, "comparison_of", lambda *given: None)
    monkeypatch.setattr(compare, "write_comparison", lambda *given: kept.append(given))
    compare.compare([case], jobs=1)
    assert kept[0][2] == before != case_hash(case)


def test_no_ladder_is_kept_of_children_of_other_data(
    case: Case, meanwhile: Meanwhile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(extend, "diagnose", lambda *given, **more: a_diagnosis())
    one = extend.StepwiseExtension((case,), compare.Comparison((), excluded_by()), "", "")
    meanwhile(extend, "extended", lambda *given: one)
    with pytest.raises(InputError, match=r"brook\.yaml: a file that it names changed while it was extended; run"):
        vegglue.extend_stepwise(case, jobs=1)
