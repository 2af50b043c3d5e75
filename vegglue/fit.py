"""The best place of a prior: maximum a posteriori by least squares with exact slopes.

    minimise |W (y - f(z))|^2 + |z|^2,   W' W the inverse covariance of the errors
"""

from dataclasses import dataclass

import numpy as np

from vegglue.effect import Array
from vegglue.linearise import Model, Point, linearise, theta_at
from vegglue.noise import Noise

# A step that promises less than this improvement of the misfit ends the search.
SETTLED = 0.02
MOST_STEPS = 14
# Longest step [standard deviations of the prior].
LONGEST = 1.5


@dataclass(frozen=True)
class Fitted:
    """Where a search ended: a point, |W (y - f)|^2, the same with the prior's |z|^2, and the covariance of z (p, p)."""

    point: Point
    chi2: float
    objective: float
    covariance: Array
    settled: bool


def fit(model: Model, noise: Noise, start: Point, steps: int = MOST_STEPS) -> Fitted:
    """From a point downhill (Levenberg 1944, Marquardt 1963) until no step promises to help."""
    point, damping = start, 1e-3
    now = objective(noise, point)
    settled = False
    for _ in range(steps):
        step, promised = _step(noise, point, damping)
        if promised < SETTLED:
            settled = True
            break
        moved = linearise(model, point.z + step, point)
        there = np.inf if moved is None else objective(noise, moved)
        if moved is None or not there < now:
            damping = max(10.0 * damping, 1e-2)
            if damping > 1e6:
                break
            continue
        point, now, damping = moved, there, damping / 10.0
    return Fitted(point, chi2(noise, point), now, covariance(noise, point), settled)


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


def _step(noise: Noise, point: Point, damping: float) -> tuple[Array, float]:
    """The damped step, no longer than LONGEST, and by how much it should lower the misfit."""
    slope = noise.whiten(noise.used(point.slope))
    left = noise.whiten(noise.residual(point.prediction))
    matrix, right = slope.T @ slope + np.eye(point.z.size), slope.T @ left - point.z
    step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), right)
    step *= min(1.0, LONGEST / float(np.abs(step).max() + 1e-300))
    return np.asarray(step), float(2.0 * right @ step - step @ matrix @ step)


