"""Prior distributions: Sobol' points through their inverse distribution functions, and their density.

scipy.stats is imported where it is needed: it takes longer than all else that reads a case.
"""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri

from vegglue.case.schema import Parameter

# Distance [-] kept from probabilities 0 and 1, where an unbounded prior is infinite: half the spacing of 2^30 points.
SMALLEST_PROBABILITY = 2.0**-31


def quantile(prior: Parameter, probability: ArrayLike) -> NDArray[np.float64]:
    """x = F^-1(probability), F(x) = P(X <= x) [unit of the prior]; at 0 and 1 its bounds, which may be infinite."""
    number, share = _numbers(prior), np.asarray(probability, dtype=np.float64)
    if prior.distribution == "uniform":
        return np.asarray(number["low"] + share * (number["high"] - number["low"]))
    if prior.distribution == "loguniform":
        return np.asarray(number["low"] * (number["high"] / number["low"]) ** share)
    if prior.distribution == "lognormal":
        return np.asarray(number["median"] * np.exp(number["log_sd"] * ndtri(share)))
    return _truncated_normal(number["mean"], number["sd"], prior.low, prior.high, share)


def _truncated_normal(
    mean: float, sd: float, low: float | None, high: float | None, share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """x = mean + sd Phi^-1(A + q (B - A)), with A and B = Phi of the bounds and q the share.

    Where both bounds lie above the mean, the distribution is mirrored: A and B close to 1 would lose their digits.
    """
    a, b = _standard_bounds(mean, sd, low, high)
    if a > 0.0:
        mirrored = _truncated_normal(-mean, sd, None if high is None else -high, -low, 1.0 - share)  # type: ignore[operator]
        return np.asarray(-mirrored)
    below, above = ndtr(a), ndtr(b)
    return np.clip(mean + sd * ndtri(below + share * (above - below)), low, high)


def probability(prior: Parameter, value: ArrayLike) -> NDArray[np.float64]:
    """F(x) = P(X <= x) [-], the inverse of `quantile`; x in the unit of the prior."""
    number, x = _numbers(prior), np.asarray(value, dtype=np.float64)
    if prior.distribution == "uniform":
        return np.clip((x - number["low"]) / (number["high"] - number["low"]), 0.0, 1.0)
    if prior.distribution == "loguniform":
        low, high = np.log(number["low"]), np.log(number["high"])
        return (np.log(np.clip(x, number["low"], number["high"])) - low) / (high - low)
    if prior.distribution == "lognormal":
        with np.errstate(divide="ignore"):  # Phi(-inf) = 0 is what lies below 0
            return np.asarray(ndtr(np.log(np.maximum(x / number["median"], 0.0)) / number["log_sd"]))
    a, b = _standard_bounds(number["mean"], number["sd"], prior.low, prior.high)
    place = np.clip((x - number["mean"]) / number["sd"], a, b)
    return np.asarray(_normal_mass(a, place) / _normal_mass(a, b))


def _normal_mass(low: float, high: ArrayLike) -> NDArray[np.float64]:
    """Phi(high) - Phi(low), from the tail in which both keep their digits; low <= high."""
    return np.asarray(ndtr(-low) - ndtr(np.negative(high)) if low > 0.0 else ndtr(high) - ndtr(low))


def _standard_bounds(mean: float, sd: float, low: float | None, high: float | None) -> tuple[float, float]:
    """The bounds of a normal prior in standard deviations from its mean; infinite where there is none."""
    return -math.inf if low is None else (low - mean) / sd, math.inf if high is None else (high - mean) / sd


def sample_prior(parameters: Mapping[str, Parameter], members: int, seed: int) -> dict[str, NDArray[np.float64]]:
    """x_ij = F_j^-1(s_ij) with s the `sobol_points`; an array (members,) for each parameter [unit of its prior]."""
    if not parameters:
        return {}
    points = sobol_points(len(parameters), members, seed)
    return {name: quantile(prior, points[:, j]) for j, (name, prior) in enumerate(parameters.items())}


def sobol_points(parameters: int, members: int, seed: int) -> NDArray[np.float64]:
    """s_ij, the first points of the scrambled Sobol' sequence in the unit cube, (members, parameters) [-].

    The first points of a longer sequence are the same, because it is drawn up to the next power of two.
    Source: Owen (1998), https://doi.org/10.1006/jcom.1998.0487.
    """
    from scipy.stats import qmc

    sequence = qmc.Sobol(parameters, scramble=True, seed=seed)
    points = sequence.random_base2(math.ceil(math.log2(members)))[:members]
    return np.clip(points, SMALLEST_PROBABILITY, 1.0 - SMALLEST_PROBABILITY)


def log_prior(parameters: Mapping[str, Parameter], theta: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
    """log p(theta) = sum_j log p_j(theta_j) (members,), as priors are independent; -inf outside a bound.

    theta: values (members,) of each parameter [unit of its prior].
    """
    terms = [np.asarray(_distribution(prior).logpdf(theta[name])) for name, prior in parameters.items()]
    return np.sum(terms, axis=0, dtype=np.float64)


@lru_cache(maxsize=256)  # scipy takes a millisecond to make one
def _distribution(prior: Parameter) -> Any:
    import scipy.stats

    number = _numbers(prior)
    if prior.distribution == "uniform":
        return scipy.stats.uniform(number["low"], number["high"] - number["low"])
    if prior.distribution == "loguniform":
        return scipy.stats.loguniform(number["low"], number["high"])
    if prior.distribution == "lognormal":
        return scipy.stats.lognorm(number["log_sd"], scale=number["median"])
    mean, sd = number["mean"], number["sd"]
    return scipy.stats.truncnorm(*_standard_bounds(mean, sd, prior.low, prior.high), loc=mean, scale=sd)


def _numbers(prior: Parameter) -> dict[str, float]:
    keys = ("low", "high", "mean", "sd", "median", "log_sd")
    return {key: math.nan if (value := getattr(prior, key)) is None else value for key in keys}
