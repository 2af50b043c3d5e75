"""Commands given in a folder that came from others: what libraries take from there by themselves is not taken."""

import subprocess
import sys
from pathlib import Path

import pytest
from reach import COARSE, ENVIRONMENT, write_reach

# As the command that an install puts in place: without the folder among the places of modules.
ENTRY = "from vegglue.cli.main import main\nif __name__ == '__main__':\n    main()\n"
ALARM = "open({mark!r}, 'w').close()\nraise ImportError('the code of a stranger')\n"
SAME_NAMES = ("numpy", "json", "pickle", "multiprocessing", "joblib", "distributed", "h5py", "scipy", "yaml")
FEWER = ("members: 1024", "members: 128")


def given(folder: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    entry = folder.parent / "entry.py"
    entry.write_text(ENTRY, encoding="utf-8")
    return subprocess.run(
        [sys.executable, entry, *arguments], cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    here = tmp_path / "strangers"
    here.mkdir()
    write_reach(here, COARSE, FEWER)
    return here


@pytest.mark.slow
@pytest.mark.parametrize("where", [("--jobs", "2"), ("--cluster", "local:1")], ids=["processes", "cluster"])
def test_processes_import_no_module_that_lies_there(folder: Path, tmp_path: Path, where: tuple[str, ...]) -> None:
    mark = tmp_path / "ran"
    for name in SAME_NAMES:
        (folder / f"{name}.py").write_text(ALARM.format(mark=str(mark)), encoding="utf-8")
    done = given(folder, "simulate", "brook.yaml", *where)
    assert done.returncode == 0, done.stderr
    assert not mark.exists()


def test_no_machine_code_is_taken_from_there(folder: Path) -> None:
    (folder / ".numba_config.yaml").write_text("cache_dir: cache\n", encoding="utf-8")
    done = given(folder, "check", "brook.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    assert ".numba_config" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (folder / "cache").exists()


@pytest.mark.slow
def test_figures_take_no_settings_from_there(folder: Path) -> None:
    assert given(folder, "check", "brook.yaml").returncode == 0
    picture = folder / "runs/brook/channel.png"
    drawn = picture.read_bytes()
    picture.unlink()
    (folder / "matplotlibrc").write_text("text.usetex: True\nsavefig.dpi: 30\nlines.linewidth: 9\n", encoding="utf-8")
    done = given(folder, "check", "brook.yaml")
    assert done.returncode == 0, done.stderr
    assert picture.read_bytes() == drawn
