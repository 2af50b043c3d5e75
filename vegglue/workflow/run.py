"""case -> everything: the loop from misfit to missing effect, then posterior and report before and after."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import held_out_rmse
from vegglue.errors import InputError, shown_path
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Watch, silent
from vegglue.results.resume import begun_or_finished
from vegglue.wording.sentences import phrase
from vegglue.workflow.case_run import CaseRun, case_run
from vegglue.workflow.compare import Comparison, comparison_of, draw_ladder_of, keep_comparison, model_score_of
from vegglue.workflow.diagnose import diagnose
from vegglue.workflow.discover import discover
from vegglue.workflow.extend import StepwiseExtension, extend_stepwise
from vegglue.workflow.infer import chosen_method, infer, is_inferred, needs_ensemble
from vegglue.workflow.next_measurement import next_measurement
from vegglue.workflow.simulate import is_up_to_date, refuse_to_shrink, simulate

Show = Callable[[Case, Any], None]


def run(
    case: Case | CaseRun,
    *,
    runs: Path | str = "runs",
    members: int | None = None,
    jobs: int = -1,
    watch: Watch = silent,
    show: Show = silent,
    force: bool = False,
) -> StepwiseExtension:
    """Diagnose a case, add what is missing while errors fall, diagnose again; infer and report.

    Posterior and report are of the last child, or of the case if there is none. If no listed effect and no place
    explains the misfit, a law is searched, and kept if errors fall with it. What is up to date is not made again.

    Parameters
    ----------
    case : Case or CaseRun
    runs : Path or str
        Folder that holds the folders of runs.
    members : int, optional
        Size of the ensemble, which is solved if it is given, if one is there, or if the posterior needs it.
    jobs : int
        Processes, -1 for one on each core. Results do not depend on it.
    watch : callable
        Gets a `Progress` at each step.
    show : callable
        Gets each result as it comes, with its case: Diagnosis, StepwiseExtension, DiscoveredCase and Comparison, list
        of Question, Ensemble, Posterior, the Path of a page, or a sentence.
    force : bool
        Whether to replace a child that was edited by hand, and a larger ensemble.

    Returns
    -------
    StepwiseExtension

    Raises
    ------
    InputError
        If the model finds no flow, a station has no standard error, or a child was edited by hand.
    StorageError
        If a file cannot be written.
    """
    whole = case_run(case, runs, jobs, watch, force)
    refuse_to_shrink(whole.sized(members))
    found = diagnose(whole)
    show(whole.case, found)
    extension = extend_stepwise(whole)
    show(whole.case, extension)
    last = whole if extension.cases[-1].source == whole.case.source else whole.of(extension.cases[-1])
    draw_ladder_of(extension.comparison, last)
    # A law is searched where none of the known effects explains the misfit and it is not at a place, or one stands out.
    acts_all_over = found.law_stands_out or (found.verdict.kind == "none-of-these" and not found.places)
    if last is whole and acts_all_over and not whole.case.of_another_model:
        last = with_a_law(whole, extension.comparison, show)
    if last is not whole:
        show(last.case, diagnose(last))
    for each in (whole, last) if last is not whole else (whole,):
        show(each.case, next_measurement(each))
    show(last.case, f"Errors drawn in {last.folder / 'ladder.png'}; last config: {shown_path(last.case.source)}")
    # A posterior of the case without what it lacks would be of a model that is known to be wrong. What the diagnosis
    # found is of the case, whatever its size.
    if make_posterior(last, members, show):
        from vegglue.workflow.report import report

        show(last.case, report(last, members=members))
    return extension


@one_thread()
def with_a_law(parent: CaseRun, alone: Comparison, show: Show) -> CaseRun:
    """A case with a law that is in no list, if one is found and helps.

    Parameters
    ----------
    alone : Comparison
        Of that case alone.
    show : callable
        Is called with each result.

    Returns
    -------
    CaseRun
        The child if errors at held-out sections are less with the law, else the parent. Only then their comparison is
        kept.
    """
    law = discover(parent)
    show(parent.case, law)
    if law.child is None:
        return parent
    child = parent.of(law.child)
    with at_most(parent.jobs):
        with_law = model_score_of(child, alone.left_out)
    both = Comparison((alone.model_scores[0], with_law), alone.left_out)
    draw_ladder_of(both, child)
    show(child.case, both)
    if not held_out_rmse(with_law) < held_out_rmse(alone.model_scores[0]):  # nor if nothing could be held out: NaN
        return parent
    keep_comparison(comparison_of(both, [parent, child]), [parent, child])
    return child


def make_posterior(run: CaseRun, members: int | None, show: Show) -> bool:
    """Make the posterior of a case, and the ensemble if it is wanted, unless they are up to date.

    An ensemble is wanted if its size is given, the posterior needs it, its fields are to be kept, or there was one.

    Parameters
    ----------
    members : int or None
        Of the ensemble, as in the case if None.
    show : callable
        Is called with each result.

    Returns
    -------
    bool
        Whether there is a posterior.
    """
    case, ensemble = run.case, None
    there = begun_or_finished(run.runs / case.name / "ensemble.h5")
    needed = case.simulate.fields is not None or needs_ensemble(case, chosen_method(case, None))
    if members is not None or there or needed:
        sized = run.sized(members)
        current = is_up_to_date(sized)
        ensemble = simulate(sized)
        show(case, phrase("up_to_date", run.folder / "ensemble.h5") if current else ensemble)
    if is_inferred(run.sized(members)):
        show(case, phrase("up_to_date", run.folder / "posterior.h5"))
        return True
    try:
        show(case, infer(run, ensemble))
    except InputError as error:
        show(case, phrase("no_report", error, case.name))
        return False
    return True
