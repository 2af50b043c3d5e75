"""The covariance of the errors: those of the measurements, correlated along a section, of the grid and of the model.

    cov = s^2 D R D + E + M + O O',   R_ij = rho^(d_ij / d),   E_ij = (c + (1 - c) 1_ij) g_i g_j

D are the standard errors of the measurements and s their scale. rho is the correlation of neighbours in a section, d
their usual spacing and d_ij the distance between stations i and j, across the channel where they were measured together
across it. R_ij is 0 between sections, experiments and kinds. g is the error of discretisation and c its correlation
between two stations. M is the model's own error, see `model_error`. The columns of O are of instruments that are off:
what their readings share counts for nothing. rho and s are estimated from the residual of a calibrated model.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd
import scipy.linalg
import scipy.special

from vegglue.arrays import Array
from vegglue.decision_constants import constants
from vegglue.errors import InputError
from vegglue.measurements.kinds import correlated_rows, unstated_errors
from vegglue.measurements.observations import section_places
from vegglue.parallel import in_threads
from vegglue.wording.sentences import sentence

# What an instrument that is off adds, over the largest standard error of its readings [-]: so large that it is free,
# and the covariance can still be factored.
UNKNOWN_ERROR = 1e3
# Correlations rho and sizes t [-] of a coarse grid, from the best pair of which the maximum likelihood is searched.
# Chosen, not measured: more pairs cost time and guard against a local maximum.
START_CORRELATIONS, START_SIZES = (0.03, 0.2, 0.4, 0.6, 0.8), (0.01, 0.1, 1.0, 10.0)
# rho is searched below this [-]: a covariance of rho = 1 has no inverse.
LARGEST_RHO = 0.98
# Values of rho [-] of which the posterior probability is computed. Chosen, not measured: closer levels only cost time.
LEVEL_STEP = 0.05
CORRELATION_LEVELS = LEVEL_STEP * np.arange(1, 20)


@dataclass(frozen=True)
class Noise:
    """Measured values of the n used stations and the covariance of their errors, see the head of this file.

    Attributes
    ----------
    rows : ndarray of int (n,)
        Of the used stations among all.
    value, error : ndarray (n,)
        Measured, and standard errors as stated [m/s or m].
    separation : ndarray (n, n)
        d_ij / d [-], infinite between sections.
    grid_error : ndarray (n,)
        g [m/s or m], zero if unknown.
    grid_correlation : float
        c [-].
    correlation : float
        rho [-].
    scale : float
        s [-].
    lower : ndarray (n, n)
        Lower Cholesky factor of the covariance.
    correlation_chances : ndarray (2, k)
        Values of rho, and the posterior probability of each [-].
    model_error : ndarray (n, n)
        M, zero if the model is taken to be right.
    unknown : ndarray (n, k)
        O, of instruments that are off by an unknown amount [m/s or m].
    """

    rows: np.ndarray
    value: Array
    error: Array
    separation: Array
    grid_error: Array
    grid_correlation: float
    correlation: float
    scale: float
    lower: Array
    correlation_chances: Array
    model_error: Array
    unknown: Array

    def used(self, values: Array) -> Array:
        """The rows of the used stations (n, ...) of values of all stations (station, ...)."""
        return values[self.rows]

    def among_all(self, values: Array, stations: int) -> Array:
        """Values of the used stations (n,) among all, (station,), NaN for the others."""
        wide = np.full(stations, np.nan)
        wide[self.rows] = values
        return wide

    @property
    def data_error(self) -> Array:
        """s times the stated standard errors (n,) [m/s or m]."""
        return self.scale * self.error

    def residual(self, prediction: Array) -> Array:
        """Measured minus predicted (n,) of predictions (station,)."""
        return self.value - prediction[self.rows]

    def whiten(self, values: Array) -> Array:
        """W values (n, ...) [-], W = L^-1 with cov = L L': whitened errors are independent and standard normal."""
        wide = values.reshape(len(values), -1)
        # x' L' = values': as it lies in memory. scipy's own interface copies thousands of columns into another order.
        solved = scipy.linalg.blas.dtrsm(1.0, self.lower, wide.T, side=1, lower=1, trans_a=1).T
        return np.asarray(solved).reshape(values.shape)


