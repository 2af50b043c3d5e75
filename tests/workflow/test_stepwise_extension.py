"""An extension that is kept is read back where all it hangs on is as it was, and made again elsewhere."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnoses import a_diagnosis
from kills import WITH_ERRORS
from model_scores import a_model_score
from reach import write_reach

import vegglue
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import excluded_by
from vegglue.results.loop_results import write_model_score
from vegglue.workflow import extend
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.compare import Comparison, comparison_of, excluded_rows, keep_comparison
from vegglue.workflow.extend import kept_extension, verdict_digest

FOUND = a_diagnosis()
ASIDE = excluded_by(FOUND)


@pytest.fixture
def family(tmp_path: Path) -> tuple[Case, Case]:
    """A case and its child, and how it was extended to it, kept in `runs`."""
    parent = vegglue.load_case(write_reach(tmp_path, WITH_ERRORS))
    cases = parent, vegglue.extend(parent, "streamlining")
    several = [CaseRun(one, tmp_path / "runs") for one in cases]
    comparison = Comparison(tuple(a_model_score(one.name) for one in cases), ASIDE)
    for run, model_score in zip(several, comparison.model_scores, strict=True):
        write_model_score(run.folder, model_score, excluded_rows(ASIDE), run.config_hash)
    keep_comparison(comparison_of(comparison, several, "Added: streamlining.", verdict_digest(FOUND)), several)
    return cases


def test_it_is_read_back(family: tuple[Case, Case], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parent, child = family
    monkeypatch.setattr(extend, "diagnose", lambda *given, **more: FOUND)
    monkeypatch.setattr(extend, "extended", pytest.fail)
    found = vegglue.extend_stepwise(parent, runs=tmp_path / "runs")
    assert [one.name for one in found.cases] == [parent.name, child.name]
    assert (found.sentence, found.reason) == (FOUND.verdict.sentence, "Added: streamlining.")
    assert [one.name for one in found.comparison.model_scores] == [parent.name, child.name]
    np.testing.assert_equal(found.comparison.model_scores[1].held_out.sections, a_model_score("").held_out.sections)


def test_another_diagnosis_or_model_or_child_extends_again(family: tuple[Case, Case], tmp_path: Path) -> None:
    """Another verdict, other readings excluded, another viscosity; a child that was edited, or is gone."""
    parent, path = family[0], family[1].source
    flagged = () if FOUND.errors.flagged else (0,)
    for case, found in (
        (parent, replace(FOUND, verdict=replace(FOUND.verdict, effects=()))),
        (parent, replace(FOUND, errors=replace(FOUND.errors, flagged=flagged))),
        (parent.model_copy(update={"eddy_viscosity": 0.03}), FOUND),
    ):
        assert kept_extension(CaseRun(case, tmp_path / "runs"), found) is None
    path.write_text(path.read_text(encoding="utf-8") + "eddy_viscosity: 0.03\n", encoding="utf-8")
    assert kept_extension(CaseRun(parent, tmp_path / "runs"), FOUND) is None
    path.unlink()
    assert kept_extension(CaseRun(parent, tmp_path / "runs"), FOUND) is None


def test_code_that_a_child_names_is_never_run(family: tuple[Case, Case], tmp_path: Path) -> None:
    """Nor is a child of a case with code of the user's read: what was trusted is the code that the case names."""
    path = family[1].source
    (tmp_path / "own.py").write_text("raise AssertionError('it was run')\n", encoding="utf-8")
    path.write_text(path.read_text(encoding="utf-8") + "effect_file: own.py\n", encoding="utf-8")
    assert kept_extension(CaseRun(family[0], tmp_path / "runs"), FOUND) is None
