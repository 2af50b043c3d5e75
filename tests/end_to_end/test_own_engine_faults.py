"""A command as the engine of a case when something goes wrong: members that fail, kills, Ctrl-C, what is refused."""

import os
import re
import signal
import subprocess
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import SMOOTH, commanded
from reach import COARSE, Say, begin, here
from reach import vegglue as shell

import vegglue
from vegglue.diagnosis.diagnose import diagnose_model
from vegglue.errors import InputError
from vegglue.flow.status import FAILED, RUN_BY_COMMAND
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.result_files import read_ensemble
from vegglue.results.verdict import CommandCompared, CommandDiffers, CommandNotSettled
from vegglue.wording.commands import LAST_WORDS
from vegglue.workflow import command_model

MEMBERS = 8
SMALL = ("members: 1024", f"members: {MEMBERS}")
# Leaves a line for each run, in a file beside the config, and takes a while.
MARKED = """
import json, os, time
phi = json.load(open("parameters.json"))["parameters"]["phi"]["value"]
with open({marks!r}, "a") as file:
    file.write(f"{{os.getpid()}} {{phi!r}}\\n")
time.sleep({seconds})
"""


def slow_brook(folder: Path, seconds: float) -> Path:
    """The brook with a command that takes so long; returns the file with a line for each run."""
    marks = folder / "marks"
    commanded(folder, MARKED.format(marks=str(marks), seconds=seconds) + SMOOTH, "", COARSE, SMALL)
    return marks


def lines_of(marks: Path) -> list[str]:
    return marks.read_text(encoding="utf-8").splitlines() if marks.exists() else []


def after_runs(marks: Path, count: int, process: "subprocess.Popen[str]") -> None:
    """Waits until so many runs have begun."""
    until = time.monotonic() + 60.0
    while len(lines_of(marks)) < count:
        assert process.poll() is None, process.stderr.read() if process.stderr else ""
        assert time.monotonic() < until
        time.sleep(0.02)


@pytest.mark.slow
def test_members_that_fail_are_counted_with_their_reason(tmp_path: Path) -> None:
    picky = f"{SMOOTH}\nif phi > 10: raise SystemExit('dry')\n"
    case = commanded(tmp_path, picky, "", COARSE, SMALL)
    ensemble = vegglue.simulate(case, runs=tmp_path / "runs", jobs=2)
    high = ensemble.parameters["phi"] > 10
    assert 0 < high.sum() < MEMBERS
    np.testing.assert_array_equal(ensemble.status, np.where(high, FAILED, RUN_BY_COMMAND))
    assert set(ensemble.reason[high].astype(str)) == {"the command ended with exit code 1, its last line: dry"}
    assert np.isnan(ensemble.prediction[high]).all()
    assert np.isfinite(ensemble.prediction[~high]).all()
    posterior = vegglue.infer(case, ensemble, runs=tmp_path / "runs", method="glue")
    assert posterior.sample.failed == high.sum()
    assert f"{high.sum()} of 8 members failed" in vegglue.report(case, runs=tmp_path / "runs").read_text("utf-8")


@pytest.mark.slow
def test_where_all_fail_it_is_said_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say) -> None:
    commanded(tmp_path, "raise SystemExit('no licence')", "", COARSE, SMALL)
    monkeypatch.chdir(tmp_path)
    code, said = say("check", "brook.yaml", "--trust", "--quiet")
    assert (code, said.count("\n")) == (2, 1)
    assert (
        "brook.yaml: the command of `engine` failed at the medians of the priors: the command ended with exit" in said
    )
    assert "its last line: no licence; its files lie in runs/brook/engine." in said
    done = here(tmp_path, "simulate", "brook.yaml", "--trust", succeed=False)
    assert "8 members, run by the command, 8 failed; 8 of them: the command ended with exit code 1" in done.stdout
    assert done.returncode == 2
    assert "brook.yaml: expected members with a solution, got none of 8; 8 of them: the command ended" in done.stderr
    for command in ("infer", "diagnose"):
        code, said = say(command, "brook.yaml", "--trust", "--quiet")
        assert code == 2
        assert "no licence" in said


