"""Cases as files: YAML read with all that `extends` names, and refused in one sentence if it is wrong or its parts
disagree: every name used is declared and every declaration used, files and places exist.
"""

import math
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from vegglue.case.messages import CaseError, KeyPath, dotted, first_refusal, refuse_unknown_without_value
from vegglue.case.resolved_config import Tree
from vegglue.case.safe_yaml import safe_yaml, yaml_problem
from vegglue.case.schema import Case, Experiment, Observation, share_below
from vegglue.case.site_schema import (
    COEFFICIENT_OF,
    BedLayer,
    FrictionClass,
    Interval,
    Value,
    VegetationOverride,
    VegetationType,
)
from vegglue.case.size_limits import LARGEST_CONFIG, LARGEST_DATA, LONGEST_CHAIN
from vegglue.case.text_files import read_text
from vegglue.errors import InputError, shown_path
from vegglue.wording.numbers import nearest
from vegglue.wording.sentences import phrase

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
# Names that dimensions of the result files have, and a variable in them must not.
DIMENSIONS = ("chain", "draw", "member", "station", "experiment", "section")
# Share of its prior [-] at which a quantity that must be positive may be 0 or less: no ensemble is that large.
LEAST_PROBABILITY = 1e-6


def load_case(path: Path | str, trust: bool = False) -> Case:
    """The case in a YAML file, with all it extends.

    Parameters
    ----------
    path : Path or str
    trust : bool
        Whether a Python file or a command that the case names may be run, and settings of the folder may choose where
        compiled code lies.

    Returns
    -------
    Case

    Raises
    ------
    InputError
        With what is wrong, where, and what to do.
    """
    path = Path(path)
    # The compiler takes settings from the working folder, which may be a stranger's, and runs the code they name.
    if not trust and Path(COMPILER_SETTINGS).exists():
        raise InputError(
            f"{COMPILER_SETTINGS}: can make numba run code of a stranger: remove it, or add --trust if you trust it."
        )
    layers = _layers(path, ())
    file, layer = layers[0]
    if file.name in SITE_FILES and "channel" in layer:
        raise InputError(
            f"{shown_path(file)}: expected a config, got the site file of a folder of measurements: "
            f"`vegglue import {shown_path(file.parent)}` makes a config of it."
        )
    for file, layer in layers:
        try:
            refuse_unknown_without_value(layer)
        except CaseError as refusal:
            raise _input_error([(file, layer)], refusal) from None
    tree: Tree = {}
    for _, layer in reversed(layers):
        tree = _merged(tree, layer)
    # With a single inflow, `discharge: 2.66` means all of it: {inflow: 2.66}.
    if isinstance(tree.get("inflows"), dict) and len(tree["inflows"]) == 1:
        (inflow,) = tree["inflows"]
        tree |= _all_named(tree, inflow)
        if isinstance(tree.get("validation"), dict):
            tree |= {"validation": tree["validation"] | _all_named(tree["validation"], inflow)}
    tree |= {"source": Path(os.path.realpath(path))}
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
    try:
        for agree in (_names_agree, _effects_agree, _parameters_agree, _places_agree, _other_models_agree):
            agree(case)
    except CaseError as refusal:
        raise _input_error(layers, refusal) from None
    return case


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
    """Keys and values of a YAML file.

    Parameters
    ----------
    above : tuple of Path
        Files whose `extends` led to it.

    Raises
    ------
    InputError
        If it cannot be read, or is no mapping of keys to values.
    """
    is_site = any(os.path.isfile(path / name) for name in SITE_FILES)  # which no name is too long for
    advice = "extends" if above else "import" if is_site else "path"
    text = read_text(path, LARGEST_CONFIG, advice, above[-1] if above else None)
    try:
        tree = safe_yaml(text)
    except yaml.YAMLError as error:
        raise InputError(f"{shown_path(path)}{yaml_problem(error, text)}.") from None
    if not isinstance(tree, dict):
        got = KINDS_OF_YAML.get(type(tree), "a single value")
        raise InputError(f"{shown_path(path)}: expected keys and values (`name: ...`), got {got}; correct the file.")
    return tree


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


