"""A case as one text without `extends`, the hashes that tie results to it, and configs that vegglue writes among a
user's own: it replaces what it wrote itself, and nothing else.

A written config ends with the digests of itself and of the tables written with it. A file without one, or with another
content, was made or edited by hand.
"""

import hashlib
import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from vegglue.case.safe_yaml import yaml_of
from vegglue.case.schema import Case
from vegglue.case.text_files import write_text
from vegglue.errors import InputError, path_from, shown_path
from vegglue.wording.remedies import KNOWN_BY_THESE

# Keys that a finished ensemble does not depend on, as pydantic wants those to leave out.
NOT_SIMULATED = dict.fromkeys(
    (
        "name",
        "title",
        "infer",
        "survey",
        "validation",
        "reference",
        "canopy_correction",
        "frame",
        "imported",
        "planned",
    ),
    True,
) | {
    "exclude": True,
    "bed": {"__all__": {"survey"}},
    "simulate": {"field_budget"},
    "observations": {"__all__": {"synthetic"}},
    "engine": {"keep", "step", "most_runs"},
}
# Goes up whenever the same case gets other numbers, so that results of before no longer fit it.
EQUATIONS = 9
Tree = dict[str, Any]


def resolved_yaml(case: Case) -> str:
    """The case as one file without `extends`; data files are named relative to the file it was read from."""
    return as_yaml(plain_tree(dumped(case), lambda file: path_from(case.source.parent, file)))


def as_yaml(tree: Tree) -> str:
    """Keys and values as the text of a config."""
    return yaml_of(tree)


def case_hash(case: Case) -> str:
    """SHA-256 of the resolved case, in its order, and of the contents of every file it names, wherever they lie.

    Its title and what is planned are not in it: no result depends on them.

    Returns
    -------
    str
        Hexadecimal.
    """
    return _hash(dumped(case, {"planned": True}) | {"title": ""})


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


LINE = re.compile(r"^# sha256 ([0-9a-f]{16}) of (.+)\n", re.MULTILINE)


def write_made(texts: Mapping[Path, str], advice: str, force: bool = False) -> None:
    """Write a config, and before it the tables it comes with.

    Parameters
    ----------
    texts : mapping of str
        By path, the config last.
    advice : str
        What to do, for messages.
    force : bool
        Whether what vegglue did not write as it is is replaced, too.

    Raises
    ------
    InputError
        Before anything is written, if such a file is there and not to be replaced.
    StorageError
        If one cannot be written.
    """
    refuse_not_made(texts, advice, force)
    *tables, config = texts
    for table in tables:
        write_text(table, texts[table], advice)
    stamped = {path.name: texts[path] for path in (config, *tables)}
    lines = "".join(f"# sha256 {_short(text)} of {name}\n" for name, text in stamped.items())
    write_text(config, texts[config] + KNOWN_BY_THESE + lines, advice)


def refuse_not_made(texts: Mapping[Path, str], advice: str, force: bool = False) -> None:
    """Errors: InputError, as those of `write_made`, where something is there that is not to be replaced."""
    config = list(texts)[-1]
    for path in texts:
        if (path.exists() or path.is_symlink()) and not path.is_file():  # reading a pipe would wait
            raise InputError(f"{shown_path(path)}: expected a file or nothing, got something else; {advice}.")
    if force:
        return
    try:
        stated = {name: digest for digest, name in LINE.findall(config.read_text(encoding="utf-8"))}
    except (OSError, UnicodeDecodeError):
        stated = {}
    for path, text in texts.items():
        try:
            there = path.read_bytes().decode(errors="backslashreplace")
        except FileNotFoundError:
            continue
        except OSError:
            there = ""  # not readable: not what vegglue wrote
        body, heading, lines = there.rpartition(KNOWN_BY_THESE)
        there = body if heading and not LINE.sub("", lines) else there
        if there != text and stated.get(path.name) != _short(there):
            raise InputError(
                f"{shown_path(path)}: is there, and was not made by vegglue or was edited since; add --force to "
                f"replace it, or {advice}."
            )


def refuse_parent(target: Path, parent: Path) -> None:
    """Errors: InputError where a config is to be written over the one that it extends, which --force would replace."""
    if target.resolve() == parent:
        raise InputError(f"--to {shown_path(target)}: is the config that it extends; give another file.")


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
