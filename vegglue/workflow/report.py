"""case -> page: everything known of a run as one HTML file, and its figures beside it; one page about several runs."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash, simulation_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.comparison import without_stations
from vegglue.engine.model import with_compilation
from vegglue.errors import InputError, shown_command, shown_path
from vegglue.inference.command_ensemble import refuse_useless
from vegglue.measurements.plant_survey import read_survey, rigid_cylinder
from vegglue.pages.page import write_overview, write_report
from vegglue.pages.run import LoopResults, Run
from vegglue.parallel import one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.loop_results import comparison_that_fits, questions_that_fit
from vegglue.results.result_files import diagnosis_that_fits, read_ensemble, read_posterior
from vegglue.results.resume import begun_or_finished
from vegglue.wording.phases import DRAWING, SOLVING_FLOW
from vegglue.workflow.case_run import CaseRun, as_solved, case_run, excluded_in, median_flow


@one_thread()
def report(
    case: Case | CaseRun, *, runs: Path | str = "runs", members: int | None = None, watch: Watch = silent
) -> Path:
    """Write the page of a run, runs/<name>/report.html, and its figures.

    It shows the posterior, its ensemble if there is one, and the diagnosis, comparison and questions that fit it.

    Parameters
    ----------
    case : Case or CaseRun
    runs : Path or str
        Folder that holds the folders of runs.
    members : int, optional
        Size of the ensemble; that of the one that is there if not given.
    watch : callable
        Gets a `Progress` at each step.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        If there is no posterior of this case, or if its ensemble is missing or of another state of the case.
    StorageError
        If a file cannot be written.
    """
    run = case_run(case, runs, watch=watch)
    sized = run.of(as_solved(run.case, run.folder)) if members is None else run.sized(members)
    known = results_of(sized, run)
    run.watch(Progress(with_compilation(SOLVING_FLOW.format(run.case.name))))
    flow = median_flow(sized, known.posterior)
    run.watch(Progress(DRAWING.format(run.case.name)))
    return write_report(replace(known, flow=flow))


def overview(
    cases: Sequence[Case | CaseRun], *, runs: Path | str = "runs", trust: bool = False, watch: Watch = silent
) -> Path:
    """Write runs/overview.html about several runs that have a posterior.

    The last child stands for a case that `run` extended, as it has the posterior.

    Parameters
    ----------
    cases : sequence of Case or CaseRun
        In the order of the page.
    runs : Path or str
        Folder that holds the folders of runs.
    trust : bool
        Whether the file of a law that a child names may be run.
    watch : callable
        Gets a `Progress` at each step.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        If an ensemble or a posterior is missing or out of date.
    StorageError
        If a file cannot be written.
    """
    known = []
    for run in (case_run(case, runs, watch=watch) for case in cases):
        run.watch(Progress(f"reading {run.case.name}"))
        shown = run
        ladder = comparison_that_fits(run.folder, run.config_hash)
        if ladder is not None and not (run.folder / "posterior.h5").exists():
            made = [one for one in ladder.steps if (run.runs / one.name / "posterior.h5").exists()]
            child = run.case.source.with_name((made or ladder.steps)[-1].config)
            shown = run.of(load_case(child, trust)) if child.exists() else run
        known.append(results_of(shown.of(as_solved(shown.case, shown.folder)), shown, above=""))
    watch(Progress("drawing the overview"))
    return write_overview(Path(runs) / "overview.html", known)


def results_of(sized: CaseRun, run: CaseRun, above: str = "../") -> Run:
    """All that is kept of a run but its flow.

    Parameters
    ----------
    sized : CaseRun
        The case with as many members as its ensemble has, which is all that a diagnosis does not depend on.
    above : str
        The folder of all runs, seen from the page that is made.

    Raises
    ------
    InputError
        As `report`.
    StorageError
        For a broken file.
    """
    case, folder, observations = run.case, run.folder, run.observations
    path, ensemble = folder / "ensemble.h5", None
    if begun_or_finished(path):
        ensemble = read_ensemble(path, simulation_hash(sized.case), case.source)
        if ensemble.by_command:
            refuse_useless(sized.case, ensemble)
    if not (folder / "posterior.h5").exists():
        refuse_if_the_run_went_on(run)
    posterior = read_posterior(folder / "posterior.h5", case_hash(sized.case), case.source)
    # The page shows what the posterior used, and how much of it has been excluded since.
    kept = posterior.station[["used", "reason"]].set_axis(observations.table.index)
    table = observations.table.assign(**kept)
    since = table["used"] & ~without_stations(table, excluded_in(run))["used"]
    observations = replace(observations, table=table)
    if ensemble is None and posterior.settings.ensemble_hash:
        read_ensemble(path, config=case.source)  # raises, as it is gone
    survey = rigid_cylinder(read_survey(case.survey.file), case.survey) if case.survey else None
    diagnosis = diagnosis_that_fits(folder / "diagnosis.h5", run.config_hash)
    loop, site, later = loop_results_of(run, above), run.site, int(since.sum())
    return Run(folder, sized.case, site, observations, ensemble, posterior, {}, survey, diagnosis, loop, later)


def refuse_if_the_run_went_on(run: CaseRun) -> None:
    """Raise InputError if the loop extended the model, and the posterior is that of the last one only."""
    ladder = comparison_that_fits(run.folder, run.config_hash)
    last = ladder.steps[-1].name if ladder is not None else run.case.name
    page = run.runs / last / "report.html"
    if last != run.case.name and page.exists():
        raise InputError(
            f"{shown_path(run.case.source)}: the run went on to {last}, whose report is {shown_path(page)}; for one of "
            f"{run.case.name} itself run {shown_command('infer', run.case.source)} first."
        )


def loop_results_of(run: CaseRun, above: str) -> LoopResults:
    """What diagnose, extend, compare and next left of exactly this case, and of the first model of its comparison."""
    runs, wanted, name = run.runs, run.config_hash, run.case.name
    ladder = comparison_that_fits(runs / name, wanted)
    first, first_hash = (name, wanted) if ladder is None else (ladder.steps[0].name, ladder.steps[0].config_hash)
    steps = () if ladder is None else ladder.steps
    own = questions_that_fit(runs / name, wanted)
    made = [one.name for one in steps if (runs / one.name / "posterior.h5").exists()]
    return LoopResults(
        behind=diagnosis_that_fits(runs / first / "diagnosis.h5", first_hash),
        ladder=ladder,
        questions=own if own is not None else questions_that_fit(runs / first, first_hash),
        pages={one: f"{above}{one}/report.html" for one in made},
    )
