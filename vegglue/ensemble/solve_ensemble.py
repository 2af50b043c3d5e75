"""config -> ensemble: Sobol' members solved in fixed chunks over the cores, appended as they are finished.

A chunk is what one task solves: neighbours in the prior, the same set whatever the number of jobs, so that the
results are too.
"""

import hashlib
import os
import time
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from vegglue.case.parameter_space import parameters_at, unit_points
from vegglue.case.prior import sample_prior
from vegglue.case.resolved_config import resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.flow.problem import Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import FlowFields, flow_fields, read_sensors
from vegglue.measurements.kinds import velocity_rows
from vegglue.measurements.observations import Observations
from vegglue.parallel import as_finished
from vegglue.progress import Progress, Watch, silent
from vegglue.results.ensemble import Header
from vegglue.results.fields import QUANTITIES, FieldWindow, excess, window_of
from vegglue.site.gridded_site import Site, build_site
from vegglue.site.zones import refuse_ranges_without_cells
from vegglue.solver.batch import NEIGHBOURHOOD, solve_members
from vegglue.solver.parameter_metric import leaves, parameter_metric
from vegglue.solver.reference_member import SolvedMember, known_middle
from vegglue.solver.status import FAILED
from vegglue.storage.resume import ensemble_writer
from vegglue.version import VERSION

# Chunks are as large as LARGEST_CHUNK, to share a cold start, but at least FEWEST_CHUNKS, to share the cores.
LARGEST_CHUNK, FEWEST_CHUNKS = 256, 4
# Members read by the sensors at once, so that their fields stay small.
READ = 16
Rows = dict[str, np.ndarray]
Begin = dict[str, SolvedMember | None]


def solve_ensemble(case: Case, observations: Observations, path: Path, jobs: int, watch: Watch = silent) -> None:
    """Solve all members of the case and write them to `path`; what an earlier run of the same case solved is kept.

    Errors: InputError when an inflow or the outlet holds no cell centre, or the fields to be kept exceed their budget;
    StorageError when another run holds the folder or the disk is full (what was written stays).
    """
    if not case.parameters:
        raise InputError(f"{os.path.relpath(case.source)}: `parameters` expected a prior or more, got none: add one.")
    site = build_site(case)
    refuse_ranges_without_cells(case, site.grid)
    if sentence := excess(case, site.grid):
        raise InputError(f"{os.path.relpath(case.source)}: {sentence}")
    theta = sample_prior(case.parameters, case.simulate.members, case.simulate.seed)
    places = unit_points(case, theta)
    begin, chunks = begin_and_chunks(case, site, places)
    header = make_header(case, observations, theta, chunks, window_of(case, site.grid))
    with ensemble_writer(path, header) as writer:
        todo = [index for index in range(len(chunks)) if index not in writer.done]
        resumed = sum(chunks[index].size for index in writer.done)
        solved, failed = resumed, 0
        watch(Progress(case.name, solved, len(places), failed, resumed))
        for index, rows in _solve_all(case, site, observations, places, chunks, todo, begin, jobs):
            fields = rows.pop("fields")
            writer.append(index, chunks[index], rows, fields)
            solved, failed = solved + chunks[index].size, failed + int((rows["status"] == FAILED).sum())
            watch(Progress(case.name, solved, len(places), failed, resumed))


