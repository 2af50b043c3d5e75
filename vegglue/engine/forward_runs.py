"""True runs of a model at many places, most of them near places where its flow and factors are known."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.special import ndtr, ndtri

from vegglue.arrays import Array
from vegglue.engine.linearised_model import Model, Point, predict_near, problem_at
from vegglue.flow.problem import Problem
from vegglue.flow.sensor import read_sensors
from vegglue.parallel import in_threads
from vegglue.solver.batch import solve_members
from vegglue.solver.status import FAILED

# Places solved together.
RUNS_TOGETHER = 16


def predict(model: Model, points: Sequence[Point], jobs: int, z: Array) -> Array:
    """Predictions (m, n) at z (m, p): from the nearest point; on their own where that fails; NaN where both do.

    Sets of places that are as far from their point are solved together, the same whatever the number of jobs.
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
    for part, prediction in zip(rows, in_threads(predict_near, tasks, jobs), strict=True):
        found[part] = prediction
    left = np.flatnonzero(np.isnan(found).any(axis=1))
    if left.size:
        found[left] = _alone(model, z[left], jobs)
    return found


def _sets(index: np.ndarray) -> list[np.ndarray]:
    return [index[first : first + RUNS_TOGETHER] for first in range(0, index.size, RUNS_TOGETHER)]


def _alone(model: Model, z: Array, jobs: int) -> Array:
    """The same from no point, as members of an ensemble are solved."""
    found = np.full((len(z), len(model.station)), np.nan)
    places = ndtr(z)
    tasks = [(model, experiment, places) for experiment in model.case.experiments]
    for experiment, readings in zip(model.case.experiments, in_threads(_read_alone, tasks, jobs), strict=True):
        found[:, model.rows[experiment]] = readings
    found[np.isnan(found).any(axis=1)] = np.nan
    return found


def _read_alone(model: Model, experiment: str, places: Array) -> Array:
    build = partial(_problem, model, experiment)
    solved = solve_members(build, places, model.case.numerics.tolerance)
    station = model.station.iloc[model.rows[experiment]]
    state = np.ascontiguousarray(solved.state)
    prediction = read_sensors(build(places), state, model.site.grid, station, ()).prediction
    prediction[solved.status == FAILED] = np.nan
    return prediction


def _problem(model: Model, experiment: str, places: Array) -> Problem:
    return problem_at(model, experiment, ndtri(places))
