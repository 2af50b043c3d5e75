"""Models are compared by the same measurements, each under a name of its own."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import vegglue
from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case, Validation
from vegglue.diagnosis.comparison import MEASUREMENT, excluded_by
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.results.loop_results import ComparedModel, ModelComparison, comparison_that_fits, write_comparison
from vegglue.workflow import case_run, compare
from vegglue.workflow.case_run import CaseRun, excluded_in, folder_of, judged_by


@pytest.fixture
def case(tmp_path: Path) -> Case:
    return load_case(vegglue.new("brook", folder=tmp_path).source)


def test_models_of_other_measurements_are_refused(case: Case, tmp_path: Path) -> None:
    one = next(one for one in case.observations if one.kind == "velocity")
    lines = one.file.read_text(encoding="utf-8").splitlines(keepends=True)
    fewer = tmp_path / "fewer.csv"
    fewer.write_text("".join(lines[:-1]), encoding="utf-8")
    observations = tuple(each.model_copy(update={"file": fewer}) if each is one else each for each in case.observations)
    other = case.model_copy(update={"name": "fewer", "observations": observations})
    with pytest.raises(InputError, match="expected fewer and brook to be fitted to the same measurements, got others"):
        vegglue.compare([case, other], runs=tmp_path / "runs")


def other_error(case: Case) -> Case:
    one = next(one for one in case.observations if one.kind == "velocity")
    table = pd.read_csv(one.file, comment="#")
    wider = one.file.with_name("wider.csv")
    table.assign(u_se=0.2).to_csv(wider, index=False)
    observations = tuple(each.model_copy(update={"file": wider}) if each is one else each for each in case.observations)
    return case.model_copy(update={"observations": observations})


def shorter(case: Case) -> Case:
    return case.model_copy(update={"grid": case.grid.model_copy(update={"x": (case.grid.x[0], 17.0)})})


@pytest.mark.parametrize("changed", [other_error, shorter])
def test_errors_are_set_side_by_side_under_the_same_errors_at_the_same_stations(
    case: Case, tmp_path: Path, changed: Callable[[Case], Case]
) -> None:
    """A grid that ends before the last section ended in a traceback; chi2 stood beside one of other errors."""
    other = changed(case).model_copy(update={"name": "other"})
    with pytest.raises(InputError, match="fitted to the same measurements, got others; name the same files in both"):
        vegglue.compare([case, other], runs=tmp_path / "runs")


def test_models_arejudged_by_the_same_measurements_for_validation(case: Case, tmp_path: Path) -> None:
    judged = [
        case.model_copy(
            update={
                "name": f"judged{number}",
                "validation": Validation(experiments=case.experiments, observations=case.observations[:number]),
            }
        )
        for number in (1, 2)
    ]
    with pytest.raises(InputError, match="judged2 and judged1 to have the same measurements for validation"):
        vegglue.compare(judged, runs=tmp_path / "runs")


def test_models_of_one_name_are_refused(case: Case, tmp_path: Path) -> None:
    other = case.model_copy(update={"eddy_viscosity": 0.02})
    with pytest.raises(InputError, match="expected models of different names, got two called brook"):
        vegglue.compare([case, other], runs=tmp_path / "runs")


@pytest.mark.slow
def test_a_model_may_be_there_twice(case: Case, tmp_path: Path) -> None:
    """Who extends by hand what `extend --auto` has extended has two files of one model."""
    first, second = vegglue.compare([case, case], runs=tmp_path / "runs").model_scores
    assert first.in_sample.chi2 == second.in_sample.chi2


@pytest.mark.slow
def test_a_ladder_keeps_the_model_that_it_begins_with(case: Case, tmp_path: Path) -> None:
    """The diagnosis of that says which readings are set aside; without it they would count again."""
    runs = tmp_path / "runs"
    first, second = (
        case.model_copy(update={"name": name, "eddy_viscosity": value}) for name, value in (("a", 0.02), ("b", 0.03))
    )
    vegglue.compare([case, first], runs=runs)
    vegglue.compare([first, second], runs=runs)
    kept = [comparison_that_fits(runs / one.name, case_hash(one)) for one in (case, first, second)]
    assert [[step.name for step in one.steps] for one in kept if one] == [["brook", "a"], ["brook", "a"], ["a", "b"]]
    assert judged_by(first, runs) == {"brook": case_hash(case), "a": case_hash(first)}


def test_a_model_is_judged_by_its_diagnosis_of_now_beside_a_ladder_of_before(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The ladder of the second began with the first as it was: what that set aside since then counted again."""
    asked = list[tuple[str, str]]()
    monkeypatch.setattr(case_run, "diagnosis_that_fits", lambda path, wanted: asked.append((path.parent.name, wanted)))
    second = case.model_copy(update={"name": "second"})
    before = ComparedModel("brook", "brook.yaml", "as it was", (), 3, *[0.1] * 5)
    write_comparison(folder_of(tmp_path, second), ModelComparison((before,), 0, ""), case_hash(second))
    for cases in ([case, second], [second, case]):
        asked.clear()
        assert excluded_in(*(CaseRun(one, tmp_path) for one in cases)).empty
        assert set(asked) == {(one.name, case_hash(one)) for one in cases} | {("brook", "as it was")}


@pytest.mark.slow
def test_what_a_model_misses_is_computed_once(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also under another title; and again as soon as a measurement is set aside."""
    runs = tmp_path / "runs"
    first = vegglue.compare([case], runs=runs).model_scores[0]
    monkeypatch.setattr(compare, "calibrated", pytest.fail)
    titled = case.model_copy(update={"title": "Brook in June"})
    again = vegglue.compare([titled], runs=runs).model_scores[0]
    assert again.title == "Brook in June"
    np.testing.assert_equal(asdict(replace(again, title=first.title)), asdict(first))
    aside = read_observations(case).table[MEASUREMENT].iloc[[0]]
    assert compare.kept_model_score(CaseRun(case, runs), excluded_by()) is not None
    assert compare.kept_model_score(CaseRun(case, runs), aside) is None


def test_a_ladder_that_says_why_it_ends_is_kept() -> None:
    steps = tuple(ComparedModel(name, "", name, (), 4, 0.1, 0.2, 0.3, 0.4, 0.1) for name in ("brook", "a"))
    extended, compared = ModelComparison(steps, 1, "Added: wind."), ModelComparison(steps, 1, "")
    assert compare.tells_more(extended, compared)
    assert not compare.tells_more(compared, extended)
    assert not compare.tells_more(None, compared)
    assert not compare.tells_more(extended, replace(compared, left_out=2))
