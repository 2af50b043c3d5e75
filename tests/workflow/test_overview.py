"""The page of several runs shows the last child of a case that has no posterior itself."""

from pathlib import Path

import pytest
from small_case import SMALL

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash
from vegglue.errors import InputError
from vegglue.results.loop_results import ComparedModel, ModelComparison, write_comparison
from vegglue.workflow.report import overview


def with_a_law_as_child(folder: Path) -> None:
    """small.yaml, its child with an effect file, and the ladder that `run` keeps of both."""
    (folder / "small.yaml").write_text(SMALL, encoding="utf-8")
    own = "from dataclasses import replace\nfrom vegglue.effects.force import EFFECTS as KNOWN\n"
    own += "EFFECTS = (replace(KNOWN[0], name='own_force'),)\n"
    (folder / "own.py").write_text(own, encoding="utf-8")
    (folder / "child.yaml").write_text("extends: small.yaml\nname: child\neffect_file: own.py\n", encoding="utf-8")
    wanted = case_hash(load_case(folder / "small.yaml"))
    errors = (0.1, 0.1, 0.1, 0.1, 0.01)
    steps = tuple(ComparedModel(name, f"{name}.yaml", wanted, (), 2, *errors) for name in ("small", "child"))
    (folder / "runs" / "small").mkdir(parents=True)
    write_comparison(folder / "runs" / "small", ModelComparison(steps, 0, ""), wanted)


def test_the_file_of_a_law_is_run_only_where_it_is_trusted(tmp_path: Path) -> None:
    with_a_law_as_child(tmp_path)
    case = load_case(tmp_path / "small.yaml")
    with pytest.raises(InputError, match=r"child\.yaml: `effect_file` names .*own\.py.*--trust"):
        overview([case], runs=tmp_path / "runs")
    # What is asked for next is the posterior of the child, not of the case.
    with pytest.raises(InputError, match="runs/child/"):
        overview([case], runs=tmp_path / "runs", trust=True)
    (tmp_path / "child.yaml").unlink()
    with pytest.raises(InputError, match="runs/small/"):
        overview([case], runs=tmp_path / "runs")
