"""Many runs of a command: side by side, kept and not run again, ended with their iterator."""

import json
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from commands import SMOOTH, commanded

from vegglue.case.schema import Case
from vegglue.engine.command import CommandRuns, command_predictions, command_runs, ended_runs, own_parameters
from vegglue.errors import InputError, StorageError
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most, task_backend
from vegglue.results.resume import hold_lock

THETAS = [{"n_b": 0.03, "phi": 2.0}, {"n_b": 0.04, "phi": 3.0}, {"n_b": 0.05, "phi": 4.0}]
PHI = "json.load(open('parameters.json'))['parameters']['phi']['value']"
COUNTED = "import os; open(os.path.join({folder!r}, str(os.getpid())), 'w').close()\n"


def table_of(case: Case):  # type: ignore[no-untyped-def]
    return read_observations(case).table


def visible(runs: CommandRuns) -> list[Path]:
    """All in the folder of the runs but its lock."""
    return [path for path in runs.folder.iterdir() if path.name != ".lock"]


def counting(tmp_path: Path, rest: str = "") -> tuple[Case, CommandRuns, Path]:
    """A command that leaves a mark each time it runs."""
    marks = tmp_path / "marks"
    marks.mkdir(exist_ok=True)
    case = commanded(tmp_path, COUNTED.format(folder=str(marks)) + rest + SMOOTH)
    return case, command_runs(case, tmp_path / "runs"), marks


def test_what_has_run_is_not_run_again(tmp_path: Path) -> None:
    case, runs, marks = counting(tmp_path)
    first, reasons = command_predictions(runs, case, table_of(case), THETAS[:2])
    assert reasons == ["", ""]
    again, _ = command_predictions(runs, case, table_of(case), [*THETAS, THETAS[2]])
    np.testing.assert_array_equal(again[:2], first)
    np.testing.assert_array_equal(again[2], again[3])
    assert len(list(marks.iterdir())) == 3
    assert sorted(path.suffix for path in visible(runs)) == [".json"] * 3, "folders of good runs are gone"


