"""Draws from a posterior by adaptive importance sampling.

    w_i = p(z_i) / q(z_i),   q the mixture of the proposals of all rounds

p comes from a run of the flow model at every draw. A proposal is a mixture of Student's t distributions. Between rounds
a polynomial emulator of the model, fitted to its runs, shapes the next proposal: it decides how many draws are
effective, and never what the result is.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations_with_replacement

import numpy as np
from scipy.special import chdtri, gammaln, logsumexp, ndtri

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.inference.weighted_statistics import effective_size, systematic_draws
from vegglue.progress import silent

# Degrees of freedom of every component: tails heavy enough for a posterior that is not normal.
FREEDOM = 5.0
# The numbers below are chosen, not measured: they trade time for effective draws, and no weight depends on them.
# Effective draws that a fit of the mixture needs; with fewer the weights are tempered, w^t with t < 1.
EFFECTIVE_TO_FIT = 200
# Rounds of adaptation, draws in each (of an emulator, which cost little); components at most, and added in a round.
ADAPTATION_ROUNDS, EMULATED_DRAWS, MOST_COMPONENTS, COMPONENTS_ADDED = 8, 4096, 12, 3
# Rounds whose draws are pooled; draws of equal weight that a fit is made to, in so many steps.
ROUNDS_POOLED, DRAWS_FITTED, FIT_STEPS = 3, 2000, 10
# Share that is handed out evenly after each fit: a component that nothing belongs to for once can grow again.
SHARED_EVENLY = 0.05
# Steps that halve the range of the power t in w^t: 1 in 2^40 is left of it.
HALVINGS = 40
# Share of the effective draws given up to cover the tails, for a normal density: the mixture adapts to a flatter one.
TAIL_SHARE = 0.2
# Adaptation ends when this share of the draws is effective, or when a round gains less than this factor on the last.
WELL_ADAPTED, LEAST_GAIN = 0.85, 1.03


@dataclass(frozen=True)
class Mixture:
    """sum_k share_k t(centre_k, lower_k lower_k'), of FREEDOM degrees of freedom

    Attributes
    ----------
    share : ndarray (k,)
        Of sum 1 [-].
    centre : ndarray (k, p)
    lower : ndarray (k, p, p)
        Lower Cholesky factors.
    """

    share: Array
    centre: Array
    lower: Array


def mixture_at_modes(centres: Array, covariances: Array, log_mass: Array) -> Mixture:
    """A component t(centre_k, cov_k) for each mode, share_k ~ exp(ln mass_k).

    Parameters
    ----------
    centres : ndarray (k, p)
    covariances : ndarray (k, p, p)
    log_mass : ndarray (k,)
        Up to a constant [-].
    """
    return Mixture(np.exp(log_mass - logsumexp(log_mass)), centres, np.asarray(np.linalg.cholesky(covariances), float))


def draw(mixture: Mixture, points: Array) -> Array:
    """z = centre_k + (f / chi2_f)^(1/2) lower_k e,   k drawn by the shares, e ~ N(0, 1), f = FREEDOM.

    Parameters
    ----------
    points : ndarray (m, p + 2)
        Of the unit cube: the first column draws k, the second chi2, the others e.

    Returns
    -------
    ndarray (m, p)
    """
    points = np.clip(points, 1e-9, 1.0 - 1e-9)
    which = np.minimum(np.searchsorted(np.cumsum(mixture.share), points[:, 0]), mixture.share.size - 1)
    stretch = np.sqrt(FREEDOM / chdtri(FREEDOM, points[:, 1]))
    away = np.einsum("mij,mj->mi", mixture.lower[which], ndtri(points[:, 2:]))
    return np.asarray(mixture.centre[which] + stretch[:, None] * away)


def log_density(mixture: Mixture, z: Array) -> Array:
    """ln q(z) = ln sum_k share_k t_k(z).

    Parameters
    ----------
    z : ndarray (m, p)

    Returns
    -------
    ndarray (m,)
    """
    return _log_of_sum(_parts(mixture, z)[0])


def _log_of_sum(logs: Array) -> Array:
    """ln sum_k exp(l_k), (k, m) -> (m,), some l_k finite: scipy's, for any values, takes 3 to 12 times as long."""
    highest = logs.max(axis=0)
    return np.asarray(highest + np.log(np.exp(logs - highest).sum(axis=0)))


def _parts(mixture: Mixture, z: Array) -> tuple[Array, Array]:
    """ln share_k t_k(z) and the squared distance from each centre, (k, m) both."""
    p = z.shape[1]
    inside = np.linalg.inv(mixture.lower) @ (z.T - mixture.centre[:, :, None])
    away = np.einsum("kpm,kpm->km", inside, inside)
    scale = np.log(np.diagonal(mixture.lower, axis1=1, axis2=2)).sum(axis=1)
    constant = gammaln(0.5 * (FREEDOM + p)) - gammaln(0.5 * FREEDOM) - 0.5 * p * np.log(FREEDOM * np.pi)
    logs = (np.log(mixture.share) + constant - scale)[:, None] - 0.5 * (FREEDOM + p) * np.log1p(away / FREEDOM)
    return logs, away


def pooled_weights(log_target: Array, z: Array, rounds: list[tuple[int, Mixture]]) -> Array:
    """w_i = p(z_i) / sum_r (n_r / n) q_r(z_i)

    Parameters
    ----------
    log_target : ndarray (n,)
        ln p up to a constant.
    z : ndarray (n, p)
    rounds : list of (int, Mixture)
        n_r, the draws of each round, and q_r, the mixture they are drawn from.

    Returns
    -------
    ndarray (n,)
        [-], of sum 1.

    References
    ----------
    Cornuet et al. (2012), https://doi.org/10.1111/j.1467-9469.2011.00756.x.
    """
    sizes = np.array([size for size, _ in rounds], float)
    logs = np.stack([log_density(mixture, z) for _, mixture in rounds])
    log_weight = log_target - _log_of_sum(logs + np.log(sizes / sizes.sum())[:, None])
    weights = np.exp(log_weight - np.max(log_weight))
    return np.asarray(weights / weights.sum())


def adapt(target: Callable[[Array], Array], start: Mixture, seed: int) -> Mixture:
    """A mixture moved, reshaped and split until it resembles a density.

    It resembles it if WELL_ADAPTED of the draws are effective, or if a round brings less than LEAST_GAIN of the last.

    Parameters
    ----------
    target : callable
        z (m, p) -> log density (m,), up to a constant.
    """
    random, p = np.random.default_rng(seed), start.centre.shape[1]
    # b < 1 with (b (2 - b))^(p / 2) = 1 - TAIL_SHARE, the effective share of draws from p^b, p normal.
    power = float(1.0 - np.sqrt(1.0 - (1.0 - TAIL_SHARE) ** (2.0 / p)))
    mixture, before = start, 0.0
    rounds: list[tuple[int, Mixture]] = []
    parts: list[tuple[Array, Array]] = []
    for _ in range(ADAPTATION_ROUNDS):
        new = draw(mixture, random.random((EMULATED_DRAWS, p + 2)))
        logs = power * target(new)
        rounds = [*rounds[1 - ROUNDS_POOLED :], (EMULATED_DRAWS, mixture)]
        parts = [*parts[1 - ROUNDS_POOLED :], (new, logs)]
        share = effective_size(pooled_weights(logs, new, rounds[-1:])) / EMULATED_DRAWS
        if share > WELL_ADAPTED or 0.5 < share < LEAST_GAIN * before:
            break
        before = share
        z, logs = (np.concatenate(part) for part in zip(*parts, strict=True))
        weights = tempered(pooled_weights(logs, z, rounds), EFFECTIVE_TO_FIT)
        equal = z[systematic_draws(weights, DRAWS_FITTED, random)]
        more, k = min(COMPONENTS_ADDED, MOST_COMPONENTS - mixture.share.size), mixture.share.size
        if more > 0:
            # More components at some of the draws, half as wide as all of them together.
            spread = np.cov(equal.T, ddof=0).reshape(p, -1) / 4.0
            lower = np.linalg.cholesky(spread + 1e-6 * np.diag(np.diag(spread)) + 1e-300 * np.eye(p))
            mixture = Mixture(
                np.concatenate([mixture.share * k, np.ones(more)]) / (k + more),
                np.concatenate([mixture.centre, equal[random.choice(len(equal), more, replace=False)]]),
                np.concatenate([mixture.lower, np.tile(lower, (more, 1, 1))]),
            )
        for _ in range(FIT_STEPS):
            mixture = _expectation_maximisation(mixture, equal, effective_size(weights))
    return mixture


def tempered(weights: Array, wanted: float) -> Array:
    """w^t / sum w^t with the largest t in 0 to 1 for which enough draws are effective.

    Parameters
    ----------
    weights : ndarray (m,)
        w, of sum 1 [-].
    wanted : float
        Effective draws at least.

    Returns
    -------
    ndarray (m,)
        [-], of sum 1.
    """
    if effective_size(weights) >= wanted:
        return weights
    low, high = 0.0, 1.0
    logs = np.log(np.maximum(weights, 1e-300))
    logs -= logs.max()
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        enough = effective_size(np.exp(middle * logs)) >= wanted
        low, high = (middle, high) if enough else (low, middle)
    return np.asarray(np.exp(low * logs) / np.exp(low * logs).sum())


def _expectation_maximisation(mixture: Mixture, z: Array, effective: float) -> Mixture:
    """One step of expectation and maximisation for a mixture of t's (Cappé et al. 2008, doi:10.1007/s11222-008-9059-x).

    z (m, p): draws of equal weight; effective: their effective number. A component that few of them belong to keeps
    most of its shape.
    """
    logs, away = _parts(mixture, z)
    belongs = np.exp(logs - _log_of_sum(logs)) / len(z)
    share, p = belongs.sum(axis=1), z.shape[1]
    gain = belongs * (FREEDOM + p) / (FREEDOM + away)
    centre, lower = mixture.centre.copy(), mixture.lower.copy()
    for k in np.flatnonzero(share * effective > 1.0):
        centre[k] = gain[k] @ z / gain[k].sum()
        scatter = (z - centre[k]).T @ ((z - centre[k]) * gain[k, :, None])
        kept = 2.0 * p / effective
        lower[k] = np.linalg.cholesky((scatter + kept * lower[k] @ lower[k].T) / (share[k] + kept))
    share = (share + SHARED_EVENLY / share.size) / (1.0 + SHARED_EVENLY)
    return replace(mixture, share=share, centre=centre, lower=lower)


# Degree of the polynomial at most. Chosen, not measured: coefficients grow as p^4 / 24, and each needs runs.
HIGHEST_DEGREE = 4
# Least runs for each coefficient. Chosen, not measured: a polynomial through fewer would follow single runs.
RUNS_PER_COEFFICIENT = 2.0
# Ridge over the mean square of a term [-]: keeps the normal equations solvable where runs leave a term undetermined.
RIDGE = 1e-6
# Fall of the log density below the best run [per parameter] at which the root of a run's weight is a half. Chosen, not
# measured: a smaller one fits the mode more closely and the tails less.
HALF_WEIGHT_DROP = 5.0
# Parts into which runs are cut, to find the degree that predicts those held out. Chosen, not measured.
HELD_OUT_PARTS = 4
# Fall of the log density below the best run [per parameter] beyond which how far it falls does not matter: chosen. With
# two parameters a draw of a normal posterior falls so far with a chance of 2e-9, with more less often.
NO_CHANCE_DROP = 10.0


@dataclass(frozen=True)
class Emulator:
    """values(z) = sum_b coefficient_b prod_j u_j^(powers of b),   u = lower^-1 (z - centre)

    Attributes
    ----------
    centre : ndarray (p,)
    lower : ndarray (p, p)
    powers : tuple of tuple of int
        Of each term b the power of each u_j.
    coefficient : ndarray (b, n)
    """

    centre: Array
    lower: Array
    powers: tuple[tuple[int, ...], ...]
    coefficient: Array

    def predict(self, z: Array) -> Array:
        """Values (m, n) at z (m, p)."""
        return np.asarray(_terms(_standardised(z, self.centre, self.lower), self.powers) @ self.coefficient)


def emulator_of_density(
    z: Array, values: Array, density: Callable[[Array, Array], Array], centre: Array, lower: Array
) -> Emulator:
    """`fit_emulator` of the degree with which a part of the runs predicts the density of the others best.

        sum_i weight_i (l_emulated(z_i) - l(z_i))^2,   i among the runs held out, weights as in `fit_emulator`

    A degree that the runs determine and that does not bend as the model does swings beyond them, where the next are
    then drawn.

    Parameters
    ----------
    z : ndarray (m, p)
        Of the runs.
    values : ndarray (m, n)
        Of each run.
    density : callable
        z (m, p), values (m, n) -> l = ln p(z) up to a constant (m,), -inf or NaN where a run failed.
    centre, lower : ndarray (p,), (p, p)
        Of the coordinates of the polynomial, see `Emulator`.

    Returns
    -------
    Emulator
        Of degree 2 to HIGHEST_DEGREE.
    """
    logs = density(z, values)
    known = np.isfinite(logs)
    z, values, logs = z[known], values[known], logs[known]
    part, weight = np.arange(len(z)) % HELD_OUT_PARTS, _weights(logs, z.shape[1])
    least = logs.max() - NO_CHANCE_DROP * z.shape[1]

    def error(degree: int) -> float:
        found = np.empty(len(z))
        for k in range(HELD_OUT_PARTS):
            seen = part != k
            emulator = fit_emulator(z[seen], values[seen], logs[seen], centre, lower, degree)
            found[~seen] = density(z[~seen], emulator.predict(z[~seen]))
        return float(weight @ (np.maximum(found, least) - np.maximum(logs, least)) ** 2)

    return fit_emulator(z, values, logs, centre, lower, min(range(2, HIGHEST_DEGREE + 1), key=error))


def fit_emulator(
    z: Array, values: Array, log_density: Array, centre: Array, lower: Array, highest: int = HIGHEST_DEGREE
) -> Emulator:
    """Weighted least squares through runs, of the highest degree that they determine; best where the posterior is.

        weight = (1 + (max l - l) / (HALF_WEIGHT_DROP p))^-2,   u = lower^-1 (z - centre) the variables

    Parameters
    ----------
    z : ndarray (m, p)
    values : ndarray (m, n)
    log_density : ndarray (m,)
        l of each run.
    centre : ndarray (p,)
    lower : ndarray (p, p)
    highest : int
        Highest degree.
    """
    known = np.isfinite(log_density)
    z, values, log_density = z[known], values[known], log_density[known]
    p = z.shape[1]
    degrees = range(2, highest + 1)
    degree = max((d for d in degrees if RUNS_PER_COEFFICIENT * math.comb(p + d, d) <= len(z)), default=1)
    powers = tuple(
        tuple(chosen.count(j) for j in range(p))
        for d in range(degree + 1)
        for chosen in combinations_with_replacement(range(p), d)
    )
    terms = _terms(_standardised(z, centre, lower), powers)
    weight = _weights(log_density, p)
    size = np.sqrt((weight @ terms**2) / weight.sum())
    root = np.sqrt(weight)[:, None]
    left = terms / size * root
    matrix = left.T @ left + RIDGE * weight.sum() * np.eye(len(powers))
    return Emulator(centre, lower, powers, np.linalg.solve(matrix, left.T @ (values * root)) / size[:, None])


def _weights(log_density: Array, parameters: int) -> Array:
    """Of runs in a fit (m,)."""
    return np.asarray(1.0 / (1.0 + (log_density.max() - log_density) / (HALF_WEIGHT_DROP * parameters)) ** 2)


def _standardised(z: Array, centre: Array, lower: Array) -> Array:
    return np.asarray(np.linalg.solve(lower, (z - centre).T).T, np.float64)


def _terms(u: Array, powers: tuple[tuple[int, ...], ...]) -> Array:
    """prod_j u_j^powers (m, b)."""
    table = np.stack([u**d for d in range(HIGHEST_DEGREE + 1)])
    terms = np.ones((len(u), len(powers)))
    for b, power in enumerate(powers):
        for j, d in enumerate(power):
            if d:
                terms[:, b] *= table[d, :, j]
    return terms


# Rounds at most, draws of the first, and of any other at most. Chosen, not measured: they bound the runs of the model
# (5,696 at most), and a larger first round makes a better emulator of a proposal that may be poor.
SAMPLING_ROUNDS, FIRST_DRAWS, MOST_DRAWS = 7, 192, 1024
# Draws of a round over those before at most: chosen, so that a proposal that turns out to be poor costs two thirds of
# all draws so far, while 192 draws and two more rounds are enough for 1,000 effective ones of six in ten.
GROWTH = 2
# Draws with a density below which nothing is drawn anew: the emulator predicts each from others.
FEWEST_SOLVED = 2
# Effective share of the draws [-] below which the next round is small, and the least that is hoped for of another,
# as proposals get better; what is drawn over what is missing, for hope may be wrong. Chosen, not measured.
POOR_SHARE, HOPED_SHARE, OVER_MISSING = 0.25, 0.75, 1.05
# Draws come in sets of this size: neighbours are solved together.
DRAWS_TOGETHER = 16
Predict = Callable[[Array], Array]
LogDensity = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Sample:
    """All draws of importance sampling.

    Attributes
    ----------
    z : ndarray (m, p)
    values : ndarray (m, n)
        Predicted there, NaN where that failed.
    log_density : ndarray (m,)
        ln p(z) up to a constant, -inf where that failed.
    weights : ndarray (m,)
        Of sum 1 [-].
    drawn : tuple of int
        Draws so far, after each round.
    effective : tuple of float
        Effective draws so far, after each round.
    """

    z: Array
    values: Array
    log_density: Array
    weights: Array
    drawn: tuple[int, ...]
    effective: tuple[float, ...]


def sample(
    predict: Predict,
    density: LogDensity,
    start: Mixture,
    wanted: int,
    seed: int,
    finished: Callable[[int], None] = silent,
) -> Sample:
    """Draws until `wanted` of them are effective, or SAMPLING_ROUNDS are over.

        w_i = p(z_i) / sum_r (n_r / n) q_r(z_i),   n_r draws of each round r from its own mixture q_r

    Parameters
    ----------
    predict : callable
        z (m, p) -> values (m, n), NaN where a run failed.
    density : callable
        z (m, p), values (m, n) -> ln p(z) up to a constant (m,).
    start : Mixture
        The proposal of the first round.
    wanted : int
        Effective draws.
    seed : int
        Of the Halton points that draws are made from.
    finished : callable
        Is called with the number of effective draws, `wanted` at most, after each round.

    Returns
    -------
    Sample
        All draws, with weights of sum 1.

    Raises
    ------
    InputError
        If fewer than FEWEST_SOLVED of the draws have a density.

    References
    ----------
    Cornuet et al. (2012), https://doi.org/10.1111/j.1467-9469.2011.00756.x.
    """
    from scipy.stats import qmc  # late: other commands need not wait for it

    def emulated(by: Emulator, at: Array) -> Array:
        return density(at, by.predict(at))

    points = qmc.Halton(start.centre.shape[1] + 2, seed=seed)
    mixture, size = start, FIRST_DRAWS
    rounds: list[tuple[int, Mixture]] = []
    parts: list[tuple[Array, Array, Array]] = []
    drawn: list[int] = []
    effective: list[float] = []
    while True:
        new = draw(mixture, points.random(size))
        values = predict(new)
        of_new = density(new, values)
        parts.append((new, values, np.where(np.isnan(of_new), -np.inf, of_new)))
        rounds.append((size, mixture))
        z, values, logs = (np.concatenate(part) for part in zip(*parts, strict=True))
        if (solved := int(np.isfinite(logs).sum())) < FEWEST_SOLVED:
            raise InputError(
                f"infer: {solved or 'none'} of the {len(z)} members drawn around the best fit was solved, too few "
                "to go on from; use `--method glue`."
            )
        weights = pooled_weights(logs, z, rounds)
        drawn.append(len(z))
        effective.append(effective_size(weights))
        finished(min(int(effective[-1]), wanted))
        if effective[-1] >= wanted or len(rounds) == SAMPLING_ROUNDS:
            return Sample(z, values, logs, weights, tuple(drawn), tuple(effective))
        last, share = parts[-1][2], 0.0
        if np.isfinite(last).any():
            share = effective_size(pooled_weights(last, new, rounds[-1:])) / len(new)
        emulator = emulator_of_density(z, values, density, mixture.centre[0], mixture.lower[0])
        mixture = adapt(partial(emulated, emulator), mixture, seed + len(rounds))
        # Few while only a small share of the draws is effective, else what is missing.
        size = 2 * FIRST_DRAWS
        if share >= POOR_SHARE:
            hoped = OVER_MISSING * (wanted - effective[-1]) / max(share, HOPED_SHARE)
            size = np.clip(hoped, DRAWS_TOGETHER, MOST_DRAWS)
        size = min(int(DRAWS_TOGETHER * np.ceil(size / DRAWS_TOGETHER)), GROWTH * len(z))
