"""case -> page: everything known of a run as one HTML file, and its figures beside it."""

from dataclasses import replace
from pathlib import Path

import pandas as pd

from vegglue.case.gridded_site import build_site
from vegglue.case.resolved_config import case_hash, simulation_hash
from vegglue.case.schema import Case
from vegglue.diagnosis.excluded_stations import without_stations
from vegglue.errors import InputError, shown_command, shown_path
from vegglue.measurements.observations import Observations, read_observations
from vegglue.measurements.plant_survey import read_survey, rigid_cylinder
from vegglue.parallel import one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.report.page import write_report
from vegglue.report.run import LoopResults, Run
from vegglue.results.json_store import comparison_that_fits, questions_that_fit
from vegglue.results.posterior import Posterior
from vegglue.results.result_files import diagnosis_that_fits, read_ensemble, read_posterior
from vegglue.results.resume import begun_or_finished
from vegglue.workflow.median_flow import median_flow
from vegglue.workflow.run_folder import as_solved, folder_of, of_size
from vegglue.workflow.set_aside import set_aside_of


@one_thread()
def report(case: Case, *, runs: Path | str = "runs", members: int | None = None, watch: Watch = silent) -> Path:
    """Write runs/<name>/report.html and figures/ from the posterior, its ensemble if it has one and, where they fit,
    the diagnosis, the comparison and the questions kept there; returns the page. members: size of the ensemble, if not
    given that of the one there is.

    Errors: InputError when there is no posterior of this case, or its ensemble is gone or of another state of it;
    StorageError when a file cannot be written.
    """
    sized = as_solved(case, folder_of(runs, case)) if members is None else of_size(case, members)
    known = results_of(sized, case, runs)
    watch(Progress(f"solving the flow of {case.name} at its medians"))
    flow = median_flow(known.case, known.posterior, known.folder)
    watch(Progress(f"drawing the figures of {case.name}"))
    return write_report(replace(known, flow=flow))


def results_of(sized: Case, case: Case, runs: Path | str, above: str = "../") -> Run:
    """All that is kept of a run but its flow. sized: the case with as many members as its ensemble has, which is all
    that a diagnosis does not depend on; above: the folder of all runs, seen from the page that is made.

    Errors: as those of `report`; StorageError for a broken file, too.
    """
    observations = read_observations(sized)
    folder = folder_of(runs, case)
    path, ensemble = folder / "ensemble.h5", None
    if begun_or_finished(path):
        ensemble = read_ensemble(path, simulation_hash(sized), case.source)
    if not (folder / "posterior.h5").exists():
        _refuse_if_the_run_went_on(case, runs)
    posterior = read_posterior(folder / "posterior.h5", case_hash(sized), case.source)
    observations, since = _as_inferred(observations, posterior, set_aside_of(case, runs))
    if ensemble is None and posterior.settings.ensemble_hash:
        read_ensemble(path, config=case.source)  # says that it is gone
    survey = rigid_cylinder(read_survey(case.survey.file), case.survey) if case.survey else None
    diagnosis = diagnosis_that_fits(folder / "diagnosis.h5", case_hash(case))
    loop = loop_results_of(case, runs, above)
    return Run(folder, sized, build_site(sized), observations, ensemble, posterior, {}, survey, diagnosis, loop, since)


def _as_inferred(observations: Observations, posterior: Posterior, aside: pd.DataFrame) -> tuple[Observations, int]:
    """The observations with what the posterior left out, and how many of it are set aside by now."""
    kept = posterior.station[["used", "reason"]].set_axis(observations.table.index)
    table = observations.table.assign(**kept)
    still = table["used"].astype(bool) & ~without_stations(table, aside)["used"].astype(bool)
    return replace(observations, table=table), int(still.sum())


def _refuse_if_the_run_went_on(case: Case, runs: Path | str) -> None:
    """Errors: InputError when the loop extended the model, and the posterior is that of the last one only."""
    comparison = comparison_that_fits(folder_of(runs, case), case_hash(case))
    last = comparison.steps[-1].name if comparison is not None else case.name
    page = Path(runs) / last / "report.html"
    if last != case.name and page.exists():
        raise InputError(
            f"{shown_path(case.source)}: the run went on to {last}, whose report is {shown_path(page)}; for one of "
            f"{case.name} itself run {shown_command('infer', case.source)} first."
        )


def loop_results_of(case: Case, runs: Path | str, above: str) -> LoopResults:
    """What diagnose, extend, compare and next left of exactly this case, and of the model its ladder begins with."""
    runs, wanted = Path(runs), case_hash(case)
    comparison = comparison_that_fits(runs / case.name, wanted)
    first, first_hash = (
        (case.name, wanted) if comparison is None else (comparison.steps[0].name, comparison.steps[0].config_hash)
    )
    steps = () if comparison is None else comparison.steps
    own = questions_that_fit(runs / case.name, wanted)
    made = [one.name for one in steps if (runs / one.name / "posterior.h5").exists()]
    return LoopResults(
        behind=diagnosis_that_fits(runs / first / "diagnosis.h5", first_hash),
        ladder=comparison,
        questions=own if own is not None else questions_that_fit(runs / first, first_hash),
        pages={name: f"{above}{name}/report.html" for name in made},
    )
