"""Statistics of weighted members: quantiles, moments, the effective number of members, draws of equal weight, and
whether they predict held-out data.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp, ndtr, ndtri

from vegglue.arrays import Array

# Steps of a mixture quantile at most: were all halvings of its bracket, 2^-50 of its width would be below rounding.
QUANTILE_STEPS = 50
# Step of a mixture quantile [standard errors] after which it is exact: Newton's next one would be its square, 1e-18.
QUANTILE_STEP = 1e-9
# k-hat above which a mean over weighted members is not to be trusted: no practical number of members makes its error
# small (Vehtari et al. 2024, https://jmlr.org/papers/v25/19-556.html).
TRUSTED_K_HAT = 0.7


def weighted_quantile(values: Array, weights: Array, levels: ArrayLike) -> Array:
    """q(p) interpolates the sorted values at p_k = (w_1 + ... + w_k - w_k/2) / sum w.

    Parameters
    ----------
    values : array (member, ...)
        In any unit.
    weights : array (member,)
        Members of weight zero do not count [-].
    levels : array-like
        p [-].

    Returns
    -------
    array (level, ...)
        In the unit of the values; NaN if that of any weighted member is.
    """
    values, weights = values[weights > 0], weights[weights > 0]
    columns, wanted = values.reshape(len(weights), -1), np.asarray(np.atleast_1d(levels), float)
    quantiles = []
    for column in columns.T:
        order = np.argsort(column)
        share = weights[order] / weights.sum()
        known = not np.isnan(column).any()
        found = np.interp(wanted, np.cumsum(share) - 0.5 * share, column[order]) if known else wanted * np.nan
        quantiles.append(found)
    return np.reshape(np.transpose(quantiles), (np.size(levels), *values.shape[1:]))


def mixture_quantile(centres: Array, weights: Array, sd: Array, levels: ArrayLike) -> Array:
    """q(p) with sum_k w_k Phi((q - c_k) / s) = p: quantiles of the members' predictions c_k plus a normal error.

    Parameters
    ----------
    centres : array (member, station)
        c [m/s or m].
    weights : array (member,)
        w [-].
    sd : array (station,)
        s > 0 [m/s or m].
    levels : array-like
        p [-].

    Returns
    -------
    array (level, station)
        By Newton's method within a bracket [m/s or m]; NaN if a centre or sd is.
    """
    kept = weights > 1e-12 * weights.max()  # the others together weigh less than rounding
    centres, share = centres[kept], weights[kept] / weights[kept].sum()
    wanted = np.reshape(levels, (-1, 1)).astype(float)
    low, high = centres.min(axis=0) - 10 * sd, centres.max(axis=0) + 10 * sd
    spread = np.sqrt(share @ (centres - share @ centres) ** 2 + sd**2)
    at = np.clip(share @ centres + spread * ndtri(np.clip(wanted, 1e-9, 1 - 1e-9)), low, high)
    for _ in range(QUANTILE_STEPS):
        away = [(row - centres) / sd for row in at]
        above = np.array([share @ ndtr(one) for one in away]) - wanted
        density = np.array([share @ np.exp(-0.5 * one**2) for one in away]) / (np.sqrt(2 * np.pi) * sd)
        low, high = np.where(above < 0, at, low), np.where(above < 0, high, at)
        newton = at - above / np.maximum(density, 1e-300)
        following = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
        still = np.abs(following - at) > QUANTILE_STEP * sd
        at = following
        if not still.any():
            break
    return at


def weighted_covariance(values: Array, weights: Array) -> Array:
    """cov_ij = sum_k w_k (x_ki - m_i)(x_kj - m_j) / sum w,   m the weighted mean.

    Parameters
    ----------
    values : ndarray (member, i)
        x, in any units.
    weights : ndarray (member,)
        w; members of weight zero do not count [-].

    Returns
    -------
    ndarray (i, i)
        [product of the two units]
    """
    share = weights[weights > 0] / weights.sum()
    centred = values[weights > 0] - share @ values[weights > 0]
    return (centred * share[:, None]).T @ centred


def weighted_median(values: Array, weights: Array) -> float:
    """q(0.5) of values (member,), in their unit."""
    return float(weighted_quantile(values, weights, [0.5])[0])


def weighted_sd(values: Array, weights: Array) -> float:
    """sd = sqrt(sum_k w_k (x_k - m)^2 / sum w),   m the weighted mean.

    Parameters
    ----------
    values : ndarray (member,)
        x, in any unit.
    weights : ndarray (member,)
        w [-].

    Returns
    -------
    float
        In the unit of the values; NaN if one of a weight above zero is not finite.
    """
    if not np.isfinite(values[weights > 0]).all():
        return float("nan")
    return float(np.sqrt(weighted_covariance(values[:, None], weights)[0, 0]))


def correlation(covariance: Array) -> Array:
    """r_ij = cov_ij / sqrt(cov_ii cov_jj).

    Parameters
    ----------
    covariance : ndarray (i, i)

    Returns
    -------
    ndarray (i, i)
        [-]; NaN if a quantity does not vary.
    """
    sd = np.sqrt(np.diag(covariance))
    scale = np.outer(sd, sd)
    return np.divide(covariance, scale, out=np.full_like(covariance, np.nan), where=scale > 0)


def effective_size(weights: Array) -> float:
    """n = (sum w)^2 / sum w^2: the effective sample size.

    Parameters
    ----------
    weights : ndarray
        w, of any sum above 0 [-].

    Returns
    -------
    float
        From 1 to the number of weights [-].

    References
    ----------
    Kish (1965), Survey Sampling.
    """
    return float(weights.sum() ** 2 / np.sum(weights**2))


def systematic_draws(weights: Array, count: int, random: np.random.Generator) -> NDArray[np.int64]:
    """Members in whose step of the cumulated weights a point (u + i) / count falls, u uniform in 0 to 1, shuffled.

    Parameters
    ----------
    weights : ndarray (member,)
        Of any sum above 0 [-].
    count : int
        Draws, i from 0.

    Returns
    -------
    ndarray (count,)
        Indices of members, each floor or ceil of count times its share of the weights.

    References
    ----------
    Kitagawa (1996), https://doi.org/10.2307/1390750.
    """
    cumulated = np.cumsum(weights)
    points = (random.random() + np.arange(count)) / count * cumulated[-1]
    return random.permutation(np.searchsorted(cumulated, points, side="right"))


def pareto_shape(weights: Array) -> float:
    """k-hat: shape of the generalised Pareto distribution of the largest min(n/5, 3 sqrt(n)) of n weights.

    Parameters
    ----------
    weights : ndarray (n,)
        [-]

    Returns
    -------
    float
        [-]; above TRUSTED_K_HAT the weighted means are not to be trusted, whatever the effective size is. NaN if fewer
        than 5 weights stand out.

    References
    ----------
    Vehtari et al. (2024), https://jmlr.org/papers/v25/19-556.html; fit of Zhang and Stephens (2009),
    https://doi.org/10.1198/tech.2009.08017.
    """
    ordered = np.sort(weights / np.max(weights))
    tail = _tail(len(ordered))
    excess = ordered[-tail:] - ordered[max(len(ordered) - tail - 1, 0)]
    excess = excess[excess > 0]
    return _generalised_pareto(excess)[0] if len(excess) >= 5 else float("nan")


def pareto_smoothed(log_weights: Array) -> tuple[Array, float]:
    """Weights of which the largest are replaced by quantiles of the Pareto distribution fitted to them.

    Parameters
    ----------
    log_weights : ndarray (m,)
        Up to a constant [-].

    Returns
    -------
    weights : ndarray (m,)
        Of sum 1 [-]; with fewer than 5 large weights nothing is replaced.
    k : float
        k-hat [-]; then NaN, or infinite if their effective number is below 5.

    References
    ----------
    Vehtari et al. (2024), https://jmlr.org/papers/v25/19-556.html.
    """
    weights = np.exp(log_weights - np.max(log_weights))
    order = np.argsort(weights, kind="stable")
    tail = order[-_tail(len(weights)) :]
    cut = weights[order[max(len(weights) - len(tail) - 1, 0)]]
    tail = tail[weights[tail] > cut]  # what is below rounding, as most may be, does not grow to a quantile of the rest
    if len(tail) < 5:
        return weights / weights.sum(), float("inf" if effective_size(weights) < 5 else "nan")
    k, scale = _generalised_pareto(weights[tail] - cut)
    level = (np.arange(len(tail)) + 0.5) / len(tail)
    grown = -scale * np.log1p(-level) if abs(k) < 1e-9 else scale * np.expm1(-k * np.log1p(-level)) / k
    weights[tail] = np.minimum(cut + grown, 1.0)
    return weights / weights.sum(), k


def _tail(count: int) -> int:
    return int(np.ceil(min(count / 5, 3 * np.sqrt(count))))


def _generalised_pareto(excess: Array) -> tuple[float, float]:
    """Shape k and scale: posterior mean over a grid of b = -k/scale; k has a weak prior of 0.5, as of 10 values."""
    count = len(excess)
    grid = 30 + int(np.sqrt(count))
    quartile = excess[int(count / 4 + 0.5) - 1]
    b = (1 - np.sqrt(grid / (np.arange(1, grid + 1) - 0.5))) / (3 * quartile) + 1 / excess[-1]
    k = np.log1p(-b[:, None] * excess).mean(axis=1)
    profile = count * (np.log(-b / k) - k - 1)
    share = np.exp(profile - profile.max())
    best = (b * share).sum() / share.sum()
    shape = float(np.log1p(-best * excess).mean())
    return (shape * count + 0.5 * 10) / (count + 10), float(-shape / best)


def root_mean_square(values: Array) -> float:
    """sqrt(mean x^2).

    Parameters
    ----------
    values : ndarray
        x, in any unit.

    Returns
    -------
    float
        In the unit of the values; NaN without any, or if one is NaN.
    """
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def stations_by_kind(station: pd.DataFrame) -> dict[str, NDArray[np.intp]]:
    """Rows of the used stations by kind of measurement."""
    used = station["used"].to_numpy()
    return {str(kind): np.flatnonzero(used & (station["kind"] == kind)) for kind in station["kind"][used].unique()}


@dataclass(frozen=True)
class LeftOut:
    """What is predicted of measurements that are left out.

    Attributes
    ----------
    score : float
        Log predictive density [-].
    k : float
        k-hat of the weights that leave them out [-].
    """

    score: float
    k: float


@dataclass(frozen=True)
class StationScores:
    """Each station given all others.

    Attributes
    ----------
    score : ndarray (n,)
        Log predictive density [-].
    k : ndarray (n,)
        k-hat of the weights that leave it out [-].
    below : ndarray (n,)
        Share of its prediction below it [-].
    """

    score: Array
    k: Array
    below: Array


def log_likelihoods(residual: Array, precision: Array) -> Array:
    """ln p(y_i | the other stations, draw) = ln(Q_ii / 2 pi) / 2 - (Q r)_i^2 / (2 Q_ii).

    Parameters
    ----------
    residual : ndarray (m, n)
        r of each draw [unit of the station].
    precision : ndarray (n, n)
        Q, the inverse of the covariance of the errors.

    Returns
    -------
    ndarray (m, n)
        [ln of 1 / unit of the station]; NaN of a draw that failed.
    """
    own = np.diag(precision)
    return np.asarray(0.5 * np.log(own / (2.0 * np.pi)) - 0.5 * (residual @ precision) ** 2 / own)


def leave_one_out(residual: Array, precision: Array, weights: Array) -> StationScores:
    """Every station left out in turn.

        p(y_i | others, draw) = N(y_i - Q_ii^-1 (Q r)_i, Q_ii^-1),   Q = C^-1,   r the residual of the draw

    Draws of the posterior without i have the weights w / p(y_i | others), smoothed; their k-hat shows whether these are
    to be trusted.

    Parameters
    ----------
    residual : ndarray (m, n)
        Of the draws [unit of the station].
    precision : ndarray (n, n)
        Q, the inverse of the covariance C of the errors.
    weights : ndarray (m,)
        Above 0 [-].

    References
    ----------
    Buerkner, Gabry and Vehtari (2021), doi:10.1007/s00180-020-01045-4; Vehtari et al. (2024).
    """
    logs = log_likelihoods(residual, precision)
    away = (residual @ precision) / np.sqrt(np.diag(precision))
    score, k, below = (np.empty(residual.shape[1]) for _ in range(3))
    for i in range(residual.shape[1]):
        others, k[i] = pareto_smoothed(np.log(weights) - logs[:, i])
        score[i] = _log_mean(logs[:, i], others)
        below[i] = others @ ndtr(away[:, i])
    return StationScores(score, k, below)


def leave_out(residual: Array, precision: Array, weights: Array, group: np.ndarray) -> LeftOut:
    """p(y_g | others, draw) = N(y_g; y_g - Q_gg^-1 (Q r)_g, Q_gg^-1), the stations g left out together.

    Parameters
    ----------
    residual : ndarray (m, n)
    precision : ndarray (n, n)
    weights : ndarray (m,)
        As of `leave_one_out`.
    group : ndarray (k,)
        g, columns of the residual.
    """
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
    """Share of measurements within the band that should hold `level` of them: |F - 1/2| < level / 2.

    Parameters
    ----------
    below : ndarray (n,)
        F, the share of each prediction below its measurement [-].
    level : float
        [-]

    Returns
    -------
    float
        [-]
    """
    return float(np.mean(np.abs(below - 0.5) < 0.5 * level))