def _all_named(tree: Tree, inflow: str) -> Tree:
    """The experiments of a tree with discharges by inflow."""
    if not isinstance(tree.get("experiments"), dict):
        return {}
    named = {
        name: one | {"discharge": {inflow: one["discharge"]}}
        for name, one in tree["experiments"].items()
        if isinstance(one, dict) and not isinstance(one.get("discharge"), dict | None)
    }
    return {"experiments": tree["experiments"] | named}


def _input_error(layers: list[tuple[Path, Tree]], refusal: CaseError) -> InputError:
    """The message, with the file that has (or lacks) what is refused: the first of those with most of its keys."""

    def depth(tree: Any) -> int:
        for depth, key in enumerate(refusal.place):
            keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
            if key not in keys:
                return depth
            tree = tree[key]
        return len(refusal.place)

    path, _ = max(layers, key=lambda layer: depth(layer[1]))
    end = "" if refusal.complaint.endswith(("?", ".")) else "."
    return InputError(f"{shown_path(path)}: `{dotted(refusal.place)}` {refusal.complaint}{end}")


def values(case: Case) -> Iterator[tuple[KeyPath, Value | None, bool]]:
    """Every number that may be a parameter: where it stands, what stands there, and whether it must be positive."""
    for name, friction_class in case.friction.classes.items():
        yield from _coefficients(("friction", "classes", name), friction_class)
    if case.friction.walls is not None:
        yield from _coefficients(("friction", "walls"), case.friction.walls)
    owners: list[tuple[KeyPath, Mapping[str, VegetationType | VegetationOverride]]]
    owners = [(("plants",), case.plants.stands), *((at, one.stands) for at, one in _experiments(case))]
    for place, stands in owners:
        for name, stand in stands.items():
            for key in ("phi", "canopy_height", "bare_chezy"):
                yield (*place, "stands", name, key), getattr(stand, key), True
    for at, experiment in _experiments(case):
        for inflow, discharge in experiment.discharge.items():
            yield (*at, "discharge", inflow), discharge, True
        yield (*at, "level"), experiment.level, False
    yield ("eddy_viscosity",), case.eddy_viscosity, True
    for name, entry in case.effects.items():
        for key, value in entry.values.items():
            yield ("effects", name, "values", key), value, False


def _experiments(case: Case) -> Iterator[tuple[KeyPath, Experiment]]:
    """Every experiment and where it stands: those that are calibrated to, then those of the validation."""
    yield from ((("experiments", name), one) for name, one in case.experiments.items())
    if case.validation is not None:
        yield from ((("validation", "experiments", name), one) for name, one in case.validation.experiments.items())


def _observations(case: Case) -> Iterator[tuple[KeyPath, Observation, Iterable[str]]]:
    """Every observation, where it stands, and the names of the experiments that it may be of."""
    yield from ((("observations", i), one, case.experiments) for i, one in enumerate(case.observations))
    if case.validation is not None:
        unseen = case.validation.experiments
        for i, one in enumerate(case.validation.observations):
            yield ("validation", "observations", i), one, unseen


def _planned(case: Case) -> Iterator[tuple[KeyPath, Any]]:
    """Every planned piece of field work, and where it stands."""
    for group in ("transects", "points", "gauges", "discharges") if case.planned is not None else ():
        yield from ((("planned", group, i), one) for i, one in enumerate(getattr(case.planned, group)))


def _coefficients(place: KeyPath, law: FrictionClass) -> Iterator[tuple[KeyPath, Value | None, bool]]:
    for key in COEFFICIENT_OF.values():
        yield (*place, key), getattr(law, key), True


def _declared(place: KeyPath, word: str, known: Iterable[str], what: str) -> None:
    if word not in (names := list(known)):
        raise CaseError(place, f"names the {what} `{word}`, which is not declared: {nearest(word, names)}")


