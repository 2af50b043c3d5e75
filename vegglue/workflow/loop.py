"""The loop in files: calibrated places, diagnoses and child configs beside the results they belong to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline, baseline, for_prediction
from vegglue.case.case_effects import amplitude_of, effect_of
from vegglue.case.config import load_case
from vegglue.case.parameter_space import theta_at
from vegglue.case.resolved_config import as_yaml, case_hash, resolved_yaml
from vegglue.case.schema import Case
from vegglue.case.text_files import write_text
from vegglue.diagnosis.child_config import candidate_named, child_tree
from vegglue.diagnosis.comparison import Rung, improvement, rung
from vegglue.diagnosis.diagnose import diagnose
from vegglue.diagnosis.excluded_stations import excluded_by, excluding
from vegglue.diagnosis.next_measurement import MeasurementWorth, Rival, worth_of_measurements
from vegglue.diagnosis.refits import NEEDED
from vegglue.diagnosis.suspects import SEEN_SURELY
from vegglue.effects.definition import Effect
from vegglue.engine.interface import responses
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most
from vegglue.progress import Say
from vegglue.report.diagnosis_pictures import save_diagnosis_figure
from vegglue.results.diagnosis import Diagnosis, Suspect
from vegglue.screening.candidates import Candidate, cause_of, start_of
from vegglue.storage.result_files import diagnosis_that_fits, write_diagnosis
from vegglue.workflow.run_folder import MAKE_ROOM, known_place, model_in, remember_place, validation_of

# Effects hidden behind calibration that measurements are proposed for.
HIDDEN = 4


@dataclass(frozen=True)
class Grown:
    """How a case was extended: its configs from the first to the last, their rungs, the measurements that none of them
    uses, and why it ended.
    """

    paths: tuple[Path, ...]
    rungs: tuple[Rung, ...]
    aside: pd.DataFrame
    reason: str


def diagnosed(case: Case, folder: Path, jobs: int, say: Say) -> Diagnosis:
    """The diagnosis of a case: the one in its folder when it fits, else a new one, which is kept there."""
    path, wanted = folder / "diagnosis.h5", case_hash(case)
    kept = diagnosis_that_fits(path, wanted)
    if kept is not None:
        return kept
    with at_most(jobs):
        found = diagnose(model_in(case), known_place(case, folder), say)
    write_diagnosis(path, found, resolved_yaml(case), wanted)
    save_diagnosis_figure(found, case, folder / "diagnosis.png")
    remember_place(case, folder, found.first_parameters)
    return found


def calibrated(case: Case, folder: Path, aside: pd.DataFrame) -> Baseline:
    """The case where it predicts best, which is kept for the next command; aside: measurements that are left out."""
    base = for_prediction(baseline(excluding(model_in(case), aside), known_place(case, folder)))
    remember_place(case, folder, _theta(base))
    return base


def left_out(cases: Sequence[Case], runs: Path) -> pd.DataFrame:
    """The measurements that the diagnosis of any of the cases has set aside, where it fits the case."""
    found = (diagnosis_that_fits(runs / case.name / "diagnosis.h5", case_hash(case)) for case in cases)
    return excluded_by(*(one for one in found if one is not None))


def write_child(parent: Case, target: Path, added: Sequence[tuple[Candidate, Mapping[str, float]]]) -> Case:
    """Write the config that extends `parent`, and read it back as any other."""
    tree = child_tree(parent, target, added)
    names = ", ".join(candidate.name for candidate, _ in added)
    text = f"# Made by `vegglue extend`: {parent.name} with {names}.\n"
    write_text(target, text + as_yaml(tree), MAKE_ROOM)
    return load_case(target, trust=True)  # what it can run, its parent has run


def child_path(parent: Path, added: Sequence[Candidate]) -> Path:
    return parent.with_name("+".join([parent.stem, *(candidate.key for candidate in added)]) + parent.suffix)


def named_candidates(case: Case, names: Sequence[str], shapes: Mapping[str, float]) -> list[tuple[Candidate, Any]]:
    """Candidates by name, each with those of the shapes that it has; InputError for a shape that none has."""
    station = read_observations(case).table
    added = []
    for name in names:
        candidate = candidate_named(case, station, name)
        own = {shape.name for shape in candidate.effect.shapes}
        added.append((candidate, {key: value for key, value in shapes.items() if key in own}))
    stray = set(shapes) - {key for _, given in added for key in given}
    if stray:
        raise InputError(f"--shape: `{min(stray)}` is no shape of {', '.join(names)}; see `vegglue effects NAME`.")
    return added


def grow(case: Case, runs: Path, jobs: int, say: Say) -> Grown:
    """Add what the diagnosis accepts, one effect after the other, while errors of held-out measurements fall and the
    misfit with all others.
    """
    found = diagnosed(case, runs / case.name, jobs, say)
    aside = excluded_by(found)
    paths, rungs = [case.source], [_rung(case, runs / case.name, aside)]
    parent, added = case, []
    for step in found.steps:
        suspect = next(one for one in found.suspects if one.name == step.accepted)
        added.append((candidate_named(case, found.station, step.accepted), suspect.shapes))
        say(f"adding {step.accepted}")
        child = write_child(case, child_path(case.source, [one for one, _ in added]), added)
        _start_child(child, runs / child.name, found, added)
        next_rung = _rung(child, runs / child.name, aside)
        worse = _worse(rungs[-1], next_rung)
        if worse:
            child.source.unlink()
            return Grown(tuple(paths), tuple(rungs), aside, f"{step.accepted} was not kept: {worse}")
        paths.append(child.source)
        rungs.append(next_rung)
        parent = child
    unneeded = [name for name in parent.effects if not _needed(parent, rungs[-1], name)]
    ended = f"{found.sentence} No longer needed: {', '.join(unneeded)}." if unneeded else found.sentence
    return Grown(tuple(paths), tuple(rungs), aside, ended)


def _worse(before: Rung, after: Rung) -> str:
    """Why an effect is not kept, '' if it is."""
    gain, _ = improvement(before, after)
    if not gain > 0:
        return "held-out errors did not fall"
    # Held-out errors are those of a linear step: where the misfit with everything seen rises, it led astray.
    return "" if after.chi2 < before.chi2 else "the misfit with what was seen rose"


def _start_child(
    child: Case, folder: Path, found: Diagnosis, added: Sequence[tuple[Candidate, Mapping[str, float]]]
) -> None:
    """Let the child begin where the diagnosis ended; effects still to come stay out of it."""
    theta = {name: values[0] for name, values in found.parameters.items() if name in child.parameters}
    for one, _ in added:
        theta.setdefault(one.parameter, start_of(one.effect, one.effect.amplitude.plausible))
    remember_place(child, folder, theta)


def _needed(case: Case, rung: Rung, name: str) -> bool:
    parameter = amplitude_of(case, name)
    if parameter is None:
        return True
    middle, low, high = rung.values[parameter]
    off = effect_of(case, name).amplitude.off
    return abs(middle - off) > NEEDED * (high - low) / 3.92


def ladder_of(cases: Sequence[Case], runs: Path, aside: pd.DataFrame, say: Say) -> list[Rung]:
    """One rung for each case, in their order, all without the measurements set aside."""
    rungs = []
    for case in cases:
        say(f"calibrating {case.name}")
        rungs.append(_rung(case, runs / case.name, aside))
    return rungs


def trace_of(case: Case, folder: Path, effect: Effect) -> tuple[Array, pd.DataFrame]:
    """What one effect, everywhere and at its default shapes, would change at the stations of the calibrated case, per
    unit of (amplitude - off)^power: (station,) and the stations.
    """
    base, one = calibrated(case, folder, excluded_by()), Candidate(effect)
    shapes = {shape.name: shape.default for shape in effect.shapes}
    changed = cause_of(base.model.case, one, shapes)
    return responses(base.model, base.fitted.point, [changed])[:, 0], base.model.station


def _rung(case: Case, folder: Path, aside: pd.DataFrame) -> Rung:
    return rung(calibrated(case, folder, aside), validation_of(case))


def next_measurements(
    case: Case, folder: Path, jobs: int, say: Say, between: Sequence[str]
) -> list[tuple[str, list[MeasurementWorth]]]:
    """What is to be told apart, in words, and the measurements that could, the best first; empty when nothing is left.

    between: names of effects, else those that the diagnosis could not tell apart, else the strongest of those it could
    not test, each by itself at a plausible size.
    """
    found = diagnosed(case, folder, jobs, say)
    by_name = {one.name: one for one in found.suspects}
    unknown = [name for name in between if name not in by_name]
    if unknown:
        raise InputError(f"--between: `{unknown[0]}` is not among the effects of the diagnosis: {', '.join(by_name)}.")
    asked = _questions(case, found, list(between) or (list(found.steps[-1].rivals) if found.steps else []))
    if not asked:
        return []
    base = calibrated(case, folder, excluded_by(found))
    point = base.fitted.point
    worths = worth_of_measurements(base.model, base.noise, point.z, [rivals for _, rivals in asked])
    return [(what, worth) for (what, _), worth in zip(asked, worths, strict=True)]


def _questions(case: Case, found: Diagnosis, names: Sequence[str]) -> list[tuple[str, list[Rival]]]:
    """In words, and the rivals of each."""
    if len(names) > 1:
        return [(" from ".join(names), rivals_of(case, found, names))]
    hidden = [one for one in found.suspects if not one.testable and not found.steps]
    # What calibration hides best, of all that would leave a trace without it.
    strongest = sorted(hidden, key=lambda one: -_raw_trace(case, found, one))[:HIDDEN]
    single = [one for one in found.suspects if list(names) == [one.name]] or strongest
    return [
        (f"{one.name} from a change of {one.mimicked_by}", rivals_of(case, found, [one.name], plausible=True))
        for one in single
    ]


def _raw_trace(case: Case, found: Diagnosis, suspect: Suspect) -> float:
    """Length of the trace of a plausible amplitude before projection, in standard errors."""
    amplitude = candidate_named(case, found.station, suspect.name).effect.amplitude
    seen = amplitude.gain(amplitude.off + suspect.smallest_detectable)
    return (found.threshold + SEEN_SURELY) * amplitude.plausible / seen / max(suspect.visibility, 1e-6)


def rivals_of(case: Case, found: Diagnosis, names: Sequence[str], plausible: bool = False) -> list[Rival]:
    """Effects of a diagnosis by name, at the size it found or a plausible one."""
    rivals: list[Rival] = []
    for suspect in (one for one in found.suspects if one.name in names):
        candidate = candidate_named(case, found.station, suspect.name)
        amplitude = candidate.effect.amplitude
        gain = amplitude.plausible if plausible else amplitude.gain(suspect.amplitude)
        rivals.append((candidate, suspect.shapes, gain))
    return rivals


def _theta(base: Baseline) -> dict[str, float]:
    return {name: float(value[0]) for name, value in theta_at(base.model.case, base.fitted.point.z).items()}
