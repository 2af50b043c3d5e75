"""Cases as files: YAML read with all that `extends` names, and refused in one sentence where it is wrong."""

import os
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from vegglue.case.consistency import disagreement
from vegglue.case.messages import KeyPath, Refusal, dotted, first_refusal, unknown_without_value
from vegglue.case.resolved_config import Tree
from vegglue.case.safe_yaml import safe_yaml
from vegglue.case.schema import Case
from vegglue.case.size_limits import LARGEST_CONFIG, LONGEST_CHAIN
from vegglue.case.text_files import read_text
from vegglue.case.yaml_problems import yaml_problem
from vegglue.errors import InputError, shown_path

# Keys whose value is a path, relative to the file it is written in.
PATHS = ("file", "raster", "points", "effect_file")
# A key whose values are such paths, by a name each.
NAMED_PATHS = "files"
# A mapping that names one of these is a declaration of its own: it replaces an inherited one instead of adding to it.
DECLARING = ("law", "distribution")
# What a folder of measurements holds, of which `import` makes a config.
SITE_FILES = ("site.yaml", "site.json")
KINDS_OF_YAML = {type(None): "an empty file", list: "a list", str: "a text"}
COMPILER_SETTINGS = ".numba_config.yaml"


def load_case(path: Path | str, trust: bool = False) -> Case:
    """The case in a YAML file, with all it extends.

    trust: whether a Python file or a command that the case names may be run, and settings of the folder may say where
    compiled code lies. Errors: InputError, which says what is wrong, where, and what to do.
    """
    path = Path(path)
    if not trust:
        _refuse_settings_of_folder()
    layers = _layers(path, ())
    _refuse_site_file(*layers[0])
    for file, layer in layers:
        if (refusal := unknown_without_value(layer)) is not None:
            raise _input_error([(file, layer)], refusal)
    tree: Tree = {}
    for _, layer in reversed(layers):
        tree = _merged(tree, layer)
    tree = _with_one_inflow_named(tree) | {"source": Path(os.path.realpath(path))}
    try:
        case = Case.model_validate(tree)
    except ValidationError as error:
        raise _input_error(layers, first_refusal(tree, error.errors())) from None
    if case.effect_file is not None and not trust:
        raise InputError(
            f"{shown_path(path)}: `effect_file` names {shown_path(case.effect_file)}, which runs as code: read it, and "
            "add --trust if you trust it."
        )
    if case.engine is not None and not trust:
        raise InputError(
            f"{shown_path(path)}: `engine` names the command {case.engine.command!r}, which runs as code: read it and "
            "the files it runs, and add --trust if you trust them."
        )
    refusal = disagreement(case)
    if refusal is not None:
        raise _input_error(layers, refusal)
    return case


def _refuse_settings_of_folder() -> None:
    """The compiler takes settings from the folder the user stands in, which may be a stranger's, and runs what lies
    where they say. Errors: InputError when there are any.
    """
    if Path(COMPILER_SETTINGS).exists():
        raise InputError(
            f"{COMPILER_SETTINGS}: can make numba run code that lies where it says: remove it, or add --trust if you "
            "trust it."
        )


def _refuse_site_file(path: Path, tree: Tree) -> None:
    """Errors: InputError for the site file of a folder of measurements, whose keys are not those of a case."""
    if path.name in SITE_FILES and "channel" in tree:
        raise InputError(
            f"{shown_path(path)}: expected a config, got the site file of a folder of measurements: "
            f"`vegglue import {shown_path(path.parent)}` makes a config of it."
        )


def _layers(path: Path, above: tuple[Path, ...]) -> list[tuple[Path, Tree]]:
    """The file and what it extends, the most special one first."""
    path = Path(os.path.realpath(path))  # which a loop of links does not stop
    if path in above:
        circle = " -> ".join(shown_path(file) for file in (*above[above.index(path) :], path))
        raise InputError(f"{shown_path(above[-1])}: `extends` goes round in a circle, {circle}: take one of them out.")
    if len(above) == LONGEST_CHAIN:
        raise InputError(f"{shown_path(path)}: `extends` names more than {LONGEST_CHAIN} files in a row: join some.")
    tree = read_tree(path, above)
    base = tree.pop("extends", None)
    layer = (path, _with_full_paths(tree, path.parent))
    if base is None:
        return [layer]
    if not isinstance(base, str):
        raise InputError(f"{shown_path(path)}: `extends` expected the name of one YAML file, got {base!r}.")
    return [layer, *_layers(path.parent / base, (*above, path))]


