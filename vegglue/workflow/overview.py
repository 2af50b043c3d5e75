"""cases -> one page about their runs: the answers first, parameters side by side, and the way to each report."""

from collections.abc import Sequence
from pathlib import Path

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.progress import Progress, Watch, silent
from vegglue.report.overview import write_overview
from vegglue.results.json_store import comparison_that_fits
from vegglue.workflow.report import results_of
from vegglue.workflow.run_folder import as_solved, folder_of


def overview(cases: Sequence[Case], *, runs: Path | str = "runs", trust: bool = False, watch: Watch = silent) -> Path:
    """Write runs/overview.html about runs that have a posterior, in the order given; returns the page.

    In place of a case that `run` took round the loop stands its last child, which has the posterior. trust: whether the
    file of a law that the child names may be run.

    Errors: InputError where an ensemble or a posterior of a case is missing or out of date; StorageError when a file
    cannot be written.
    """
    known = []
    for case in cases:
        watch(Progress(f"reading {case.name}"))
        shown = _with_posterior(case, runs, trust)
        known.append(results_of(as_solved(shown, folder_of(runs, shown)), shown, runs, above=""))
    watch(Progress("drawing the overview"))
    return write_overview(Path(runs) / "overview.html", known)


def _with_posterior(case: Case, runs: Path | str, trust: bool) -> Case:
    """The case; where it has no posterior the last child of its comparison that has one, else the last of all."""
    comparison = comparison_that_fits(folder_of(runs, case), case_hash(case))
    if comparison is None or (folder_of(runs, case) / "posterior.h5").exists():
        return case
    made = [one for one in comparison.steps if (Path(runs) / one.name / "posterior.h5").exists()]
    child = case.source.with_name((made or comparison.steps)[-1].config)
    return load_case(child, trust) if child.exists() else case
