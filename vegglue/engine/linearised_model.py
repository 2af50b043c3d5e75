"""A model and its exact derivatives at one place of the prior: what diagnosis, refinement and design stand on.

Places are z = Phi^-1(F(theta)), in which every prior is a standard normal: the misfit of a prior is |z|^2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.parameter_space import theta_at
from vegglue.case.schema import Case
from vegglue.effects.definition import Amplitude
from vegglue.flow.equations import residual
from vegglue.flow.problem import ACROSS, ALONG, Problem, crop
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import read_sensors, reading_weights
from vegglue.measurements.observations import Observations
from vegglue.parallel import in_threads
from vegglue.site.gridded_site import Site, build_site
from vegglue.solver.jacobian import Factors
from vegglue.solver.reference_member import settled
from vegglue.solver.tangent import adjoints, tangents
from vegglue.solver.wet_band import chord_in_band, widen

# Step of differences in z, small against the prior and large against rounding.
DIFFERENCE_STEP = 1e-3
# Relative exactness of tangents.
EXACT = 1e-5


@dataclass(frozen=True)
class Model:
    """A case on its grid, read at stations: a function from z (p,) to predictions (n,)."""

    case: Case
    site: Site
    station: pd.DataFrame

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.case.parameters)

    @cached_property
    def rows(self) -> dict[str, np.ndarray]:
        """Which stations stand in each experiment."""
        names = self.station["experiment"].to_numpy()
        return {experiment: np.flatnonzero(names == experiment) for experiment in self.case.experiments}


@dataclass(frozen=True)
class Flowing:
    """One experiment at a place: its state (nx, 3, wet rows, 1) in a band of all `rows`, factors, and slopes
    d state / dz_j (nx, 3, wet rows, p).
    """

    state: Array
    band: tuple[int, int]
    rows: int
    factors: Factors
    slopes: Array


@dataclass(frozen=True)
class Point:
    """The model at z (p,): predictions (n,), slopes d prediction / dz (n, p), and the flow of each experiment."""

    z: Array
    prediction: Array
    slope: Array
    flows: dict[str, Flowing]


def model_of(case: Case, observations: Observations) -> Model:
    return Model(case, build_site(case), observations.table)


def linearise(model: Model, z: Array, near: Point | None = None) -> Point | None:
    """The model and its slopes at z; None when a flow finds no rest. near: a point to start from."""
    prediction, slope = np.full(len(model.station), np.nan), np.full((len(model.station), z.size), np.nan)
    flows = {}
    tasks = [(model, experiment, z, near) for experiment in model.case.experiments]
    for experiment, flow in zip(model.case.experiments, in_threads(_flow, tasks, -1), strict=True):
        if flow is None:
            return None
        flows[experiment] = flow
        rows = model.rows[experiment]
        prediction[rows], slope[rows] = _read_slopes(model, experiment, z, flow)
    return Point(z, prediction, slope, flows)


def predict_near(model: Model, point: Point, z: Array, lanes: int = 16) -> Array:
    """Predictions (m, n) at places z (m, p) around a point, with its factors; NaN rows where they do not lead there."""
    found = np.full((len(z), len(model.station)), np.nan)
    for first in range(0, len(z), lanes):
        part = slice(first, min(first + lanes, len(z)))
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


def fingerprint(model: Model, point: Point, changed: Sequence[tuple[Case, str, Amplitude]]) -> Array:
    """d prediction / d (amplitude - off)^power at off, (n, c), for cases that each have one parameter more.

    changed: the case, the name of its added parameter, and the amplitude it stands for.
    """
    found = np.zeros((len(model.station), len(changed)))
    tasks = [(model, point, experiment, changed) for experiment in point.flows]
    for experiment, prints in zip(point.flows, in_threads(_prints, tasks, -1), strict=True):
        found[model.rows[experiment]] = prints
    return found


def _prints(model: Model, point: Point, experiment: str, changed: Sequence[tuple[Case, str, Amplitude]]) -> Array:
    """Fingerprints of one experiment, (stations of it, c); zero for what does not act in it."""
    flow, theta, rows = point.flows[experiment], theta_at(model.case, point.z), model.rows[experiment]
    found = np.zeros((rows.size, len(changed)))
    here = [j for j, (case, _, _) in enumerate(changed) if _acts_in(case, experiment)]
    if not here:
        return found
    base = crop(problem_at(model, experiment, point.z), *flow.band)
    calm = residual(base, flow.state)
    built, causes = [], np.empty((*flow.state.shape[:3], len(here)))
    for lane, j in enumerate(here):
        case, name, amplitude = changed[j]
        gain, value = amplitude.small**amplitude.power, np.array([amplitude.off + amplitude.small])
        problem = build_problem(case, model.site, experiment, theta | {name: value})
        causes[..., lane] = ((residual(crop(problem, *flow.band), flow.state) - calm) / gain)[..., 0]
        built.append((problem, gain))
    answers = tangents(base, flow.state, flow.factors, causes, EXACT)
    for lane, j in enumerate(here):
        problem, gain = built[lane]
        moved = flow.state + gain * answers[..., lane : lane + 1]
        now = _read(model, experiment, problem, moved, flow.band)[0]
        found[:, j] = (now - point.prediction[rows]) / gain
    return found


def force_response(model: Model, point: Point, experiment: str) -> Array:
    """d prediction / d f_x [m/s per m/s2] of the experiment's stations for a force along x in each cell, (n, nx, ny).

    By adjoints in single precision: one solve for each station.
    """
    flow = point.flows[experiment]
    rows = model.rows[experiment]
    weights = reading_weights(model.station.iloc[rows], model.site.grid)[:, :, slice(*flow.band)]
    sensitivity = adjoints(flow.factors, weights)[:, ALONG]
    faces = np.moveaxis(sensitivity, -1, 0)
    # A force in a cell pushes the faces on both sides of it by half; R_u falls by what pushes.
    cells = 0.5 * faces
    cells[:, 1:] += 0.5 * faces[:, :-1]
    wide = np.zeros((rows.size, model.site.grid.x.size, model.site.grid.y.size))
    wide[:, :, flow.band[0] : flow.band[1]] = cells
    return wide


def problem_at(model: Model, experiment: str, z: Array) -> Problem:
    return build_problem(model.case, model.site, experiment, theta_at(model.case, z))


def _acts_in(case: Case, experiment: str) -> bool:
    last = list(case.effects.values())[-1]
    return last.experiments is None or experiment in last.experiments


def _flow(model: Model, experiment: str, z: Array, near: Point | None) -> Flowing | None:
    problem = problem_at(model, experiment, z)
    ny = problem.shape[1]
    warm = None if near is None else _warm(near, near.flows[experiment], z, (problem.shape[0], ny))
    solution, factors, band = settled(problem, warm, model.case.numerics.tolerance)
    if factors is None:
        return None
    part = crop(problem, *band)
    slopes = tangents(part, solution.state, factors, _causes(model, experiment, z, solution.state, band), EXACT)
    return Flowing(solution.state, band, ny, factors, slopes)


def _warm(near: Point, before: Flowing, z: Array, shape: tuple[int, int]) -> Array:
    """A start (nx, 3, ny, 1) from a point nearby, along its slopes; from one on cells of twice the size if need be."""
    warm = widen(before.state, before.rows, before.band)
    if before.slopes.shape[3] == z.size:
        warm = warm + widen(before.slopes @ (z - near.z)[:, None], before.rows, before.band)
    if shape[0] == 2 * warm.shape[0]:
        warm = _shorter(warm)
    return _narrower(warm) if shape[1] == 2 * warm.shape[2] else warm


def _shorter(coarse: Array) -> Array:
    """A state (nx, 3, ny, 1) on cells of half the length: velocities between faces are the mean of both."""
    fine = np.repeat(coarse, 2, axis=0)
    fine[2::2, ALONG] = 0.5 * (fine[1:-1:2, ALONG] + fine[3::2, ALONG])
    return fine


def _narrower(coarse: Array) -> Array:
    """A state (nx, 3, ny, 1) on cells of half the width, likewise."""
    fine = np.repeat(coarse, 2, axis=2)
    fine[:, ACROSS, 1:-1:2] = 0.5 * (fine[:, ACROSS, :-2:2] + fine[:, ACROSS, 2::2])
    return fine


def _causes(model: Model, experiment: str, z: Array, state: Array, band: tuple[int, int]) -> Array:
    """dR/dz_j (nx, 3, rows, p) by central differences."""
    steps = DIFFERENCE_STEP * np.eye(z.size)
    ahead = crop(problem_at(model, experiment, z + steps), *band)
    behind = crop(problem_at(model, experiment, z - steps), *band)
    many = np.repeat(state, z.size, axis=3)
    return (residual(ahead, many) - residual(behind, many)) / (2.0 * DIFFERENCE_STEP)


def _read(model: Model, experiment: str, problem: Problem, state: Array, band: tuple[int, int]) -> Array:
    """Predictions (m, stations of the experiment) of states in a band."""
    station = model.station.iloc[model.rows[experiment]]
    wide = widen(state, model.site.grid.y.size, band)
    return read_sensors(problem, wide, model.site.grid, station, ()).prediction


def _read_slopes(model: Model, experiment: str, z: Array, flow: Flowing) -> tuple[Array, Array]:
    read = partial(_read, model, experiment, band=flow.band)
    steps = DIFFERENCE_STEP * np.eye(z.size)
    here = read(problem_at(model, experiment, z), flow.state)[0]
    ahead = read(problem_at(model, experiment, z + steps), flow.state + DIFFERENCE_STEP * flow.slopes)
    behind = read(problem_at(model, experiment, z - steps), flow.state - DIFFERENCE_STEP * flow.slopes)
    return here, (ahead - behind).T / (2.0 * DIFFERENCE_STEP)
