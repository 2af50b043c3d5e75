"""config -> ensemble: Sobol' members solved in fixed chunks over the cores, appended as they are finished.

A chunk is neighbours in the prior, the same set whatever the number of jobs, so that the results are too. One task
solves a chunk in one experiment.
"""

import hashlib
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from vegglue.case.gridded_site import Site, build_site
from vegglue.case.parameter_space import PriorSample, parameters_at, refuse_without_parameters, sample_of, sobol_sample
from vegglue.case.resolved_config import resolved_yaml, simulation_hash
from vegglue.case.schema import Case
from vegglue.case.size_limits import MOST_PREDICTIONS
from vegglue.case.zones import refuse_ranges_without_cells
from vegglue.engine.model import ever_coarser, with_compilation
from vegglue.errors import InputError, shown_path
from vegglue.flow.batch import CLUSTER_SIZE, SolvedMembers, solve_members
from vegglue.flow.march import FallBack, fall_back
from vegglue.flow.nested_grids import GridProblem, solve_nested
from vegglue.flow.parameter_metric import clusters, parameter_metric
from vegglue.flow.problem import Problem, take
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.reference_member import LinearisedMember, linearised_median
from vegglue.flow.sensor import FlowFields, flow_fields, read_sensors
from vegglue.flow.status import FAILED, members_with
from vegglue.measurements.kinds import velocity_rows
from vegglue.measurements.observations import Observations
from vegglue.parallel import as_finished, in_threads
from vegglue.progress import Progress, Watch
from vegglue.results.ensemble import QUANTITIES, FieldWindow, Header, excess, window_of
from vegglue.results.resume import EnsembleWriter, ensemble_writer
from vegglue.version import VERSION
from vegglue.wording.sentences import sentence

# Members of a chunk at most, to share what leads to the first of them, and chunks at least, to share the cores [-].
# Chosen, not measured: smaller chunks share the work more evenly and lose less if a run is killed, larger ones reach
# fewer first members from afar. No key of a config: with other chunks members have other neighbours, and last digits.
LARGEST_CHUNK, FEWEST_CHUNKS = 256, 4
# Members [-] up to which each is solved on coarser cells first. Of 256 on 9,600 cells that takes 70 % of the time that
# neighbours alone take; more were not tried. Chunks then hold half of the members, and at most
# SPARSE_CHUNK, or twice as many if several experiments share the cores: larger ones share more, or leave cores idle.
SPARSE_MEMBERS, SPARSE_CHUNK = 256, 64
# Members read by the sensors at once [-], so that their fields stay small. No number depends on it.
READ_TOGETHER = 16
Rows = dict[str, np.ndarray]
StartFrom = Mapping[str, LinearisedMember | None]


@dataclass(frozen=True)
class UnfinishedRunMoved:
    """An unfinished run of another state of a case, moved to a file of this name."""

    case: str
    file: str