def chunk_size(members: int) -> int:
    """Members solved by one task at most; it depends on nothing but the size of the ensemble."""
    return min(max(-(-members // FEWEST_CHUNKS), NEIGHBOURHOOD), LARGEST_CHUNK)


def begin_and_chunks(case: Case, site: Site, places: np.ndarray) -> tuple[Begin, list[np.ndarray]]:
    """Where members come from, and what one task solves; a single chunk needs no common beginning."""
    size = chunk_size(len(places))
    begin = begin_at(case, site) if len(places) > size else {}
    slopes = [known.slopes for known in begin.values() if known is not None]
    return begin, leaves(parameter_metric(places, slopes).spots, size)


def _solve_all(
    case: Case,
    site: Site,
    observations: Observations,
    places: np.ndarray,
    chunks: list[np.ndarray],
    todo: list[int],
    begin: Begin,
    jobs: int,
) -> Iterator[tuple[int, Rows]]:
    tasks = ((index, case, site, observations, places[chunks[index]], begin) for index in todo)
    yield from as_finished(_solve_numbered, tasks, jobs)


def _solve_numbered(
    index: int, case: Case, site: Site, observations: Observations, places: np.ndarray, begin: Begin
) -> tuple[int, Rows]:
    return index, solve_chunk(case, site, observations, places, begin)


def begin_at(case: Case, site: Site) -> Begin:
    """Of every experiment, the member in the middle of the prior."""
    return {
        experiment: known_middle(
            partial(_problem_at, case, site, experiment), len(case.parameters), case.numerics.tolerance
        )
        for experiment in case.experiments
    }


def solve_chunk(
    case: Case, site: Site, observations: Observations, places: np.ndarray, begin: Begin | None = None
) -> Rows:
    """The rows of the ensemble file for members at `places` of the unit cube, every experiment of the case, and as
    `fields` (member, experiment, quantity, x, y) what is kept of their flow. begin: where members come from.
    """
    station, sections = observations.table, section_places(observations)
    members, window = len(places), window_of(case, site.grid)
    kept = window.columns if window else slice(0, 0)
    fields_shape = (members, len(case.experiments), len(QUANTITIES), kept.stop - kept.start, site.grid.y.size)
    rows: Rows = {
        "prediction": np.full((members, len(station)), np.nan),
        "section_flow": np.full((members, len(case.experiments), len(sections)), np.nan),
        "mass_error": np.zeros(members),
        "status": np.zeros(members, np.int8),
        "reason": np.full(members, "", object),
        "iterations": np.zeros(members, np.int32),
        "seconds": np.zeros(members),
        "fields": np.full(fields_shape, np.nan, np.float32),
    }
    for number, experiment in enumerate(case.experiments):
        began = time.perf_counter()
        build = partial(_problem_at, case, site, experiment)
        solved = solve_members(build, places, case.numerics.tolerance, (begin or {}).get(experiment))
        here = (station["experiment"] == experiment).to_numpy()
        for first in range(0, members, READ):
            few = slice(first, min(first + READ, members))
            state = np.ascontiguousarray(solved.state[..., few])
            readings = read_sensors(build(places[few]), state, site.grid, station[here], sections, kept)
            rows["prediction"][few, here] = readings.prediction
            rows["section_flow"][few, number] = readings.section_flow
            rows["fields"][few, number] = readings.fields
            rows["mass_error"][few] = np.maximum(rows["mass_error"][few], readings.mass_error)
        rows["status"] = np.maximum(rows["status"], solved.status.astype(np.int8))
        rows["iterations"] += solved.iterations.astype(np.int32)
        rows["seconds"] += (time.perf_counter() - began) / members
        for member, reason in enumerate(solved.reason):
            if reason:
                rows["reason"][member] = f"{rows['reason'][member]} {experiment}: {reason}".strip()
    for name in ("prediction", "fields"):
        rows[name][rows["status"] == FAILED] = np.nan
    return rows


def solve_flow(case: Case, theta: Mapping[str, float]) -> dict[str, FlowFields]:
    """Steady fields of one member at cell centres, by experiment; an experiment that finds none is left out."""
    site = build_site(case)
    place = unit_points(case, {name: np.array([theta[name]]) for name in case.parameters})
    fields = {}
    for experiment in case.experiments:
        build = partial(_problem_at, case, site, experiment)
        solved = solve_members(build, place, case.numerics.tolerance)
        if solved.status[0] != FAILED:
            fields[experiment] = flow_fields(build(place), solved.state, site.grid)
    return fields


def _problem_at(case: Case, site: Site, experiment: str, places: np.ndarray) -> Problem:
    return build_problem(case, site, experiment, parameters_at(case, places))


def make_header(
    case: Case,
    observations: Observations,
    theta: dict[str, np.ndarray],
    chunks: list[np.ndarray],
    window: FieldWindow | None,
) -> Header:
    return Header(
        parameters=theta,
        units={name: parameter.unit for name, parameter in case.parameters.items()},
        station=observations.table,
        experiments=tuple(case.experiments),
        sections=section_places(observations),
        chunks=len(chunks),
        cut=hashlib.sha256(np.concatenate(chunks).tobytes()).hexdigest(),
        config=resolved_yaml(case),
        config_hash=simulation_hash(case),
        seed=case.simulate.seed,
        version=VERSION,
        window=window,
    )


def section_places(observations: Observations) -> tuple[tuple[str, float], ...]:
    """Name and mean x [m] of every section a velocity was measured in."""
    velocity = observations.table[velocity_rows(observations.table)]
    return tuple((str(name), float(x)) for name, x in velocity.groupby("section", sort=False)["x"].mean().items())
