"""case -> plan: what planned measurements would show before anyone measures, which to add, and what to take along."""

import json
from collections.abc import Sequence
from pathlib import Path

from vegglue.case.schema import Case, Planned
from vegglue.case.text_files import write_text
from vegglue.diagnosis.plan import plan_measurements
from vegglue.errors import InputError
from vegglue.parallel import at_most, import_beside, one_thread
from vegglue.plain_json import plain
from vegglue.progress import Watch, silent
from vegglue.results.plan import FieldPlan, plan_json, refuse_filled_in, write_field_files
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.workflow.case_run import CaseRun, case_run

# Folder of the plan in that of the run.
FOLDER = "plan"


@one_thread()
def plan(
    case: Case | CaseRun,
    *,
    about: str = "",
    size: float | None = None,
    between: Sequence[str] = (),
    hours: float | None = None,
    runs: Path | str = "runs",
    jobs: int = -1,
    watch: Watch = silent,
) -> FieldPlan:
    """What the measured and the planned stations of a case would show, and which pieces of field work to add.

    If the case has neither, a first set is proposed for its hours of field work. Writes runs/<name>/plan/: plan.html,
    plan.json, stations.csv, stations.gpx and sheet/, see docs/plan.md.

    Parameters
    ----------
    case : Case or CaseRun
        With priors; with `planned`, or measurements, or neither.
    about : str
        An effect: pieces are then chosen by the chance that it is detected.
    size : float, optional
        Its amplitude [its unit]; a plausible one if None.
    between : sequence of str
        Two effects: pieces are then chosen by the chance to distinguish them at plausible sizes.
    hours : float, optional
        Field work that is to be had [h], instead of `planned.hours`.
    runs : Path or str
        Folder that holds one folder of results for each case.
    jobs : int
        Number of threads, -1 for all cores. No result depends on it.
    watch : Watch
        Receives the progress.

    Returns
    -------
    FieldPlan

    Raises
    ------
    InputError
        If there is nothing to calibrate, nothing is under water, no flow is found, an effect is unknown, or the sheet
        of an earlier plan was filled in.
    StorageError
        If a file cannot be written.
    """
    run = case_run(case, runs, jobs, watch)
    if hours is not None:
        if not hours > 0.0:
            raise InputError(f"--hours: expected hours of field work above 0, got {hours:g}; give another.")
        planned = (run.case.planned or Planned()).model_copy(update={"hours": float(hours)})
        run = run.of(run.case.model_copy(update={"planned": planned}))
    folder = run.folder / FOLDER
    refuse_filled_in(folder)
    import_beside("vegglue.pages.plan")
    with at_most(run.jobs):
        found = plan_measurements(run.model, about, size, between, run.watch)
    files = write_field_files(folder, run.case, found)
    write_text(folder / "plan.json", json.dumps(plain(plan_json(found)), allow_nan=False), MAKE_ROOM)
    from vegglue.pages.plan import render_plan

    write_text(folder / "plan.html", render_plan(run.case, run.site, found, files), MAKE_ROOM)
    return found