def noise_of(station: pd.DataFrame, fallback: dict[str, float] | None = None) -> Noise:
    """Independent errors as stated in the data.

    Parameters
    ----------
    station : DataFrame
        All stations.
    fallback : dict of float, optional
        Standard errors by kind [unit of the kind], for stations that state none.

    Returns
    -------
    Noise
        With rho = 0, s = 1 and no error of grid or model.

    Raises
    ------
    InputError
        If no station is used, or a used one has no standard error.
    """
    used = station[station["used"]]
    if used.empty:
        raise InputError(
            "observations: no station is used, nothing can be inferred; see the output of `vegglue check`."
        )
    error = used["standard_error"].to_numpy(float).copy()
    for kind, value in (fallback or {}).items():
        error[(used["kind"] == kind).to_numpy() & ~(error > 0)] = value
    if not (error > 0).all():
        raise InputError(f"observations: {sentence(unstated_errors(used.assign(standard_error=error)))}")
    noise = Noise(
        rows=np.flatnonzero(station["used"].to_numpy()),
        value=used["value"].to_numpy(float),
        error=error,
        separation=_separation(used),
        grid_error=np.zeros(len(used)),
        grid_correlation=constants().grid_error_correlation,
        correlation=0.0,
        scale=1.0,
        lower=np.diag(error),
        correlation_chances=np.array([[0.0], [1.0]]),
        model_error=np.zeros((len(used), len(used))),
        unknown=np.zeros((len(used), 0)),
    )
    return _with_cholesky(noise)


def _separation(used: pd.DataFrame) -> Array:
    """d_ij / d (n, n) [-]: distance over the median spacing of a section; infinite between sections and kinds, and for
    kinds whose errors are not correlated. Where two of a section stand at one y it is no line: d_ij is then as it is.
    """
    separation = np.full((len(used), len(used)), np.inf)
    np.fill_diagonal(separation, 0.0)
    keys = used[["experiment", "section", "kind"]].agg("\n".join, axis=1).to_numpy()
    own = used[["x", "y"]].to_numpy(float)
    in_line = np.column_stack([section_places(used).to_numpy(float), own[:, 1]])
    for key in np.unique(keys[correlated_rows(used)]):
        here = np.flatnonzero(keys == key)
        line = np.unique(in_line[here], axis=0)
        spacing = np.median(np.hypot(*np.diff(line, axis=0).T)) if len(line) > 1 else 1.0
        x, y = (in_line if len(line) == here.size else own)[here].T
        distance = np.hypot(x[:, None] - x, y[:, None] - y)
        separation[np.ix_(here, here)] = distance / max(spacing, 1e-9)
    return separation


def with_grid_error(noise: Noise, difference: Array) -> Noise:
    """g = grid_error_share (f - f_coarse): the noise with an error of the grid.

    Parameters
    ----------
    difference : ndarray (station,)
        f - f_coarse, to cells of twice the size [unit of each station].
    """
    return _with_cholesky(replace(noise, grid_error=constants().grid_error_share * difference[noise.rows]))


def with_independent_grid_errors(noise: Noise) -> Noise:
    """The noise with c = 0, for a fit that is to predict on its own grid.

    With c > 0 the fit may shift all stations as a finer grid would, and then shifts what it predicts elsewhere.
    """
    return _with_cholesky(replace(noise, grid_correlation=0.0))


def with_correlation(noise: Noise, correlation: float, scale: float) -> Noise:
    """The noise with rho and s given, and no uncertainty of rho.

    Parameters
    ----------
    correlation, scale : float
        rho and s [-].
    """
    certain = np.array([[correlation], [1.0]])
    return _with_cholesky(replace(noise, correlation=correlation, scale=scale, correlation_chances=certain))


def with_scale(noise: Noise, scale: float) -> Noise:
    """The noise with s given [-]; rho is as uncertain as it was."""
    return _with_cholesky(replace(noise, scale=scale))


def with_model_error(noise: Noise, columns: Array) -> Noise:
    """M = columns columns': the noise with an error of the model in place of the one that it has.

    Parameters
    ----------
    columns : ndarray (station, k)
        See `model_error_columns` [unit of each station].
    """
    used = noise.used(columns)
    return _with_cholesky(replace(noise, model_error=used @ used.T))


