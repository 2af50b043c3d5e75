"""case -> child case: a config that extends its parent by effects, named or accepted by the diagnosis one by one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vegglue.case.case_effects import amplitude_of, effect_of
from vegglue.case.config import load_case
from vegglue.case.resolved_config import as_yaml
from vegglue.case.schema import Case
from vegglue.case.text_files import write_text
from vegglue.diagnosis.child_config import candidate_named, child_tree
from vegglue.diagnosis.comparison import Rung, improvement
from vegglue.diagnosis.excluded_stations import excluded_by
from vegglue.diagnosis.refits import NEEDED
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Say, silent
from vegglue.results.diagnosis import Diagnosis
from vegglue.screening.candidates import Candidate, start_amplitude
from vegglue.workflow.compare import Comparison, rung_of
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.run_folder import MAKE_ROOM, folder_of, remember_place

Addition = tuple[Candidate, Mapping[str, float]]  # an effect, and values of its shapes


@dataclass(frozen=True)
class StepwiseExtension:
    """How a case was extended: the cases from the first to the last, their errors, and why it ended."""

    cases: tuple[Case, ...]
    comparison: Comparison
    reason: str


def extend(
    case: Case, add: Sequence[str], *, shapes: Mapping[str, float] | None = None, to: Path | str | None = None
) -> Case:
    """Write a config that extends the case by effects, each with a prior for its amplitude, and read it.

    add: names such as `streamlining` or `discharge_error[high]`; shapes: values of their shapes by name; to: the config
    to write, beside the parent if not given. Errors: InputError for an unknown effect, place or shape.
    """
    added = named_candidates(case, add, shapes or {})
    target = child_path(case.source, [one for one, _ in added]) if to is None else Path(to)
    return write_child(case, target, added)


@one_thread()
def extend_stepwise(case: Case, *, runs: Path | str = "runs", jobs: int = -1, say: Say = silent) -> StepwiseExtension:
    """Add what the diagnosis accepts, one effect after the other, while errors of held-out measurements fall and the
    misfit with all others.
    """
    found = diagnose(case, runs=runs, jobs=jobs, say=say)
    with at_most(jobs):
        return _extended(case, found, runs, say)


def _extended(case: Case, found: Diagnosis, runs: Path | str, say: Say) -> StepwiseExtension:
    """Child after child, each compared with the one before."""
    aside = excluded_by(found)
    cases, rungs = [case], [rung_of(case, runs, aside)]
    added: list[Addition] = []

    def ended(reason: str) -> StepwiseExtension:
        return StepwiseExtension(tuple(cases), Comparison(tuple(rungs), aside), reason)

    for step in found.steps:
        candidate = candidate_named(case, found.predictions.station, step.accepted)
        added.append((candidate, found.suspect(step.accepted).shapes))
        say(f"adding {step.accepted}")
        child = write_child(case, child_path(case.source, [one for one, _ in added]), added)
        _start_child(child, folder_of(runs, child), found, added)
        after = rung_of(child, runs, aside)
        if worse := _worse(rungs[-1], after):
            child.source.unlink()
            return ended(f"{step.accepted} was not kept: {worse}")
        cases.append(child)
        rungs.append(after)
    unneeded = [name for name in cases[-1].effects if not _needed(cases[-1], rungs[-1], name)]
    sentence = found.verdict.sentence
    return ended(f"{sentence} No longer needed: {', '.join(unneeded)}." if unneeded else sentence)


def named_candidates(case: Case, names: Sequence[str], shapes: Mapping[str, float]) -> list[Addition]:
    """Candidates by name, each with those of the shapes that it has; InputError for a shape that none has."""
    station = read_observations(case).table
    added: list[Addition] = []
    for name in names:
        candidate = candidate_named(case, station, name)
        own = {shape.name for shape in candidate.effect.shapes}
        added.append((candidate, {key: value for key, value in shapes.items() if key in own}))
    stray = set(shapes) - {key for _, given in added for key in given}
    if stray:
        raise InputError(f"--shape: `{min(stray)}` is no shape of {', '.join(names)}; see `vegglue effects NAME`.")
    return added


def child_path(parent: Path, added: Sequence[Candidate]) -> Path:
    return parent.with_name("+".join([parent.stem, *(candidate.key for candidate in added)]) + parent.suffix)


def write_child(parent: Case, target: Path, added: Sequence[Addition]) -> Case:
    """Write the config that extends `parent`, and read it back as any other."""
    tree = child_tree(parent, target, added)
    names = ", ".join(candidate.name for candidate, _ in added)
    text = f"# Made by `vegglue extend`: {parent.name} with {names}.\n"
    write_text(target, text + as_yaml(tree), MAKE_ROOM)
    return load_case(target, trust=True)  # what it can run, its parent has run


def _worse(before: Rung, after: Rung) -> str:
    """Why an effect is not kept, '' if it is."""
    gain, _ = improvement(before, after)
    if not gain > 0:
        return "held-out errors did not fall"
    # Held-out errors are those of a linear step: where the misfit with everything seen rises, it led astray.
    return "" if after.in_sample.chi2 < before.in_sample.chi2 else "the misfit with what was seen rose"


def _start_child(child: Case, folder: Path, found: Diagnosis, added: Sequence[Addition]) -> None:
    """Let the child begin where the diagnosis ended; effects still to come stay out of it."""
    theta = {name: values[0] for name, values in found.parameters.last.items() if name in child.parameters}
    for one, _ in added:
        theta.setdefault(one.parameter, start_amplitude(one.amplitude, one.amplitude.plausible_gain))
    remember_place(child, folder, theta)


def _needed(case: Case, rung: Rung, name: str) -> bool:
    parameter = amplitude_of(case, name)
    if parameter is None:
        return True
    middle, low, high = rung.values[parameter]
    off = effect_of(case, name).amplitude.off
    return abs(middle - off) > NEEDED * (high - low) / 3.92
