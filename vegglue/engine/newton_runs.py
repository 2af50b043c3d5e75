"""Runs of a model at many points, most of them near points where its flow and factors are known."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy.special import ndtr, ndtri

from vegglue.arrays import Array
from vegglue.engine.flow_problem import problem_at
from vegglue.engine.interface import Model, Point
from vegglue.flow.batch import solve_members
from vegglue.flow.march import fall_back
from vegglue.flow.problem import Problem
from vegglue.flow.sensor import predictions_at_sensors
from vegglue.flow.status import FAILED
from vegglue.parallel import side_by_side

# Points solved together: as many as fit the lanes of chord steps from one point.
RUNS_TOGETHER = 32

PredictNear = Callable[[Model, Point, Array], Array]


def predict_members(predict_near: PredictNear, model: Model, points: Sequence[Point], z: Array) -> Array:
    """Predictions (m, n) at z (m, p): from the nearest point; on their own where that fails; NaN where both do.

    Sets of members that are as far from their point are solved together, the same whatever the number of cores.
    """
    away = np.stack([np.linalg.norm(z - point.z, axis=1) for point in points])
    nearest = away.argmin(axis=0)
    sets = [
        (k, part)
        for k in range(len(points))
        for part in _sets(np.flatnonzero(nearest == k)[np.argsort(away[k, nearest == k], kind="stable")])
    ]
    found = np.full((len(z), len(model.station)), np.nan)
    work, tasks = partial(_from_one, predict_near, model, points), [(k, z[part]) for k, part in sets]
    for (_, part), prediction in zip(sets, side_by_side(work, tasks), strict=True):
        found[part] = prediction
    left = np.flatnonzero(np.isnan(found).any(axis=1))
    if left.size:
        found[left] = _alone(model, z[left])
    return found


def _sets(index: np.ndarray) -> list[np.ndarray]:
    return [index[first : first + RUNS_TOGETHER] for first in range(0, index.size, RUNS_TOGETHER)]


def _from_one(predict_near: PredictNear, model: Model, points: Sequence[Point], k: int, z: Array) -> Array:
    return predict_near(model, points[k], z)


def _alone(model: Model, z: Array) -> Array:
    """The same from no point, as members of an ensemble are solved."""
    found = np.full((len(z), len(model.station)), np.nan)
    tasks = [(experiment, z) for experiment in model.case.experiments]
    readings_of = side_by_side(partial(_read_alone, model), tasks)
    for experiment, readings in zip(model.case.experiments, readings_of, strict=True):
        found[:, model.rows[experiment]] = readings
    found[np.isnan(found).any(axis=1)] = np.nan
    return found


def _read_alone(model: Model, experiment: str, z: Array) -> Array:
    numerics = model.case.numerics
    how = fall_back(numerics.march_step, numerics.march_span)
    problem = problem_at(model, experiment, z)
    build = partial(_problem_in_cube, model, experiment)
    solved = solve_members(problem, ndtr(z), build, numerics.tolerance, how=how)
    state = np.ascontiguousarray(solved.state)
    prediction = predictions_at_sensors(problem, state, model.site.grid, model.station_of(experiment))
    prediction[solved.status == FAILED] = np.nan
    return prediction


def _problem_in_cube(model: Model, experiment: str, points: Array) -> Problem:
    """The flow problem of one experiment at points (m, p) of the unit cube."""
    return problem_at(model, experiment, ndtri(points))
