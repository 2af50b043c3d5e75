"""cases -> error ladder: how well each predicts what it was fitted to, what was held out, and what no fit has seen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import (
    MEASUREMENT,
    exclusion_in_words,
    held_out_rmse,
    model_score,
    model_score_in_short,
)
from vegglue.engine.model import with_compilation
from vegglue.errors import InputError
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.loop_results import (
    ComparedModel,
    ModelComparison,
    ModelScore,
    comparison_that_fits,
    model_score_that_fits,
    write_comparison,
    write_model_score,
)
from vegglue.wording.numbers import in_short, in_short_html
from vegglue.wording.sentences import phrase
from vegglue.workflow.case_run import CaseRun, calibrated, case_run, excluded_in

# What the name of a case with a finished result ends with when the built-in engine predicts.
BUILT_IN = "-built-in"
# On which errors hang that are set side by side, of each station.
ALIKE_IN_ALL = [*MEASUREMENT, "standard_error", "used"]


@dataclass(frozen=True)
class Comparison:
    """Models side by side.

    Attributes
    ----------
    model_scores : tuple of ModelScore
        One for each model, in the order they were given.
    left_out : DataFrame
        Measurements that none of them uses, since a diagnosis excludes them.
    """

    model_scores: tuple[ModelScore, ...]
    left_out: pd.DataFrame

    def __repr__(self) -> str:
        heading = phrase("comparison_in_short", len(self.model_scores))
        return in_short(heading, [*map(model_score_in_short, self.model_scores), exclusion_in_words(self.left_out)])

    def _repr_html_(self) -> str:
        return in_short_html(repr(self))


@one_thread()
def compare(
    cases: Sequence[Case | CaseRun], *, runs: Path | str = "runs", jobs: int = -1, watch: Watch = silent
) -> Comparison:
    """Compare models by their errors at what they were calibrated to, at held-out and at validation data.

    Readings that the diagnosis of any of them excludes are excluded for all. The comparison is drawn in ladder.png of
    the last run, and kept in comparison.json of each, unless one model is there twice, or a comparison is kept there
    that begins with another model. Errors of a model are kept in rung.json, and read there for exactly the same
    case.

    Parameters
    ----------
    cases : sequence of Case or CaseRun
        The baseline first. One case with a finished result is set beside the same case of the built-in engine.
    runs : Path or str
        Folder that holds the folders of runs.
    jobs : int
        Processes, -1 for one on each core. Results do not depend on it.
    watch : callable
        Gets a `Progress` at each step.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        If models have other measurements, or one name and differ, if one finds no flow, or if a station has no standard
        error.
    """
    several = [case_run(case, runs, jobs, watch) for case in cases]
    if len(several) == 1 and several[0].case.finished_result is not None:  # theirs beside ours
        theirs = several[0].case
        own = {"finished_result": None, "name": f"{theirs.name}{BUILT_IN}", "title": f"{theirs.title}, built-in engine"}
        several.insert(0, several[0].of(theirs.model_copy(update=own)))
    hashes = [run.config_hash for run in several]  # before anything is read, see CaseRun.config_hash
    refuse_other_measurements(several)
    aside, model_scores = excluded_in(*several), []
    with at_most(several[0].jobs):
        for number, run in enumerate(several):
            run.watch(Progress(with_compilation(f"comparing {run.case.name}"), number, len(several), "models"))
            model_scores.append(model_score_of(run, aside))
    found = Comparison(tuple(model_scores), aside)
    draw_ladder_of(found, several[-1])
    if len({run.case.name for run in several}) == len(several):  # a model beside itself is no ladder
        ladder = comparison_of(found, several)
        for run, wanted in zip(several, hashes, strict=True):
            if not tells_more(comparison_that_fits(run.folder, wanted), ladder):
                write_comparison(run.folder, ladder, wanted)
    return found


def tells_more(kept: ModelComparison | None, ladder: ModelComparison) -> bool:
    """Whether a ladder that is kept begins with a model that is not in this one, or states for the same models why it
    ends there: the page would lose where it began, which readings are excluded there, or that reason.
    """
    if kept is None:
        return False
    hashes = [step.config_hash for step in ladder.steps]
    same = kept.left_out == ladder.left_out and [step.config_hash for step in kept.steps] == hashes
    return kept.steps[0].config_hash not in hashes or (same and bool(kept.reason))


def refuse_other_measurements(several: Sequence[CaseRun]) -> None:
    """Refuse models that cannot be compared.

    Errors are compared station by station under the same errors of the data, and kept in a folder for each name.

    Raises
    ------
    InputError
        Unless all models have the same measurements, and no two models that differ have one name; one model may be
        there twice.
    """
    if not several:
        raise InputError("compare: expected one model or more, got none; give the cases as a list.")
    first, *others = several
    for number, run in enumerate(others, 1):
        name = run.case.name
        if any(one.case.name == name and one.config_hash != run.config_hash for one in several[:number]):
            raise InputError(f"compare: expected models of different names, got two called {name}; name one otherwise.")
        if not run.observations.table[ALIKE_IN_ALL].equals(first.observations.table[ALIKE_IN_ALL]):
            raise InputError(
                f"compare: expected {name} and {first.case.name} to be fitted to the same measurements, got others; "
                "name the same files in both, with the same errors, and a grid that holds the same stations. "
                "A reading that is off is left out of all models once it is diagnosed."
            )
    unseen = [
        (run.case.name, run.validation.observations.table[ALIKE_IN_ALL])
        for run in several
        if run.validation is not None
    ]
    for name, station in unseen[1:]:
        if not station.equals(unseen[0][1]):
            raise InputError(
                f"compare: expected {name} and {unseen[0][0]} to have the same measurements for validation, got "
                "others; name the same files in both."
            )


def model_score_of(run: CaseRun, aside: pd.DataFrame) -> ModelScore:
    """The errors of a case where it predicts best, without excluded measurements; kept for the next command."""
    kept = kept_model_score(run, aside)
    if kept is None:
        kept = model_score(calibrated(run, aside), run.validation_model)
        write_model_score(run.folder, kept, excluded_rows(aside), run.config_hash)
    return kept


def kept_model_score(run: CaseRun, aside: pd.DataFrame) -> ModelScore | None:
    """What an earlier command found for exactly this case and these exclusions, under its present title."""
    kept = model_score_that_fits(run.folder, excluded_rows(aside), run.config_hash)
    return None if kept is None else replace(kept, title=run.case.title)


def excluded_rows(aside: pd.DataFrame) -> list[tuple[str | float, ...]]:
    """Excluded measurements, in one order whichever diagnosis named them first."""
    return sorted(aside.itertuples(index=False, name=None))


def draw_ladder_of(found: Comparison, last: CaseRun) -> None:
    """Draw the comparison in the folder of its last case."""
    from vegglue.pages.ladder_figure import save_ladder_figure

    save_ladder_figure(found.model_scores, last.folder / "ladder.png")


def keep_comparison(ladder: ModelComparison, several: Sequence[CaseRun]) -> None:
    """Keep a comparison in the folder of each of its cases, for their pages. Raises StorageError."""
    for run in several:
        write_comparison(run.folder, ladder, run.config_hash)


def comparison_of(
    found: Comparison, several: Sequence[CaseRun], reason: str = "", verdict: str = ""
) -> ModelComparison:
    """The comparison of models as it is kept; reason, verdict: see `ModelComparison`."""
    steps, before = [], tuple[str, ...]()
    for run, one in zip(several, found.model_scores, strict=True):
        step = ComparedModel(
            name=run.case.name,
            config=run.case.source.name,
            config_hash=run.config_hash,
            added=tuple(name for name in one.effects if name not in before),
            parameters=len(one.values),
            in_sample=one.in_sample.velocity,
            held_out_sections=held_out_rmse(one),
            held_out_experiments=held_out_rmse(one, "experiments"),
            unseen=one.validation,
            noise_floor=one.in_sample.noise_floor,
        )
        steps.append(step)
        before = one.effects
    return ModelComparison(tuple(steps), len(found.left_out), reason, verdict)