def with_more_error(noise: Noise, columns: Array) -> Noise:
    """M + columns columns': the noise with one more error of the model.

    Parameters
    ----------
    columns : ndarray (n, k)
        Of the used stations [unit of each].
    """
    return _with_cholesky(replace(noise, model_error=noise.model_error + columns @ columns.T))


def with_unknown_errors(noise: Noise, columns: Array) -> Noise:
    """O with columns u = UNKNOWN_ERROR max(s) c / max|c| more: what an instrument that is off adds counts for nothing.

    Parameters
    ----------
    columns : ndarray (n, k)
        c, what it can add to its readings, of standard errors s; 0 elsewhere. See `candidates.error_columns`.
    """
    largest = np.where(columns != 0.0, noise.error[:, None], 0.0).max()
    unknown = UNKNOWN_ERROR * largest * columns / np.abs(columns).max(axis=0)
    return _with_cholesky(replace(noise, unknown=np.column_stack([noise.unknown, unknown])))


def draw_whitened_errors(noise: Noise, draws: int, random: np.random.Generator) -> Array:
    """W e,   e ~ N(0, cov(rho)),   rho drawn from its posterior probabilities.

    Returns
    -------
    ndarray (draws, n)
        [-]; independent and standard normal only if rho is certain.
    """
    parts = []
    levels, chances = noise.correlation_chances
    for level, count in zip(levels, random.multinomial(draws, chances), strict=True):
        lower = _with_cholesky(replace(noise, correlation=float(level))).lower
        parts.append(random.standard_normal((count, noise.rows.size)) @ noise.whiten(lower).T)
    return np.concatenate(parts)


def _with_cholesky(noise: Noise) -> Noise:
    return replace(noise, lower=np.asarray(np.linalg.cholesky(covariance_of(noise))))


def covariance_of(noise: Noise) -> Array:
    """s^2 D R D + E + M + O O', see the head of this file.

    Returns
    -------
    ndarray (n, n)
        Of the used stations [product of their units].
    """
    shared = noise.grid_correlation * np.outer(noise.grid_error, noise.grid_error)
    own = np.diag((1.0 - noise.grid_correlation) * noise.grid_error**2)
    return np.asarray(covariance_of_data(noise) + shared + own + noise.model_error + noise.unknown @ noise.unknown.T)


def covariance_of_data(noise: Noise) -> Array:
    """s^2 D R D: the covariance of the measurements' own errors.

    Returns
    -------
    ndarray (n, n)
        Of the used stations [product of their units].
    """
    rho, size = noise.correlation, noise.rows.size
    correlations = np.eye(size) if rho == 0.0 else np.exp(noise.separation * np.log(rho))
    return np.asarray(noise.scale**2 * correlations * np.outer(noise.error, noise.error))


def estimate_noise(noise: Noise, residual: Array, gram: Array) -> Noise:
    """rho and s of the errors by maximum likelihood of the residual r.

        r ~ N(0, cov(rho, s) + t^2 F F')

    F (n, k) are changes of the predictions that calibration and missing effects could make, each of plausible size; t
    scales them all. A misfit that they could make is not taken for errors. rho >= 0; s differs from 1 only if the
    likelihood rejects the stated errors at 1 %, and is never below 1.

    Errors that are smaller than stated look correlated where s is 1: a covariance with rho near 1 expects smaller
    differences. So the probabilities of each rho are those of the s that fits best, if this is below 1; rho is their
    median, 0 unless some correlation is likelier than none.

    Parameters
    ----------
    noise : Noise
        As far as it is known.
    residual : array (n,)
        Measured minus predicted [m/s or m].
    gram : array (n, n)
        F F' [squares of the units of the stations].

    Returns
    -------
    Noise
        With rho, s and the posterior probabilities of rho.
    """
    deviance = _deviance_of(noise, residual, gram)
    # Without two stations in one section the data know nothing of a correlation.
    neighbours = bool((np.isfinite(noise.separation) & ~np.eye(noise.rows.size, dtype=bool)).any())
    correlations = [[0.0], START_CORRELATIONS] if neighbours else [[0.0]]
    fits = in_threads(partial(_likeliest, deviance), itertools.product(correlations, [False, True]))
    (stated_without, free_without), (stated, free) = fits[:2], fits[-2:]
    rejected = stated.deviance - free.deviance > constants().scale_evidence and free.scale > 1.0
    scale = free.scale if rejected else 1.0
    if not neighbours:
        return with_correlation(noise, 0.0, scale)
    best, none = (free, free_without) if rejected or free.scale < 1.0 else (stated, stated_without)
    at_levels = [deviance(float(rho), best.scale, best.log_size) for rho in CORRELATION_LEVELS]
    costs = np.array([none.deviance, *at_levels])
    uncorrelated = constants().uncorrelated_chance
    share = (1.0 - uncorrelated) / CORRELATION_LEVELS.size
    chance = np.array([uncorrelated, *[share] * CORRELATION_LEVELS.size]) * np.exp(-0.5 * (costs - costs.min()))
    chance = chance / chance.sum()
    # The median; each level stands for what is nearest.
    edges, below = [0.5 * LEVEL_STEP, *(CORRELATION_LEVELS + 0.5 * LEVEL_STEP)], np.cumsum(chance)
    rho = 0.0 if below[0] >= 0.5 else float(np.interp(0.5, below, edges))
    found = with_correlation(noise, rho if rho > LEVEL_STEP else 0.0, scale)
    return replace(found, correlation_chances=np.stack([np.concatenate([[0.0], CORRELATION_LEVELS]), chance]))


