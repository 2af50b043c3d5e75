"""What keeps the project in shape: one way of dependence, homes of libraries, sizes, names, no machine's paths."""

import re
import sys
import tomllib
from pathlib import Path

import pytest
from house import FILES, PACKAGE, ROOT, folders, imported, imported_files, imports_of, module_of, page
from house import public_names as public_names_of

MODULES = [path for path in FILES if path.name != "__init__.py"]
AT_HOME_EVERYWHERE = {"numpy", "scipy"}
# Folders or files where each library may be imported. A new home is a decision: say it here.
HOMES = {
    "h5py": {"importers", "results"},
    "jinja2": {"wording"},
    "joblib": {"parallel"},
    "matplotlib": {"pages"},
    "numba": {"compilation"},
    "pandas": {
        "calibration", "diagnosis", "engine", "flow", "inference", "measurements", "pages", "results", "workflow",
    },
    "psutil": {"engine", "parallel"},
    "pydantic": {"case", "importers", "results"},
    "rich": {"cli"},
    "threadpoolctl": {"parallel"},
    "typer": {"cli"},
    "yaml": {"case"},
}  # fmt: skip
# Homes of what vegglue can do without: an extra, imported where it is used.
HOMES_OF_EXTRAS = {
    "arviz": {"results", "workflow"},
    "dask": {"cluster"},
    "distributed": {"cluster"},
    "mhkit": {"importers"},
    "openpyxl": {"importers"},
    "pyproj": {"importers", "results"},
    "shapefile": {"importers"},
    "tifffile": {"importers", "results"},
    "xarray": {"results", "workflow"},
}
DISTRIBUTIONS = {"shapefile": "pyshp", "yaml": "pyyaml"}
CATCH_ALLS = {"utils", "helpers", "base", "types", "constants", "common", "misc"}
# Names that every file of a family defines in its own right.
OF_A_FAMILY = {"EFFECTS"}
PLACES = "|".join(("home", "root", "work", "Users", "mnt", "tmp", "opt", "venv"))
OF_A_MACHINE = re.compile(rf"(?<![\w.~$}}])/(?:{PLACES})/\w|\b[A-Z]:\\\w")


def of_others(path: Path) -> set[str]:
    """Third-party libraries a file imports."""
    return {name.split(".")[0] for name in imported(path)} - set(sys.stdlib_module_names) - {"vegglue", "__future__"}


def test_no_arrow_runs_upward_between_folders() -> None:
    order = list(folders())  # fails on a circle
    assert set(order) == {path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name != "__pycache__"}
    for position, name in enumerate(order):
        assert imports_of(name) <= set(order[:position]), name


@pytest.mark.parametrize("folder", folders().values(), ids=lambda folder: folder.name)
def test_a_folder_imports_what_it_says(folder) -> None:
    assert sorted(imports_of(folder.name)) == sorted(folder.may_import)
    for name in folder.first:
        assert (PACKAGE / folder.name / name).is_file(), f"{folder.name}: {name} is to be opened first"


def test_files_import_each_other_in_no_circle() -> None:
    needs = {module_of(path): imported_files(path) for path in FILES}
    while needs:
        free = {name for name, needed in needs.items() if not needed & needs.keys()}
        assert free, f"a circle among {sorted(needs)}"
        needs = {name: needed for name, needed in needs.items() if name not in free}


def test_files_beside_the_folders_know_none_of_them() -> None:
    """errors, arrays and their like are below all folders but that of words; what Python starts with lies above."""
    for path in PACKAGE.glob("*.py"):
        if path.stem not in ("__init__", "__main__"):
            folders_known = {name.split(".")[1] for name in imported_files(path) if name.count(".") > 1}
            assert folders_known <= {"wording"}, path


def test_every_library_stays_at_home() -> None:
    found: dict[str, set[str]] = {}
    for path in FILES:
        home = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        for library in of_others(path) - AT_HOME_EVERYWHERE:
            found.setdefault(library, set()).add(home)
    assert found == HOMES | HOMES_OF_EXTRAS


def test_what_is_imported_is_what_is_declared() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = {re.split(r"[<>=\[ ]", requirement)[0] for requirement in project["dependencies"]}
    assert declared == {DISTRIBUTIONS.get(library, library) for library in HOMES} | AT_HOME_EVERYWHERE
    extras = [
        one for name in ("arviz", "cluster", "field", "instruments") for one in project["optional-dependencies"][name]
    ]
    wanted = {DISTRIBUTIONS.get(library, library) for library in HOMES_OF_EXTRAS}
    assert wanted <= {re.split("[<>=]", one)[0] for one in extras}


def test_files_say_what_they_are() -> None:
    for path in MODULES:
        assert path.read_text(encoding="utf-8").startswith('"""'), f"{path} begins with what it is for"
        assert path.stem not in CATCH_ALLS


def test_a_public_name_means_one_thing() -> None:
    homes: dict[str, list[str]] = {}
    for path in MODULES:
        for name in public_names_of(path) - OF_A_FAMILY:
            homes.setdefault(name, []).append(module_of(path))
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def test_tests_mirror_the_folders() -> None:
    of_no_folder = {"end_to_end", "studies", "verification"}
    there = {path.name for path in (ROOT / "tests").iterdir() if path.is_dir() and not path.name.startswith("_")}
    assert there - of_no_folder <= set(folders())


def test_the_map_is_made_of_the_docstrings() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    assert page() in text, "`make house` writes the table"


def tracked() -> list[Path]:
    """Text files of the project, whether or not there is a version control to ask."""
    of_text = ("vegglue", "tests", "docs", "configs", "data", ".ci", ".github")
    inside = [path for name in of_text for path in (ROOT / name).rglob("*")]
    here = [path for path in ROOT.iterdir() if path.suffix in (".md", ".toml") or path.name in ("Makefile", "LICENSE")]
    return [path for path in inside + here if path.is_file() and "__pycache__" not in path.parts]


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


def test_the_code_knows_no_study_as_the_paper() -> None:
    """Code that runs on any case names a study by its authors; a config may say `the paper`."""
    of_one_study = re.compile(r"\bthe paper\b|\bpaper['’]s\b|\bwillow", re.IGNORECASE)
    sources = [path for path in PACKAGE.rglob("*") if path.suffix in (".py", ".j2")]
    assert [str(path) for path in sources if of_one_study.search(path.read_text(encoding="utf-8"))] == []


def test_the_top_level_is_the_one_agreed() -> None:
    for name in ("pyproject.toml", "vegglue", "configs", "data", "runs", "tests", "Makefile", "README.md", "LICENSE"):
        assert (ROOT / name).exists(), name