@pytest.mark.slow
def test_members_that_failed_are_run_again_with_force_and_no_other(tmp_path: Path) -> None:
    """A licence that is there for some members only, at first."""
    licence = tmp_path / "licence"
    asks = f"import os\nif not os.path.exists({str(licence)!r}) and phi > 10: raise SystemExit('no licence')\n"
    marks = slow_brook(tmp_path, 0.0)
    model = tmp_path / "model.py"
    model.write_text(model.read_text(encoding="utf-8") + asks, encoding="utf-8")
    first = here(tmp_path, "simulate", "brook.yaml", "--trust").stdout
    failed = int(re.search(r"(\d) failed", first)[1])  # type: ignore[index]
    assert 0 < failed < MEMBERS == len(lines_of(marks))
    licence.touch()
    assert "is up to date" in here(tmp_path, "simulate", "brook.yaml", "--trust").stdout
    again = here(tmp_path, "simulate", "brook.yaml", "--trust", "--force").stdout
    assert f"{MEMBERS} members, run by the command, 0 failed" in again
    assert len(lines_of(marks)) == MEMBERS + failed
    assert "is up to date" in here(tmp_path, "simulate", "brook.yaml", "--trust", "--force").stdout


@pytest.mark.slow
def test_a_killed_run_goes_on_and_repeats_no_member(tmp_path: Path) -> None:
    marks = slow_brook(tmp_path, 0.3)
    process = begin(tmp_path, "simulate", "brook.yaml", "--trust", "--jobs", 2)
    after_runs(marks, 5, process)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    time.sleep(1.0)  # what was under way ends by itself
    kept = len(list((tmp_path / "runs" / "brook" / "engine").glob("*.json")))
    assert kept >= 3
    before = len(lines_of(marks))
    said = shell(tmp_path, "simulate", "brook.yaml", "--trust", "--jobs", 2).stdout
    assert f"{MEMBERS} members, run by the command, 0 failed" in said
    assert len(lines_of(marks)) - before == MEMBERS - kept
    undisturbed = tmp_path / "undisturbed"
    undisturbed.mkdir()
    case = commanded(undisturbed, SMOOTH, "", COARSE, SMALL)
    wanted = vegglue.simulate(case, runs=undisturbed / "runs", jobs=1)
    found = read_ensemble(tmp_path / "runs" / "brook" / "ensemble.h5")
    np.testing.assert_array_equal(found.prediction, wanted.prediction)


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_or_a_plain_kill_ends_what_is_under_way(how: signal.Signals, tmp_path: Path) -> None:
    marks = slow_brook(tmp_path, 60.0)
    process = begin(tmp_path, "simulate", "brook.yaml", "--trust", "--jobs", 2)
    after_runs(marks, 2, process)
    os.kill(process.pid, how)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    assert LAST_WORDS["stopped"] in said
    for line in lines_of(marks):
        with pytest.raises(ProcessLookupError):
            os.kill(int(line.split()[0]), 0)


