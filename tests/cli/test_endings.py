"""How commands end where the machine refuses: one sentence and exit code 3, never a traceback."""

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from reach import COARSE, ENVIRONMENT, Say, command, said_to, write_reach

from vegglue import parallel
from vegglue.__main__ import enter
from vegglue.cli.main import ending_well
from vegglue.errors import InputError, StorageError
from vegglue.wording.commands import LAST_WORDS

SIXTEEN = (COARSE, ("members: 1024", "members: 16"))


@pytest.fixture
def say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Say:
    """`vegglue ...` in a folder with the brook: exit code and standard error, of one line if it fails."""
    monkeypatch.chdir(tmp_path)
    write_reach(tmp_path, *SIXTEEN)

    def said(*arguments: object) -> tuple[int, str]:
        code, error = said_to(monkeypatch, capsys, *arguments)
        assert error.count("\n") == bool(code), error
        return code, error

    return said


def _file(name: str, reason: str) -> str:
    return LAST_WORDS["file"].format(name, reason)


def raises(error: BaseException) -> Callable[[], None]:
    def command() -> None:
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "code", "expected"),
    [
        (InputError("a mistake"), 2, "a mistake\n"),
        (StorageError("a.h5: the disk is full; make room."), 3, "a.h5: the disk is full; make room.\n"),
        (OSError(errno.EACCES, "Permission denied", "runs"), 3, _file("runs", "Permission denied")),
        (OSError(errno.ESTALE, "Stale file handle"), 3, _file(LAST_WORDS["output"], "Stale file handle")),
        (RuntimeError("Symlink loop from '/x'"), 2, LAST_WORDS["link"].format("Symlink loop from '/x'")),
        (MemoryError(), 3, LAST_WORDS["memory"]),
        (SystemExit(130), 130, LAST_WORDS["stopped"]),
        (SystemExit(2), 2, ""),
    ],
    ids=["mistake", "storage", "system", "unnamed", "link", "memory", "stopped", "usage"],
)
def test_every_end_has_its_code(
    error: BaseException, code: int, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        ending_well(raises(error))
    assert ended.value.code == code
    assert capsys.readouterr().err.startswith(expected)


def test_ctrl_c_while_libraries_load_is_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Loading(ModuleType):
        def __getattr__(self, name: str) -> Any:
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "vegglue.cli.main", Loading("main"))
    before = signal.getsignal(signal.SIGINT)
    try:
        with pytest.raises(SystemExit) as ended:
            enter()
        assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN, "nothing is left to stop"
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended.value.code == 130
    assert capsys.readouterr().err == f"{LAST_WORDS['stopped']}\n"


def test_runs_that_are_a_file_are_told(tmp_path: Path, say: Say) -> None:
    (tmp_path / "notes").write_text("mine")
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs/brook").write_text("mine")
    for step in ("check", "simulate", "diagnose"):
        for arguments in (("--runs", "notes"), ()):
            code, error = say(step, "brook.yaml", *arguments)
            assert code == 3
            assert "brook: cannot be written" in error
            assert "another one by --runs" in error
    assert (tmp_path / "notes").read_text() == (tmp_path / "runs/brook").read_text() == "mine"


def test_an_ensemble_that_is_a_folder_is_told(tmp_path: Path, say: Say) -> None:
    (tmp_path / "runs/brook/ensemble.h5").mkdir(parents=True)
    code, error = say("simulate", "brook.yaml")
    assert (code, "expected a file or nothing, found a folder" in error) == (3, True)
    code, error = say("infer", "brook.yaml")
    assert (code, "ensemble.h5: cannot be opened" in error) == (3, True)


def test_names_that_are_too_long_are_told(say: Say) -> None:
    assert say("check", "brook.yaml", "--runs", "a" * 300)[0] == 3
    assert say("check", "b" * 300 + ".yaml")[0] == 2


