"""The package's own engine: steady states by Newton and chord steps, with exact slopes and adjoints."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vegglue.arrays import Array
from vegglue.case.case_effects import stages_of
from vegglue.case.parameter_space import theta_at
from vegglue.engine.flow_problem import problem_at
from vegglue.engine.interface import Cause, CentreFlow, Engine, Model, Point, Wanted
from vegglue.engine.newton_fields import responses_by_adjoints
from vegglue.engine.newton_runs import predict_members
from vegglue.flow.chord import ChordSolution
from vegglue.flow.equations import faces, residual
from vegglue.flow.jacobian import Factors, factors
from vegglue.flow.newton import CLOSE
from vegglue.flow.problem import EMPTY, Problem, crop
from vegglue.flow.problem_setup import with_effects_of
from vegglue.flow.prolongation import on_grid
from vegglue.flow.reference_member import settled
from vegglue.flow.sensor import predictions_at_sensors
from vegglue.flow.tangent import CAUSE_LANES, tangents
from vegglue.flow.wet_band import chord_in_band, rows_inside, widen
from vegglue.parallel import in_threads

# Step of central differences in z [standard deviations of the prior], small against 1 and large against rounding.
DIFFERENCE_STEP = 1e-3
# Correction of a tangent, over its largest entry, that is the last to be made [-]: what is left then is far smaller. On
# open-b chi2, parameters and their intervals are the same to five digits as with 1e-3, for a third less work.
TANGENT_TOLERANCE = 1e-2
# Chord steps with the factors of another flow before new ones are made [-]. Of 422 flows of a run 406 got there in ten,
# most in three; factors cost as much as some ten steps.
BORROWED_STEPS = 10
# Members solved side by side from one point: on 9,600 cells 384 draws take 5.1 s with 32, 5.3 s with 24 and 6.2 s with
# 16; more need more memory. No result depends on it but in the last digits.
LANES_FROM_A_POINT = 32


@dataclass(frozen=True)
class SteadyFlow:
    """One experiment at a point: its state (nx, 3, wet rows, 1) in a band of all `rows`, factors of a Jacobian, slopes
    d state / dz_j (nx, 3, wet rows, p), and by how much at most the state has moved since those factors [m, m/s].
    """

    state: Array
    band: tuple[int, int]
    rows: int
    factors: Factors
    slopes: Array
    moved: float


def linearised(model: Model, z: Array, near: Point | None, wanted: Wanted) -> Point | None:
    """See `Engine.linearise`; experiments side by side, their slopes once all flows are known."""
    found = in_threads(_at_rest, [(model, experiment, z, near) for experiment in model.case.experiments])
    flows = [one for one in found if one is not None]
    if len(flows) < len(found):
        return None
    prediction, slope = np.full(len(model.station), np.nan), np.full((len(model.station), z.size), np.nan)
    for experiment, (_, values) in zip(model.case.experiments, flows, strict=True):
        prediction[model.rows[experiment]] = values
    if not wanted(prediction):
        return None
    tasks = [(model, experiment, z, flow) for experiment, (flow, _) in zip(model.case.experiments, flows, strict=True)]
    sloping = dict(zip(model.case.experiments, in_threads(_with_slopes, tasks), strict=True))
    for experiment, (_, slopes) in sloping.items():
        slope[model.rows[experiment]] = slopes
    if np.isnan(slope[np.isfinite(prediction)]).any():  # an effect of the user's gives no numbers beside this flow
        return None
    return Point(z, prediction, slope, {experiment: flow for experiment, (flow, _) in sloping.items()})


def predict_near(model: Model, point: Point, z: Array) -> Array:
    """Predictions (m, n) at z (m, p) around a point, with its factors; NaN rows where they do not lead there."""
    found = np.full((len(z), len(model.station)), np.nan)
    for first in range(0, len(z), LANES_FROM_A_POINT):
        part = slice(first, min(first + LANES_FROM_A_POINT, len(z)))
        found[part] = _few_near(model, point, z[part])
    return found


def _few_near(model: Model, point: Point, z: Array) -> Array:
    found = np.full((len(z), len(model.station)), np.nan)
    for experiment, flow in point.flows.items():
        rows = model.rows[experiment]
        problem = problem_at(model, experiment, z)
        start = flow.state + flow.slopes @ (z - point.z).T
        solution = chord_in_band(problem, start, flow.factors, flow.band, model.case.numerics.tolerance)
        found[:, rows] = _read(model, experiment, problem, solution.state, flow.band)
        found[~solution.converged] = np.nan
    return found


def responses_by_tangents(model: Model, point: Point, causes: Sequence[Cause]) -> Array:
    """See `Engine.responses`; one tangent for each cause, those that are solved together side by side with others."""
    found = np.zeros((len(model.station), len(causes)))
    tasks = []
    for experiment in point.flows:
        here = [j for j, cause in enumerate(causes) if not cause.experiments or experiment in cause.experiments]
        tasks += [(experiment, here[first : first + CAUSE_LANES]) for first in range(0, len(here), CAUSE_LANES)]
    work = partial(_responses_in, model, point)
    parts = in_threads(work, [(experiment, [causes[j] for j in some]) for experiment, some in tasks])
    for (experiment, some), part in zip(tasks, parts, strict=True):
        found[np.ix_(model.rows[experiment], np.array(some))] = part
    return found


def _responses_in(model: Model, point: Point, experiment: str, causes: Sequence[Cause]) -> Array:
    """Responses in one experiment, (stations of it, causes), to causes that act in it."""
    flow, theta, rows = point.flows[experiment], theta_at(model.case, point.z), model.rows[experiment]
    found = np.zeros((rows.size, len(causes)))
    whole = problem_at(model, experiment, point.z)
    base = crop(whole, *flow.band)
    without_cause = residual(base, flow.state)
    built, changes = [], np.zeros((*flow.state.shape[:3], len(causes)))
    moving = [lane for lane, cause in enumerate(causes) if stages_of(cause.case, cause.parameter) != {"sensor"}]
    for lane, cause in enumerate(causes):
        amplitude = cause.amplitude
        gain, value = amplitude.gain(amplitude.off + amplitude.small), np.array([amplitude.off + amplitude.small])
        problem = with_effects_of(cause.case, model.site, experiment, theta | {cause.parameter: value}, whole)
        if lane in moving:
            changes[..., lane] = ((residual(crop(problem, *flow.band), flow.state) - without_cause) / gain)[..., 0]
        built.append((problem, gain))
    changes[..., moving] = tangents(base, flow.state, flow.factors, changes[..., moving], TANGENT_TOLERANCE)
    for lane, (problem, gain) in enumerate(built):
        state = flow.state + gain * changes[..., lane : lane + 1]
        now = _read(model, experiment, problem, state, flow.band)[0]
        found[:, lane] = (now - point.prediction[rows]) / gain
    return found


def with_own_factors(model: Model, point: Point) -> Point:
    """See `Engine.by_itself`: with factors of a flow nearby answers to cells are off by some 5 %, with its own by
    0.5 %.
    """
    flows = dict(point.flows)
    for experiment, flow in point.flows.items():
        if flow.moved > 0.0:
            problem = crop(problem_at(model, experiment, point.z), *flow.band)
            flows[experiment] = replace(flow, factors=factors(problem, flow.state), moved=0.0)
    return replace(point, flows=flows)


def with_coarse_correction(point: Point, before: Point, after: Point) -> Point:
    """u + S dz + P (U_after - U_before - S_c dz): slopes of the point, and what they leave out on coarse cells.

    u, U: states of the point and on cells of twice the size; S, S_c: their slopes; P: prolongation. See
    `Engine.with_coarse_correction`. Source: coarse-grid correction of the full approximation scheme (Brandt 1977,
    doi:10.1090/S0025-5718-1977-0431719-X; not checked against it).
    """
    flows, step = dict(point.flows), _step_of_known(point.z, after.z)
    for experiment in point.flows.keys() & before.flows.keys() & after.flows.keys():
        flow, first, last = (one.flows[experiment] for one in (point, before, after))
        left = _whole(last) - _moved_along_slopes(first, step)
        fine = _moved_along_slopes(flow, step) + on_grid(left, (flow.state.shape[0], flow.rows))
        state = rows_inside(fine, flow.band)
        moved = flow.moved + float(np.abs(state - flow.state).max())
        flows[experiment] = replace(flow, state=state, moved=moved)
    return replace(point, z=after.z[: point.z.size], flows=flows)


def centre_flow(model: Model, point: Point, experiment: str) -> CentreFlow:
    """See `Engine.flow_at_centres`: velocities are the mean of those on both faces."""
    flow = point.flows[experiment]
    now = faces(problem_at(model, experiment, point.z), widen(flow.state, model.site.grid.y.size, flow.band))
    u = 0.5 * (now.u[1:] + now.u[:-1])[..., 0]
    v = 0.5 * (now.v[:, 1:] + now.v[:, :-1])[..., 0]
    return CentreFlow(now.cell[..., 0], u, v)


def _at_rest(model: Model, experiment: str, z: Array, near: Point | None) -> tuple[SteadyFlow, Array] | None:
    """The flow of one experiment without its slopes, and its predictions (stations of it,)."""
    problem = problem_at(model, experiment, z)
    found = _state_and_factors(model, experiment, problem, z, near)
    return None if found is None else (found, _read(model, experiment, problem, found.state, found.band)[0])


def _with_slopes(model: Model, experiment: str, z: Array, flow: SteadyFlow) -> tuple[SteadyFlow, Array]:
    """The flow with its slopes d state / dz, and those of its predictions (stations of the experiment, p)."""
    p, steps = z.size, DIFFERENCE_STEP * np.eye(z.size)
    ends = problem_at(model, experiment, np.concatenate([z + steps, z - steps]))  # ahead in each z, then behind
    rates = residual(crop(ends, *flow.band), np.repeat(flow.state, 2 * p, axis=3))
    causes = (rates[..., :p] - rates[..., p:]) / (2.0 * DIFFERENCE_STEP)
    base = crop(problem_at(model, experiment, z), *flow.band)
    if flow.moved >= CLOSE:  # made only now: of a flow that is not wanted none are
        flow = replace(flow, factors=factors(base, flow.state), moved=0.0)
    slopes = tangents(base, flow.state, flow.factors, causes, TANGENT_TOLERANCE)
    moved = DIFFERENCE_STEP * slopes
    states = np.concatenate([flow.state + moved, flow.state - moved], axis=3)
    read = _read(model, experiment, ends, states, flow.band)
    return replace(flow, slopes=slopes), (read[:p] - read[p:]).T / (2.0 * DIFFERENCE_STEP)


def _state_and_factors(
    model: Model, experiment: str, problem: Problem, z: Array, near: Point | None
) -> SteadyFlow | None:
    """The flow without its slopes: with the factors of a point nearby, else with its own."""
    tolerance, warm = model.case.numerics.tolerance, None
    before = None if near is None else near.flows.get(experiment)
    if near is not None and before is not None:
        warm = _warm(near, before, z, problem.shape)
        end = _borrowed(problem, before, warm, tolerance)
        if end is not None and end.converged[0]:
            moved = before.moved + float(np.abs(end.state - before.state).max())
            return replace(before, state=end.state, moved=moved)
        if end is not None and end.correction[0] < CLOSE:  # factors made here lead on, and are those of the flow itself
            warm = widen(end.state, before.rows, before.band)
    solution, own, band = settled(problem, warm, tolerance)
    return None if own is None else SteadyFlow(solution.state, band, problem.shape[1], own, EMPTY, 0.0)


def _borrowed(problem: Problem, before: SteadyFlow, warm: Array, tolerance: float) -> ChordSolution | None:
    """A few chord steps with factors of a flow nearby; None if that has other cells."""
    if before.state.shape[0] != problem.shape[0] or before.rows != problem.shape[1]:
        return None
    start = rows_inside(warm, before.band)
    return chord_in_band(problem, start, before.factors, before.band, tolerance, BORROWED_STEPS)


def _warm(near: Point, before: SteadyFlow, z: Array, shape: tuple[int, int]) -> Array:
    """A start (nx, 3, ny, 1) from a point nearby, along its slopes; from one on cells of twice the size if need be.

    Where an effect was added since, its amplitude is the last of z.
    """
    return on_grid(_moved_along_slopes(before, _step_of_known(near.z, z)), shape)


def _step_of_known(known: Array, z: Array) -> Array:
    """z - z_known, to take along slopes known at one point; none where an effect was taken away since."""
    return z[: known.size] - known if known.size <= z.size else np.zeros(0)


def _moved_along_slopes(flow: SteadyFlow, step: Array) -> Array:
    """State (nx, 3, ny, 1) of all rows after a step (q,) in the first q parameters."""
    return _whole(flow) + widen(flow.slopes[..., : step.size] @ step[:, None], flow.rows, flow.band)


def _whole(flow: SteadyFlow) -> Array:
    """Its state (nx, 3, ny, 1) with the rows beside its band."""
    return widen(flow.state, flow.rows, flow.band)


def _read(model: Model, experiment: str, problem: Problem, state: Array, band: tuple[int, int]) -> Array:
    """Predictions (m, stations of the experiment) of states in a band."""
    wide = widen(state, model.site.grid.y.size, band)
    return predictions_at_sensors(problem, wide, model.site.grid, model.station_of(experiment))


NEWTON = Engine(
    name="newton",
    linearise=linearised,
    predict=partial(predict_members, predict_near),
    responses=responses_by_tangents,
    responses_to_cells=responses_by_adjoints,
    flow_at_centres=centre_flow,
    by_itself=with_own_factors,
    with_coarse_correction=with_coarse_correction,
)
