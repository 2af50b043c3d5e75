"""case -> everything: the loop from misfit to missing effect, then posterior and report before and after."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import held_out_rmse
from vegglue.errors import InputError
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Watch, silent
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.resume import begun_or_finished
from vegglue.workflow.compare import Comparison, comparison_of, draw_ladder_of, keep_comparison, model_score_of
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.discover import discover
from vegglue.workflow.extend import extend_stepwise
from vegglue.workflow.infer import chosen_method, infer, is_inferred, needs_ensemble
from vegglue.workflow.next_measurement import next_measurement
from vegglue.workflow.run_folder import folder_of, of_size
from vegglue.workflow.simulate import is_up_to_date, refuse_to_shrink, simulate
from vegglue.workflow.stepwise_extension import StepwiseExtension

Show = Callable[[Case, Any], None]


def _unseen(case: Case, result: Any) -> None:
    """Shows nothing."""


def run(
    case: Case,
    *,
    runs: Path | str = "runs",
    members: int | None = None,
    jobs: int = -1,
    watch: Watch = silent,
    show: Show = _unseen,
    force: bool = False,
) -> StepwiseExtension:
    """Diagnose, add what is missing, watch the error fall, diagnose again and say what to measure next; then
    posterior and report of the last child, or of the case if there is none, and an ensemble where `members` are asked
    for, one is there, or the posterior needs it. What is up to date is not made again. Where
    none of the known effects explains the misfit, and it is not at a place, a law is searched that does, and kept where
    errors fall with it. members: size of the ensemble instead of the case's; force: replace a child that was edited by
    hand and a larger ensemble, too.

    show is given each result as it comes, with its case: Diagnosis, StepwiseExtension, DiscoveredCase and Comparison,
    list of Question, Ensemble, Posterior, the Path of a page, or a sentence.
    """
    refuse_to_shrink(of_size(case, members), runs, force)
    found = diagnose(case, runs=runs, jobs=jobs, watch=watch)
    show(case, found)
    extension = extend_stepwise(case, runs=runs, jobs=jobs, watch=watch, force=force)
    show(case, extension)
    last = extension.cases[-1]
    draw_ladder_of(extension.comparison, last, runs)
    if last.source == case.source and _acts_all_over(found) and case.engine is None:
        last = _with_a_law(case, extension.comparison, runs, jobs, watch, show, force)
    if last.source != case.source:
        show(last, diagnose(last, runs=runs, jobs=jobs, watch=watch))
    both = {one.source: one for one in (case, last)}.values()
    for each in both:
        show(each, next_measurement(each, runs=runs, jobs=jobs, watch=watch))
    show(last, f"Ladder drawn in {folder_of(runs, last) / 'ladder.png'}; last config: {last.source}")
    # A posterior of the case without what it lacks would be of a model that is known to be wrong. What the diagnosis
    # said is of the case, whatever its size.
    wanted = members is not None or _is_wanted(last, runs)
    if _make_posterior(last, members, wanted, runs, jobs, watch, show, force):
        from vegglue.workflow.report import report

        show(last, report(last, runs=runs, members=members, watch=watch))
    return extension


def _acts_all_over(found: Diagnosis) -> bool:
    """Whether none of the known effects explains the misfit, and it is not at a place; or a law stands out."""
    return found.law_stands_out or (found.verdict.kind == "none-of-these" and not found.places)


@one_thread()
def _with_a_law(
    case: Case, alone: Comparison, runs: Path | str, jobs: int, watch: Watch, show: Show, force: bool
) -> Case:
    """The case with a law that is in no list, where one is found and errors at held-out sections are less with it than
    those of the case `alone`; else the case. Only then their comparison is kept.
    """
    law = discover(case, runs=runs, jobs=jobs, watch=watch, force=force)
    show(case, law)
    if law.child is None:
        return case
    with at_most(jobs):
        with_law = model_score_of(law.child, runs, alone.left_out, watch)
    both, cases = Comparison((alone.model_scores[0], with_law), alone.left_out), [case, law.child]
    draw_ladder_of(both, law.child, runs)
    show(law.child, both)
    if not held_out_rmse(with_law) < held_out_rmse(alone.model_scores[0]):  # nor where nothing could be held out: NaN
        return case
    hashes = [case_hash(one) for one in cases]
    keep_comparison(comparison_of(both, cases, hashes), cases, hashes, runs)
    return law.child


def _is_wanted(case: Case, runs: Path | str) -> bool:
    """Whether an ensemble is to be made: the posterior needs it, its fields are to be kept, or there was one."""
    there = begun_or_finished(Path(runs) / case.name / "ensemble.h5")
    return there or case.simulate.fields is not None or needs_ensemble(case, chosen_method(case, None))


def _make_posterior(
    case: Case, members: int | None, wanted: bool, runs: Path | str, jobs: int, watch: Watch, show: Show, force: bool
) -> bool:
    """Make the ensemble, if `wanted`, and the posterior of a case where they are not up to date; whether it has a
    posterior then.
    """
    folder, ensemble = folder_of(runs, case), None
    if wanted:
        sized = of_size(case, members)
        current = is_up_to_date(sized, runs, force)
        ensemble = simulate(sized, runs=runs, jobs=jobs, watch=watch, force=force)
        show(case, f"{folder / 'ensemble.h5'} is up to date." if current else ensemble)
    if is_inferred(case, runs, members):
        show(case, f"{folder / 'posterior.h5'} is up to date.")
    else:
        try:
            show(case, infer(case, ensemble, runs=runs, jobs=jobs, watch=watch))
        except InputError as error:
            show(case, f"{error} There is no report of {case.name} without a posterior.")
            return False
    return True
