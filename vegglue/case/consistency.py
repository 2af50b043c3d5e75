"""Whether the parts of a case agree: every name used is declared and every declaration used, files and places exist."""

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from vegglue.case.messages import KeyPath, Refusal, dotted, nearest
from vegglue.case.parts import Interval, Value
from vegglue.case.prior_tails import share_below
from vegglue.case.schema import Case, Experiment, Observation
from vegglue.case.site_schema import COEFFICIENT_OF, BedLayer, FrictionClass, Inflow, Stand, StandOverride
from vegglue.case.size_limits import LARGEST_DATA
from vegglue.errors import shown_path

if TYPE_CHECKING:
    from vegglue.effects.definition import Amplitude, Shape

# Names that dimensions of the result files have, and a variable in them must not.
DIMENSIONS = ("chain", "draw", "member", "station", "experiment", "section")
# Share of its prior [-] at which a quantity that must be positive may be 0 or less: no ensemble is that large.
LEAST_PROBABILITY = 1e-6


def disagreement(case: Case) -> Refusal | None:
    """The first thing in a case that does not agree with the rest of it; None when all agrees."""
    checks = (_names, _files, _effects, _values, _parameters, _sides, _likelihood, _engine)
    return next((refusal for check in checks for refusal in check(case)), None)


def values(case: Case) -> Iterator[tuple[KeyPath, Value | None, bool]]:
    """Every number that may be a parameter: where it stands, what stands there, and whether it must be positive."""
    for name, friction_class in case.friction.classes.items():
        yield from _coefficients(("friction", "classes", name), friction_class)
    if case.friction.walls is not None:
        yield from _coefficients(("friction", "walls"), case.friction.walls)
    owners: list[tuple[KeyPath, Mapping[str, Stand | StandOverride]]] = [(("plants",), case.plants.stands)]
    owners += [(at, experiment.stands) for at, experiment in _experiments(case)]
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


def _coefficients(place: KeyPath, law: FrictionClass) -> Iterator[tuple[KeyPath, Value | None, bool]]:
    for key in COEFFICIENT_OF.values():
        yield (*place, key), getattr(law, key), True


def _unknown(place: KeyPath, word: str, known: Iterable[str], what: str) -> Iterator[Refusal]:
    if word not in (names := list(known)):
        yield Refusal(place, f"names the {what} `{word}`, which is not declared: {nearest(word, names)}")


def _names(case: Case) -> Iterator[Refusal]:
    classes, stands = case.friction.classes, case.plants.stands
    yield from _unknown(("friction", "default"), case.friction.default, classes, "friction class")
    for i, zone in enumerate(case.friction.zones):
        for word in [zone.friction_class] if zone.friction_class else (zone.values or {}).values():
            yield from _unknown(("friction", "zones", i), word, classes, "friction class")
    patches = [patch.name for patch in case.plants.patches]
    for i, patch in enumerate(case.plants.patches):
        yield from _unknown(("plants", "patches", i, "stand"), patch.stand, stands, "stand")
        if patch.name in patches[:i]:
            yield Refusal(("plants", "patches", i, "name"), f"is `{patch.name}` a second time: rename one of them")
    for at, experiment in _experiments(case):
        for inflow in experiment.discharge:
            yield from _unknown((*at, "discharge"), inflow, case.inflows, "inflow")
        for inflow in case.inflows.keys() - experiment.discharge.keys():
            yield Refusal((*at, "discharge"), f"says nothing about the inflow `{inflow}`: add it")
        for stand in experiment.stands:
            yield from _unknown((*at, "stands"), stand, stands, "stand")
        for present in experiment.plants if isinstance(experiment.plants, tuple) else ():
            yield from _unknown((*at, "plants"), present, patches, "patch")
    for at, observation, experiments in _observations(case):
        if observation.experiment is not None:
            yield from _unknown((*at, "experiment"), observation.experiment, experiments, "experiment")
    for name, entry in case.effects.items():
        for word in entry.experiments or ():
            yield from _unknown(("effects", name, "experiments"), word, case.experiments, "experiment")
    if case.canopy_correction is not None:
        yield from _unknown(("canopy_correction", "stand"), case.canopy_correction.stand, stands, "stand")


def _values(case: Case) -> Iterator[Refusal]:
    for place, value, positive in values(case):
        if isinstance(value, str):
            yield from _unknown(place, value, case.parameters, "parameter")
            if positive and share_below(case.parameters[value], 0.0) >= LEAST_PROBABILITY:
                complaint = f"may fall to 0 or below, but `{dotted(place)}` must be above 0: raise its lower bound"
                yield Refusal(("parameters", value), complaint)
        elif value is not None and positive and value <= 0:
            yield Refusal(place, f"expected a number above 0, got {value:g}")


