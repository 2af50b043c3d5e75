"""The cache of compiled loops: stale as soon as a file changes that a loop takes a function or a constant from."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from house import FILES, PACKAGE, tree_of
from reach import COARSE, here, write_reach

from vegglue.compilation import SHARED, _stamp, compiled, compiled_on_views, shapes_loops
from vegglue.wording.phases import COMPILING

CHEZY = """
from vegglue.effects.plant_laws import baptist_chezy
print(baptist_chezy(1.0, 0.5, 1.0, 60.0), sum(baptist_chezy.stats.cache_hits.values()))
"""

DRAG = """
import hashlib
import numpy as np
from vegglue.effects.bed_laws import class_drag
chance = np.random.default_rng(0)
depth, half_range = chance.uniform(5e-4, 1.5, (40, 40, 16)), chance.uniform(1e-3, 0.1, (40, 40))
classes = np.repeat(chance.integers(0, 2, (40, 1)), 40, axis=1)
coefficient = np.stack([chance.uniform(0.02, 0.05, 16), chance.uniform(0.1, 2.0, 16)])
found = class_drag(depth, half_range, classes, np.array([0, 1]), coefficient, 1.3, 0.01)
print(hashlib.sha256(found.tobytes()).hexdigest())
"""


def chezy(folder: Path, **environment: str) -> tuple[float, int]:
    """C of a copy of the package in a process of its own, and how many compilations came from the cache."""
    own = {"PYTHONPATH": str(folder), "HOME": str(folder), "XDG_CACHE_HOME": str(folder / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", CHEZY],
        env=os.environ | own | environment, cwd=folder, capture_output=True, text=True, check=True,
    )  # fmt: skip
    value, hits = done.stdout.split()
    return float(value), int(hits)


def copied(copy: Path) -> None:
    """What loops of resistance need of the package, in a folder."""
    for part in ("__init__.py", "version.py", "compilation.py", "effects"):
        source = PACKAGE / part
        copy.mkdir(exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, copy / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, copy / part)


@pytest.mark.slow
@pytest.mark.parametrize("where", ["beside the code", "in a read-only folder", "where the user says"])
def test_a_constant_changed_in_another_file_is_compiled_anew(tmp_path: Path, where: str) -> None:
    copy = tmp_path / "vegglue"
    copied(copy)
    if where == "in a read-only folder":  # no folder for a cache can be made there
        (copy / "effects" / "__pycache__").write_text("")
    elsewhere = {"NUMBA_CACHE_DIR": str(tmp_path / "own")} if where == "where the user says" else {}
    first, again = chezy(tmp_path, **elsewhere), chezy(tmp_path, **elsewhere)
    assert first[0] == again[0]
    assert (first[1], again[1]) == (0, 1)
    constants = copy / "effects" / "physical_constants.py"
    constants.write_text(constants.read_text().replace("KARMAN = 0.41", "KARMAN = 0.40"))
    other = chezy(tmp_path, **elsewhere)
    assert other[0] > first[0]
    assert other[1] == 0


@pytest.mark.slow
def test_a_cold_and_a_warm_cache_give_the_same_digits(tmp_path: Path) -> None:
    command, own = [sys.executable, "-c", DRAG], os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    runs = [subprocess.run(command, env=own, capture_output=True, text=True, check=True) for _ in range(2)]
    assert runs[0].stdout == runs[1].stdout


def test_code_of_other_types_never_takes_the_same_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two processes each find no code of a loop yet, and number their own as the first."""
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path))
    loop = compiled(_twice)
    index = loop._cache._cache_file
    monkeypatch.setattr(index, "_load_index", dict)
    for types in ("float64", "int64"):
        index.save((types,), types)
    assert len(list(tmp_path.rglob("*.nbc"))) == 2


def _twice(value: float) -> float:
    return 2.0 * value


