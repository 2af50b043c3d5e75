"""One chunk of an ensemble: its members solved in one experiment after the other, and what is read of their flows."""

import time
from collections.abc import Mapping
from functools import partial

import numpy as np

from vegglue.case.gridded_site import Site, build_site
from vegglue.case.parameter_space import PriorSample, parameters_at, sample_of
from vegglue.case.schema import Case
from vegglue.engine.model import ever_coarser
from vegglue.flow.batch import SolvedMembers, solve_members
from vegglue.flow.march import FallBack, fall_back
from vegglue.flow.nested_grids import GridProblem, solve_nested
from vegglue.flow.problem import Problem, take
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.reference_member import LinearisedMember, linearised_median
from vegglue.flow.sensor import FlowFields, flow_fields, read_sensors
from vegglue.flow.status import FAILED
from vegglue.measurements.kinds import velocity_rows
from vegglue.measurements.observations import Observations
from vegglue.parallel import in_threads
from vegglue.results.fields import QUANTITIES, FieldWindow, window_of

# Members read by the sensors at once [-], so that their fields stay small. No number hangs on it.
READ_TOGETHER = 16
Rows = dict[str, np.ndarray]
StartFrom = Mapping[str, LinearisedMember | None]


def linearised_medians(case: Case, site: Site) -> StartFrom:
    """Of every experiment, the member at the medians of all priors; None where it had to be marched."""
    parameters, tolerance = len(case.parameters), case.numerics.tolerance

    def median_in(experiment: str) -> LinearisedMember | None:
        return linearised_median(partial(_problem_at, case, site, experiment), parameters, tolerance, _fall_back(case))

    found = in_threads(median_in, [(experiment,) for experiment in case.experiments])
    return dict(zip(case.experiments, found, strict=True))


def solve_chunk(
    case: Case, site: Site, observations: Observations, sample: PriorSample, start_from: StartFrom | None = None
) -> Rows:
    """The rows of the ensemble file for the members of a sample, every experiment of the case, and as `fields`
    (member, experiment, quantity, x, y) what is kept of their flow. start_from: where members come from, coarser cells
    if not given.
    """
    solve = partial(solve_in_experiment, case, site, observations, start_from)
    return rows_of_chunk(case, observations, [solve(experiment, sample) for experiment in case.experiments])


def solve_in_experiment(
    case: Case,
    site: Site,
    observations: Observations,
    start_from: StartFrom | None,
    experiment: str,
    sample: PriorSample,
) -> Rows:
    """What `rows_of_chunk` takes of one experiment: predictions (member, station of the experiment), section flows
    (member, section), fields (member, quantity, x, y), and the rest as it is stored.
    """
    began = time.perf_counter()
    problem = build_problem(case, site, experiment, sample.theta)
    solved = _solved_in(case, site, experiment, sample, problem, start_from)
    rows = _readings(case, site, observations, experiment, problem, solved)
    rows |= {"status": solved.status.astype(np.int8), "iterations": solved.iterations.astype(np.int32)}
    rows["reason"] = np.array([f"{experiment}: {reason}" if reason else "" for reason in solved.reason], object)
    spent = time.perf_counter() - began
    return rows | {"seconds": np.full(problem.members, spent / problem.members)}


def rows_of_chunk(case: Case, observations: Observations, parts: list[Rows]) -> Rows:
    """The rows of a chunk, of those of each experiment in the order of the case; a member that failed in one has no
    predictions.
    """
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
        rows["prediction"][:, _stations_of(observations, experiment)] = part["prediction"]
    for name in ("prediction", "fields"):
        rows[name][rows["status"] == FAILED] = np.nan
    return rows


def _stations_of(observations: Observations, experiment: str) -> np.ndarray:
    return np.asarray(observations.table["experiment"] == experiment)


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


def _readings(
    case: Case, site: Site, observations: Observations, experiment: str, problem: Problem, solved: SolvedMembers
) -> Rows:
    """What sensors and sections read of the members in one experiment."""
    sections, columns = section_positions(observations), kept_columns(window_of(case, site.grid))
    station = observations.table[_stations_of(observations, experiment)]
    members, fields = problem.members, (len(QUANTITIES), columns.stop - columns.start, site.grid.y.size)
    rows = {
        "prediction": np.empty((members, len(station))),
        "section_flow": np.empty((members, len(sections))),
        "mass_error": np.empty(members),
        "fields": np.empty((members, *fields), np.float32),
    }
    for first in range(0, members, READ_TOGETHER):
        few = slice(first, min(first + READ_TOGETHER, members))
        state = np.ascontiguousarray(solved.state[..., few])
        part = take(problem, np.arange(members)[few])
        readings = read_sensors(part, state, site.grid, station, sections, columns)
        for name, values in rows.items():
            values[few] = getattr(readings, name)
    return rows


def kept_columns(window: FieldWindow | None) -> slice:
    return window.columns if window else slice(0, 0)


def section_positions(observations: Observations) -> tuple[tuple[str, float], ...]:
    """Name and mean x [m] of every section a velocity was measured in."""
    velocity = observations.table[velocity_rows(observations.table)]
    return tuple((str(name), float(x)) for name, x in velocity.groupby("section", sort=False)["x"].mean().items())


def solve_flow(case: Case, theta: Mapping[str, float]) -> dict[str, FlowFields]:
    """Steady fields of one member at cell centres, by experiment; an experiment that finds none is left out."""
    site = build_site(case)
    sample = sample_of(case, {name: np.array([theta[name]]) for name in case.parameters})

    def fields_of(experiment: str) -> dict[str, FlowFields]:
        problem = build_problem(case, site, experiment, sample.theta)
        solved = _solved_in(case, site, experiment, sample, problem, None)
        return {} if solved.status[0] == FAILED else {experiment: flow_fields(problem, solved.state, site.grid)}

    found = in_threads(fields_of, [(experiment,) for experiment in case.experiments])
    return {experiment: fields for one in found for experiment, fields in one.items()}


def _fall_back(case: Case) -> FallBack:
    return fall_back(case.numerics.march_step, case.numerics.march_span)


def _problem_at(case: Case, site: Site, experiment: str, points: np.ndarray) -> Problem:
    return build_problem(case, site, experiment, parameters_at(case, points))
