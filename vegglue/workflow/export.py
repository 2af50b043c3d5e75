"""case -> files for others: the flow and the stations as CSV, GeoTIFF and netCDF, on the map where there is a frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from vegglue.arrays import Array
from vegglue.case.grid import build_grid
from vegglue.case.parameter_space import refuse_without_parameters, theta_at
from vegglue.case.resolved_config import case_hash, resolved_yaml
from vegglue.case.schema import Case
from vegglue.case.text_files import names_in_files
from vegglue.diagnosis.excluded_stations import without_stations
from vegglue.engine.first_use import with_compilation
from vegglue.errors import InputError, shown_path
from vegglue.flow.sensor import FlowFields
from vegglue.inference.solve_ensemble import solve_flow
from vegglue.measurements.observations import read_observations
from vegglue.parallel import one_thread
from vegglue.progress import Progress, Watch, silent
from vegglue.results.geotiff import write_geotiff
from vegglue.results.labelled_arrays import extra_library
from vegglue.results.mesh_file import quantities, write_mesh
from vegglue.results.point_tables import write_field_table, write_station_table
from vegglue.results.result_files import read_posterior, stored_hash
from vegglue.version import VERSION
from vegglue.whole_files import folder_within
from vegglue.workflow.median_flow import median_flow
from vegglue.workflow.run_folder import as_solved, folder_of, kept_best_fit
from vegglue.workflow.set_aside import set_aside_of

Form = Literal["csv", "geotiff", "netcdf"]
# Libraries that each form needs, all of the extra `field`.
LIBRARIES_OF_FORM: dict[Form, tuple[str, ...]] = {"csv": (), "geotiff": ("tifffile",), "netcdf": ("xarray", "h5netcdf")}


@dataclass(frozen=True)
class Exported:
    """What was written, and of which parameters the flow is, in words."""

    files: tuple[Path, ...]
    parameters: str


@one_thread()
def export(
    case: Case, *, runs: Path | str = "runs", forms: Sequence[Form] = get_args(Form), watch: Watch = silent
) -> Exported:
    """Write the flow of a case at cell centres, and its stations, into runs/<name>/export/.

    The flow is that of the posterior's medians, else of the best fit that a diagnosis found, else of the middle of
    the priors. csv: stations.csv and flow-<experiment>.csv; geotiff: one file for each quantity and experiment, none on
    a grid along a centreline; netcdf: flow.nc, a UGRID mesh. With a `frame` in the case all have their place on the
    map, and velocities are turned to it.
    Errors: InputError when no flow is found, nothing is left to write, or a library is missing; StorageError.
    """
    if list(forms) == ["geotiff"] and build_grid(case).centreline is not None:
        raise InputError(
            f"{shown_path(case.source)}: expected cells in straight rows for a GeoTIFF, got a grid along a centreline; "
            "choose --only netcdf or csv."
        )
    refuse_without_parameters(case)
    for library in (name for form in forms for name in LIBRARIES_OF_FORM[form]):  # before minutes are spent on the flow
        extra_library(library, "field", "vegglue export", "choose --only csv")
    folder = folder_of(runs, case)
    watch(Progress(with_compilation(f"solving the flow of {case.name}")))
    flows, predicted, words = _flow(case, folder)
    words += "" if case.engine is None else ", by the built-in engine"
    if not flows:
        raise InputError(f"{shown_path(case.source)}: no experiment finds a steady flow at {words}; check the case.")
    into = folder_within(folder, "export")
    write = {"csv": _csv, "geotiff": _geotiff, "netcdf": _netcdf}
    files = [path for form in forms for path in write[form](case, flows, predicted, into, words)]
    return Exported(tuple(files), words)


def _flow(case: Case, folder: Path) -> tuple[dict[str, FlowFields], Array | None, str]:
    """The flow by experiment, predictions at the stations where they are kept, and whose parameters these are."""
    sized = as_solved(case, folder)
    wanted = case_hash(sized)
    if stored_hash(folder / "posterior.h5") == wanted:
        posterior = read_posterior(folder / "posterior.h5", wanted)
        predicted = posterior.station["value"].to_numpy(float) - posterior.fit.residual
        return median_flow(sized, posterior, folder), predicted, "the medians of the posterior"
    best = kept_best_fit(case, folder)
    z = np.zeros(len(case.parameters)) if best is None else best
    theta = {name: float(value[0]) for name, value in theta_at(case, z[None]).items()}
    words = "the middle of the priors" if best is None else "the best fit that was found"
    if (folder / "posterior.h5").exists():
        words += ", as the posterior that is kept is of another state of the config or its data"
    return solve_flow(case, theta), None, words


def _csv(case: Case, flows: dict[str, FlowFields], predicted: Array | None, into: Path, words: str) -> list[Path]:
    stations = into / "stations.csv"
    table = without_stations(read_observations(case).table, set_aside_of(case, into.parents[1]))
    write_station_table(
        stations, {name: table[name].to_numpy() for name in table}, predicted, build_grid(case), case.frame
    )
    paths = [stations]
    called = names_in_files(flows)
    for name, flow in flows.items():
        paths.append(into / f"flow-{called[name]}.csv")
        write_field_table(paths[-1], flow, build_grid(case), case.frame)
    return paths


def _geotiff(case: Case, flows: dict[str, FlowFields], predicted: Array | None, into: Path, words: str) -> list[Path]:
    """None on a grid along a centreline, whose cells are no pixels: the mesh has them."""
    grid, paths = build_grid(case), list[Path]()
    if grid.centreline is not None:
        return []
    called = names_in_files(flows)
    for experiment, flow in flows.items():
        for name, values in quantities(flow, grid, case.frame).items():
            paths.append(into / f"{name}-{called[experiment]}.tif")
            write_geotiff(paths[-1], values, grid, case.frame)
    return paths


def _netcdf(case: Case, flows: dict[str, FlowFields], predicted: Array | None, into: Path, words: str) -> list[Path]:
    told = {"title": case.title or case.name, "source": f"vegglue {VERSION}, flow of {words}"}
    told |= {"config_hash": case_hash(case), "config": resolved_yaml(case)}
    write_mesh(into / "flow.nc", flows, build_grid(case), case.frame, told)
    return [into / "flow.nc"]