@pytest.mark.slow
def test_without_a_folder_to_write_to_loops_are_compiled_each_time_and_it_is_said_once(tmp_path: Path) -> None:
    """As in a container with a read-only install and no home: a file stands where each folder would be."""
    copied(tmp_path / "vegglue")
    (tmp_path / "vegglue" / "effects" / "__pycache__").write_text("")
    (tmp_path / "home").write_text("")
    nowhere = {"PYTHONPATH": str(tmp_path), "HOME": str(tmp_path / "home"), "XDG_CACHE_HOME": str(tmp_path / "home")}
    done = subprocess.run(
        [sys.executable, "-c", CHEZY],
        env=os.environ | nowhere, cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert float(done.stdout.split()[0]) > 0.0
    assert done.stderr.count("No folder for compiled code can be written to") == len(done.stderr.splitlines()) == 1


def test_loops_use_nothing_of_the_package_but_loops_and_shared_constants() -> None:
    """What else a loop took from another file would be frozen in its cache."""
    for path in filter(shapes_loops, FILES):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        foreign = {
            alias.asname or alias.name
            for node in tree.body
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vegglue.")
            and not shapes_loops(PACKAGE.parent / f"{node.module.replace('.', '/')}.py")
            for alias in node.names
        }  # fmt: skip
        loops = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.decorator_list]
        bodies = [part for loop in loops for statement in loop.body for part in ast.walk(statement)]
        assert not foreign & {part.id for part in bodies if isinstance(part, ast.Name)}, path


def test_loops_on_views_give_numbers_to_loops_that_count() -> None:
    """A view of which no reference was counted, given to a loop that counts, is freed while it is used."""
    loops = {
        node.name: (node, {part.id for part in node.decorator_list if isinstance(part, ast.Name)})
        for path in filter(shapes_loops, FILES)
        for node in tree_of(path).body
        if isinstance(node, ast.FunctionDef)
    }
    on_views = {name for name, (_, decorators) in loops.items() if compiled_on_views.__name__ in decorators}
    called = {
        part.func.id
        for name, (node, decorators) in loops.items()
        if decorators and name not in on_views
        for part in ast.walk(node)
        if isinstance(part, ast.Call) and isinstance(part.func, ast.Name)
    }
    assert {"_momentum_x", "_momentum_y"} <= on_views & called
    for name in sorted(on_views & called):
        node, _ = loops[name]
        given = any(isinstance(part, ast.Return) and part.value is not None for part in ast.walk(node))
        kinds = {part.id for part in ast.walk(node.returns) if isinstance(part, ast.Name)} if node.returns else set()
        assert not given or (kinds and kinds <= {"tuple", "float", "int", "bool"}), name


def test_a_file_depends_on_those_below_it_only(tmp_path: Path) -> None:
    assert {path.name for path in FILES if path.name in SHARED} == set(SHARED)
    stamps = {name: _stamp(PACKAGE / name) for name in ("flow/kernels.py", "flow/wet_and_dry.py", "flow/batch.py")}
    assert len(set(stamps.values())) == len(stamps)
    assert _stamp(tmp_path / "nothing.py") == ""


FIRST_USE = """
import numpy as np
from vegglue.engine.model import with_compilation
from vegglue.flow.kernels import rates
from vegglue.parallel import at_most
with at_most(1):
    print(with_compilation("calibrating"))
cell, side = np.ones((1, 1, 1)), np.ones((1, 1))
of_flow = np.ones((1, 3, 1, 1)), side, np.zeros((0, 0, 0)), side, 0.01, False, cell, cell, side, side, side
rates(*of_flow, np.ones(1, bool), np.ones(1), 1.0, 1.0, None)
print(with_compilation("calibrating"))
"""


@pytest.mark.slow
def test_the_first_command_says_that_it_compiles(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(PACKAGE.parent)}
    said = [
        subprocess.run(
            [sys.executable, "-c", FIRST_USE], env=environment, capture_output=True, text=True, check=True
        ).stdout.splitlines()
        for _ in range(2)
    ]
    assert said == [[f"calibrating{COMPILING}", "calibrating"], ["calibrating", "calibrating"]]


@pytest.mark.parametrize(
    "command", [("infer",), ("plan",), ("diagnose",), ("simulate", "--members", "32")], ids=lambda words: words[0]
)
def test_every_command_that_solves_flows_says_that_it_compiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]
) -> None:
    """And it says so before it solves the first one, on a machine where nothing is kept."""
    begun: list[None] = []
    monkeypatch.setattr("vegglue.engine.model.rates", SimpleNamespace(signatures=()))
    monkeypatch.setattr("vegglue.engine.model.is_kept", lambda loop: False)
    monkeypatch.setattr("vegglue.engine.model.compile_beside", lambda: begun.append(None))
    config = write_reach(tmp_path, COARSE, ("experiment: June}", "experiment: June, standard_error: 0.02}"))
    first, *_ = here(tmp_path, *command, config.name, "--jobs", "1").stdout.splitlines()
    assert COMPILING.strip() in first
    assert begun