def read_tree(path: Path, above: tuple[Path, ...] = ()) -> Tree:
    """Keys and values of a YAML file; above: the files whose `extends` led to it. Errors: InputError."""
    named = f"it is named by `extends` in {shown_path(above[-1])}, check the path" if above else _way_from(path)
    text = read_text(path, LARGEST_CONFIG, named)
    try:
        tree = safe_yaml(text)
    except yaml.YAMLError as error:
        raise InputError(f"{shown_path(path)}{yaml_problem(error, text)}.") from None
    if not isinstance(tree, dict):
        got = KINDS_OF_YAML.get(type(tree), "a single value")
        raise InputError(f"{shown_path(path)}: expected keys and values (`name: ...`), got {got}; correct the file.")
    return tree


def _way_from(path: Path) -> str:
    """What to do about a config that cannot be read: a folder of measurements has to be imported."""
    if any(os.path.isfile(path / name) for name in SITE_FILES):  # which no name is too long for
        return f"`vegglue import {shown_path(path)}` makes a config of that folder"
    return "check the path"


def _with_full_paths(tree: Any, folder: Path) -> Any:
    if isinstance(tree, list):
        return [_with_full_paths(item, folder) for item in tree]
    if not isinstance(tree, dict):
        return tree
    paths = {key: os.path.realpath(folder / tree[key]) for key in PATHS if isinstance(tree.get(key), str)}
    named = tree.get(NAMED_PATHS)
    if isinstance(named, dict):
        full = {name: os.path.realpath(folder / file) for name, file in named.items() if isinstance(file, str)}
        paths[NAMED_PATHS] = named | full
    return {key: _with_full_paths(value, folder) for key, value in tree.items()} | paths


def _merged(base: Any, layer: Any) -> Any:
    """`layer` over `base`: mappings key by key, anything else replaced; null takes an inherited key away."""
    if not isinstance(layer, dict):
        return layer
    if not isinstance(base, dict) or any(key in layer for key in DECLARING):
        base = {}
    both = base | {key: _merged(base.get(key), value) for key, value in layer.items()}
    return {key: value for key, value in both.items() if value is not None}


def _with_one_inflow_named(tree: Tree) -> Tree:
    """With a single inflow, `discharge: 2.66` means all of it: write it as {inflow: 2.66}."""
    inflows = tree.get("inflows")
    if not (isinstance(inflows, dict) and len(inflows) == 1):
        return tree
    (inflow,) = inflows
    named = _all_named(tree, inflow)
    if isinstance(tree.get("validation"), dict):
        named |= {"validation": tree["validation"] | _all_named(tree["validation"], inflow)}
    return tree | named


def _all_named(tree: Tree, inflow: str) -> Tree:
    experiments = tree.get("experiments")
    if not isinstance(experiments, dict):
        return {}
    return {"experiments": {name: _named(experiment, inflow) for name, experiment in experiments.items()}}


def _named(experiment: Any, inflow: str) -> Any:
    if not isinstance(experiment, dict) or isinstance(experiment.get("discharge"), dict | None):
        return experiment
    return experiment | {"discharge": {inflow: experiment["discharge"]}}


def _input_error(layers: list[tuple[Path, Tree]], refusal: Refusal) -> InputError:
    """The sentence, with the file that says (or should say) what is refused: the first of those that say most of it."""
    path, _ = max(layers, key=lambda layer: _depth(layer[1], refusal.place))
    end = "" if refusal.complaint.endswith(("?", ".")) else "."
    return InputError(f"{shown_path(path)}: `{dotted(refusal.place)}` {refusal.complaint}{end}")


def _depth(tree: Any, place: KeyPath) -> int:
    """How many keys of a place a tree has."""
    for depth, key in enumerate(place):
        keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
        if key not in keys:
            return depth
        tree = tree[key]
    return len(place)