def test_a_folder_that_cannot_be_written_is_told(say: Say, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: object, **more: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system", "runs")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "mkdir", refuse)
        code, error = say("check", "brook.yaml")
    assert code == 3
    assert "cannot be written (Read-only file system)" in error


def test_a_full_disk_under_check_is_told(say: Say, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert say("check", "brook.yaml") == (3, "runs/brook/channel.png: the disk is full; make room and run it again.\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="of Linux alone")
def test_an_output_that_is_full_is_told() -> None:
    with open("/dev/full", "w", encoding="utf-8") as full:
        done = subprocess.run(command("version"), stdout=full, stderr=subprocess.PIPE, env=ENVIRONMENT, text=True)
    assert done.returncode == 3
    assert done.stderr == _file(LAST_WORDS["output"], "No space left on device") + "\n"


@pytest.mark.parametrize("at_once", ["", "1"])
def test_an_output_that_nobody_reads_on_ends_the_command_without_a_word(at_once: str) -> None:
    """Whether it is written line by line or at the end, which was told as a full disk is."""
    shell, environment = f"set -o pipefail; {' '.join(command('effects'))} | true", {"PYTHONUNBUFFERED": at_once}
    done = subprocess.run(["bash", "-c", shell], capture_output=True, env=ENVIRONMENT | environment, text=True)
    assert (done.returncode, done.stderr) == (1, "")


def test_an_output_that_is_closed_harms_nothing() -> None:
    shell = " ".join(command("version")) + " >&-"
    done = subprocess.run(shell, shell=True, stderr=subprocess.PIPE, env=ENVIRONMENT, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("arguments", [("effects",), ("effects", "--json")])
def test_a_terminal_that_knows_fewer_letters_shows_what_it_can(arguments: tuple[str, ...]) -> None:
    ascii_alone = ENVIRONMENT | {"PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command(*arguments), capture_output=True, env=ascii_alone, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.isascii()


def die(number: int) -> int:
    if number == 1:
        os.kill(os.getpid(), 9)
    return number


@pytest.mark.slow
def test_a_worker_that_is_killed_is_one_sentence() -> None:
    with pytest.raises(StorageError, match=r"A process that solved members was killed, .* with fewer --jobs"):
        list(parallel.as_finished(die, [(number,) for number in range(4)], 2))
    assert sorted(parallel.as_finished(die, [(0,), (2,)], 2)) == [0, 2], "a second start finishes"


def test_fields_that_a_killed_run_left_are_taken_away(tmp_path: Path, say: Say) -> None:
    assert say("simulate", "brook.yaml", "--jobs", 1) == (0, "")
    left = tmp_path / "runs/brook/fields.part"
    left.write_bytes(b"killed just before this was taken away")
    assert say("simulate", "brook.yaml", "--jobs", 1) == (0, "")
    assert not left.exists()


EXITS = """
from vegglue.effects.definition import Amplitude, Effect
raise SystemExit(0)
"""


def test_an_effect_that_ends_the_program_is_told(tmp_path: Path, say: Say) -> None:
    (tmp_path / "mine.py").write_text(EXITS)
    code, error = say("effects", "--check", "mine.py", "--trust")
    assert code == 2
    assert "mine.py: cannot be run: SystemExit" in error


@pytest.mark.parametrize("value", ["NaN", "1e999", "1e300", "1" + "0" * 400, '"far"', "[]", "null"])
def test_a_best_fit_that_is_none_counts_as_not_there(tmp_path: Path, say: Say, value: str) -> None:
    from vegglue.case.config import load_case
    from vegglue.case.resolved_config import case_hash
    from vegglue.workflow.case_run import kept_best_fit

    case = load_case(tmp_path / "brook.yaml")
    theta = ", ".join(f'"{name}": {value}' for name in case.parameters)
    (tmp_path / "best.json").write_text(f'{{"config_hash": "{case_hash(case)}", "theta": {{{theta}}}}}')
    best = kept_best_fit(case, tmp_path)
    assert best is None or abs(best).max() <= 6
