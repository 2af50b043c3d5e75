"""How a case was extended, and whether that is kept: its comparison in comparison.json, each model in rung.json."""

from dataclasses import dataclass
from pathlib import Path

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.excluded_stations import excluded_by
from vegglue.errors import InputError
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.json_store import comparison_that_fits
from vegglue.results.model_comparison import ComparedModel
from vegglue.wording.numbers import in_short
from vegglue.workflow.compare import Comparison, kept_model_score
from vegglue.workflow.run_folder import folder_of


@dataclass(frozen=True)
class StepwiseExtension:
    """How a case was extended: the cases from the first to the last, their errors, the sentence of the verdict, and
    what was added or not, and why; unclear: names of what was added whose fall of held-out errors cannot be told from
    none.
    """

    cases: tuple[Case, ...]
    comparison: Comparison
    sentence: str
    reason: str
    unclear: tuple[str, ...] = ()

    def __repr__(self) -> str:
        names = " -> ".join(case.name for case in self.cases)
        return in_short(f"Extension: {names}", [self.sentence, self.reason, *repr(self.comparison).splitlines()])


def kept_extension(case: Case, found: Diagnosis, runs: Path | str) -> StepwiseExtension | None:
    """How the case was extended before, by exactly this diagnosis, where its children are as they were; else None.

    Never that of a case with code or a command of the user's, as a child could name another.
    """
    wanted = case_hash(case)
    kept = comparison_that_fits(folder_of(runs, case), wanted)
    if kept is None or case.effect_file is not None or case.engine is not None:
        return None
    first, *others = kept.steps
    sentence, aside = found.verdict.sentence, excluded_by(found)
    if (first.config_hash, kept.verdict) != (wanted, sentence):
        return None
    children = [child for step in others if (child := _child_of(case, step)) is not None]
    cases = (case, *children)
    scores = [one for each in cases if (one := kept_model_score(each, runs, aside)) is not None]
    if len(scores) < len(kept.steps):
        return None
    return StepwiseExtension(cases, Comparison(tuple(scores), aside), sentence, kept.reason, kept.unclear)


def _child_of(parent: Case, step: ComparedModel) -> Case | None:
    """The case of a later step, beside its parent; None where it is gone, or another."""
    try:
        child = load_case(parent.source.with_name(step.config))
    except (InputError, OSError):
        return None
    return child if case_hash(child) == step.config_hash else None