def _effects(case: Case) -> Iterator[Refusal]:
    """Effects and their parameters by name; none without its amplitude, and no number outside what it may be."""
    if not case.effects and case.effect_file is None:
        return
    from vegglue.effects.library import library  # which needs numpy

    known = library(case.effect_file)
    for key, entry in case.effects.items():
        place: KeyPath = ("effects", key)
        name = entry.effect or key
        yield from _unknown(place if entry.effect is None else (*place, "effect"), name, known, "effect")
        effect = known[name]
        parameters = {parameter.name: parameter for parameter in effect.parameters}
        for word, value in entry.values.items():
            yield from _unknown_word((*place, "values", word), word, parameters)
            yield from _in_support(case, (*place, "values", word), value, parameters[word])
        if effect.amplitude.name not in entry.values:
            complaint = f"says nothing about `{effect.amplitude.name}`, without which {name} is off: add it"
            yield Refusal((*place, "values"), complaint)
        if effect.stage != "sensor" and (entry.sections or entry.devices):
            yield Refusal(place, f"names sections or devices, but {name} acts on the flow: use `experiments`")


def _unknown_word(place: KeyPath, word: str, known: Iterable[str]) -> Iterator[Refusal]:
    names = list(known)
    if word not in names:
        yield Refusal(place, f"is no parameter of this effect: {nearest(word, names)}")


def _in_support(case: Case, place: KeyPath, value: Value, parameter: "Amplitude | Shape") -> Iterator[Refusal]:
    low, high = parameter.low, parameter.high
    if isinstance(value, str):
        if value in case.parameters:
            prior = case.parameters[value]
            if share_below(prior, low) > LEAST_PROBABILITY or share_below(prior, high) < 1.0 - LEAST_PROBABILITY:
                complaint = (
                    f"may leave {low:g} to {high:g} {parameter.unit}, where `{dotted(place)}` must lie: bound it"
                )
                yield Refusal(("parameters", value), complaint)
    elif not low <= value <= high:
        yield Refusal(place, f"expected a number from {low:g} to {high:g} {parameter.unit}, got {value:g}")


def _parameters(case: Case) -> Iterator[Refusal]:
    used = {value for _, value, _ in values(case) if isinstance(value, str)}
    for name in case.parameters:
        place = ("parameters", name)
        if name in DIMENSIONS:
            yield Refusal(place, f"has one of the names {', '.join(DIMENSIONS)}, kept for results: rename it")
        if name not in used and case.engine is None:  # a command may know what the built-in solver does not
            yield Refusal(place, "is declared but used nowhere: name it where its value belongs, or remove it")


def _sides(case: Case) -> Iterator[Refusal]:
    for name, inflow in case.inflows.items():
        yield from _inside(("inflows", name, "range"), inflow.range, _side(case, inflow))
    yield from _inside(("outlet", "range"), case.outlet.range, case.grid.y)
    if case.simulate.fields is not None:
        yield from _inside(("simulate", "fields", "x"), case.simulate.fields.x, case.grid.x)


def _side(case: Case, inflow: Inflow) -> Interval:
    return case.grid.y if inflow.side == "west" else case.grid.x


def _inside(place: KeyPath, part: Interval | None, whole: Interval) -> Iterator[Refusal]:
    if part is None:
        return
    low, high = part
    if low < whole[0] or high > whole[1]:
        yield Refusal(place, f"expected a range within {whole[0]:g} to {whole[1]:g} m, got {low:g} to {high:g} m")


def _files(case: Case) -> Iterator[Refusal]:
    named: list[tuple[KeyPath, Path | None]] = [*_files_of_bed((), case.bed)]
    named += [one for at, experiment in _experiments(case) for one in _files_of_bed(at, experiment.bed or ())]
    named += [(("friction", "zones", i, "raster"), zone.raster) for i, zone in enumerate(case.friction.zones)]
    named += [((*at, "file"), observation.file) for at, observation, _ in _observations(case)]
    named += [(("survey", "file"), case.survey.file)] if case.survey else []
    named += [(("effect_file",), case.effect_file)]
    for place, file in named:
        if file is None:
            continue
        if not os.path.isfile(file):  # False for every name that no file can have, where a Path would raise
            yield Refusal(place, f"expected an existing file, got {shown_path(file)}: put it there or correct the path")
        elif os.path.getsize(file) > LARGEST_DATA:
            yield Refusal(place, f"expected a file of at most {LARGEST_DATA:,} bytes, got more: make it smaller")


def _files_of_bed(at: KeyPath, layers: Iterable[BedLayer]) -> Iterator[tuple[KeyPath, Path | None]]:
    """Files of the layers of a bed, that of the case or of an experiment, and where each is named."""
    for i, layer in enumerate(layers):
        yield (*at, "bed", i, "raster"), layer.raster
        yield (*at, "bed", i, "points"), layer.points


def _engine(case: Case) -> Iterator[Refusal]:
    """Files of the command are there, and nothing is asked of it that it does not give."""
    if case.engine is None:
        return
    for name, path in case.engine.files.items():
        if not os.path.exists(path):
            complaint = f"expected an existing file or folder, got {shown_path(path)}: put it there or correct the path"
            yield Refusal(("engine", "files", name), complaint)
    if case.simulate.fields is not None:
        yield Refusal(("simulate", "fields"), "cannot be kept of a command, which predicts at stations only: remove it")


def _likelihood(case: Case) -> Iterator[Refusal]:
    if case.infer.behavioural is not None and case.infer.likelihood == "gaussian":
        yield Refusal(("infer", "behavioural"), "goes with an informal likelihood, not with gaussian: remove it")
