"""What keeps the project in shape: homes of libraries, sizes of files, the map of the files, no machine's paths."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted((ROOT / "vegglue").glob("*.py"))
NOWHERE_ELSE = {"numpy", "scipy"}  # at home everywhere
# Where each library may be imported. A new home is a decision: say it here.
HOMES = {
    "h5py": {"store"},
    "jinja2": {"report"},
    "joblib": {"cores"},
    "matplotlib": {
        "channel_figure", "diagnosis_pictures", "figure_ladder", "figure_misfit", "figure_plan", "figure_posterior",
        "figure_style", "figure_suspects", "figures", "reported",
    },
    "numba": {"blocks", "elementary", "sweeps"},
    "pandas": {
        "adv", "aside", "candidates", "contract", "design", "diagnosis", "diagnosis_pictures", "ensemble", "extend",
        "figure_misfit", "figure_suspects", "figures", "flow_pictures", "groundwork", "infer", "layout",
        "likelihood", "linearise", "loop", "measured_pictures", "noise", "observations", "posterior",
        "refine", "report_tables", "sensor", "table", "twin", "twin_files", "verdict",
    },
    "pydantic": {"config", "schema"},
    "rich": {"cli", "cli_effects", "cli_loop", "cli_twin"},
    "threadpoolctl": {"cores"},
    "typer": {"cli", "cli_effects", "cli_loop", "cli_twin"},
    "yaml": {"config"},
}  # fmt: skip
DISTRIBUTIONS = {"yaml": "pyyaml"}
# Who may know the shell, the files, the pictures: nobody below them.
ABOVE = {
    "cli": {"__main__"},
    "store": {"cli", "cli_twin", "loop", "simulate"},
    "report": {"cli"},
    "simulate": {"cli"},
}
LONGEST = 400
CATCH_ALLS = {"utils", "helpers", "base", "types", "constants", "common", "misc"}
FOLDERS = "|".join(("home", "root", "work", "Users", "mnt", "tmp", "opt", "venv"))
OF_A_MACHINE = re.compile(rf"(?<![\w.~$}}])/(?:{FOLDERS})/\w|\b[A-Z]:\\\w")


def imported(path: Path) -> set[str]:
    """Modules a file imports anywhere in it, in full."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def of_others(path: Path) -> set[str]:
    """Third-party libraries a file imports."""
    return {name.split(".")[0] for name in imported(path)} - set(sys.stdlib_module_names) - {"vegglue", "__future__"}


def test_every_library_stays_at_home() -> None:
    found: dict[str, set[str]] = {}
    for path in MODULES:
        for library in of_others(path) - NOWHERE_ELSE:
            found.setdefault(library, set()).add(path.stem)
    assert found == HOMES


def test_what_is_imported_is_what_is_declared() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = {re.split(r"[<>=\[ ]", requirement)[0] for requirement in project["dependencies"]}
    assert declared == {DISTRIBUTIONS.get(library, library) for library in HOMES} | NOWHERE_ELSE


def test_nobody_below_knows_what_stands_above() -> None:
    known_by = {name: {path.stem for path in MODULES if f"vegglue.{name}" in imported(path)} for name in ABOVE}
    assert known_by == ABOVE


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_files_are_short_and_say_what_they_are(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST
    assert ast.get_docstring(ast.parse(text)), "a file begins with what it is for"
    assert path.stem not in CATCH_ALLS


def test_the_map_of_the_files_is_complete() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    part = text[text.index("## Files") : text.index("## What holds everywhere")]
    named = re.findall(r"`(\w+)`", part)
    assert sorted(named) == sorted(path.stem for path in MODULES), "each file once"


def tracked() -> list[Path]:
    """Text files of the project, whether or not there is a version control to ask."""
    folders = [path for name in ("vegglue", "tests", "configs", "data", ".ci") for path in (ROOT / name).rglob("*")]
    here = [path for path in ROOT.iterdir() if path.suffix in (".md", ".toml") or path.name in ("Makefile", "LICENSE")]
    return [path for path in folders + here if path.is_file() and "__pycache__" not in path.parts]


def test_no_file_names_a_place_on_a_machine() -> None:
    found = [
        f"{path.relative_to(ROOT)}, line {number}: {line.strip()}"
        for path in tracked()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if OF_A_MACHINE.search(line)
    ]
    assert found == []


def test_paths_of_a_machine_are_recognised() -> None:
    for parts in (("see ", "home", "ann", "x"), ("'", "work", "main'")):
        assert OF_A_MACHINE.search("/".join(parts)), parts
    assert OF_A_MACHINE.search("\\".join(("C:", "Users", "ann")))
    for text in ("/".join(("runs", "work", "x")), "https://doi.org/10.1/x", "m3/s", "m^1/2/s"):
        assert not OF_A_MACHINE.search(text), text


def test_the_top_level_is_the_one_agreed() -> None:
    for name in ("pyproject.toml", "vegglue", "configs", "data", "runs", "tests", "Makefile", "README.md", "LICENSE"):
        assert (ROOT / name).exists(), name
