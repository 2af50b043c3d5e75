"""The correlation and the size of the errors, from the residual of a calibrated model, by maximum likelihood."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.linalg
import scipy.special

from vegglue.arrays import Array
from vegglue.calibration.noise import Noise, covariance_of, with_correlation
from vegglue.parallel import in_threads

# Rise of twice the log-likelihood with a free scale s, above which stated errors count as too small [-]: the 99 % point
# of chi2 with one degree of freedom.
SCALE_EVIDENCE = 6.6
# Correlations rho and sizes t [-] of a coarse grid, from the best pair of which the maximum likelihood is searched.
# Chosen, not measured: more pairs cost time and guard against a local maximum.
START_CORRELATIONS, START_SIZES = (0.03, 0.2, 0.4, 0.6, 0.8), (0.01, 0.1, 1.0, 10.0)
# rho is searched below this [-]: a covariance of rho = 1 has no inverse.
LARGEST_RHO = 0.98
# Values of rho [-] of which the posterior probability is computed, and the prior probability of rho = 0: the data alone
# decide between some correlation and none. Chosen, not measured: closer levels only cost time.
LEVEL_STEP, UNCORRELATED_CHANCE = 0.05, 0.5
CORRELATION_LEVELS = LEVEL_STEP * np.arange(1, 20)


def estimate_noise(noise: Noise, residual: Array, gram: Array) -> Noise:
    """rho and s of the errors by maximum likelihood of the residual r (n,), measured minus predicted.

        r ~ N(0, cov(rho, s) + t^2 F F')

    gram: F F' (n, n), F (n, k) changes of the predictions that calibration and missing effects could make, each of
    plausible size; t scales them all. A misfit that they could make is not taken for errors. rho >= 0; s differs from 1
    only when the likelihood rejects the stated errors at 1 %, and is never below 1.

    Errors that are smaller than stated look correlated where s is 1: a covariance with rho near 1 expects smaller
    differences. So the chances of each rho are those of the s that fits best, where this is below 1; rho is the median
    of these chances, 0 unless some correlation is likelier than none.
    """
    deviance, neighbours = _deviance_of(noise, residual, gram), _has_neighbours(noise)
    correlations = [[0.0], START_CORRELATIONS] if neighbours else [[0.0]]
    fits = in_threads(partial(_likeliest, deviance), itertools.product(correlations, [False, True]))
    (stated_without, free_without), (stated, free) = fits[:2], fits[-2:]
    rejected = stated.deviance - free.deviance > SCALE_EVIDENCE and free.scale > 1.0
    scale = free.scale if rejected else 1.0
    if not neighbours:
        return with_correlation(noise, 0.0, scale)
    best, none = (free, free_without) if rejected or free.scale < 1.0 else (stated, stated_without)
    chances = _correlation_chances(lambda rho: deviance(rho, best.scale, best.log_size), none.deviance)
    rho = _median(chances)
    found = with_correlation(noise, rho if rho > LEVEL_STEP else 0.0, scale)
    return replace(found, correlation_chances=chances)


@dataclass(frozen=True)
class _Likeliest:
    """The maximum of the likelihood: -2 ln L up to a constant, s and ln t there."""

    deviance: float
    scale: float
    log_size: float


def _likeliest(
    deviance: Callable[[float, float, float], float],
    correlations: Sequence[float],
    scale_free: bool,
) -> _Likeliest:
    """The least of -2 ln L by Nelder and Mead, from the best pair of rho and ln t; rho stays 0 where that is given."""
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


def _has_neighbours(noise: Noise) -> bool:
    """Whether two stations share a section, so that the data know of a correlation."""
    return bool((np.isfinite(noise.separation) & ~np.eye(noise.rows.size, dtype=bool)).any())


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
        # Asked by name, and for the transpose, which it need not copy: half the time of scipy's own words for it.
        factor, failed = scipy.linalg.lapack.dpotrf(covariance.T, lower=1, clean=0, overwrite_a=1)
        if failed:
            return np.inf
        solved, _ = scipy.linalg.lapack.dpotrs(factor, residual, lower=1)
        return float(2.0 * np.log(np.diag(factor)).sum() + residual @ solved)

    return deviance


def _correlation_chances(deviance: Callable[[float], float], uncorrelated: float) -> Array:
    """Values of rho, 0 the first, and the posterior probability of each (2, k).

    deviance: rho -> -2 ln likelihood; uncorrelated: the least one with rho = 0, whose s and t are its own.
    """
    costs = np.array([uncorrelated, *(deviance(float(level)) for level in CORRELATION_LEVELS)])
    share = (1.0 - UNCORRELATED_CHANCE) / CORRELATION_LEVELS.size
    chance = np.array([UNCORRELATED_CHANCE, *[share] * CORRELATION_LEVELS.size]) * np.exp(-0.5 * (costs - costs.min()))
    return np.stack([np.concatenate([[0.0], CORRELATION_LEVELS]), chance / chance.sum()])


def _median(chances: Array) -> float:
    """Median rho [-] of values, 0 the first, and their chances (2, k); each other value stands for what is nearest."""
    (_, *levels), below = chances[0], np.cumsum(chances[1])
    edges = [levels[0] - 0.5 * LEVEL_STEP, *(np.array(levels) + 0.5 * LEVEL_STEP)]
    return 0.0 if below[0] >= 0.5 else float(np.interp(0.5, below, edges))
