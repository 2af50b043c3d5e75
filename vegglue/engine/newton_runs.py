"""Runs of a model at many points, most of them near points where its flow and factors are known."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.special import ndtr, ndtri

from vegglue.arrays import Array
from vegglue.case.parameter_space import theta_at
from vegglue.engine.interface import Model, Point
from vegglue.flow.problem import Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import read_sensors
from vegglue.parallel import in_threads
from vegglue.solver.batch import solve_members
from vegglue.solver.march import fall_back
from vegglue.solver.status import FAILED

# Points solved together: as many as fit the lanes of chord steps from one point.
RUNS_TOGETHER = 16

PredictNear = Callable[[Model, Point, Array], Array]


def predict_members(predict_near: PredictNear, model: Model, points: Sequence[Point], z: Array) -> Array:
    """Predictions (m, n) at z (m, p): from the nearest point; on their own where that fails; NaN where both do.

    Sets of members that are as far from their point are solved together, the same whatever the number of cores.
    """
    away = np.stack([np.linalg.norm(z - point.z, axis=1) for point in points])
    nearest = away.argmin(axis=0)
    sets = [
        (model, points[k], part)
        for k in range(len(points))
        for part in _sets(np.flatnonzero(nearest == k)[np.argsort(away[k, nearest == k], kind="stable")])
    ]
    found = np.full((len(z), len(model.station)), np.nan)
    rows = [part for _, _, part in sets]
    tasks = [(model, point, z[part]) for model, point, part in sets]
    for part, prediction in zip(rows, in_threads(predict_near, tasks), strict=True):
        found[part] = prediction
    left = np.flatnonzero(np.isnan(found).any(axis=1))
    if left.size:
        found[left] = _alone(model, z[left])
    return found


def _sets(index: np.ndarray) -> list[np.ndarray]:
    return [index[first : first + RUNS_TOGETHER] for first in range(0, index.size, RUNS_TOGETHER)]


def _alone(model: Model, z: Array) -> Array:
    """The same from no point, as members of an ensemble are solved."""
    found = np.full((len(z), len(model.station)), np.nan)
    tasks = [(model, experiment, z) for experiment in model.case.experiments]
    for experiment, readings in zip(model.case.experiments, in_threads(_read_alone, tasks), strict=True):
        found[:, model.rows[experiment]] = readings
    found[np.isnan(found).any(axis=1)] = np.nan
    return found


def _read_alone(model: Model, experiment: str, z: Array) -> Array:
    numerics = model.case.numerics
    how = fall_back(numerics.march_step, numerics.march_span)
    problem = _problem(model, experiment, z)
    build = partial(_problem_at, model, experiment)
    solved = solve_members(problem, ndtr(z), build, numerics.tolerance, how=how)
    state = np.ascontiguousarray(solved.state)
    prediction = read_sensors(problem, state, model.site.grid, model.station_of(experiment), ()).prediction
    prediction[solved.status == FAILED] = np.nan
    return prediction


def _problem(model: Model, experiment: str, z: Array) -> Problem:
    return build_problem(model.case, model.site, experiment, theta_at(model.case, z))


def _problem_at(model: Model, experiment: str, points: Array) -> Problem:
    """The same at points of the unit cube."""
    return _problem(model, experiment, ndtri(points))
