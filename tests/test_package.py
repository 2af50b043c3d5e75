"""What is handed out: one version everywhere, all files in the wheel, and a wheel that runs by itself elsewhere."""

import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml
from lowest_versions import lowest_versions
from reach import ENVIRONMENT, write_reach

from vegglue.version import VERSION

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "vegglue"
WITHOUT_CHECKOUT = {name: value for name, value in ENVIRONMENT.items() if name != "PYTHONPATH"}


def package_files() -> set[str]:
    """All files of the package that are not made by running it."""
    paths = (path for path in PACKAGE.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to(ROOT).as_posix() for path in paths}


def built(what: str, folder: Path) -> Path:
    """A wheel or sdist, made by the backend as pip would ask for it, from a copy of the sources."""
    names = ("vegglue", "configs", "data", "docs", "tests", "runs", ".ci")
    copy = folder / "sources"
    listed = [*(name for name in names), *(path.name for path in ROOT.iterdir() if path.is_file())]
    with tarfile.open(folder / "sources.tar", "w") as archive:
        for name in listed:
            archive.add(ROOT / name, name, filter=_without_runs)
    with tarfile.open(folder / "sources.tar") as archive:
        archive.extractall(copy, filter="data")
    program = f"from setuptools import build_meta; print(build_meta.build_{what}({str(folder)!r}))"
    done = subprocess.run([sys.executable, "-c", program], cwd=copy, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stderr}\n`make setup` brings the setuptools that pyproject.toml asks for"
    return folder / done.stdout.splitlines()[-1]


def _without_runs(entry: tarfile.TarInfo) -> tarfile.TarInfo | None:
    made = entry.name.startswith("runs/") and entry.name != "runs/.gitkeep"
    return None if made or "__pycache__" in entry.name or ".egg-info" in entry.name else entry


def test_the_version_is_the_same_everywhere() -> None:
    changes = re.findall(r"^## (\S+), (\d{4}-\d{2}-\d{2})$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert changes[0] == (VERSION, str(citation["date-released"]))
    assert citation["version"] == VERSION


def test_the_citation_names_the_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["cff-version"] == "1.2.0"
    assert citation["authors"] == [{"name": "vegglue developers"}]
    (paper,) = citation["references"]
    assert f"https://doi.org/{paper['doi']}" in (ROOT / "README.md").read_text("utf-8")


def test_every_dependency_states_its_lowest_version() -> None:
    stated = dict(one.split("==") for one in lowest_versions())
    assert {"numpy", "arviz", "xarray"} <= set(stated)


def test_whatever_is_no_python_is_declared_as_data() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"]["*"]
    others = {Path(name) for name in package_files() if not name.endswith(".py")}
    assert [path for path in others if not any(path.match(pattern) for pattern in patterns)] == []


def test_the_demonstration_has_the_files_of_the_checkout() -> None:
    """They stand twice: an installed package has neither `configs` nor `data`."""
    shipped = PACKAGE / "workflow" / "demo_files"
    origin = {"measured": ROOT / "data" / "open_cases", "configs": ROOT / "configs", "data": ROOT / "data"}
    files = [path.relative_to(shipped) for path in shipped.rglob("*") if path.is_file()]
    assert len(files) == 10
    for path in files:
        first, *rest = path.parts
        there = origin[first].joinpath(*("open-b" if name == "willows" else name for name in rest))
        assert (shipped / path).read_bytes() == there.read_bytes(), path


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built("wheel", tmp_path_factory.mktemp("wheel"))


@pytest.mark.slow
def test_the_wheel_holds_all_files_and_no_others(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if not name.startswith(f"vegglue-{VERSION}.dist-info/")}
    assert names == package_files()


@pytest.mark.slow
def test_the_source_distribution_holds_what_the_tests_need(tmp_path: Path) -> None:
    with tarfile.open(built("sdist", tmp_path)) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert package_files() <= names
    for name in ("Makefile", "README.md", "LICENSE", "CITATION.cff", "configs/d0.yaml", "tests/conftest.py",
                 "data/kict/adv_points.csv", "docs/diagnosis.md", "runs/.gitkeep"):  # fmt: skip
        assert name in names


@pytest.mark.slow
def test_a_wheel_checks_a_case_far_from_the_checkout(wheel: Path, tmp_path: Path) -> None:
    """In an environment of its own, which sees the libraries of this one: no network is needed."""
    there, user = tmp_path / "environment", tmp_path / "user"
    user.mkdir()
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(there)], check=True)
    python = there / "bin" / "python"
    own = Path(asked(python, "import sysconfig; print(sysconfig.get_path('purelib'))"))
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", own, wheel]
    subprocess.run(install, check=True)
    (own / "others.pth").write_text(f"{Path(yaml.__file__).parents[1]}\n", encoding="utf-8")
    write_reach(user)
    command = [python, "-m", "vegglue", "check", "brook.yaml"]
    done = subprocess.run(command, cwd=user, env=WITHOUT_CHECKOUT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "540 cells, 15 of 15 stations in use" in done.stdout
    assert (user / "runs" / "brook" / "channel.png").exists()
    assert Path(asked(python, "import vegglue; print(vegglue.__file__)")).is_relative_to(own)


def asked(python: Path, program: str) -> str:
    """What a program prints, that sees no checkout."""
    command = [python, "-c", program]
    return subprocess.check_output(command, cwd=python.parent, env=WITHOUT_CHECKOUT, text=True).strip()
