"""case -> child case: a config that extends its parent by effects, named, or found by the diagnosis."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.candidates import Candidate, start_amplitude
from vegglue.case.bed_error import surveyed_lines, without_level
from vegglue.case.config import load_case
from vegglue.case.grid import Grid
from vegglue.case.parameter_space import middle_value, z_at
from vegglue.case.resolved_config import as_yaml, case_hash, refuse_parent, write_made
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import candidate_at, candidate_named, child_tree, relevelled_tree, with_additions
from vegglue.diagnosis.comparison import excluded_by, model_score
from vegglue.diagnosis.stepwise_choice import (
    Addition,
    Choice,
    Names,
    choice_among,
    places_tried,
    tried_additions,
    values_tried,
)
from vegglue.engine.interface import Model
from vegglue.engine.model import with_compilation
from vegglue.errors import InputError, shown_path
from vegglue.parallel import at_most, in_threads, one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.loop_results import comparison_that_fits, write_model_score
from vegglue.results.result_files import diagnosis_that_fits
from vegglue.wording.numbers import in_short
from vegglue.wording.phases import CALIBRATING_WITHOUT_LINE
from vegglue.wording.sentences import phrase, sentence, tagged
from vegglue.workflow.case_run import CaseRun, best_parameters, calibrated, calibrated_anew, case_run, keep_best_fit
from vegglue.workflow.compare import Comparison, comparison_of, excluded_rows, keep_comparison, kept_model_score
from vegglue.workflow.diagnose import diagnose


def extend(
    case: Case,
    add: str | Sequence[str],
    *,
    shapes: Mapping[str, float] | None = None,
    to: Path | str | None = None,
    force: bool = False,
    runs: Path | str = "runs",
) -> Case:
    """Write a config that extends a case by effects, each with a prior for its amplitude, and read it.

    A place that the diagnosis of the case found is spread as `extend_stepwise` spreads it.

    Parameters
    ----------
    case : Case
    add : str or sequence of str
        Names such as `streamlining` or `discharge_error[high]`.
    shapes : mapping of str to float, optional
        Shapes of these effects by name.
    to : Path or str, optional
        The config to write; beside the parent if not given.
    force : bool
        Whether to replace files that were edited by hand or not written by vegglue.
    runs : Path or str
        Folder that holds the folders of runs.

    Returns
    -------
    Case

    Raises
    ------
    InputError
        For an unknown effect, place or shape, or if a file would be replaced.
    """
    names = [add] if isinstance(add, str) else list(dict.fromkeys(add))
    if not names:
        raise InputError("--add: expected the name of an effect or more, got none; `vegglue effects` lists them.")
    run = case_run(case, runs)
    diagnosed = diagnosis_that_fits(run.folder / "diagnosis.h5", run.config_hash)
    places = [] if diagnosed is None else places_tried(diagnosed)
    at_places = [(candidate_at(case, place), place.shapes) for place in places]
    known = {candidate.name: (candidate, where) for candidate, where in at_places}
    added = named_candidates(run, names, shapes or {}, known)
    target = child_path(case.source, [one for one, _ in added]) if to is None else Path(to)
    return write_child(case, target, added, force)


@dataclass(frozen=True)
class StepwiseExtension:
    """How a case was extended.

    Attributes
    ----------
    cases : tuple of Case
        From the parent to the last child.
    comparison : Comparison
        Their errors.
    sentence : str
        The verdict.
    reason : str
        What was added or not, and why.
    unclear : tuple of str
        Names of what was added although the fall of held-out errors may be chance.
    """

    cases: tuple[Case, ...]
    comparison: Comparison
    sentence: str
    reason: str
    unclear: tuple[str, ...] = ()

    def __repr__(self) -> str:
        names = " -> ".join(case.name for case in self.cases)
        return in_short(f"Extension: {names}", [self.sentence, self.reason, *repr(self.comparison).splitlines()])


@one_thread()
def extend_stepwise(
    case: Case | CaseRun, *, runs: Path | str = "runs", jobs: int = -1, watch: Watch = silent, force: bool = False
) -> StepwiseExtension:
    """Add the effects and places that the diagnosis found while held-out errors and the misfit fall.

    They are added one by one, or together; see `stepwise_choice`. The comparison is kept in comparison.json of each
    case, and read there if the case, its diagnosis and its children are unchanged.

    Parameters
    ----------
    case : Case or CaseRun
    runs : Path or str
        Folder that holds the folders of runs.
    jobs : int
        Processes, -1 for one on each core. Results do not depend on it.
    watch : callable
        Gets a `Progress` at each step.
    force : bool
        Whether to replace a child that was edited by hand.

    Returns
    -------
    StepwiseExtension

    Raises
    ------
    InputError
        If a child was edited by hand, or a file of the case changes meanwhile.
    """
    run = case_run(case, runs, jobs, watch, force)
    wanted = run.config_hash
    found = diagnose(run)
    kept = kept_extension(run, found)
    if kept is not None:
        return kept
    with at_most(run.jobs):
        extension = extended(run, found)
    several = [run, *(run.of(child) for child in extension.cases[1:])]
    if case_hash(run.case) != wanted:  # children are of the files as they are now, their numbers of those before
        source = shown_path(run.case.source)
        raise InputError(f"{source}: a file that it names changed while it was extended; run `vegglue extend` again.")
    for one, errors in zip(several, extension.comparison.model_scores, strict=True):
        write_model_score(one.folder, errors, excluded_rows(extension.comparison.left_out), one.config_hash)
    ladder = comparison_of(extension.comparison, several, extension.reason, verdict_digest(found))
    keep_comparison(replace(ladder, unclear=extension.unclear), several)
    return extension


def extended(run: CaseRun, found: Diagnosis) -> StepwiseExtension:
    """The parent and its children, each better than the one before; a model that is only tried leaves no file.

    Parameters
    ----------
    run : CaseRun
        Of the parent.
    found : Diagnosis
        Of the parent.
    """
    aside = excluded_by(found)
    run.watch(Progress(with_compilation(f"calibrating {run.case.name}")))
    parent = calibrated(run, aside)
    several, bases = [run], [parent]
    loose = without_levels(run.case, run.site.grid, found)
    if loose is not run.case:  # as an instrument that is off it is excluded, whatever errors that were held out do
        target = run.case.source.with_name(f"{run.case.source.stem}+survey{run.case.source.suffix}")
        run.watch(Progress(CALIBRATING_WITHOUT_LINE))
        run = run.of(write_relevelled(run.case, loose, target, run.force))
        parent = calibrated(run, aside)
        several.append(run)
        bases.append(parent)
    case = run.case
    named = {candidate.name: (candidate, shapes) for candidate, shapes in tried_additions(case, found)}
    tried: dict[Names, Baseline | None] = {(): parent}

    def base_with(names: Names) -> Baseline | None:
        if names not in tried:
            run.watch(Progress(f"trying {' and '.join(names)}"))
            tried[names] = calibrated_with_additions(parent.model, [named[name] for name in names], found, aside)
        return tried[names]

    choice = choice_among(case, found, base_with)
    for names in choice.stages[1:]:
        base = tried[names]
        assert base is not None
        added = [named[name] for name in names]
        child = run.of(write_child(case, child_path(case.source, [one for one, _ in added]), added, run.force))
        keep_best_fit(child.case, child.folder, best_parameters(base), child.config_hash)
        several.append(child)
        bases.append(base)
    # Only now are the measurements for validation looked at.
    bases = [replace(base, model=replace(base.model, case=one.case)) for one, base in zip(several, bases, strict=True)]
    unseen = [one.validation_model for one in several]
    ladder = Comparison(tuple(in_threads(model_score, list(zip(bases, unseen, strict=True)))), aside)
    cases = tuple(one.case for one in several)
    return StepwiseExtension(
        cases, ladder, found.verdict.sentence, sentence(extension_reason(case, found, choice)), tuple(choice.unclear)
    )


def without_levels(case: Case, grid: Grid, found: Diagnosis) -> Case:
    """The case with the level of each surveyed line unknown that a diagnosis found to be off; itself without any."""
    for off in (one for one in found.instruments if one.kind == "line"):
        lines = [one for one in surveyed_lines(case, grid).lines if (one.x, one.y) == (off.x, off.y)]
        if lines:
            case = without_level(case, lines[0])
    return case


def verdict_digest(found: Diagnosis) -> str:
    """SHA-256 of the verdict as a value, whatever its words."""
    return sha256(json.dumps(tagged(found.verdict), sort_keys=True, default=str).encode()).hexdigest()


def kept_extension(run: CaseRun, found: Diagnosis) -> StepwiseExtension | None:
    """How exactly this case was extended before, by exactly this diagnosis and with its children unchanged.

    Returns
    -------
    StepwiseExtension or None
        None without one, and of a case with code or a command of the user, as a child could name another.
    """
    kept = comparison_that_fits(run.folder, run.config_hash)
    if kept is None or run.case.effect_file is not None or run.case.engine is not None:
        return None
    first, *others = kept.steps
    aside = excluded_by(found)
    if (first.config_hash, kept.verdict) != (run.config_hash, verdict_digest(found)):
        return None
    several = [run]
    for step in others:
        try:
            child = run.of(load_case(run.case.source.with_name(step.config)))
            if child.config_hash == step.config_hash:
                several.append(child)
        except (InputError, OSError):
            pass
    model_scores = [one for each in several if (one := kept_model_score(each, aside)) is not None]
    if len(model_scores) < len(kept.steps):
        return None
    cases = tuple(one.case for one in several)
    compared = Comparison(tuple(model_scores), aside)
    return StepwiseExtension(cases, compared, found.verdict.sentence, kept.reason, kept.unclear)


@dataclass(frozen=True)
class ExtensionReason:
    """What was added, or why nothing was, and why each of the others was not."""

    added: tuple[str, ...]  # names of what was added, in order
    # Why nothing was tried: `law` if `discover` would add one, else the kind of the verdict; empty if something was
    # tried
    nothing: str = ""
    # Name, half length and half width [m] of each added place, over which it is spread
    spread: tuple[tuple[str, float, float], ...] = ()
    # Falls of held-out errors that may be chance, by the name of what was added
    unclear: Mapping[str, Any] = field(default_factory=dict)
    refused: Mapping[str, Any] = field(default_factory=dict)  # why each of the others was not kept, by name
    lines: tuple[float, ...] = ()  # x of surveyed lines whose level is not used [m]


def extension_reason(case: Case, found: Diagnosis, choice: Choice) -> ExtensionReason:
    """The outcome of a choice among what a diagnosis found."""
    added = choice.stages[-1]
    lines = tuple(one.x for one in found.instruments if one.kind == "line")
    if not added and not choice.refused:
        return ExtensionReason((), "law" if found.law_stands_out else found.verdict.kind, lines=lines)
    places = [(candidate_at(case, place).name, place) for place in places_tried(found)]
    spread = tuple((name, place.length, place.width) for name, place in places if name in added)
    return ExtensionReason(added, "", spread, choice.unclear, choice.refused, lines)


def named_candidates(
    run: CaseRun, names: Sequence[str], shapes: Mapping[str, float], known: Mapping[str, Addition]
) -> list[Addition]:
    """Candidates by name, each with those of the shapes that it has, and with those of what is known under its name.

    Raises
    ------
    InputError
        For a shape that none has.
    """
    station = run.observations.table
    added: list[Addition] = []
    for name in names:
        candidate, of_known = known[name] if name in known else (candidate_named(run.case, station, name), {})
        own = {shape.name for shape in candidate.effect.shapes}
        added.append((candidate, {**of_known, **{key: value for key, value in shapes.items() if key in own}}))
    stray = set(shapes) - {shape.name for candidate, _ in added for shape in candidate.effect.shapes}
    if stray:
        raise InputError(f"--shape: `{min(stray)}` is no shape of {', '.join(names)}; see `vegglue effects NAME`.")
    return added


def child_path(parent: Path, added: Sequence[Candidate]) -> Path:
    """`brook+streamlining.yaml` beside brook.yaml."""
    return parent.with_name("+".join([parent.stem, *(candidate.key for candidate in added)]) + parent.suffix)


def write_child(parent: Case, target: Path, added: Sequence[Addition], force: bool = False) -> Case:
    """Write the config that extends `parent`, and read it back as any other.

    Raises
    ------
    InputError
        If `target` is the parent, or holds what may not be replaced, see `write_made`.
    """
    refuse_parent(target, parent.source)
    tree = child_tree(parent, target, added)
    names = ", ".join(candidate.name for candidate, _ in added)
    text = phrase("made_by", "extend", {"parent": parent.name, "names": names})
    write_made({target: f"{text}\n{as_yaml(tree)}"}, "move it away", force)
    return load_case(target, trust=True)  # what it can run, its parent has run


def write_relevelled(parent: Case, loose: Case, target: Path, force: bool = False) -> Case:
    """Write the config of the parent without levels of surveyed lines, and read it back, as `write_child`."""
    refuse_parent(target, parent.source)
    text = phrase("made_by", "extend", {"parent": parent.name})
    write_made({target: f"{text}\n{as_yaml(relevelled_tree(parent, loose, target))}"}, "move it away", force)
    return load_case(target, trust=True)


def calibrated_with_additions(
    parent: Model, added: Sequence[Addition], found: Diagnosis, aside: pd.DataFrame
) -> Baseline | None:
    """The parent with additions, calibrated from the prior and from where the diagnosis ended.

    Parameters
    ----------
    added : sequence of (Candidate, mapping of float)
        Effects with values of their shapes [unit of each].
    aside : DataFrame
        Measurements that are excluded, with the columns of MEASUREMENT.

    Returns
    -------
    Baseline or None
        None if no flow is found.
    """
    child = with_additions(parent.case, added)
    theta = {name: value for name, value in values_tried(parent.case, found).items() if name in child.parameters}
    for one, _ in added:
        theta.setdefault(one.parameter, start_amplitude(one.amplitude, one.amplitude.plausible_gain))
        theta = {name: float(middle_value(child, name)) for name in one.free.values()} | theta
    known = z_at(child, {name: np.array([theta[name]]) for name in child.parameters})[0]
    try:
        return calibrated_anew(replace(parent, case=child), known, aside)
    except InputError:  # it has run without the additions: they leave it no steady flow
        return None
