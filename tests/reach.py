"""The brook of docs/own_case.md as a user would have it: its files on disk, and the command line."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from vegglue.cli.main import main

ROOT = Path(__file__).parents[1]
OWN_CASE, OWN_FILES = ((ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("own_case.md", "own_files.md"))
ENVIRONMENT = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MPLBACKEND": "agg", "COLUMNS": "200"}
Say = Callable[..., tuple[int, str]]
COARSE = ("cell: [1.0, 0.5]", "cell: [1.25, 0.75]")  # solves several members in a hundredth of a second


def block(language: str) -> str:
    """The first code block in a language, of own_case.md, else of own_files.md."""
    found = re.search(rf"^```{language}\n(.*?)^```", f"{OWN_CASE}\n{OWN_FILES}", re.MULTILINE | re.DOTALL)
    assert found, f"neither page has a {language} block"
    return found[1]


def write_reach(folder: Path, *changes: tuple[str, str]) -> Path:
    """The config and the measurements of the page in a folder, with some text replaced; returns the config."""
    text = block("yaml")
    for old, new in changes:
        assert old in text, f"the example has no {old!r}"
        text = text.replace(old, new)
    (folder / "velocities.csv").write_text(block("csv"), encoding="utf-8")
    (folder / "brook.yaml").write_text(text, encoding="utf-8")
    return folder / "brook.yaml"


def command(*arguments: str | int | Path) -> list[str]:
    return [sys.executable, "-m", "vegglue", *map(str, arguments)]


def vegglue(folder: Path, *arguments: str | int | Path, succeed: bool = True) -> subprocess.CompletedProcess[str]:
    """What `vegglue ...` said and how it ended, run in a folder."""
    done = subprocess.run(
        command(*arguments), cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=300, check=False
    )
    assert not succeed or done.returncode == 0, done.stderr
    return done


def here(folder: Path, *arguments: str | int | Path, succeed: bool = True) -> subprocess.CompletedProcess[str]:
    """As `vegglue`, in this process: libraries are imported, and a model is calibrated, once for all commands."""
    said, errors = StringIO(), StringIO()
    with pytest.MonkeyPatch.context() as patched, redirect_stdout(said), redirect_stderr(errors):
        patched.chdir(folder)
        patched.setattr(sys, "argv", ["vegglue", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
    done = subprocess.CompletedProcess(arguments, int(ended.value.code or 0), said.getvalue(), errors.getvalue())
    assert not succeed or done.returncode == 0, done.stderr
    return done


def said_to(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    """How `vegglue ...` ended in this process, and its standard error: much sooner than in one of its own."""
    monkeypatch.setattr(sys, "argv", ["vegglue", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0), capsys.readouterr().err


def begin(folder: Path, *arguments: str | int | Path) -> "subprocess.Popen[str]":
    """`vegglue ...` on its way, its output to be read line by line; a process group of its own, as from a terminal."""
    return subprocess.Popen(
        command(*arguments),
        cwd=folder,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
