"""Velocities that stand above the water are told by every command that computes with them, where they are most."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.calibration import baseline
from vegglue.errors import InputError
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.check import doubts_of


@pytest.mark.parametrize(("dry", "doubtful"), [(3, True), (1, False)])
def test_a_survey_on_land_is_doubted(tmp_path: Path, dry: int, doubtful: bool) -> None:
    """`run` took 12 velocities on dry banks for measurements, all of them "in use", and named what may be missing."""
    places = [*((12, 3.6 + 0.1 * n) for n in range(dry)), (12, 0.0), (12, 1.0)]
    table = "\n".join(["x,y,u,u_se", *(f"{x},{y},0.4,0.02" for x, y in places)])
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    said = "above the water: most of its velocities; check their y, the bed and the outlet level."
    assert any(said in one for one in doubts_of(CaseRun(case))) == doubtful
    remarks = vegglue.check(case, runs=tmp_path / "runs").remarks
    assert sum("outside the wet channel" in one for one in remarks) == 1
    assert any(said in one for one in remarks) == doubtful


def test_a_model_without_any_flow_says_where_to_look(monkeypatch: pytest.MonkeyPatch) -> None:
    """It ended in a sentence that did not say what to do."""
    monkeypatch.setattr(baseline, "linearise", lambda *_: None)
    monkeypatch.setattr(baseline, "in_threads", lambda work, tasks: [None for _ in tasks])
    model = SimpleNamespace(names=("n_b",), case=SimpleNamespace(name="brook"))
    with pytest.raises(InputError, match=r"brook: no steady flow .* see what `vegglue check` says of outlet"):
        baseline._starts(model, None)