def _names_agree(case: Case) -> None:
    """Every name is declared, and every file is there and not too large."""
    classes, stands = case.friction.classes, case.plants.stands
    _declared(("friction", "default"), case.friction.default, classes, "friction class")
    for i, zone in enumerate(case.friction.zones):
        for word in [zone.friction_class] if zone.friction_class else (zone.values or {}).values():
            _declared(("friction", "zones", i), word, classes, "friction class")
    patches = [patch.name for patch in case.plants.patches]
    for i, patch in enumerate(case.plants.patches):
        _declared(("plants", "patches", i, "stand"), patch.stand, stands, "stand")
        if patch.name in patches[:i]:
            raise CaseError(("plants", "patches", i, "name"), f"is `{patch.name}` a second time: rename one of them")
    for at, experiment in _experiments(case):
        for inflow in experiment.discharge:
            _declared((*at, "discharge"), inflow, case.inflows, "inflow")
        for inflow in case.inflows.keys() - experiment.discharge.keys():
            raise CaseError((*at, "discharge"), f"lacks the inflow `{inflow}`: add it")
        for stand in experiment.stands:
            _declared((*at, "stands"), stand, stands, "stand")
        for present in experiment.plants if isinstance(experiment.plants, tuple) else ():
            _declared((*at, "plants"), present, patches, "patch")
    for at, observation, experiments in _observations(case):
        if observation.experiment is not None:
            _declared((*at, "experiment"), observation.experiment, experiments, "experiment")
    for name, entry in case.effects.items():
        for word in entry.experiments or ():
            _declared(("effects", name, "experiments"), word, case.experiments, "experiment")
    for at, one in _planned(case):
        for word in one.experiments or ():
            _declared((*at, "experiments"), word, case.experiments, "experiment")
    if case.canopy_correction is not None:
        _declared(("canopy_correction", "stand"), case.canopy_correction.stand, stands, "stand")
    beds: list[tuple[KeyPath, Iterable[BedLayer]]] = [((), case.bed)]
    beds += [(at, experiment.bed or ()) for at, experiment in _experiments(case)]
    named: list[tuple[KeyPath, Path | None]] = []
    for at, layers in beds:
        for i, layer in enumerate(layers):
            named += [((*at, "bed", i, "raster"), layer.raster), ((*at, "bed", i, "points"), layer.points)]
            named += [((*at, "bed", i, "survey", "file"), layer.survey.file)] if layer.survey is not None else []
    named += [(("friction", "zones", i, "raster"), zone.raster) for i, zone in enumerate(case.friction.zones)]
    named += [((*at, "file"), observation.file) for at, observation, _ in _observations(case)]
    named += [(("survey", "file"), case.survey.file)] if case.survey else []
    named += [(("effect_file",), case.effect_file)]
    for place, file in named:
        if file is None:
            continue
        if not os.path.isfile(file):  # False for every name that no file can have, where a Path would raise
            raise CaseError(place, f"expected an existing file, got {shown_path(file)}: correct the path")
        if os.path.getsize(file) > LARGEST_DATA:
            raise CaseError(place, f"expected a file of at most {LARGEST_DATA:,} bytes, got more: make it smaller")


def _effects_agree(case: Case) -> None:
    """Effects and their parameters by name; none without its amplitude, and no number outside what it may be."""
    if not case.effects and not case.exclude and case.effect_file is None:
        return
    from vegglue.effects.library import library  # which needs numpy

    known = library(case.effect_file)
    for name in case.exclude or {}:
        _declared(("exclude", name), name, known, "effect")
        if any((entry.effect or key) == name for key, entry in case.effects.items()):
            raise CaseError(("exclude", name), "excludes an effect that `effects` has: take it out of one of the two")
    for key, entry in case.effects.items():
        place: KeyPath = ("effects", key)
        name = entry.effect or key
        _declared(place if entry.effect is None else (*place, "effect"), name, known, "effect")
        effect = known[name]
        parameters = {parameter.name: parameter for parameter in effect.parameters}
        for word, value in entry.values.items():
            at: KeyPath = (*place, "values", word)
            if word not in parameters:
                raise CaseError(at, f"is no parameter of this effect: {nearest(word, list(parameters))}")
            low, high, unit = parameters[word].low, parameters[word].high, parameters[word].unit
            if parameters[word].of:  # multiples of what the site is like: their signs alone are known here
                low, high = (0.0 if low >= 0.0 else -math.inf), (0.0 if high <= 0.0 else math.inf)
            if isinstance(value, str) and value in case.parameters:
                prior = case.parameters[value]
                if share_below(prior, low) > LEAST_PROBABILITY or share_below(prior, high) < 1.0 - LEAST_PROBABILITY:
                    raise CaseError(
                        ("parameters", value),
                        f"may leave {low:g} to {high:g} {unit}, where `{dotted(at)}` must lie: bound it",
                    )
            elif not isinstance(value, str) and not low <= value <= high:
                raise CaseError(at, f"expected a number from {low:g} to {high:g} {unit}, got {value:g}")
        if effect.amplitude.name not in entry.values:
            raise CaseError((*place, "values"), f"lacks `{effect.amplitude.name}`, without which {name} is off: add it")
        if effect.stage != "sensor" and (entry.sections or entry.devices):
            raise CaseError(place, f"names sections or devices, but {name} acts on the flow: use `experiments`")


