"""case -> files for others: the flow and the stations as CSV, GeoTIFF and netCDF, on the map where there is a frame;
or the case and its ensembles as PEST++ and SPOTPY read them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from vegglue.arrays import Array
from vegglue.case.grid import build_grid
from vegglue.case.parameter_space import refuse_without_parameters, sobol_sample, thetas_at
from vegglue.case.resolved_config import case_hash, resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.case.text_files import LONGEST_IN_FILES, names_in_files
from vegglue.diagnosis.comparison import without_stations
from vegglue.engine.interface import linearise
from vegglue.engine.model import with_compilation
from vegglue.errors import InputError, shown_command, shown_path
from vegglue.flow.sensor import FlowFields
from vegglue.inference.solve_ensemble import solve_flow
from vegglue.parallel import one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.calibration_files import (
    log_likelihood,
    pest_names,
    solved_rows,
    write_evaluation,
    write_pest,
    write_spotpy,
)
from vegglue.results.field_exports import quantities, write_field_table, write_geotiff, write_mesh, write_station_table
from vegglue.results.labelled_arrays import extra_library
from vegglue.results.result_files import read_ensemble, read_posterior, stored_hash
from vegglue.version import VERSION
from vegglue.whole_files import folder_within
from vegglue.wording.phases import SOLVING_FLOW
from vegglue.wording.sentences import phrase
from vegglue.workflow.case_run import CaseRun, as_solved, case_run, excluded_in, kept_best_fit, median_flow
from vegglue.workflow.command_model import refuse_command

Form = Literal["csv", "geotiff", "netcdf"]
Program = Literal["pest", "spotpy"]
# Libraries that each form needs, all of the extra `field`.
LIBRARIES_OF_FORM: dict[Form, tuple[str, ...]] = {"csv": (), "geotiff": ("tifffile",), "netcdf": ("xarray", "h5netcdf")}


@dataclass(frozen=True)
class Exported:
    """What was written.

    Attributes
    ----------
    parameters : str
        Of which parameters the flow is.
    """

    files: tuple[Path, ...]
    parameters: str


@one_thread()
def export(
    case: Case | CaseRun,
    *,
    runs: Path | str = "runs",
    forms: Sequence[Form] = get_args(Form),
    to: Program | None = None,
    watch: Watch = silent,
) -> Exported:
    """Write the flow of a case at cell centres, and its stations, into runs/<name>/export/.

    The flow is that of the medians of the posterior, else of the best fit of the diagnosis, else of the middle of the
    priors. With a `frame` in the case, places and velocities are those of the map.

    Parameters
    ----------
    case : Case or CaseRun
    runs : Path or str
        Folder that holds the folders of runs.
    forms : sequence of str
        `csv` writes stations.csv and flow-<experiment>.csv; `geotiff` one file for each quantity and experiment, none
        on a grid along a centreline; `netcdf` flow.nc, a UGRID mesh.
    to : {"pest", "spotpy"}, optional
        Write the case for this calibration program instead, into export/pest or export/spotpy: a control file with its
        prior and posterior as ensembles, or a database of the members that were solved.
    watch : callable
        Gets a `Progress` at each step.

    Returns
    -------
    Exported

    Raises
    ------
    InputError
        If no flow is found, nothing is left to write, or a library is missing.
    StorageError
        If a file cannot be written.
    """
    run = case_run(case, runs, watch=watch)
    case = run.case
    if to is not None:
        refuse_without_parameters(case)
        return export_to_pest(run) if to == "pest" else export_to_spotpy(run)
    if list(forms) == ["geotiff"] and build_grid(case).centreline is not None:
        raise InputError(
            f"{shown_path(case.source)}: expected cells in straight rows for a GeoTIFF, got a grid along a centreline; "
            "choose --only netcdf or csv."
        )
    refuse_without_parameters(case)
    for library in (name for form in forms for name in LIBRARIES_OF_FORM[form]):  # before minutes are spent on the flow
        extra_library(library, "field", "vegglue export", "choose --only csv")
    run.watch(Progress(with_compilation(SOLVING_FLOW.format(case.name))))
    flows, predicted, words = flow_to_export(run)
    if not flows:
        raise InputError(f"{shown_path(case.source)}: no experiment finds a steady flow at {words}; check the case.")
    into, grid, files = folder_within(run.folder, "export"), build_grid(case), list[Path]()
    called = names_in_files(flows)
    for form in forms:
        if form == "csv":
            table = without_stations(run.observations.table, excluded_in(run))
            files.append(into / "stations.csv")
            columns = {name: table[name].to_numpy() for name in table}
            write_station_table(files[-1], columns, predicted, grid, case.frame)
            for name, flow in flows.items():
                files.append(into / f"flow-{called[name]}.csv")
                write_field_table(files[-1], flow, grid, case.frame)
        elif form == "geotiff" and grid.centreline is None:  # cells along a centreline are no pixels
            for experiment, flow in flows.items():
                for name, values in quantities(flow, grid, case.frame).items():
                    files.append(into / f"{name}-{called[experiment]}.tif")
                    write_geotiff(files[-1], values, grid, case.frame)
        elif form == "netcdf":
            about = {"title": case.title or case.name, "source": f"vegglue {VERSION}, flow of {words}"}
            about |= {"config_hash": case_hash(case), "config": resolved_yaml(case)}
            files.append(into / "flow.nc")
            write_mesh(files[-1], flows, grid, case.frame, about)
    return Exported(tuple(files), words)


def members_to_export(run: CaseRun, valued: Array) -> dict[str, tuple[dict[str, Array], Array, Array]]:
    """The members that were solved and the draws of the posterior, of each of them that fits the case.

    Parameters
    ----------
    valued : ndarray of bool (station,)
        Stations with a value, v of them.

    Returns
    -------
    dict of (dict of ndarray (member,), ndarray (member, v), ndarray (member,))
        Parameters [unit of each], predictions [unit of each station] and chains, by "ensemble" or "posterior".
    """
    case, folder = as_solved(run.case, run.folder), run.folder
    found, wanted = {}, case_hash(case)
    if stored_hash(folder / "ensemble.h5") == simulation_hash(case):
        ensemble = read_ensemble(folder / "ensemble.h5")
        solved = solved_rows(ensemble)
        theta = {name: values[solved] for name, values in ensemble.parameters.items()}
        found["ensemble"] = theta, ensemble.prediction[solved][:, valued], np.ones(len(solved))
    if stored_hash(folder / "posterior.h5") == wanted:
        posterior = read_posterior(folder / "posterior.h5", wanted)
        (chains, draws), drawn = posterior.predicted.draws.shape, posterior.predicted.draws.ravel()
        theta = {name: values[drawn] for name, values in posterior.sample.theta.items()}
        chain = np.repeat(np.arange(1, chains + 1), draws)
        found["posterior"] = theta, posterior.sample.prediction[drawn][:, valued], chain
    return found


def export_to_pest(run: CaseRun) -> Exported:
    """Control file, template, instructions and ensembles for PEST++; its model is `simulate` with its parameters."""
    case = run.case
    if case.engine is None:
        refuse_command(case, "export --to pest")  # of a finished run, which no parameters change
    table = without_stations(run.observations.table, excluded_in(run))
    valued = table["value"].notna().to_numpy()
    found = members_to_export(run, valued)
    members: dict[str, tuple[dict[str, Array], Array | None]] = {"prior": (sobol_sample(case).theta, None)}
    for name, (theta, prediction, _) in found.items():
        members["prior" if name == "ensemble" else name] = theta, prediction
    trust = ["--trust"] if case.engine is not None or case.effect_file is not None else []
    words = ["vegglue", "simulate", str(case.source.resolve()), "--parameters", "parameters.csv", "--runs", "model"]
    command = " ".join(f'"{one}"' if " " in one else one for one in [*words, "--quiet", *trust])
    predictions = f"model/{case.name}/given/parameters/predictions.csv"
    into = folder_within(run.folder, "export/pest")
    files = write_pest(into, case, table[valued], command, predictions, members)
    return Exported(tuple(files), " and ".join(f"the {name}" for name in members))


def export_to_spotpy(run: CaseRun) -> Exported:
    """A database of the ensemble, one of the posterior's draws, and the measurements that both are compared with."""
    case, table = run.case, without_stations(run.observations.table, excluded_in(run))
    valued = table["value"].notna().to_numpy()
    members = members_to_export(run, valued)
    if not members:
        raise InputError(
            f"{shown_path(case.source)}: expected an ensemble or a posterior of this case, found none; run "
            f"{shown_command('simulate', case.source)} or {shown_command('infer', case.source)} first."
        )
    names, into = pest_names(case.parameters, LONGEST_IN_FILES), folder_within(run.folder, "export/spotpy")
    files = [into / "evaluation.csv", *(into / f"{name}.csv" for name in members)]
    write_evaluation(files[0], table[valued])
    for path, (theta, prediction, chain) in zip(files[1:], members.values(), strict=True):
        write_spotpy(path, names, theta, prediction, log_likelihood(table[valued], prediction), chain)
    return Exported(tuple(files), " and ".join(f"the {name}" for name in members))


def flow_to_export(run: CaseRun) -> tuple[dict[str, FlowFields], Array | None, str]:
    """The flow of a case for its median, best or middle parameters.

    Returns
    -------
    dict of FlowFields
        By experiment.
    ndarray (station,) or None
        Predictions [unit of each station], None if no flow is found.
    str
        Whose parameters these are, in words.
    """
    case, folder = run.case, run.folder
    sized = run.of(as_solved(case, folder))
    wanted = sized.config_hash
    if stored_hash(folder / "posterior.h5") == wanted:
        posterior = read_posterior(folder / "posterior.h5", wanted)
        predicted = posterior.station["value"].to_numpy(float) - posterior.fit.residual
        return median_flow(sized, posterior), predicted, phrase("flow_of", "posterior", False, case.engine is not None)
    best = kept_best_fit(case, folder)
    z = np.zeros(len(case.parameters)) if best is None else best
    words = phrase(
        "flow_of", "prior" if best is None else "best-fit", (folder / "posterior.h5").exists(), case.engine is not None
    )
    point = linearise(run.model, z)
    return solve_flow(case, thetas_at(case, z[None])[0]), None if point is None else point.prediction, words