def test_a_model_that_is_edited_while_it_runs_is_refused_and_not_kept(tmp_path: Path) -> None:
    """What ran before is kept as that of the model that it was then."""
    case, runs, _ = counting(tmp_path)
    command_predictions(runs, case, table_of(case), THETAS[:1])
    model = tmp_path / "model.py"
    model.write_text(model.read_text(encoding="utf-8") + "# edited\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"`model` \(.*model\.py\)"):
        command_predictions(runs, case, table_of(case), THETAS)
    command_predictions(command_runs(case, tmp_path / "runs"), case, table_of(case), THETAS)
    assert sorted(path.suffix for path in visible(runs)).count(".json") == 1 + len(THETAS)


def test_predictions_are_those_of_their_parameters(tmp_path: Path) -> None:
    case, runs, _ = counting(tmp_path)
    found, _ = command_predictions(runs, case, table_of(case), THETAS)
    x = table_of(case)["x"].to_numpy(float)
    wanted = [0.2 / one["n_b"] ** 0.5 - 0.05 * one["phi"] ** 0.2 + x / 1000 for one in THETAS]
    np.testing.assert_allclose(found, wanted, rtol=1e-14)


def test_another_state_of_the_model_is_run_anew(tmp_path: Path) -> None:
    case, runs, marks = counting(tmp_path)
    command_predictions(runs, case, table_of(case), THETAS[:1])
    case, runs, _ = counting(tmp_path, "# another state\n")
    command_predictions(runs, case, table_of(case), THETAS[:1])
    assert len(list(marks.iterdir())) == 2


@pytest.mark.parametrize("text", ["", "{", '{"prediction": [1], "seconds": 1}', '{"prediction": ["x"], "seconds": 1}'])
def test_what_is_kept_and_damaged_is_run_anew(tmp_path: Path, text: str) -> None:
    case, runs, marks = counting(tmp_path)
    command_predictions(runs, case, table_of(case), THETAS[:1])
    (kept,) = visible(runs)
    kept.write_text(text, encoding="utf-8")
    _, reasons = command_predictions(runs, case, table_of(case), THETAS[:1])
    assert reasons == [""]
    assert len(list(marks.iterdir())) == 2
    assert len(json.loads(kept.read_text())["prediction"]) == 15


def test_failures_have_reasons_their_folders_stay_and_they_are_tried_again(tmp_path: Path) -> None:
    picky = f"import json\nif {PHI} > 3.5: raise SystemExit('dry')\n"
    case, runs, marks = counting(tmp_path, picky)
    found, reasons = command_predictions(runs, case, table_of(case), THETAS)
    assert (reasons[:2], reasons[2].endswith("dry")) == (["", ""], True)
    assert np.isnan(found[2]).all()
    assert np.isfinite(found[:2]).all()
    (folder,) = [path for path in runs.folder.iterdir() if path.is_dir()]
    assert (folder / "command.log").read_text().strip() == "dry"
    command_predictions(runs, case, table_of(case), THETAS)
    assert len(list(marks.iterdir())) == 4


def test_all_folders_stay_where_the_config_says_so(tmp_path: Path) -> None:
    case = commanded(tmp_path, engine=", keep: all")
    runs = command_runs(case, tmp_path / "runs")
    command_predictions(runs, case, table_of(case), THETAS[:1])
    (folder,) = [path for path in runs.folder.iterdir() if path.is_dir()]
    assert {path.name for path in folder.iterdir()} == {
        "parameters.json", "stations.csv", "predictions.csv", "command.log",
    }  # fmt: skip


@pytest.mark.slow
def test_so_many_run_at_once_as_jobs_allow(tmp_path: Path) -> None:
    slow = "import time; began = time.time(); time.sleep(0.4); open('span', 'w').write(f'{began} {time.time()}')\n"
    (tmp_path / "one").mkdir()
    (tmp_path / "three").mkdir()
    most = {}
    for name, jobs in (("one", 1), ("three", 3)):
        case = commanded(tmp_path / name, slow + SMOOTH, ", keep: all")
        runs = command_runs(case, tmp_path / name)
        with at_most(jobs):
            command_predictions(runs, case, table_of(case), THETAS)
        spans = [[float(word) for word in path.read_text().split()] for path in runs.folder.glob("*/span")]
        most[name] = max(sum(a <= t <= b for a, b in spans) for t, _ in spans)
    assert most["one"] == 1
    assert most["three"] > 1


def test_runs_under_way_end_with_their_iterator(tmp_path: Path) -> None:
    slow = f"import json, time\nif {PHI} > 2.5: time.sleep(60)\n"
    case, runs, marks = counting(tmp_path, slow)
    began = time.monotonic()
    with at_most(2), closing(ended_runs(runs, case, table_of(case), THETAS)) as ends:
        position, end = next(ends)
    assert (position, end.reason) == (0, "")
    assert time.monotonic() - began < 30.0
    assert len(list(marks.iterdir())) <= 3
    assert [path.suffix for path in visible(runs) if path.is_file()] == [".json"]


def test_two_at_once_do_not_share_a_folder(tmp_path: Path) -> None:
    case, runs, _ = counting(tmp_path)
    runs.folder.mkdir(parents=True)
    with hold_lock(runs.folder), pytest.raises(StorageError, match="engine"):
        command_predictions(runs, case, table_of(case), THETAS[:1])


@pytest.mark.parametrize("program", ["no_such_code", "./code", "bin/code"])
def test_a_program_that_does_not_exist_is_refused_before_anything_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str
) -> None:
    """Nor is one found from where the user stands: a run stands elsewhere."""
    monkeypatch.chdir(tmp_path)
    for path in (tmp_path / "code", tmp_path / "bin" / "code"):
        path.parent.mkdir(exist_ok=True)
        path.write_text("#!/bin/sh\n", encoding="utf-8")
        path.chmod(0o755)
    case = commanded(tmp_path)
    assert case.engine is not None
    missing = case.model_copy(update={"engine": case.engine.model_copy(update={"command": f"{program} run"})})
    with pytest.raises(InputError, match=f"`engine.command`.*'{program}'"):
        command_runs(missing, tmp_path / "runs")


def test_a_cluster_is_refused(tmp_path: Path) -> None:
    case = commanded(tmp_path)
    nowhere = task_backend(lambda work, tasks: iter(()))
    with nowhere, pytest.raises(InputError, match="--cluster"):
        command_runs(case, tmp_path / "runs")


def test_a_command_is_not_given_what_only_effects_need(tmp_path: Path) -> None:
    gust = "gust: {distribution: uniform, low: -5, high: 5, unit: m/s}"
    effect = f"effects: {{wind: {{values: {{speed: gust}}}}}}\nparameters:\n  {gust}\n  #"
    case = commanded(tmp_path, "", "", ("parameters:  ", effect))
    assert own_parameters(case) == ("n_b", "phi")


def test_a_command_that_is_given_no_parameter_is_refused(tmp_path: Path) -> None:
    """All that is calibrated stands in `effects`: slopes of nothing ended in a traceback."""
    effect = "effects: {bank_trend: {values: {trend: n_b}}, wind: {values: {speed: phi}}}\nparameters:  "
    case = commanded(
        tmp_path,
        "",
        "",
        ("n: n_b", "n: 0.05"),
        ("phi: phi,", "phi: 9,"),
        ("high: 100", "high: 20"),
        ("parameters:  ", effect),
    )
    assert own_parameters(case) == ()
    with pytest.raises(InputError, match="`engine`"):
        command_runs(case, tmp_path / "runs")