def _parameters_agree(case: Case) -> None:
    """Quantities are positive if they must be, and every parameter is used."""
    for place, value, positive in values(case):
        if isinstance(value, str):
            _declared(place, value, case.parameters, "parameter")
            if positive and share_below(case.parameters[value], 0.0) >= LEAST_PROBABILITY:
                raise CaseError(
                    ("parameters", value),
                    f"may fall to 0 or below, but `{dotted(place)}` must be above 0: raise its lower bound",
                )
        elif value is not None and positive and value <= 0:
            raise CaseError(place, f"expected a number above 0, got {value:g}")
    used = {value for _, value, _ in values(case) if isinstance(value, str)}
    for name in case.parameters:
        if name in DIMENSIONS:
            raise CaseError(
                ("parameters", name), f"has one of the names {', '.join(DIMENSIONS)}, kept for results: rename it"
            )
        if name not in used and case.engine is None:  # a command may know what the built-in solver does not
            raise CaseError(
                ("parameters", name), "is declared but used nowhere: name it where its value belongs, or remove it"
            )


def _places_agree(case: Case) -> None:
    """Ranges and planned measurements lie in the grid."""
    ranges: list[tuple[KeyPath, Interval | None, Interval]] = [
        (("inflows", name, "range"), inflow.range, case.grid.y if inflow.side == "west" else case.grid.x)
        for name, inflow in case.inflows.items()
    ]
    ranges.append((("outlet", "range"), case.outlet.range, case.grid.y))
    if case.simulate.fields is not None:
        ranges.append((("simulate", "fields", "x"), case.simulate.fields.x, case.grid.x))
    for place, part, (low, high) in ranges:
        if part is not None and (part[0] < low or part[1] > high):
            got = f"{part[0]:g} to {part[1]:g}"
            raise CaseError(place, f"expected a range within {low:g} to {high:g} m, got {got} m")
    for at, one in _planned(case):
        for axis, (low, high) in (("x", case.grid.x), ("y", case.grid.y)):
            given = getattr(one, axis, None)
            for value in given if isinstance(given, tuple) else () if given is None else (given,):
                if not low <= value <= high:
                    raise CaseError((*at, axis), f"expected a place within {low:g} to {high:g} m, got {value:g}")


def _other_models_agree(case: Case) -> None:
    """A threshold has its likelihood, a finished result all flows of the case, and a command its files."""
    if case.infer.behavioural is not None and case.infer.likelihood == "gaussian":
        raise CaseError(("infer", "behavioural"), "goes with an informal likelihood, not with gaussian: remove it")
    if (result := case.finished_result) is not None:
        known = {*case.experiments, *(case.validation.experiments if case.validation is not None else ())}
        for name in sorted(known - result.files.keys()):
            raise CaseError(("finished_result", "files"), f"expected the flow of {name}, got none: add its file")
        for name, path in result.files.items():
            if name not in known:
                raise CaseError(("finished_result", "files", name), phrase("unknown_experiment_here", sorted(known)))
            if not os.path.isfile(path):
                raise CaseError(("finished_result", "files", name), phrase("no_file_here", path))
        for name in result.parameters:
            _declared(("finished_result", "parameters", name), name, case.parameters, "parameter")
    if case.engine is None:
        return
    for name, path in case.engine.files.items():
        if not os.path.exists(path):
            raise CaseError(
                ("engine", "files", name),
                f"expected an existing file or folder, got {shown_path(path)}: put it there or correct the path",
            )
    if case.simulate.fields is not None:
        raise CaseError(("simulate", "fields"), "cannot be kept of a command, which predicts at stations: remove it")
