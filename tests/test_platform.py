"""Systems without what only POSIX has: modules hidden, processes spawned, a console of code page 1252."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from kills import WITH_ERRORS
from reach import COARSE, write_reach

from vegglue.case.config import load_case
from vegglue.case.resolved_config import resolved_yaml
from vegglue.errors import shell_line, shown_path
from vegglue.parallel import no_ctrl_c_for_children

# Hides what Windows lacks; the fast tests pass there, too (docs/limits.md).
HIDDEN = Path(__file__).with_name("_without_posix")


def run_hidden(folder: Path, *words: str) -> subprocess.CompletedProcess[bytes]:
    """A command of the package in a Python that hides what only POSIX has."""
    paths = os.pathsep.join([str(HIDDEN), str(Path(__file__).parents[1])])
    environment = os.environ | {"PYTHONPATH": paths, "PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"}
    environment.pop("PYTHONSAFEPATH", None)
    return subprocess.run(
        [sys.executable, "-m", "vegglue", *words], cwd=folder, env=environment, capture_output=True, check=False
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", [("check",), ("simulate", "--members", "8", "--jobs", "2"), ("infer",), ("diagnose", "--jobs", "1")]
)
def test_commands_need_nothing_that_only_posix_has(tmp_path: Path, words: tuple[str, ...]) -> None:
    write_reach(tmp_path, COARSE, WITH_ERRORS)
    verb, *options = words
    done = run_hidden(tmp_path, verb, "brook.yaml", *options)
    assert done.returncode == 0, done.stderr.decode("cp1252")
    assert done.stdout.decode("cp1252")


def test_processes_start_without_signal_masks(monkeypatch: pytest.MonkeyPatch) -> None:
    """joblib itself asks for the mask where it is not Windows: the mask is missing for this function alone."""
    monkeypatch.delattr("signal.pthread_sigmask")
    with no_ctrl_c_for_children():
        assert os.environ["PYTHONSAFEPATH"] == "1"


@pytest.fixture
def two_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    """A path on another drive than the folder it is seen from, for which Windows has no relative path."""

    def no_path(*_: object) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr("os.path.relpath", no_path)


def test_files_on_another_drive_are_named_in_full(tmp_path: Path, two_drives: None) -> None:
    write_reach(tmp_path)
    case = load_case(tmp_path / "brook.yaml")
    assert shown_path(case.source) == str(case.source)
    assert str(tmp_path / "velocities.csv") in resolved_yaml(case)


def test_commands_to_be_copied_are_quoted_as_the_shell_wants(monkeypatch: pytest.MonkeyPatch) -> None:
    words = ["vegglue", "diagnose", "my site.yaml"]
    assert shell_line(words) == "vegglue diagnose 'my site.yaml'"
    monkeypatch.setattr(sys, "platform", "win32")
    assert shell_line([*words, r"runs\brook.yaml"]) == r'vegglue diagnose "my site.yaml" runs\brook.yaml'
