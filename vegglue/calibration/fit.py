"""The best place of a prior: maximum a posteriori by least squares with exact slopes.

minimise |W (y - f(z))|^2 + |z|^2,   W' W the inverse covariance of the errors
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.calibration.noise import Noise
from vegglue.case.parameter_space import FURTHEST, theta_at
from vegglue.engine.interface import Model, Point, linearise

# A step that promises less than this improvement of the misfit ends the search.
SETTLED = 0.02
MOST_STEPS = 14
# Longest step [standard deviations of the prior].
LONGEST_FIT_STEP = 1.5
# Added to the curvature, in that of the prior, until a step is short enough: what the data determine well stays free.
DAMPINGS = (0.0, *np.geomspace(1e-2, 1e10, 49))


@dataclass(frozen=True)
class Fitted:
    """Where a search ended: a point, |W (y - f)|^2, the same with the prior's |z|^2, and the covariance of z (p, p)."""

    point: Point
    chi2: float
    objective: float
    covariance: Array
    settled: bool


def fit(model: Model, noise: Noise, start: Point, steps: int = MOST_STEPS) -> Fitted:
    """From a point downhill, as far as the slopes can be trusted (More 1978, doi:10.1007/BFb0067700), until no step
    promises to help.
    """
    point, longest, settled = start, LONGEST_FIT_STEP, False
    for _ in range(steps):
        step, promised = _step(noise, point, longest)
        settled = promised < SETTLED
        if settled:
            break
        moved = linearise(model, point.z + step, point)
        gained = -np.inf if moved is None else objective(noise, point) - objective(noise, moved)
        length = float(np.abs(step).max())
        longest = length / 4.0 if gained < promised / 4.0 else min(max(longest, 2.0 * length), LONGEST_FIT_STEP)
        if moved is not None and gained > 0.0:
            point = moved
    return Fitted(point, chi2(noise, point), objective(noise, point), covariance(noise, point), settled)


def chi2(noise: Noise, point: Point) -> float:
    """|W (y - f)|^2 over the used stations [-]."""
    return float(np.sum(noise.whiten(noise.residual(point.prediction)) ** 2))


def objective(noise: Noise, point: Point) -> float:
    """|W (y - f)|^2 + |z|^2 [-]."""
    return chi2(noise, point) + float(point.z @ point.z)


def covariance(noise: Noise, point: Point) -> Array:
    """(J' W' W J + I)^-1, of z around the best place (p, p)."""
    slope = noise.whiten(noise.used(point.slope))
    return np.asarray(np.linalg.inv(slope.T @ slope + np.eye(point.z.size)))


def interval95(model: Model, fitted: Fitted, name: str) -> tuple[float, float, float]:
    """The best value of a parameter and the ends of its 95 % interval, from the covariance of z, in its own unit."""
    j = model.names.index(name)
    z = np.repeat(fitted.point.z[None], 3, axis=0)
    z[:, j] += 1.96 * np.sqrt(fitted.covariance[j, j]) * np.array([0.0, -1.0, 1.0])
    middle, low, high = theta_at(model.case, z)[name]
    return float(middle), float(low), float(high)


def _step(noise: Noise, point: Point, longest: float) -> tuple[Array, float]:
    """The step (Levenberg 1944), damped until it is no longer than `longest`, and what it should gain."""
    slope = noise.whiten(noise.used(point.slope))
    left = noise.whiten(noise.residual(point.prediction))
    matrix, right = slope.T @ slope + np.eye(point.z.size), slope.T @ left - point.z
    # Further out nothing changes any more: what would go there is held, and does not keep the others back.
    held = (np.abs(point.z) >= FURTHEST) & (right * point.z > 0.0)
    matrix, right = np.where(held[:, None] | held, np.eye(held.size), matrix), np.where(held, 0.0, right)
    for damping in DAMPINGS:
        step = np.linalg.solve(matrix + damping * np.eye(point.z.size), right)
        if np.abs(step).max() <= longest:
            break
    step = np.clip(point.z + step, -FURTHEST, FURTHEST) - point.z
    return np.asarray(step), float(2.0 * right @ step - step @ matrix @ step)