@dataclass(frozen=True)
class _Likeliest:
    """The maximum of the likelihood: -2 ln L up to a constant, s and ln t there."""

    deviance: float
    scale: float
    log_size: float


def _likeliest(
    deviance: Callable[[float, float, float], float], correlations: Sequence[float], scale_free: bool
) -> _Likeliest:
    """The least of -2 ln L by Nelder and Mead, from the best pair of rho and ln t; rho stays 0 if that is given."""
    from scipy.optimize import minimize  # late: many a command and every worker estimates nothing

    pairs = itertools.product(correlations, np.log(START_SIZES))
    _, rho, size = min((deviance(rho, 1.0, size), rho, size) for rho, size in pairs)
    correlated = rho > 0.0

    def unfold(x: Array) -> tuple[float, float, float]:
        scale = np.exp(np.clip(x[1], -3.0, 3.0)) if scale_free else 1.0
        found = LARGEST_RHO * scipy.special.expit(x[-1]) if correlated else 0.0
        return float(found), float(scale), float(np.clip(x[0], -20.0, 10.0))

    begin = [size, *([0.0] if scale_free else []), *([np.log(rho / (LARGEST_RHO - rho))] if correlated else [])]
    end = minimize(
        lambda x: deviance(*unfold(x)), np.array(begin), method="Nelder-Mead", options={"xatol": 0.02, "fatol": 0.02}
    )
    _, scale, log_size = unfold(end.x)
    return _Likeliest(float(end.fun), scale, log_size)


def _deviance_of(noise: Noise, residual: Array, gram: Array) -> Callable[[float, float, float], float]:
    """-2 ln likelihood (rho, s, ln t) up to a constant; infinite where t is so large that nothing can be factored."""
    known = covariance_of(replace(noise, scale=0.0))
    variance = np.outer(noise.error, noise.error)
    # Few pairs of stations share a section: a power of all distances took more time than the factors.
    pairs = np.nonzero(np.isfinite(noise.separation) & ~np.eye(residual.size, dtype=bool))
    apart, shared, own = noise.separation[pairs], variance[pairs], np.diag(variance)

    def deviance(rho: float, scale: float, log_t: float) -> float:
        covariance = known + np.exp(2.0 * log_t) * gram
        np.einsum("ii->i", covariance)[:] += scale**2 * own
        if rho > 0.0:
            covariance[pairs] += scale**2 * shared * np.exp(apart * np.log(rho))
        # Called by name, and for the transpose, which it need not copy: half the time of scipy's own interface.
        factor, failed = scipy.linalg.lapack.dpotrf(covariance.T, lower=1, clean=0, overwrite_a=1)
        if failed:
            return np.inf
        solved, _ = scipy.linalg.lapack.dpotrs(factor, residual, lower=1)
        return float(2.0 * np.log(np.diag(factor)).sum() + residual @ solved)

    return deviance
