"""A case as one text without `extends`, and the hashes that tie results to it."""

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from vegglue.case.safe_yaml import yaml_of
from vegglue.case.schema import Case

# Keys that a finished ensemble does not depend on, as pydantic wants those to leave out.
NOT_SIMULATED = dict.fromkeys(
    ("name", "title", "infer", "survey", "validation", "reference", "canopy_correction", "frame", "imported"), True
) | {
    "simulate": {"field_budget"},
    "observations": {"__all__": {"synthetic"}},
    "engine": {"keep", "step"},
}
# Goes up whenever the same case gets other numbers, so that results of before no longer fit it.
EQUATIONS = 8
Tree = dict[str, Any]


def resolved_yaml(case: Case) -> str:
    """The case as one file without `extends`; data files are named relative to the file it was read from."""
    return as_yaml(plain_tree(dumped(case), lambda file: _relative(file, case.source)))


def as_yaml(tree: Tree) -> str:
    """Keys and values as the text of a config."""
    return yaml_of(tree)


def case_hash(case: Case) -> str:
    """sha256 of the resolved case, in its order, and of the contents of every file it names, wherever they lie.

    Its title is not in it: no number hangs on that.
    """
    return _hash(dumped(case) | {"title": ""})


def simulation_hash(case: Case) -> str:
    """Like case_hash, of only what an ensemble depends on: unchanged by likelihood, title or reference values."""
    return _hash(dumped(case, NOT_SIMULATED))


def dumped(case: Case, without: Mapping[str, Any] | None = None) -> Tree:
    """Keys and values of a case, aliases as in a config, without what is None and without the keys given."""
    return case.model_dump(by_alias=True, exclude_none=True, exclude=without)


def plain_tree(tree: Any, of_file: Callable[[Path], Any]) -> Any:
    """The tree in dicts and lists, with of_file(path) for each path in it."""
    if isinstance(tree, dict):
        return {key: plain_tree(value, of_file) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [plain_tree(value, of_file) for value in tree]
    return of_file(tree) if isinstance(tree, Path) else tree


def _hash(tree: Tree) -> str:
    contents = plain_tree(tree, digest_of)
    return hashlib.sha256(json.dumps([EQUATIONS, contents], ensure_ascii=False).encode()).hexdigest()


def digest_of(path: Path) -> str:
    """sha256 of the content of a file; of a folder, of the names and contents of all files below it, but for the
    bytecode that Python leaves there.
    """
    if not path.is_dir():
        return hashlib.sha256(path.read_bytes()).hexdigest()
    listed = [
        (file.relative_to(path).as_posix(), hashlib.sha256(file.read_bytes()).hexdigest()) for file in _files_in(path)
    ]
    return hashlib.sha256(json.dumps(listed).encode()).hexdigest()


def last_changes(path: Path) -> tuple[tuple[str, int, int], ...]:
    """Of the files that `digest_of` reads: name, time of the last change [ns] and size [bytes]; they are not read."""
    stats = [(file.as_posix(), file.stat()) for file in (_files_in(path) if path.is_dir() else [path])]
    return tuple((name, found.st_mtime_ns, found.st_size) for name, found in stats)


def _files_in(folder: Path) -> list[Path]:
    return sorted(file for file in folder.rglob("*") if file.is_file() and file.parent.name != "__pycache__")


def _relative(file: Path, source: Path) -> str:
    return Path(os.path.relpath(file, source.parent)).as_posix()
