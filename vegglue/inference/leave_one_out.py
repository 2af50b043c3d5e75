"""Whether a posterior predicts held-out data: leave-one-out scores and where measurements fall in their bands.

With errors of covariance C and Q = C^-1, the density of stations g given all others and one draw is normal with

    covariance Q_gg^-1,   y_g - mean = Q_gg^-1 (Q r)_g,   r the residual of the draw

(Buerkner, Gabry and Vehtari 2021, doi:10.1007/s00180-020-01045-4). Draws of the posterior without g have the weights
w / p(y_g | others), smoothed (Vehtari et al. 2024); their k-hat shows whether these are to be trusted.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, ndtr

from vegglue.arrays import Array
from vegglue.inference.weighted_statistics import pareto_smoothed


@dataclass(frozen=True)
class LeftOut:
    """Log predictive density of what was left out [-], and k-hat of the weights that leave it out."""

    score: float
    k: float


@dataclass(frozen=True)
class StationScores:
    """Each station (n,) given all others: log predictive density, k-hat, and the share of its prediction below it."""

    score: Array
    k: Array
    below: Array


def log_likelihoods(residual: Array, precision: Array) -> Array:
    """ln p(y_i | the other stations, draw) (m, n) of residuals (m, n), errors of the inverse covariance (n, n)."""
    own = np.diag(precision)
    return np.asarray(0.5 * np.log(own / (2.0 * np.pi)) - 0.5 * (residual @ precision) ** 2 / own)


def leave_one_out(residual: Array, precision: Array, weights: Array) -> StationScores:
    """Every station left out in turn: residuals (m, n), inverse covariance (n, n), weights (m,) above 0."""
    logs = log_likelihoods(residual, precision)
    away = (residual @ precision) / np.sqrt(np.diag(precision))
    score, k, below = (np.empty(residual.shape[1]) for _ in range(3))
    for i in range(residual.shape[1]):
        others, k[i] = pareto_smoothed(np.log(weights) - logs[:, i])
        score[i] = _log_mean(logs[:, i], others)
        below[i] = others @ ndtr(away[:, i])
    return StationScores(score, k, below)


def leave_out(residual: Array, precision: Array, weights: Array, group: np.ndarray) -> LeftOut:
    """The stations `group` left out together."""
    part = precision[np.ix_(group, group)]
    pull = (residual @ precision)[:, group]
    size = np.sum(pull * np.linalg.solve(part, pull.T).T, axis=1)
    logs = 0.5 * np.linalg.slogdet(part)[1] - 0.5 * group.size * np.log(2.0 * np.pi) - 0.5 * size
    others, k = pareto_smoothed(np.log(weights) - logs)
    return LeftOut(_log_mean(logs, others), k)


def _log_mean(logs: Array, weights: Array) -> float:
    counts = weights > 1e-300  # the others together weigh less than rounding
    return float(logsumexp(logs[counts] + np.log(weights[counts])))


def share_inside(below: Array, level: float) -> float:
    """Share of measurements within the band that should hold `level` of them [-]."""
    return float(np.mean(np.abs(below - 0.5) < 0.5 * level))
