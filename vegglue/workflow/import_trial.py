"""What an import would write, read and judged elsewhere before anything of it is written."""

import os
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from vegglue.case.config import PATHS, load_case
from vegglue.case.resolved_config import Tree, as_yaml
from vegglue.case.text_files import write_text
from vegglue.errors import InputError, shown_path
from vegglue.measurements.observations import read_observations

NO_ROOM = "free some room in the folder for temporary files"


def refuse_unreadable_import(tree: Tree, texts: Mapping[Path, str], target: Path, folder: Path) -> None:
    """Errors: InputError where the config of `tree` and the texts beside it would be refused by all that reads them.

    target: where the config is to be written, of the measurements in `folder`.
    """
    made = {path.relative_to(target.parent): text for path, text in texts.items()}
    with TemporaryDirectory() as name:
        elsewhere = Path(os.path.realpath(name))
        for path, text in made.items():
            write_text(elsewhere / path, text, NO_ROOM)
        home = Path(os.path.realpath(target)).parent
        write_text(elsewhere / target.name, as_yaml(_named_from_anywhere(tree, home, made)), NO_ROOM)
        try:
            read_observations(load_case(elsewhere / target.name))
        except InputError as error:
            raise InputError(_as_if_written(str(error), elsewhere, target, made, folder)) from None


def _named_from_anywhere(tree: Any, home: Path, made: Mapping[Path, str]) -> Any:
    """The tree with full paths of files that are there; what is to be made is named as it will be."""
    if isinstance(tree, list):
        return [_named_from_anywhere(one, home, made) for one in tree]
    if not isinstance(tree, dict):
        return tree
    full = {
        key: os.path.realpath(home / value)
        for key, value in tree.items()
        if key in PATHS and isinstance(value, str) and Path(value) not in made
    }
    return {key: _named_from_anywhere(value, home, made) for key, value in tree.items()} | full


def _as_if_written(sentence: str, elsewhere: Path, target: Path, made: Mapping[Path, str], folder: Path) -> str:
    """A refusal with the paths that files would have had, and what became of these."""
    here = shown_path(target.parent / target.name).removesuffix(target.name)
    told = sentence.replace(f"{shown_path(elsewhere)}{os.sep}", here)
    names = [f"{here}{path}" for path in made if f"{here}{path}" in told]
    would = f"; {' and '.join(names)} would be made of {shown_path(folder)}" if names else ""
    return f"{told} Nothing was written{would}."
