"""Priors, and three coordinates of a member: its parameters theta in their units, s = F(theta) in the unit cube, and
z = Phi^-1(s), in which every prior is standard normal. F is the distribution function of the prior, Phi that of the
standard normal distribution.

scipy.stats is imported where it is needed: it takes longer than all else that reads a case.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri

from vegglue.arrays import Array
from vegglue.case.schema import Case, Parameter
from vegglue.case.site_schema import Value
from vegglue.errors import InputError, shown_path

# Distance [-] kept from probabilities 0 and 1, where an unbounded prior is infinite: half the spacing of 2^30 points.
SMALLEST_PROBABILITY = 2.0**-31


def quantile(prior: Parameter, probability: ArrayLike) -> NDArray[np.float64]:
    """x = F^-1(probability), F(x) = P(X <= x).

    Parameters
    ----------
    probability : array_like
        Shares [-]; at 0 and 1 the result is a bound of the prior, which may be infinite.

    Returns
    -------
    ndarray
        Same shape [unit of the prior].
    """
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
    """F(x) = P(X <= x), the inverse of `quantile`.

    Parameters
    ----------
    value : array_like
        x [unit of the prior].

    Returns
    -------
    ndarray
        Same shape [-].
    """
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
    """x_ij = F_j^-1(s_ij) with s the `sobol_points`.

    Returns
    -------
    dict of str to (members,) [unit of its prior]
    """
    if not parameters:
        return {}
    points = sobol_points(len(parameters), members, seed)
    return {name: quantile(prior, points[:, j]) for j, (name, prior) in enumerate(parameters.items())}


def sobol_points(parameters: int, members: int, seed: int) -> NDArray[np.float64]:
    """s_ij, the first points of the scrambled Sobol' sequence in the unit cube.

    Returns
    -------
    ndarray (members, parameters)
        Shares [-]. The first points of a longer sequence are the same: it is drawn up to the next power of two.

    References
    ----------
    Owen (1998), https://doi.org/10.1006/jcom.1998.0487.
    """
    from scipy.stats import qmc

    sequence = qmc.Sobol(parameters, scramble=True, seed=seed)
    points = sequence.random_base2(math.ceil(math.log2(members)))[:members]
    return np.clip(points, SMALLEST_PROBABILITY, 1.0 - SMALLEST_PROBABILITY)


def _numbers(prior: Parameter) -> dict[str, float]:
    keys = ("low", "high", "mean", "sd", "median", "log_sd")
    return {key: math.nan if (value := getattr(prior, key)) is None else value for key in keys}


Bounds = tuple[float, float]
# Largest |z|: beyond it lies a probability of 1e-9, as good as the bound of the prior.
FURTHEST = 6.0


def refuse_without_parameters(case: Case) -> None:
    """Errors: InputError for a case with nothing to calibrate."""
    if not case.parameters:
        raise InputError(f"{shown_path(case.source)}: `parameters` expected a prior or more, got none: add one.")


def theta_at(case: Case, z: Array) -> dict[str, Array]:
    """theta_j = F_j^-1(Phi(z_j)) of each parameter, {name: (m,)} [its unit].

    Parameters
    ----------
    z : (m, p) or (p,) [-]
        Held within FURTHEST of 0.
    """
    return parameters_at(case, ndtr(np.clip(np.atleast_2d(z), -FURTHEST, FURTHEST)))


def thetas_at(case: Case, z: Array) -> list[dict[str, float]]:
    """`theta_at` z (m, p), one member after the other [units of the parameters]."""
    theta = theta_at(case, z)
    return [{name: float(values[member]) for name, values in theta.items()} for member in range(len(z))]


def z_at(case: Case, theta: dict[str, Array]) -> Array:
    """z_j = Phi^-1(F_j(theta_j)) (m, p) [-], the inverse of `theta_at`, at most FURTHEST from 0.

    Parameters
    ----------
    theta : dict of str to (m,) [its unit]
    """
    columns = [_normal(prior, theta[name]) for name, prior in case.parameters.items()]
    return np.column_stack(columns)


def z_of(prior: Parameter, value: float) -> float:
    """z = Phi^-1(F(value)) [-], at most FURTHEST from 0.

    Parameters
    ----------
    value : [unit of the prior]
    """
    return float(_normal(prior, np.array([value]))[0])


def _normal(prior: Parameter, values: Array) -> Array:
    return np.clip(ndtri(probability(prior, values)), -FURTHEST, FURTHEST)


@dataclass(frozen=True)
class PriorSample:
    """Members as points of the unit cube and as theta, made of them once.

    Stored, solved and compared is this theta: made again of some of the points, its last digits may differ.

    Attributes
    ----------
    points
        s (m, p) [-].
    theta
        {parameter: (m,)} [its unit].
    """

    points: Array
    theta: dict[str, Array]

    def take(self, members: NDArray[np.int64]) -> "PriorSample":
        """Some of the members, by index (n,); their theta is copied and not computed again."""
        return PriorSample(self.points[members], {name: values[members] for name, values in self.theta.items()})


def sobol_sample(case: Case) -> PriorSample:
    """s_ij of the scrambled Sobol' sequence, theta_ij = F_j^-1(s_ij): the members of a case.

    Parameters
    ----------
    case : Case
        With the priors F_j, the number of members and the seed.
    """
    return sample_at(case, sobol_points(len(case.parameters), case.simulate.members, case.simulate.seed))


def sample_at(case: Case, points: Array) -> PriorSample:
    """Members at points s (m, p) of the unit cube."""
    return PriorSample(points, parameters_at(case, points))


def sample_of(case: Case, theta: Mapping[str, Array]) -> PriorSample:
    """s_j = F_j(theta_j): members with these parameters.

    Parameters
    ----------
    theta : mapping of str to (m,) [its unit]
    """
    values = {name: np.asarray(theta[name], dtype=np.float64) for name in case.parameters}
    columns = [probability(prior, values[name]) for name, prior in case.parameters.items()]
    return PriorSample(np.column_stack(columns), values)


def parameters_at(case: Case, points: Array) -> dict[str, Array]:
    """theta_j = F_j^-1(s_j), {parameter: (m,)} [its unit].

    Parameters
    ----------
    points : s (m, p) [-]
    """
    return {name: quantile(prior, points[:, j]) for j, (name, prior) in enumerate(case.parameters.items())}


def middle_value(case: Case, value: Value) -> float:
    """The number, or the median of the prior of the parameter of that name [its unit]."""
    return value_at(case, value, 0.5)


def value_at(case: Case, value: Value, share: float) -> float:
    """A quantile of a value: the number itself, or that of the prior of the parameter of that name.

    Parameters
    ----------
    value : float or str
        A number, or the name of a parameter.
    share : float
        Of the prior that lies below [-].

    Returns
    -------
    float
        [its unit]
    """
    return float(quantile(case.parameters[value], share)) if isinstance(value, str) else value


def prior_range(case: Case, value: Value) -> Bounds:
    """What a value may be: 95 % of its prior, or itself twice [its unit].

    Parameters
    ----------
    value : float or str
        A number, or the name of a parameter.
    """
    if isinstance(value, str):
        low, high = quantile(case.parameters[value], [0.025, 0.975])
        return float(low), float(high)
    return value, value