def solve_ensemble(
    case: Case,
    observations: Observations,
    path: Path,
    jobs: int,
    watch: Watch,
    site: Site | None = None,
    given: PriorSample | None = None,
) -> None:
    """Solve all members of the case and write them to `path`; what an earlier run of the same case solved is kept.

    Parameters
    ----------
    case : Case
        With at least one parameter; `simulate` sets members, seed and fields.
    observations : Observations
        Stations at which flows are read.
    path : Path
        Of the HDF5 file.
    jobs : int
        Processes; -1 for one on every core.
    watch : callable
        Is called after each chunk.
    site : Site, optional
        That of the case, if it is built already.
    given : PriorSample, optional
        Members in place of those that the case draws from its priors; as many as it has.

    Raises
    ------
    InputError
        If an inflow or the outlet holds no cell centre, or the fields to be kept exceed their budget.
    StorageError
        If another run holds the folder or the disk is full; what was written stays.
    """
    wanted = ensemble_hash(case, given)  # before anything else is read: what changes meanwhile makes it out of date
    refuse_too_many(case, observations)
    site = site or build_site(case)
    refuse_ranges_without_cells(case, site.grid)
    if problem := excess(case, site.grid):
        raise InputError(f"{shown_path(case.source)}: {sentence(problem)}")
    sample = given or sobol_sample(case)
    start_from, chunks = starts_and_chunks(case, site, sample.points)
    header = make_header(case, wanted, observations, sample.theta, chunks, window_of(case, site.grid))
    with ensemble_writer(path, header) as writer:
        todo = left_to_do(writer, case, chunks, watch)
        resumed = sum(chunks[index].size for index in writer.done)
        flows, failed, phase = resumed * len(case.experiments), 0, f"solving {case.name}"
        watch(Progress(with_compilation(phase), resumed, header.members, "members", failed, resumed))
        for index, rows in _solve_all(case, site, observations, sample, chunks, todo, start_from, jobs):
            flows += chunks[index].size
            if rows is not None:
                failed += members_with(rows["status"], FAILED)
                fields = rows.pop("fields")
                writer.append(index, chunks[index], rows, fields)
            watch(Progress(phase, flows // len(case.experiments), header.members, "members", failed, resumed))


def ensemble_hash(case: Case, given: PriorSample | None = None) -> str:
    """SHA-256 of what an ensemble depends on.

    Parameters
    ----------
    given : PriorSample, optional
        Members that are not drawn from the priors, whose parameters count, too.

    Returns
    -------
    str
        Hexadecimal.
    """
    own = simulation_hash(case)
    if given is None:
        return own
    return hashlib.sha256(own.encode() + b"".join(values.tobytes() for values in given.theta.values())).hexdigest()


def refuse_too_many(case: Case, observations: Observations) -> None:
    """Refuse a case without parameters, or with more than MOST_PREDICTIONS.

    Raises
    ------
    InputError
    """
    refuse_without_parameters(case)
    if (predictions := case.simulate.members * len(observations.table)) > MOST_PREDICTIONS:
        raise InputError(
            f"{shown_path(case.source)}: {case.simulate.members:,} members of {len(observations.table):,} stations "
            f"have {predictions:,} predictions; expected at most {MOST_PREDICTIONS:,}, take fewer of either."
        )


def starts_and_chunks(case: Case, site: Site, points: np.ndarray) -> tuple[StartFrom, list[np.ndarray]]:
    """Where members start from, and the members of each chunk, which lie near each other.

    Parameters
    ----------
    points : ndarray (m, p)
        Of the members in the unit cube of the priors.

    Returns
    -------
    mapping of LinearisedMember or None
        By experiment; empty for SPARSE_MEMBERS at most, which start from coarser cells.
    list of ndarray of int
        Members of each chunk.
    """
    size = chunk_size(len(points), len(case.experiments))
    start_from = linearised_medians(case, site) if len(points) > SPARSE_MEMBERS else {}
    slopes = [one.slopes for one in start_from.values() if one is not None]
    return start_from, clusters(parameter_metric(points, slopes).coordinates, size)


def chunk_size(members: int, experiments: int) -> int:
    """Members of a chunk at most.

    It depends on nothing but the size of the ensemble and the number of experiments.
    """
    if members <= SPARSE_MEMBERS:
        return min(-(-members // 2), SPARSE_CHUNK if experiments == 1 else 2 * SPARSE_CHUNK)
    return min(max(-(-members // FEWEST_CHUNKS), CLUSTER_SIZE), LARGEST_CHUNK)


def linearised_medians(case: Case, site: Site) -> StartFrom:
    """Of every experiment, the member at the medians of all priors; None if it had to be marched."""
    parameters, tolerance = len(case.parameters), case.numerics.tolerance

    def median_in(experiment: str) -> LinearisedMember | None:
        return linearised_median(partial(_problem_at, case, site, experiment), parameters, tolerance, _fall_back(case))

    found = in_threads(median_in, [(experiment,) for experiment in case.experiments])
    return dict(zip(case.experiments, found, strict=True))


def make_header(
    case: Case,
    config_hash: str,
    observations: Observations,
    theta: dict[str, np.ndarray],
    chunks: list[np.ndarray],
    window: FieldWindow | None,
) -> Header:
    """What an ensemble file states before its members."""
    return Header(
        parameters=theta,
        units={name: parameter.unit for name, parameter in case.parameters.items()},
        station=observations.table,
        experiments=tuple(case.experiments),
        sections=section_positions(observations),
        chunks=len(chunks),
        cut=hashlib.sha256(np.concatenate(chunks).tobytes()).hexdigest(),
        config=resolved_yaml(case),
        config_hash=config_hash,
        seed=case.simulate.seed,
        version=VERSION,
        window=window,
    )


def left_to_do(writer: EnsembleWriter, case: Case, chunks: list[np.ndarray], watch: Watch) -> list[int]:
    """Chunks that an earlier run has not finished, or that are damaged since; a run that was moved is reported."""
    if writer.moved_to is not None:
        watch(Progress(sentence(UnfinishedRunMoved(case.name, writer.moved_to.name))))
    writer.reopen_damaged(chunks)
    return [index for index in range(len(chunks)) if index not in writer.done]


def solved_members(case: Case, observations: Observations, sample: PriorSample, jobs: int) -> np.ndarray:
    """Predictions of the members of a sample.

    Parameters
    ----------
    jobs : int
        Processes; -1 for one on every core.

    Returns
    -------
    ndarray (member, station)
        [unit of each station]; NaN of a member that failed in any experiment.

    Raises
    ------
    StorageError
        If a process was killed.
    """
    site, found = build_site(case), np.full((len(sample.points), len(observations.table)), np.nan)
    start_from, chunks = starts_and_chunks(case, site, sample.points)
    for index, rows in _solve_all(case, site, observations, sample, chunks, [*range(len(chunks))], start_from, jobs):
        if rows is not None:
            found[chunks[index]] = rows["prediction"]
    return found


def _solve_all(
    case: Case,
    site: Site,
    observations: Observations,
    sample: PriorSample,
    chunks: list[np.ndarray],
    todo: list[int],
    start_from: StartFrom,
    jobs: int,
) -> Iterator[tuple[int, Rows | None]]:
    """A chunk as it ends in each experiment, which is one task, and its rows as the last one ends; None before."""
    work = partial(_solve_numbered, case, site, observations, start_from)
    tasks = ((index, experiment, sample.take(chunks[index])) for index in todo for experiment in case.experiments)
    ended: dict[int, dict[str, Rows]] = {}
    for index, experiment, rows in as_finished(work, tasks, jobs):
        parts = ended.setdefault(index, {})
        parts[experiment] = rows
        if len(parts) < len(case.experiments):
            yield index, None
        else:
            yield index, _rows_of_chunk(case, observations, [parts[one] for one in case.experiments])
            del ended[index]


def _solve_numbered(
    case: Case,
    site: Site,
    observations: Observations,
    start_from: StartFrom,
    index: int,
    experiment: str,
    sample: PriorSample,
) -> tuple[int, str, Rows]:
    return index, experiment, solve_in_experiment(case, site, observations, start_from, experiment, sample)


def solve_chunk(
    case: Case, site: Site, observations: Observations, sample: PriorSample, start_from: StartFrom | None = None
) -> Rows:
    """The rows of the ensemble file for the members of a sample, in every experiment of the case.

    Parameters
    ----------
    sample : PriorSample
        Of the members.
    start_from : mapping, optional
        Where members come from by experiment; coarser cells if not given.

    Returns
    -------
    dict of ndarray (member, ...)
        By variable of the file, and as `fields` (member, experiment, quantity, x, y) what is kept of their flow.
    """
    solve = partial(solve_in_experiment, case, site, observations, start_from)
    return _rows_of_chunk(case, observations, [solve(experiment, sample) for experiment in case.experiments])


def solve_in_experiment(
    case: Case,
    site: Site,
    observations: Observations,
    start_from: StartFrom | None,
    experiment: str,
    sample: PriorSample,
) -> Rows:
    """The rows of the members of a sample in one experiment.

    Parameters
    ----------
    start_from : mapping or None
        Where members come from by experiment; coarser cells if None.
    sample : PriorSample
        Of the members.

    Returns
    -------
    dict of ndarray (member, ...)
        `prediction` (member, station of the experiment) [unit of each station], `section_flow` (member, section)
        [m3/s], `fields` (member, quantity, x, y), and the rest as it is stored.
    """
    began = time.perf_counter()
    problem = build_problem(case, site, experiment, sample.theta)
    solved = _solved_in(case, site, experiment, sample, problem, start_from)
    window, sections = window_of(case, site.grid), section_positions(observations)
    columns, station = window.columns if window else slice(0, 0), _stations_in(observations, experiment)
    members, fields = problem.members, (len(QUANTITIES), columns.stop - columns.start, site.grid.y.size)
    rows = {
        "prediction": np.empty((members, int(station.sum()))),
        "section_flow": np.empty((members, len(sections))),
        "mass_error": np.empty(members),
        "fields": np.empty((members, *fields), np.float32),
    }
    for first in range(0, members, READ_TOGETHER):
        few = slice(first, min(first + READ_TOGETHER, members))
        state = np.ascontiguousarray(solved.state[..., few])
        part = take(problem, np.arange(members)[few])
        readings = read_sensors(part, state, site.grid, observations.table[station], sections, columns)
        for name, values in rows.items():
            values[few] = getattr(readings, name)
    rows |= {"status": solved.status.astype(np.int8), "iterations": solved.iterations.astype(np.int32)}
    rows["reason"] = np.array([f"{experiment}: {reason}" if reason else "" for reason in solved.reason], object)
    return rows | {"seconds": np.full(members, (time.perf_counter() - began) / members)}


def _rows_of_chunk(case: Case, observations: Observations, parts: list[Rows]) -> Rows:
    """The rows of a chunk, of those of each experiment; a member that failed in one has no predictions."""
    rows = {
        "prediction": np.full((len(parts[0]["status"]), len(observations.table)), np.nan),
        "section_flow": np.stack([part["section_flow"] for part in parts], axis=1),
        "mass_error": np.max([part["mass_error"] for part in parts], axis=0),
        "status": np.max([part["status"] for part in parts], axis=0),
        "iterations": np.sum([part["iterations"] for part in parts], axis=0, dtype=np.int32),
        "seconds": np.sum([part["seconds"] for part in parts], axis=0),
        "fields": np.stack([part["fields"] for part in parts], axis=1),
    }
    reasons = zip(*(part["reason"] for part in parts), strict=True)
    rows["reason"] = np.array([" ".join(filter(None, each)) for each in reasons], object)
    for experiment, part in zip(case.experiments, parts, strict=True):
        rows["prediction"][:, _stations_in(observations, experiment)] = part["prediction"]
    for name in ("prediction", "fields"):
        rows[name][rows["status"] == FAILED] = np.nan
    return rows


def _stations_in(observations: Observations, experiment: str) -> np.ndarray:
    return np.asarray(observations.table["experiment"] == experiment)


def section_positions(observations: Observations) -> tuple[tuple[str, float], ...]:
    """Sections in which a velocity was measured.

    Returns
    -------
    tuple of (str, float)
        Name and mean x [m] of each.
    """
    velocity = observations.table[velocity_rows(observations.table)]
    return tuple((str(name), float(x)) for name, x in velocity.groupby("section", sort=False)["x"].mean().items())


def solve_flow(case: Case, theta: Mapping[str, float]) -> dict[str, FlowFields]:
    """Steady flow of one member at cell centres.

    Parameters
    ----------
    theta : mapping of float
        All parameters of the case [unit of each].

    Returns
    -------
    dict of FlowFields
        By experiment; one without a steady flow is left out.
    """
    site = build_site(case)
    sample = sample_of(case, {name: np.array([theta[name]]) for name in case.parameters})

    def fields_of(experiment: str) -> dict[str, FlowFields]:
        problem = build_problem(case, site, experiment, sample.theta)
        solved = _solved_in(case, site, experiment, sample, problem, None)
        return {} if solved.status[0] == FAILED else {experiment: flow_fields(problem, solved.state, site.grid)}

    found = in_threads(fields_of, [(experiment,) for experiment in case.experiments])
    return {experiment: fields for one in found for experiment, fields in one.items()}


def _solved_in(
    case: Case, site: Site, experiment: str, sample: PriorSample, problem: Problem, start_from: StartFrom | None
) -> SolvedMembers:
    """The members in one experiment, from a member they all come from, or from coarser cells, the coarsest first."""
    build, tolerance = partial(_problem_at, case, site, experiment), case.numerics.tolerance
    if start_from:
        return solve_members(problem, sample.points, build, tolerance, start_from[experiment], _fall_back(case))
    grids = [
        GridProblem(build_problem(*place, experiment, sample.theta), partial(_problem_at, *place, experiment))
        for place in ever_coarser(case, site)[:-1]
    ]
    return solve_nested([*grids, GridProblem(problem, build)], sample.points, tolerance, _fall_back(case))


def _fall_back(case: Case) -> FallBack:
    return fall_back(case.numerics.march_step, case.numerics.march_span)


def _problem_at(case: Case, site: Site, experiment: str, points: np.ndarray) -> Problem:
    return build_problem(case, site, experiment, parameters_at(case, points))
