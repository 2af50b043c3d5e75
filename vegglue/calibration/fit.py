"""The MAP estimate: the best parameters of a model, given measurements and priors.

    minimise |W (y - f(z))|^2 + |z|^2,   W' W = cov^-1

y are the measurements, f the predictions and cov the covariance of the errors. z are the parameters on the scale on
which their prior is standard normal.

Steps follow the bend of the predictions (geodesic acceleration):

    z + t v + t^2/2 a,   (H + l 1) v = b,   (H + l 1) a = -J' W' W f_vv,   f_vv = 2/h [(f(z + h v) - f(z))/h - J v]

Drag and height of a canopy make up for one another along a curve, which straight steps leave at once.
Source: Transtrum and Sethna (2012), doi:10.48550/arXiv.1201.5885, where a step is refused if a is long; here t shortens
it.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import chdtrc

from vegglue.arrays import Array
from vegglue.calibration.noise import Noise
from vegglue.case.parameter_space import FURTHEST, theta_at
from vegglue.decision_constants import constants
from vegglue.engine.interface import Model, Point, linearise
from vegglue.normal_range import NORMAL95

# Predicted decrease of the objective [-] below which the search ends: the point is then within sqrt(0.02) = 0.14
# standard errors of the minimum. Chosen, not measured: a smaller one costs more runs of the model.
NEGLIGIBLE_DECREASE = 0.02
# Steps that end the search if they lower the objective by less in all [-]: an outline crosses cells one by one, so that
# its slopes promise what no step keeps. Chosen after the plants that are tried on river-c, which moved a last 0.1 nats
# in a third of their flows.
STALLED_STEPS, STALLED_DECREASE = 4, 0.2
# Steps of one search at most. Chosen, not measured: each is a run of the model.
MOST_STEPS = 14
# Longest step in any z [standard deviations of the prior]. Chosen, not measured: longer ones leave the range in which
# the slopes hold and are taken back, shorter ones are many.
LONGEST_FIT_STEP = 1.5
# Levenberg's damping, over the curvature of the prior [-], raised until a step is short enough. The factor of 1.8 from
# one to the next is chosen: it sets how closely a step keeps to its longest length.
DAMPINGS = (0.0, *np.geomspace(1e-2, 1e10, 49))
# h [-] and the largest t |a| / |v| [-], as in the source.
BEND_STEP, LARGEST_BEND = 0.1, 0.75
# Predicted decrease of the objective [-] below which the bend is not computed: steps are then within a standard error.
# Chosen, not measured: each bend costs a flow without slopes, a quarter of one with them.
STRAIGHT_DECREASE = 1.0


@dataclass(frozen=True)
class MapEstimate:
    """The parameters that fit best, z being standard normal before the data.

    Attributes
    ----------
    chi2 : float
        |W (y - f)|^2 [-].
    objective : float
        chi2 + |z|^2 [-].
    covariance : ndarray (p, p)
        Of z around it [-].
    """

    point: Point
    chi2: float
    objective: float
    covariance: Array


def fit(
    model: Model, noise: Noise, start: Point, steps: int = MOST_STEPS, enough: float = np.inf, needed: float = -np.inf
) -> MapEstimate:
    """The MAP estimate, searched from a point by Levenberg-Marquardt steps.

    The longest step shrinks where one is taken back. The search ends if the predicted decrease is below
    NEGLIGIBLE_DECREASE, if STALLED_STEPS bring less than STALLED_DECREASE, after `steps`, if slopes promise no
    objective below `enough`, or if `needed` is more than hopeless_search steps away.

    Parameters
    ----------
    model : Model
        Predictions and slopes at any z.
    noise : Noise
        Measured values and the covariance of their errors.
    start : Point
        Where the search begins.
    steps : int
        Runs of the model at most.
    enough : float
        Objective [-] above which the search is given up.
    needed : float
        `log_evidence_under` [-] below which what is found is of no use.

    Returns
    -------
    MapEstimate
        The last point that was kept.

    References
    ----------
    More (1978), doi:10.1007/BFb0067700.
    """

    def lower_there(z: Array, limit: float, prediction: Array) -> bool:
        return squared_misfit(noise, prediction) + float(z @ z) < limit

    point, longest, objectives = start, LONGEST_FIT_STEP, list[float]()
    for _ in range(steps):
        slope, residual = noise.whiten(noise.used(point.slope)), noise.whiten(noise.residual(point.prediction))
        matrix, right = slope.T @ slope + np.eye(point.z.size), slope.T @ residual - point.z
        damped, step, predicted = _levenberg_step(point, matrix, right, longest)
        before = objective(noise, point)
        objectives.append(before)
        stalled = len(objectives) > STALLED_STEPS and objectives[-1 - STALLED_STEPS] - before < STALLED_DECREASE
        # The least objective by the slopes here is F - b' H^-1 b, and its fall to the evidence that is needed
        # F + ln|H| + 2 ln p(y).
        hopeless = before + np.linalg.slogdet(matrix)[1] + 2.0 * needed > constants().hopeless_search * predicted
        if predicted < NEGLIGIBLE_DECREASE or stalled or hopeless:
            break
        if before - right @ np.linalg.solve(matrix, right) > enough:
            break
        if predicted > STRAIGHT_DECREASE:
            step = _geodesic_step(model, noise, point, damped, step)
        there = point.z + step
        # The slopes of a step that is taken back are never computed: they are half of its work.
        moved = linearise(model, there, point, partial(lower_there, there, before))
        length = float(np.abs(step).max())
        longest = length / 4.0 if moved is None else min(max(longest, 2.0 * length), LONGEST_FIT_STEP)
        point = moved or point
    return at_point(noise, point)


def fit_from(model: Model, noise: Noise, z: Array, near: Point | None = None) -> MapEstimate | None:
    """`fit` from a place.

    Parameters
    ----------
    z : ndarray (p,)
    near : Point, optional
        To start the flow from.

    Returns
    -------
    MapEstimate or None
        None if no flow is found at the place.
    """
    start = linearise(model, z, near)
    return None if start is None else fit(model, noise, start)


def _levenberg_step(point: Point, matrix: Array, right: Array, longest: float) -> tuple[Array, Array, float]:
    """H + l 1 with a step (p,) no longer than `longest` (Levenberg 1944), the step, and the predicted decrease."""
    # Beyond FURTHEST theta equals its bound: a z that would go there is held, else it shortens the step of the others.
    held = (np.abs(point.z) >= FURTHEST) & (right * point.z > 0.0)
    matrix, right = np.where(held[:, None] | held, np.eye(held.size), matrix), np.where(held, 0.0, right)
    for damping in DAMPINGS:
        damped = matrix + damping * np.eye(point.z.size)
        step = np.linalg.solve(damped, right)
        if np.abs(step).max() <= longest:
            break
    step = np.clip(point.z + step, -FURTHEST, FURTHEST) - point.z
    return damped, np.asarray(step), float(2.0 * right @ step - step @ matrix @ step)


def _geodesic_step(model: Model, noise: Noise, point: Point, damped: Array, step: Array) -> Array:
    """The step (p,) along the bend of the predictions, shorter if that is large; straight if no flow is found ahead.

    Geodesic acceleration (Transtrum and Sethna 2012, arXiv:1201.5885).
    """
    ahead = prediction_at(model, point.z + BEND_STEP * step, point)
    if ahead is None:
        return step
    bend = 2.0 / BEND_STEP * ((ahead - point.prediction) / BEND_STEP - point.slope @ step)
    slope = noise.whiten(noise.used(point.slope))
    turn = -np.linalg.solve(damped, slope.T @ noise.whiten(noise.used(bend)))
    share = min(1.0, LARGEST_BEND * float(np.linalg.norm(step)) / max(float(np.linalg.norm(turn)), 1e-300))
    there = point.z + share * step + 0.5 * share**2 * turn
    return np.asarray(np.clip(there, -FURTHEST, FURTHEST) - point.z)


def prediction_at(model: Model, z: Array, near: Point | None) -> Array | None:
    """f(z) without slopes.

    Parameters
    ----------
    z : ndarray (p,)
    near : Point or None
        To start the flow from.

    Returns
    -------
    ndarray (station,) or None
        [unit of each station]; None if no flow is found.
    """
    kept = list[Array]()

    def without_slopes(prediction: Array) -> bool:
        kept.append(prediction)
        return False

    linearise(model, z, near, without_slopes)
    return kept[0] if kept else None


def at_point(noise: Noise, point: Point) -> MapEstimate:
    """What is known at a point, taken for the MAP estimate."""
    return MapEstimate(point, chi2(noise, point), objective(noise, point), covariance(noise, point))


def chi2(noise: Noise, point: Point) -> float:
    """|W (y - f)|^2 over the used stations.

    Returns
    -------
    float
        [-]
    """
    return squared_misfit(noise, point.prediction)


def squared_misfit(noise: Noise, prediction: Array) -> float:
    """|W (y - f)|^2 over the used stations.

    Parameters
    ----------
    prediction : ndarray (station,)
        f [unit of each station].

    Returns
    -------
    float
        [-]
    """
    return float(np.sum(noise.whiten(noise.residual(prediction)) ** 2))


def objective(noise: Noise, point: Point) -> float:
    """|W (y - f)|^2 + |z|^2: -2 ln of likelihood times prior, up to a constant.

    Returns
    -------
    float
        [-]
    """
    return chi2(noise, point) + float(point.z @ point.z)


def covariance(noise: Noise, point: Point) -> Array:
    """(J' W' W J + I)^-1,   J = df/dz: the covariance of z around a MAP estimate.

    Returns
    -------
    ndarray (p, p)
        [squared standard deviations of the prior]
    """
    slope = noise.whiten(noise.used(point.slope))
    return np.asarray(np.linalg.inv(slope.T @ slope + np.eye(point.z.size)))


def chance_of_misfit(misfit: float, freedom: int) -> float:
    """P(chi2_f >= chi2): the chance of a misfit as large by errors alone.

    Parameters
    ----------
    misfit : float
        chi2 [-].
    freedom : int
        f, counted as 1 if it is less.

    Returns
    -------
    float
        [-]
    """
    return float(chdtrc(max(freedom, 1), misfit))


def determined(spread: Array) -> float:
    """p - tr V: effective number of parameters, those that the data determine.

    Parameters
    ----------
    spread : ndarray (p, p)
        V, the covariance of z.

    Returns
    -------
    float
        From 0 to p [-].
    """
    return float(spread.shape[0] - np.trace(spread))


def freedom_of_misfit(readings: int, spread: Array) -> int:
    """n - (p - tr V), to a whole number: the mean of chi2 at the best fit.

    A parameter that the data leave at its prior takes no residual away, and costs no degree of freedom.

    Parameters
    ----------
    readings : int
        n.
    spread : ndarray (p, p)
        V, the covariance of z.
    """
    return round(readings - determined(spread))


def log_evidence_under(fitted: MapEstimate) -> float:
    """ln p(y) = -F/2 - ln|H|/2,   F the objective and H^-1 the covariance of z: Laplace's approximation.

    Returns
    -------
    float
        [-], up to what all models have in common under the same covariance of the errors.

    References
    ----------
    Kass and Raftery (1995), doi:10.2307/2291091, their equation 5; not checked against it.
    """
    return float(-0.5 * fitted.objective + 0.5 * np.linalg.slogdet(fitted.covariance)[1])


def interval95(model: Model, fitted: MapEstimate, name: str) -> tuple[float, float, float]:
    """theta(z_j) and theta(z_j -/+ 1.96 s_j),   s_j^2 the variance of z_j.

    Parameters
    ----------
    name : str
        Of parameter j.

    Returns
    -------
    float, float, float
        Estimate, lower and upper end [unit of the parameter].
    """
    j = model.names.index(name)
    z = np.repeat(fitted.point.z[None], 3, axis=0)
    z[:, j] += NORMAL95 * np.sqrt(fitted.covariance[j, j]) * np.array([0.0, -1.0, 1.0])
    middle, low, high = theta_at(model.case, z)[name]
    return float(middle), float(low), float(high)
