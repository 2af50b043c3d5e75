"""Every fault of docs/faults.md happens here: exit code, what is kept, and that the next try has the same bits."""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from fault_table import ENSEMBLE, FAULTS, PAGE, Fault, page
from kills import same
from reach import COARSE, Say, write_reach
from stored import CHUNKS, a_header, append

from vegglue.inference import solve_ensemble
from vegglue.results.resume import ensemble_writer

# Four chunks, and the quicker way to a posterior.
CHANGES = (COARSE, ("simulate: {members: 1024,", "infer: {method: glue}\nsimulate: {members: 256,"))
STEPS = ("simulate", "infer")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The user's folder after all steps, when nothing happens."""
    folder = tmp_path_factory.mktemp("undisturbed")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        write_reach(folder, *CHANGES)
        for step in (*STEPS, "check", "report"):  # so that there is something that a fault might spoil
            assert code_of(patch, step) == 0
    return folder


def code_of(patch: pytest.MonkeyPatch, step: str) -> int:
    from vegglue.cli.main import main

    patch.setattr("sys.argv", ["vegglue", *words(step)])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def words(command: str) -> list[str]:
    name, *options = command.split()
    return [name, "brook.yaml", *options, *(["--jobs", "1"] if name in STEPS else [])]


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=[f"{one.command}: {one.what}" for one in FAULTS])
def test_a_fault_has_its_code_and_loses_nothing(
    fault: Fault, undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say
) -> None:
    monkeypatch.chdir(tmp_path)
    write_reach(tmp_path, *CHANGES)
    if fault.ready:
        shutil.copytree(undisturbed / "runs", tmp_path / "runs")
    before, solved = contents(tmp_path), counted(monkeypatch)
    with fault.trouble(tmp_path):
        solved.clear()
        there = contents(tmp_path)
        code, error = say(*words(fault.command))
    assert code == fault.code, error
    assert fault.names in error
    assert error.count("\n") == (1 if fault.code else 0), error
    if code:
        now = contents(tmp_path)
        changed = [name for name, content in there.items() if now.get(name) != content]
        assert changed == [], "nothing that was there is touched"
    restore(tmp_path, before, undisturbed)
    for step in STEPS:
        assert say(*words(step)) == (0, "")
    assert len(solved) == fault.solves, "chunks solved"
    # The same bits, whatever has happened.
    for name in (ENSEMBLE, ENSEMBLE.with_name("posterior.h5")):
        assert same(tmp_path / name, undisturbed / name), name


def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """A list that grows by one with each chunk that is solved."""
    solved: list[int] = []
    real = solve_ensemble.solve_in_experiment

    def solve(*arguments: Any, **more: Any) -> Any:
        solved.append(1)
        return real(*arguments, **more)

    monkeypatch.setattr(solve_ensemble, "solve_in_experiment", solve)
    return solved


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != ".lock"
    }


def restore(folder: Path, before: dict[str, bytes], undisturbed: Path) -> None:
    """What the sentence asks for: inputs as they were, broken results and what stands in their place taken away."""
    for name in ("brook.yaml", "velocities.csv"):
        (folder / name).write_bytes(before[name])
    run = folder / "runs/brook"
    if run.is_file():
        run.unlink()
    for name in ("ensemble.h5", "posterior.h5"):
        path = run / name
        if path.is_dir():
            path.rmdir()
        elif path.exists() and not same_or_broken(path, undisturbed / ENSEMBLE.with_name(name)):
            path.unlink()


def same_or_broken(path: Path, other: Path) -> bool:
    try:
        return same(path, other)
    except (OSError, KeyError, RuntimeError, ValueError):
        return False


def test_the_page_of_faults_is_made_of_the_table() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "`python tests/fault_table.py` writes it"


def test_the_reader_of_the_page_follows_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert reader is not None
    monkeypatch.chdir(tmp_path)
    said = []
    with ensemble_writer(tmp_path / ENSEMBLE, a_header()) as writer:
        for chunk in range(CHUNKS):
            append(writer, chunk)
            # In another process: one alone would share what it has open.
            done = subprocess.run([sys.executable, "-c", reader[1]], capture_output=True, text=True, check=True)
            said.append(done.stdout.split(" members")[0])
    assert said == ["4 of 12", "8 of 12", "12 of 12"]
