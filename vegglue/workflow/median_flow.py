"""case, posterior -> the flow of the median parameters: read where it is kept, solved and kept where not."""

from pathlib import Path

from vegglue.case.resolved_config import case_hash, resolved_yaml
from vegglue.case.schema import Case
from vegglue.flow.sensor import FlowFields
from vegglue.inference.solve_ensemble import solve_flow
from vegglue.results.posterior import Posterior
from vegglue.results.result_files import flow_that_fits, write_flow


def median_flow(case: Case, posterior: Posterior, folder: Path) -> dict[str, FlowFields]:
    """Steady fields at cell centres by experiment, kept in flow.h5 in the folder of the run; an experiment that finds
    none is left out. Errors: StorageError.
    """
    path, theta, wanted = folder / "flow.h5", posterior.marginals.median, case_hash(case)
    kept = flow_that_fits(path, wanted, theta)
    if kept is not None:
        return kept
    flow = solve_flow(case, theta)
    if flow:
        write_flow(path, flow, theta, resolved_yaml(case), wanted)
    return flow
