"""The package's own engine: steady states by Newton and chord steps, with exact slopes and adjoints.

How predictions answer to a term of the equations changed in each cell follows from adjoints l_n:

    d prediction_n / d a_c = - l_n . dR/da_c,    J' l_n = d prediction_n / d state

A change in a cell reaches the residual of its neighbours only, so that every CELL_STRIDE-th cell along and across is
changed at once (Curtis, Powell and Reid 1974, doi:10.1093/imamat/13.1.117; not checked against it). Where a bed changes
how discharge is shared over all cells of an inflow, that part is added on its own, see `jacobian`:

    + (l_n . dR/d ln Q) d ln W/da_c
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from weakref import WeakKeyDictionary

import numpy as np
import pandas as pd
from scipy.special import ndtr, ndtri

from vegglue.arrays import Array, Single
from vegglue.case.case_effects import stages_of
from vegglue.case.channel_geometry import ChannelGeometry, channel_geometry, rows_of
from vegglue.case.grid import on_cells
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.parameter_space import theta_at
from vegglue.case.size_limits import WIDE_FROM
from vegglue.case.zones import ranges_without_cells
from vegglue.compilation import compiled
from vegglue.engine.interface import Cause, CentreFlow, Engine, Model, Point, StationsOfCells, Wanted, always
from vegglue.flow.batch import solve_members
from vegglue.flow.chord import ChordSolution
from vegglue.flow.equations import cell_depths, faces, residual
from vegglue.flow.jacobian import (
    Factors,
    answer_to_discharge,
    cells_of,
    changes_of_whole,
    factors,
    shared_inflows,
    with_kept_shares,
)
from vegglue.flow.local_changes import Term, with_changed_term
from vegglue.flow.march import fall_back, march_to_rest
from vegglue.flow.newton import CLOSE
from vegglue.flow.problem import EMPTY, Problem, crop, take
from vegglue.flow.problem_setup import build_problem, with_effects_of
from vegglue.flow.reference_member import LinearisedMember, settled
from vegglue.flow.sensor import predictions_at_sensors, predictions_under_effects, reading_weights
from vegglue.flow.starts import backwater, between_cells, on_grid
from vegglue.flow.status import FAILED
from vegglue.flow.tangent import CAUSE_SLOTS, adjoints, tangents
from vegglue.flow.wet_band import chord_in_band, rows_inside, wet_band, widen
from vegglue.parallel import in_threads, parallel_map

# Step of central differences in z [standard deviations of the prior], small against 1 and large against rounding.
DIFFERENCE_STEP = 1e-3
# Correction of a tangent, over its largest entry, that is the last to be made [-]: what is left then is far smaller. On
# open-b chi2, parameters and their intervals are the same to five digits as with 1e-3, for a third less work.
TANGENT_TOLERANCE = 1e-2
# Chord steps with the factors of another flow before new ones are made [-]. Of 422 flows of a run 406 converged in ten,
# most in three; factors cost as much as some ten steps.
REUSED_STEPS = 10
# Steps of chords from a point to the places of the prior around it [-]: of 24 flows of a plan 23 converge in 32.
MOST_STEPS_AROUND = 40
# Members solved side by side from one point: on 9,600 cells 384 draws take 5.1 s with 32, 5.3 s with 24 and 6.2 s with
# 16; more need more memory. No result depends on it but in the last digits.
SLOTS_FROM_A_POINT = 32
# Points solved together: as many as fit the batch slots of chord steps from one point.
RUNS_TOGETHER = 32
# Cells from one changed cell to the next [-]: a change reaches the residual of two neighbours on either side.
CELL_STRIDE = 5
# Stations whose adjoints are made together [-]. On 342 x 40 cells 1,000 stations take 1.6 s of a core with 128, 1.7 s
# with 64 or 32, and 2.6 s all at once, when each holds some 50 bytes in every cell.
STATIONS_TOGETHER = 128
# Stations times cells on a wide grid whose adjoints are made together [-]: they then take 0.05 GB for each core.
STATIONS_AND_CELLS = 1e6
# Largest correction [m, m/s] of flows on coarser cells, which are off by more than that: chosen.
ROUGH = 1e-3
# Small changes for differences, in the unit of each term: thousandths of what is common, and large against rounding.
SMALL_CHANGE: dict[Term, float] = {
    "friction": 1e-3, "drag": 1e-5, "bed": 1e-4, "inflow": 1e-6, "viscosity": 1e-4, "mixing": 1e-2,
    "advection": 1e-3,
}  # fmt: skip
# Rows from which a flow without a start begins on half as many cells each way [-]. Chosen: with 25 rows Newton from
# there takes half of its time from a backwater curve, and with fewer both take little.
COARSER_FROM = 16
# Stages of effects that move a flow and nothing else that a reading without effects on instruments depends on.
UNSEEN_BY_SENSORS = {"plants", "resistance", "exchange", "force"}
# Sites on half as many cells each way, by the site on its own.
_ON_COARSER_CELLS: WeakKeyDictionary[Site, Site | None] = WeakKeyDictionary()


@dataclass(frozen=True)
class SteadyFlow:
    """One experiment at a point.

    Parameters
    ----------
    state, band, rows
        State (nx, 3, wet rows, 1) in a band of all `rows`.
    factors
        Of a Jacobian at a state nearby.
    slopes
        d state / dz_j (nx, 3, wet rows, p).
    moved
        By how much at most the state has moved since those factors [m, m/s].
    """

    state: Array
    band: tuple[int, int]
    rows: int
    factors: Factors
    slopes: Array
    moved: float

    def after(self, step: Array) -> Array:
        """The state (nx, 3, rows, 1) of all rows after a step (q,) in the first q parameters, along its slopes."""
        whole = widen(self.state, self.rows, self.band)
        return whole + widen(self.slopes[..., : step.size] @ step[:, None], self.rows, self.band)


def problem_at(model: Model, experiment: str, z: Array) -> Problem:
    """The flow problem of one experiment at z.

    Parameters
    ----------
    z : (p,) or (m, p) [standard deviations of the prior]
    """
    return build_problem(model.case, model.site, experiment, theta_at(model.case, z))


def _read_stations(model: Model, experiment: str, problem: Problem, state: Array, band: tuple[int, int]) -> Array:
    """Predictions (m, stations of the experiment) of states in a band."""
    wide = widen(state, model.site.grid.y.size, band)
    return predictions_at_sensors(problem, wide, model.site.grid, model.stations[experiment])


def linearised(model: Model, z: Array, near: Point | None, wanted: Wanted) -> Point | None:
    """f(z) and df/dz, see `Engine.linearise`; experiments side by side, their slopes once all flows are known."""
    experiments = list(model.case.experiments)
    found = in_threads(_steady, [(model, experiment, z, near) for experiment in experiments])
    flows = {experiment: one for experiment, one in zip(experiments, found, strict=True) if one is not None}
    return None if len(flows) < len(found) else _point(model, z, flows, wanted)


def linearised_around(model: Model, z: Array, near: Point) -> list[Point | None]:
    """See `Engine.linearise_around`: chord steps of all (m, p) with the factors of the point, and each by itself where
    these do not lead there.
    """
    flows = {experiment: near.flows[experiment] for experiment in model.case.experiments}

    def solve(experiment: str, flow: SteadyFlow) -> tuple[Problem, ChordSolution]:
        problem, start = problem_at(model, experiment, z), flow.state + flow.slopes @ (z - near.z).T
        tolerance = model.case.numerics.tolerance
        return problem, chord_in_band(problem, start, flow.factors, flow.band, tolerance, MOST_STEPS_AROUND)

    ends = in_threads(solve, list(flows.items()))

    def point(k: int) -> Point | None:
        if not all(end.converged[k] for _, end in ends):
            return linearised(model, z[k], near, always) or linearised(model, z[k], None, always)
        found = {}
        for (experiment, flow), (problem, end) in zip(flows.items(), ends, strict=True):
            state = np.ascontiguousarray(end.state[..., [k]])
            moved = flow.moved + float(np.abs(state - flow.state).max())
            there = replace(flow, state=state, moved=moved)
            read = _read_stations(model, experiment, take(problem, np.array([k])), state, flow.band)
            found[experiment] = there, read[0]
        return _point(model, z[k], found, always)

    return in_threads(point, [(k,) for k in range(len(z))])


def _point(model: Model, z: Array, flows: Mapping[str, tuple[SteadyFlow, Array]], wanted: Wanted) -> Point | None:
    """Flows and their predictions as a point with slopes; None if these are not wanted, or are no numbers."""
    prediction, slope = np.full(len(model.station), np.nan), np.full((len(model.station), z.size), np.nan)
    for experiment, (_, values) in flows.items():
        prediction[model.rows[experiment]] = values
    if not wanted(prediction):
        return None
    p, steps = z.size, DIFFERENCE_STEP * np.eye(z.size)

    def with_slopes(experiment: str, flow: SteadyFlow) -> tuple[SteadyFlow, Array]:
        """The flow with its slopes d state / dz, and those of its predictions (stations of the experiment, p)."""
        ends = problem_at(model, experiment, np.concatenate([z + steps, z - steps]))  # ahead in each z, then behind
        rates = residual(crop(ends, *flow.band), np.repeat(flow.state, 2 * p, axis=3))
        causes = (rates[..., :p] - rates[..., p:]) / (2.0 * DIFFERENCE_STEP)
        base = crop(problem_at(model, experiment, z), *flow.band)
        if flow.moved >= CLOSE:  # made only now: of a flow that is not wanted none are
            flow = replace(flow, factors=factors(base, flow.state), moved=0.0)
        slopes = tangents(base, flow.state, flow.factors, causes, TANGENT_TOLERANCE)
        moved = DIFFERENCE_STEP * slopes
        states = np.concatenate([flow.state + moved, flow.state - moved], axis=3)
        read = _read_stations(model, experiment, ends, states, flow.band)
        return replace(flow, slopes=slopes), (read[:p] - read[p:]).T / (2.0 * DIFFERENCE_STEP)

    tasks = [(experiment, flow) for experiment, (flow, _) in flows.items()]
    sloping = dict(zip(flows, in_threads(with_slopes, tasks), strict=True))
    for experiment, (_, slopes) in sloping.items():
        slope[model.rows[experiment]] = slopes
    if np.isnan(slope[np.isfinite(prediction)]).any():  # an effect of a user's file gives no numbers beside this flow
        return None
    return Point(z, prediction, slope, {experiment: flow for experiment, (flow, _) in sloping.items()})


def _steady(model: Model, experiment: str, z: Array, near: Point | None) -> tuple[SteadyFlow, Array] | None:
    """The flow of one experiment without its slopes, with the factors of a point nearby, else with its own, and its
    predictions (stations of it,); None if no start leads to one.
    """
    problem, tolerance, warm, flow = problem_at(model, experiment, z), model.case.numerics.tolerance, None, None
    hopeful = False  # whether the start is better than one from coarser cells at z
    before = None if near is None else near.flows.get(experiment)
    if near is not None and before is not None:
        # Along its slopes; from a point on cells of twice the size if need be.
        warm = on_grid(before.after(_step_of_known(near.z, z)), problem.shape)
        if before.state.shape[0] == problem.shape[0] and before.rows == problem.shape[1]:
            start = rows_inside(warm, before.band)
            end = chord_in_band(problem, start, before.factors, before.band, tolerance, REUSED_STEPS)
            if end.converged[0]:
                moved = before.moved + float(np.abs(end.state - before.state).max())
                flow = replace(before, state=end.state, moved=moved)
            elif end.correction[0] < CLOSE:  # factors made here lead on, and are those of the flow itself
                warm, hopeful = widen(end.state, before.rows, before.band), True
        else:
            hopeful = True
    if flow is None:
        starts = [warm] if hopeful else [_from_coarser_cells(model, experiment, z, problem), warm]
        tried = [one for one in starts if one is not None]
        # A fit that finds no flow tries another place; where one begins, the flow is worth a cold start, and a march.
        begins = before is None or before.state.shape[0] != problem.shape[0] or before.rows != problem.shape[1]
        for beginning in [*tried, None] if begins else tried:
            found = settled(problem, beginning, tolerance)
            if found.factors is not None:
                flow = SteadyFlow(found.solution.state, found.band, problem.shape[1], found.factors, EMPTY, found.moved)
                break
        else:
            if not begins:
                return None
            numerics = model.case.numerics
            how = fall_back(numerics.march_step, numerics.march_span)
            marched = march_to_rest(problem, backwater(problem), tolerance, how)
            if not marched.steady:
                return None
            band = wet_band(problem, marched.state)
            state = rows_inside(marched.state, band)
            flow = SteadyFlow(state, band, problem.shape[1], factors(crop(problem, *band), state), EMPTY, 0.0)
    return flow, _read_stations(model, experiment, problem, flow.state, flow.band)[0]


def _from_coarser_cells(model: Model, experiment: str, z: Array, problem: Problem) -> Array | None:
    """A start (nx, 3, ny, 1): the flow on cells of about twice the size, and so on to less than COARSER_FROM rows that
    may be wet; None if there are no more to begin with, or no flow is found there.
    """
    south, north = wet_band(problem, backwater(problem))
    coarse = on_half_as_many_cells(model) if north - south >= COARSER_FROM else None
    if coarse is None:
        return None
    there = problem_at(coarse, experiment, z)
    found = settled(there, _from_coarser_cells(coarse, experiment, z, there), ROUGH)
    if found.factors is None:
        return None
    return between_cells(widen(found.solution.state, there.shape[1], found.band), problem.shape)


def on_half_as_many_cells(model: Model) -> Model | None:
    """A model on half as many cells along and across, to whole numbers.

    Returns
    -------
    Model or None
        None if the grid has less than COARSER_FROM rows, or an inflow or the outlet has none of these cells.
    """
    (nx, ny), of = model.site.bed.shape, model.case.grid
    if ny < COARSER_FROM:
        return None
    case = on_cells(model.case, (float(np.ptp(of.x)) / (nx // 2), float(np.ptp(of.y)) / (ny // 2)))
    if model.site not in _ON_COARSER_CELLS:
        site = build_site(case)
        _ON_COARSER_CELLS[model.site] = None if any(ranges_without_cells(case, site.grid)) else site
    found = _ON_COARSER_CELLS[model.site]
    return None if found is None else replace(model, case=case, site=found)


def _step_of_known(known: Array, z: Array) -> Array:
    """z - z_known, to take along slopes known at one point; none if an effect was taken away since. An effect that was
    added since has the last of z.
    """
    return z[: known.size] - known if known.size <= z.size else np.zeros(0)


def predict_members(model: Model, points: Sequence[Point], z: Array) -> Array:
    """f(z) of many members, see `Engine.predict`: from the nearest point, and on their own where that fails.

    Sets of members that are as far from their point are solved together, the same whatever the number of cores.
    """
    away = np.stack([np.linalg.norm(z[:, : point.z.size] - point.z, axis=1) for point in points])
    nearest, sets = away.argmin(axis=0), []
    for k in range(len(points)):
        index = np.flatnonzero(nearest == k)[np.argsort(away[k, nearest == k], kind="stable")]
        sets += [(k, index[first : first + RUNS_TOGETHER]) for first in range(0, index.size, RUNS_TOGETHER)]
    found = np.full((len(z), len(model.station)), np.nan)
    tasks = [(points[k], z[part]) for k, part in sets]
    for (_, part), prediction in zip(sets, parallel_map(partial(predict_near, model), tasks), strict=True):
        found[part] = prediction
    lost = [
        (points[k], experiment, members)
        for k in range(len(points)) for experiment in model.case.experiments
        if (members := np.flatnonzero((nearest == k) & np.isnan(found[:, model.rows[experiment]]).any(axis=1))).size
    ]  # fmt: skip
    alone = [(point, experiment, z[members]) for point, experiment, members in lost]
    readings = parallel_map(partial(_predict_alone, model), alone)
    for (_, experiment, members), of_them in zip(lost, readings, strict=True):
        found[np.ix_(members, model.rows[experiment])] = of_them
    found[np.isnan(found).any(axis=1)] = np.nan
    return found


def predict_near(model: Model, point: Point, z: Array) -> Array:
    """f(z) around a point, with its factors; NaN in experiments where they do not lead there.

    Parameters
    ----------
    z : (m, p) [standard deviations of the prior]

    Returns
    -------
    (m, n)
    """
    found = np.full((len(z), len(model.station)), np.nan)
    for first in range(0, len(z), SLOTS_FROM_A_POINT):
        some = slice(first, min(first + SLOTS_FROM_A_POINT, len(z)))
        part = found[some]
        for experiment, flow in point.flows.items():
            problem = problem_at(model, experiment, z[some])
            start = flow.state + flow.slopes @ (z[some, : point.z.size] - point.z).T
            solution = chord_in_band(problem, start, flow.factors, flow.band, model.case.numerics.tolerance)
            read = _read_stations(model, experiment, problem, solution.state, flow.band)
            part[:, model.rows[experiment]] = np.where(solution.converged[:, None], read, np.nan)
    return found


def _predict_alone(model: Model, near: Point, experiment: str, z: Array) -> Array:
    """Predictions (m, stations of the experiment) of members that are solved as those of an ensemble, from a point."""
    numerics, flow, start = model.case.numerics, near.flows.get(experiment), None
    if flow is not None:
        further = z.shape[1] - near.z.size  # effects added since, which move nothing to first order
        density = np.exp(-0.5 * near.z**2) / np.sqrt(2.0 * np.pi)  # dP/dz
        slopes = widen(flow.slopes / density, flow.rows, flow.band)
        tangents = [np.ascontiguousarray(slopes[..., [p]]) for p in range(near.z.size)]
        state = widen(flow.state, flow.rows, flow.band)
        there = ndtr(np.concatenate([near.z, z[0, near.z.size :]]))
        start = LinearisedMember(there, state, (*tangents, *further * (np.zeros_like(state),)))

    def problem_of(points: Array) -> Problem:
        return problem_at(model, experiment, ndtri(points))

    problem, how = problem_at(model, experiment, z), fall_back(numerics.march_step, numerics.march_span)
    solved = solve_members(problem, ndtr(z), problem_of, numerics.tolerance, start, how)
    state = np.ascontiguousarray(solved.state)
    prediction = predictions_at_sensors(problem, state, model.site.grid, model.stations[experiment])
    prediction[solved.status == FAILED] = np.nan
    return prediction


def responses_by_tangents(model: Model, points: Sequence[Point], causes: Sequence[Cause]) -> Array:
    """df/dg of each cause, see `Engine.responses`: tangents, those of one experiment side by side."""
    found, tasks = np.zeros((len(points), len(model.station), len(causes))), []
    for experiment in points[0].flows:
        here = [j for j, cause in enumerate(causes) if not cause.experiments or experiment in cause.experiments]
        bands = [one.flows[experiment].band for one in points]
        for band in dict.fromkeys(bands):
            alike = [k for k, one in enumerate(bands) if one == band]
            tasks += [(experiment, alike, here[j : j + CAUSE_SLOTS]) for j in range(0, len(here), CAUSE_SLOTS)]
    parts = in_threads(
        partial(_responses_in, model),
        [([points[k] for k in alike], experiment, [causes[j] for j in some]) for experiment, alike, some in tasks],
    )
    for (experiment, alike, some), part in zip(tasks, parts, strict=True):
        found[np.ix_(np.array(alike), model.rows[experiment], np.array(some))] = part
    return found


def _responses_in(model: Model, points: Sequence[Point], experiment: str, causes: Sequence[Cause]) -> Array:
    """Responses in one experiment, (points, stations of it, causes), at points of one band to causes that act in it."""
    flows, rows, count = [one.flows[experiment] for one in points], model.rows[experiment], len(points)
    z, band, members = np.array([one.z for one in points]), flows[0].band, np.arange(len(points))
    theta, whole = theta_at(model.case, z), problem_at(model, experiment, z)
    base, state = crop(whole, *band), np.concatenate([one.state for one in flows], axis=3)
    without_cause = residual(base, state)
    built, changes = [], np.zeros((*state.shape[:3], count, len(causes)))
    stages = [stages_of(cause.case, cause.parameter) for cause in causes]
    moving = [column for column, some in enumerate(stages) if some != {"sensor"}]
    for column, cause in enumerate(causes):
        amplitude = cause.amplitude
        value = amplitude.off + amplitude.small
        gain, values = amplitude.gain(value), np.full(count, value)
        problem = with_effects_of(cause.case, model.site, experiment, theta | {cause.parameter: values}, whole)
        if column in moving:
            changes[..., column] = (residual(crop(problem, *band), state) - without_cause) / gain
        built.append((problem, gain))
    gains = np.array([gain for _, gain in built])
    if moving:
        for k, flow in enumerate(flows):
            own = take(base, members[[k]])
            changes[..., k, moving] = tangents(
                own, flow.state, flow.factors, changes[..., k, moving], TANGENT_TOLERANCE
            )
    untouched = not any(active.effect.stage == "sensor" for active in whole.effects)
    alike = [column for column in moving if untouched and stages[column] <= UNSEEN_BY_SENSORS]  # read at once
    states, now = state[..., None] + gains * changes, np.empty((count, len(causes), rows.size))
    if alike:
        each = take(whole, np.repeat(members, len(alike)))
        read = _read_stations(model, experiment, each, states[..., alike].reshape(*state.shape[:3], -1), band)
        now[:, alike] = read.reshape(count, len(alike), rows.size)
    for column in set(moving) - set(alike):
        there = np.ascontiguousarray(states[..., column])
        now[:, column] = _read_stations(model, experiment, built[column][0], there, band)
    if at_rest := [column for column in range(len(causes)) if column not in moving]:
        wide, of_each = widen(state, flows[0].rows, band), [built[column][0].effects for column in at_rest]
        now[:, at_rest] = predictions_under_effects(whole, wide, model.site.grid, model.stations[experiment], of_each)
    before = np.array([one.prediction[rows] for one in points])
    return np.asarray(((now - before[:, None]) / gains[:, None]).swapaxes(1, 2))


def responses_by_adjoints(model: Model, point: Point, experiment: str, terms: Sequence[Term]) -> StationsOfCells:
    """df/da_c of each cell, see `Engine.responses_to_cells`; in single precision, one solve for each station."""
    flow, grid, station = point.flows[experiment], model.site.grid, model.stations[experiment]
    problem = problem_at(model, experiment, point.z[None])
    state, rows = widen(flow.state, flow.rows, flow.band), slice(*flow.band)
    part = crop(problem, *flow.band)
    geometry = rows_of(channel_geometry(model.case, model.site, experiment), *flow.band)
    changes = {term: _cell_changes(part, flow.state, geometry, term) for term in terms}
    inflows = shared_inflows(part)
    discharges = [answer_to_discharge(part, flow.state, inflow).astype(np.float32) for inflow in inflows]
    together, cells = STATIONS_TOGETHER, part.shape[0] * part.shape[1]
    if part.shape[1] >= WIDE_FROM:
        together = int(np.clip(STATIONS_AND_CELLS / cells, 8, STATIONS_TOGETHER))

    def responses_of(some: pd.DataFrame) -> dict[Term, Single]:
        sensitivity = adjoints(part, flow.state, flow.factors, reading_weights(problem, state, grid, some, rows))
        of_discharges = [np.einsum("ikjn,ikj->n", sensitivity, discharge) for discharge in discharges]
        nx, _, ny, n = sensitivity.shape
        found = {term: np.zeros((n, nx, grid.y.size), np.float32) for term in terms}
        for term, (local, of_wholes) in changes.items():
            windows = np.zeros((nx, ny, n), dtype=np.float32)
            sum_windows(sensitivity, local, windows)
            answers = found[term][:, :, rows]
            answers[...] = np.moveaxis(windows, -1, 0)
            for inflow, of_discharge, of_whole in zip(inflows, of_discharges, of_wholes, strict=True):
                column, row = cells_of(part, inflow)
                answers[:, column, row] += np.outer(of_discharge, of_whole)
        return found

    for first in range(0, len(station), together):
        some = slice(first, first + together)
        yield model.rows[experiment][some], responses_of(station.iloc[some])


def _cell_changes(part: Problem, state: Array, geometry: ChannelGeometry, term: Term) -> tuple[Single, list[Array]]:
    """A term changed in each cell: dR/da at unchanged shares of the inflows, in every CELL_STRIDE-th cell both ways at
    once (nx, 3, ny, CELL_STRIDE^2), and d ln W/da of each inflow that shares by depth, (cell,) each.
    """
    (nx, ny), small, inflows = part.shape, SMALL_CHANGE[term], shared_inflows(part)
    base, before, states = residual(part, state), cell_depths(part, state), np.repeat(state, CELL_STRIDE, axis=3)
    found = np.empty((nx, 3, ny, CELL_STRIDE**2), np.float32)
    of_wholes = [np.zeros(cells_of(part, inflow)[0].size) for inflow in inflows]
    i, j = np.arange(nx)[:, None, None] % CELL_STRIDE, np.arange(ny)[None, :, None] % CELL_STRIDE
    for column in range(CELL_STRIDE):  # some members at a time, in a fifth of the memory
        lattice = ((i == column) & (j == np.arange(CELL_STRIDE))).astype(float)
        many = with_changed_term(part, geometry, term, small * lattice)
        after = cell_depths(many, states)
        rates = residual(with_kept_shares(many, before, after), states)
        found[..., column * CELL_STRIDE : (column + 1) * CELL_STRIDE] = (rates - base) / small
        # The depth of a cell changes in the one member only in which the cell itself is changed.
        for of_whole, inflow in zip(of_wholes, inflows, strict=True):
            of_whole += changes_of_whole(part, inflow, before, after).sum(axis=1) / small
    return found, of_wholes


@compiled
def sum_windows(sensitivity: Single, change: Single, found: Single) -> None:
    """-l . dR of every cell (nx, ny, n), summed over the window of CELL_STRIDE cells around it, into found.

    sensitivity l (nx, 3, ny, n), change dR (nx, 3, ny, CELL_STRIDE^2).
    """
    nx, equations, ny, n = sensitivity.shape
    half = CELL_STRIDE // 2
    for i in range(nx):
        first, last = max(i - half, 0), min(i + half + 1, nx)
        for j in range(ny):
            member = (i % CELL_STRIDE) * CELL_STRIDE + j % CELL_STRIDE
            lowest, highest = max(j - half, 0), min(j + half + 1, ny)
            for a in range(first, last):
                for b in range(lowest, highest):
                    for k in range(equations):
                        weight = change[a, k, b, member]
                        if weight != 0.0:
                            for station in range(n):
                                found[i, j, station] -= sensitivity[a, k, b, station] * weight


def with_own_factors(model: Model, point: Point) -> Point:
    """See `Engine.relinearised`: with factors of a flow nearby responses to cells are off by some 5 %, with its own by
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

    u, U: states of the point and on cells of twice the size; S, S_c: their slopes; P: prolongation.

    Parameters
    ----------
    point, before, after
        See `Engine.with_coarse_correction`.

    References
    ----------
    Coarse-grid correction of the full approximation scheme: Brandt (1977), doi:10.1090/S0025-5718-1977-0431719-X; not
    checked against it.
    """
    flows, step = dict(point.flows), _step_of_known(point.z, after.z)
    for experiment in point.flows.keys() & before.flows.keys() & after.flows.keys():
        flow, first, last = (one.flows[experiment] for one in (point, before, after))
        left = widen(last.state, last.rows, last.band) - first.after(step)
        fine = flow.after(step) + on_grid(left, (flow.state.shape[0], flow.rows))
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


NEWTON = Engine(
    name="newton",
    linearise=linearised,
    linearise_around=linearised_around,
    predict=predict_members,
    responses=responses_by_tangents,
    responses_to_cells=responses_by_adjoints,
    flow_at_centres=centre_flow,
    relinearised=with_own_factors,
    with_coarse_correction=with_coarse_correction,
)
