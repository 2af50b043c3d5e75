"""cases -> error ladder: how well each predicts what it was fitted to, what was held out, and what no fit has seen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import held_out_rmse, model_score, model_score_in_short
from vegglue.diagnosis.excluded_stations import MEASUREMENT, exclusion_in_words
from vegglue.engine.first_use import with_compilation
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.json_store import comparison_that_fits, model_score_that_fits, write_comparison, write_model_score
from vegglue.results.model_comparison import ComparedModel, ModelComparison
from vegglue.results.model_score import ModelScore
from vegglue.wording.numbers import in_short, so_many
from vegglue.workflow.run_folder import calibrated, folder_of, validation_of
from vegglue.workflow.set_aside import left_out

# On which errors hang that are set side by side, of each station.
ALIKE_IN_ALL = [*MEASUREMENT, "standard_error", "used"]


@dataclass(frozen=True)
class Comparison:
    """One score for each model, in the order they were given, and the measurements that none of them uses, since a
    diagnosis has set them aside.
    """

    model_scores: tuple[ModelScore, ...]
    left_out: pd.DataFrame

    def __repr__(self) -> str:
        heading = f"Comparison of {so_many(len(self.model_scores), 'model')}, root mean square errors of velocity [m/s]"
        return in_short(heading, [*map(model_score_in_short, self.model_scores), exclusion_in_words(self.left_out)])


@one_thread()
def compare(cases: Sequence[Case], *, runs: Path | str = "runs", jobs: int = -1, watch: Watch = silent) -> Comparison:
    """Set models side by side, the baseline first; drawn in ladder.png in the folder of the last one, and kept in
    comparison.json in the folder of each, unless one model is there twice, or a ladder kept there begins with another
    model.

    Stations that the diagnosis of any of them has set aside are left out of all. What a model misses is kept in
    rung.json, and not computed again for exactly the same. Errors: InputError when models have
    other measurements, or one name and differ, when one finds no flow, or a station has no standard error.
    """
    _refuse_other_measurements(cases)
    hashes, aside = [case_hash(case) for case in cases], left_out(cases, runs)
    scores = []
    with at_most(jobs):
        for number, case in enumerate(cases):
            watch(Progress(with_compilation(f"comparing {case.name}"), number, len(cases), "models"))
            scores.append(model_score_of(case, runs, aside, watch))
    found = Comparison(tuple(scores), aside)
    draw_ladder_of(found, cases[-1], runs)
    if len({case.name for case in cases}) == len(cases):  # a model beside itself is no ladder
        comparison = comparison_of(found, cases, hashes)
        for case, config_hash in zip(cases, hashes, strict=True):
            if not tells_more(comparison_that_fits(folder_of(runs, case), config_hash), comparison):
                write_comparison(folder_of(runs, case), comparison, config_hash)
    return found


def tells_more(kept: ModelComparison | None, comparison: ModelComparison) -> bool:
    """Whether a comparison that is kept begins with a model that is not in this one, or says of the same models why it
    ends there: the page would lose where it began, which readings were set aside there, or that reason.
    """
    if kept is None:
        return False
    hashes = [step.config_hash for step in comparison.steps]
    same = kept.left_out == comparison.left_out and [step.config_hash for step in kept.steps] == hashes
    return kept.steps[0].config_hash not in hashes or (same and bool(kept.reason))


def _refuse_other_measurements(cases: Sequence[Case]) -> None:
    """Errors are compared station by station, under the same errors of the data, and kept in a folder for each name;
    one model may be there twice.
    """
    if not cases:
        raise InputError("compare: expected one model or more, got none; give the cases as a list.")
    first, *others = cases
    for number, case in enumerate(others, 1):
        if any(one.name == case.name and case_hash(one) != case_hash(case) for one in cases[:number]):
            raise InputError(
                f"compare: expected models of different names, got two called {case.name}; name one otherwise."
            )
        if not _measured(case).equals(_measured(first)):
            raise InputError(
                f"compare: expected {case.name} and {first.name} to be fitted to the same measurements, got others; "
                "name the same files in both, with the same errors, and a grid that holds the same stations. "
                "A reading that is off is left out of all models once it is diagnosed."
            )
    unseen = [(case.name, there.station[ALIKE_IN_ALL]) for case in cases if (there := validation_of(case)) is not None]
    for name, station in unseen[1:]:
        if not station.equals(unseen[0][1]):
            raise InputError(
                f"compare: expected {name} and {unseen[0][0]} to have the same measurements for validation, got "
                "others; name the same files in both."
            )


def _measured(case: Case) -> pd.DataFrame:
    return read_observations(case).table[ALIKE_IN_ALL]


def model_score_of(case: Case, runs: Path | str, aside: pd.DataFrame, watch: Watch) -> ModelScore:
    """The case where it predicts best, without the measurements set aside; kept for the next command."""
    kept = kept_model_score(case, runs, aside)
    if kept is not None:
        return kept
    folder, wanted = folder_of(runs, case), case_hash(case)
    made = model_score(calibrated(case, folder, aside, watch), validation_of(case, folder, watch))
    write_model_score(folder, made, rows_set_aside(aside), wanted)
    return made


def kept_model_score(case: Case, runs: Path | str, aside: pd.DataFrame) -> ModelScore | None:
    """What an earlier command found for exactly this case without these measurements, under its title of now."""
    kept = model_score_that_fits(folder_of(runs, case), rows_set_aside(aside), case_hash(case))
    return None if kept is None else replace(kept, title=case.title)


def rows_set_aside(aside: pd.DataFrame) -> list[tuple[str | float, ...]]:
    """Measurements that are set aside, in one order whichever diagnosis named them first."""
    return sorted(aside.itertuples(index=False, name=None))


def draw_ladder_of(found: Comparison, last: Case, runs: Path | str) -> Path:
    """Draw the comparison in the folder of its last case; returns the picture."""
    from vegglue.report.ladder_figure import save_ladder_figure

    picture = folder_of(runs, last) / "ladder.png"
    save_ladder_figure(found.model_scores, picture)
    return picture


def keep_comparison(
    comparison: ModelComparison, cases: Sequence[Case], hashes: Sequence[str], runs: Path | str
) -> None:
    """Keep the comparison in the folder of each of its cases, for their pages. Errors: StorageError."""
    for case, config_hash in zip(cases, hashes, strict=True):
        write_comparison(folder_of(runs, case), comparison, config_hash)


def comparison_of(
    found: Comparison, cases: Sequence[Case], hashes: Sequence[str], reason: str = "", verdict: str = ""
) -> ModelComparison:
    """Models as they are kept; hashes: of the cases as they were read; reason, verdict: see `ModelComparison`."""
    before: tuple[str, ...] = ()
    steps = []
    for case, config_hash, one in zip(cases, hashes, found.model_scores, strict=True):
        steps.append(_step_of(case, config_hash, one, tuple(name for name in one.effects if name not in before)))
        before = one.effects
    return ModelComparison(tuple(steps), len(found.left_out), reason, verdict)


def _step_of(case: Case, config_hash: str, one: ModelScore, added: tuple[str, ...]) -> ComparedModel:
    return ComparedModel(
        name=case.name,
        config=case.source.name,
        config_hash=config_hash,
        added=added,
        parameters=len(one.values),
        in_sample=one.in_sample.velocity,
        held_out_sections=held_out_rmse(one),
        held_out_experiments=held_out_rmse(one, "experiments"),
        unseen=one.validation,
        noise_floor=one.in_sample.noise_floor,
    )
