"""cases -> one page about their runs: the answers first, parameters side by side, and the way to each report."""

from collections.abc import Sequence
from pathlib import Path

from vegglue.case.schema import Case
from vegglue.progress import Progress, Watch, silent
from vegglue.report_page.overview import write_overview
from vegglue.report_page.run import Run
from vegglue.storage.result_files import read_ensemble
from vegglue.workflow.report import results_of
from vegglue.workflow.run_folder import folder_of, of_size


def overview(cases: Sequence[Case], *, runs: Path | str = "runs", watch: Watch = silent) -> Path:
    """Write runs/overview.html about runs that have a posterior, in the order given; returns the page.

    Errors: InputError where an ensemble or a posterior of a case is missing or out of date; StorageError when a file
    cannot be written.
    """
    known = []
    for case in cases:
        watch(Progress(f"reading {case.name}"))
        known.append(_results_of(case, runs))
    watch(Progress("drawing the overview"))
    return write_overview(Path(runs) / "overview.html", known)


def _results_of(case: Case, runs: Path | str) -> Run:
    """The results of a case with as many members as were solved."""
    members = len(read_ensemble(folder_of(runs, case) / "ensemble.h5").status)
    return results_of(of_size(case, members), case, runs, above="")