def test_jobs_give_the_same_bits(tmp_path: Path) -> None:
    case = commanded(tmp_path, SMOOTH, "", COARSE, SMALL)
    one, two = (vegglue.simulate(case, runs=tmp_path / str(jobs), jobs=jobs).prediction for jobs in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_another_command_makes_another_ensemble(tmp_path: Path) -> None:
    first = vegglue.simulate(commanded(tmp_path, SMOOTH, "", COARSE, SMALL), runs=tmp_path / "runs", jobs=2)
    other = commanded(tmp_path, SMOOTH.replace("0.05", "0.06"), "", COARSE, SMALL)
    assert not np.array_equal(vegglue.simulate(other, runs=tmp_path / "runs", jobs=2).prediction, first.prediction)


def test_verbs_that_need_the_built_in_engine_say_so(tmp_path: Path) -> None:
    case = commanded(tmp_path, SMOOTH, "", COARSE, SMALL)
    with pytest.raises(InputError, match="`discover` works with the built-in engine only; take `engine` out"):
        vegglue.discover(case)
    with pytest.raises(InputError, match="`twin` works with the built-in engine only; take `engine` out"):
        vegglue.make_twin(case, tmp_path / "riddle", hide="nothing")


@pytest.mark.slow
def test_a_cluster_is_refused_in_a_sentence(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    commanded(tmp_path, SMOOTH, "", COARSE, SMALL)
    done = here(tmp_path, "simulate", "brook.yaml", "--trust", "--cluster", "local:1", succeed=False)
    assert done.returncode == 2
    assert "--cluster: brook runs the command of its `engine`, on this machine only" in done.stderr


# The same at every station, whatever the parameters are.
CONSTANT = re.sub(r"\{0\.2 / .*!r\}", "0.4", SMOOTH)


@pytest.mark.slow
def test_a_command_that_ignores_its_parameters_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say
) -> None:
    """It was told as water that enters the channel, beside a remark that nothing was as reckoned."""
    error = ("experiment: June}", "experiment: June, standard_error: 0.01}")
    commanded(tmp_path, CONSTANT, "", COARSE, SMALL, error)
    monkeypatch.chdir(tmp_path)
    code, said = say("diagnose", "brook.yaml", "--trust", "--quiet", "--jobs", 1)
    assert (code, said.count("\n")) == (2, 1)
    assert "expected a command of `engine` whose predictions change with n_b or phi, got the same ones" in said


# As SMOOTH, with errors of 20 mm/s that are the same for the same parameters.
RESTLESS = SMOOTH.replace("+ float(row['x'])", "+ error(row) + float(row['x'])").replace(
    "with open",
    "import random\ndef error(row): return random.Random(f'{n} {phi} {row}').gauss(0.0, 0.02)\nwith open",
    1,
)


@pytest.mark.slow
def test_a_command_that_never_rests_gets_no_verdict(tmp_path: Path) -> None:
    """Its differences are noise, which was told as friction and water that are not there."""
    error = ("experiment: June}", "experiment: June, standard_error: 0.05}")
    case = commanded(tmp_path, RESTLESS, "", COARSE, SMALL, error)
    found = vegglue.diagnose(case, runs=tmp_path / "runs", jobs=1).verdict
    assert found.kind == "cannot-tell"
    assert isinstance(found.distrust, CommandNotSettled)
    assert set(found.distrust.parameters) <= set(case.parameters)


@pytest.mark.slow
def test_a_command_far_from_what_was_reckoned_with_gets_no_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same command is believed where it may differ by as much as it does; what was found with it is the same."""
    error = ("experiment: June}", "experiment: June, standard_error: 0.05}")
    case = commanded(tmp_path, SMOOTH, "", COARSE, SMALL, error)
    found: list[Diagnosis] = []

    def found_once(*model: Any) -> Diagnosis:
        if not found:
            found.append(diagnose_model(*model))
        return found[0]

    monkeypatch.setattr("vegglue.workflow.diagnose.diagnose_model", found_once)
    believed = vegglue.diagnose(case, runs=tmp_path / "runs", jobs=1).verdict
    assert isinstance(believed.notes[0], CommandCompared)
    assert believed.notes[0].errors > 0.0
    assert believed.distrust is None
    monkeypatch.setattr(command_model, "BEYOND_BELIEF", -1.0)
    (tmp_path / "runs" / "brook" / "diagnosis.h5").unlink()
    doubted = vegglue.diagnose(case, runs=tmp_path / "runs", jobs=1).verdict
    assert doubted.kind == "cannot-tell"
    assert isinstance(doubted.distrust, CommandDiffers)
    assert replace(doubted, kind=believed.kind, distrust=None) == believed
