"""What is imported before it is needed: nothing heavy for help, for the version, or to refuse a config."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from reach import ENVIRONMENT, ROOT, write_reach

pytestmark = pytest.mark.slow

HEAVY = {"dask", "distributed", "h5py", "jinja2", "joblib", "matplotlib", "numba", "numpy", "pandas", "scipy"}
# Runs a command in a fresh interpreter, then tells which modules are there on the last line of standard error.
TELLING = """
import json, sys
from vegglue.cli.main import main
try:
    main()
finally:
    print(json.dumps(sorted({name.split(".")[0] for name in sys.modules})), file=sys.stderr)
"""
ENVIRONMENT_HERE = ENVIRONMENT | {"PYTHONPATH": str(ROOT)}


def imported_by(folder: Path, *arguments: object) -> tuple[int, set[str]]:
    """How `vegglue ...` ended in a process of its own, and the top level of all that it imported."""
    done = subprocess.run(
        [sys.executable, "-c", TELLING, *map(str, arguments)],
        cwd=folder, env=ENVIRONMENT_HERE, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.returncode, set(json.loads(done.stderr.splitlines()[-1]))


@pytest.mark.parametrize(
    "arguments", [("--help",), ("infer", "--help"), ("run", "--help"), ("version",), ("--version",)]
)
def test_help_and_version_import_nothing_heavy(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    code, imported = imported_by(tmp_path, *arguments)
    assert code == 0
    assert imported & (HEAVY | {"yaml"}) == set()


# Each command reads a config by the same calls, and is tried with two mistakes or three.
@pytest.mark.parametrize(
    ("command", "old", "new"),
    [
        ("check", "title: A short", "title: [A short"),
        ("diagnose", "canopy_height:", "canopy_hight:"),
        ("infer", "discharge: 2.0", "discharge: fast water"),
        ("run", "discharge: 2.0", "discharge: -2.0"),
        ("check", "level: 0.95", "level: deep"),
        ("diagnose", "file: velocities.csv", "file: elsewhere.csv"),
        (
            "infer",
            "n_b: {distribution: uniform, low: 0.02, high: 0.10",
            "n_b: {distribution: normal, mean: 0.05, sd: 0.04",
        ),
        ("run", "default: bed", "default: bad"),
        ("run", "  phi: {dist", "  stray: {distribution: normal, mean: 1, sd: 0.1, unit: '-'}\n  phi: {dist"),
    ],
)
def test_a_config_is_refused_before_anything_heavy_is_imported(
    tmp_path: Path, command: str, old: str, new: str
) -> None:
    config = write_reach(tmp_path, (old, new))
    code, imported = imported_by(tmp_path, command, config.name)
    assert code == 2
    assert imported & HEAVY <= {"jinja2"}  # what is wrong with YAML is worded by a template


def test_only_numpy_is_needed_to_refuse_an_effect(tmp_path: Path) -> None:
    config = write_reach(tmp_path, ("observations:\n", "effects:\n  wound: {values: {speed: 1}}\nobservations:\n"))
    code, imported = imported_by(tmp_path, "diagnose", config.name)
    assert code == 2
    assert imported & HEAVY == {"numpy"}


@pytest.fixture(scope="module", params=["check", "simulate", "infer", "diagnose", "extend_stepwise", "compare", "run"])
def of_verb(request: pytest.FixtureRequest) -> set[str]:
    """Modules that are there once a verb is at hand."""
    found = subprocess.run(
        [sys.executable, "-c", f"import sys, vegglue; vegglue.{request.param}; print(*sys.modules)"],
        env=ENVIRONMENT_HERE, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return set(found.stdout.split())


def test_nothing_draws_before_there_is_something_to_draw(of_verb: set[str]) -> None:
    assert {name.split(".")[0] for name in of_verb} & {"jinja2", "matplotlib", "rich", "typer"} == set()


def test_distributions_and_splines_wait_for_who_needs_them(of_verb: set[str]) -> None:
    """A second of a processor, which each worker of an ensemble would spend anew."""
    assert of_verb & {"scipy.stats", "scipy.interpolate", "scipy.optimize"} == set()
