"""case -> page: everything known of a run as one HTML file, and its figures beside it."""

from pathlib import Path

from vegglue.case.resolved_config import case_hash, simulation_hash
from vegglue.case.schema import Case
from vegglue.ensemble.solve_ensemble import solve_flow
from vegglue.measurements.observations import read_observations
from vegglue.measurements.plant_survey import read_survey, rigid_cylinder
from vegglue.parallel import one_thread
from vegglue.report_page.page import write_report
from vegglue.storage.result_files import diagnosis_that_fits, read_ensemble, read_posterior
from vegglue.workflow.run_folder import folder_of, of_size


@one_thread()
def report(case: Case, *, runs: Path | str = "runs", members: int | None = None) -> Path:
    """Write runs/<name>/report.html and figures/ from the ensemble, the posterior and, if it fits, the diagnosis kept
    there; returns the page. members: size of the ensemble instead of the case's.

    Errors: InputError when there is no ensemble or posterior of this case; StorageError when a file cannot be written.
    """
    sized = of_size(case, members)
    observations = read_observations(sized)
    folder = folder_of(runs, case)
    ensemble = read_ensemble(folder / "ensemble.h5", simulation_hash(sized))
    posterior = read_posterior(folder / "posterior.h5", case_hash(sized))
    flow = solve_flow(sized, posterior.marginals.median)
    survey = rigid_cylinder(read_survey(case.survey.file), case.survey) if case.survey else None
    # A diagnosis needs no ensemble: it is that of the case, whatever the size of this one.
    diagnosis = diagnosis_that_fits(folder / "diagnosis.h5", case_hash(case))
    return write_report(folder, sized, observations, ensemble, posterior, flow, survey, diagnosis)
