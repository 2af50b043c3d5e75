"""A mixture of Student's t distributions, the proposal of importance sampling: drawn from, evaluated and adapted."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from scipy.special import chdtri, gammaln, logsumexp, ndtri

from vegglue.arrays import Array
from vegglue.inference.weighted_statistics import effective_size, systematic_draws

# Degrees of freedom of every component: tails heavy enough for a posterior that is not normal.
FREEDOM = 5.0
# The numbers below are chosen, not measured: they trade time for effective draws, and no weight depends on them.
# Effective draws that a fit of the mixture asks for; with fewer the weights are tempered, w^t with t < 1.
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
    """sum_k share_k t(centre_k, lower_k lower_k'), of FREEDOM: share (k,), centre (k, p), lower (k, p, p)."""

    share: Array
    centre: Array
    lower: Array


def mixture_at_modes(centres: Array, covariances: Array, log_mass: Array) -> Mixture:
    """A component for each mode (k, p) with its covariance (k, p, p); shares go with exp(log_mass) (k,)."""
    return Mixture(np.exp(log_mass - logsumexp(log_mass)), centres, np.asarray(np.linalg.cholesky(covariances), float))


def draw(mixture: Mixture, points: Array) -> Array:
    """z (m, p) at points (m, p + 2) of the unit cube: which component, how far out, and in which direction."""
    points = np.clip(points, 1e-9, 1.0 - 1e-9)
    which = np.minimum(np.searchsorted(np.cumsum(mixture.share), points[:, 0]), mixture.share.size - 1)
    stretch = np.sqrt(FREEDOM / chdtri(FREEDOM, points[:, 1]))
    away = np.einsum("mij,mj->mi", mixture.lower[which], ndtri(points[:, 2:]))
    return np.asarray(mixture.centre[which] + stretch[:, None] * away)


def log_density(mixture: Mixture, z: Array) -> Array:
    """ln sum_k share_k t_k(z), (m,)."""
    return np.asarray(logsumexp(_parts(mixture, z)[0], axis=1))


def _parts(mixture: Mixture, z: Array) -> tuple[Array, Array]:
    """ln share_k t_k(z) and the squared distance from each centre, (m, k) both."""
    p = z.shape[1]
    pairs = zip(mixture.centre, mixture.lower, strict=True)
    away = np.stack([_distance(lower, z - centre) for centre, lower in pairs], axis=1)
    scale = np.log(np.diagonal(mixture.lower, axis1=1, axis2=2)).sum(axis=1)
    constant = gammaln(0.5 * (FREEDOM + p)) - gammaln(0.5 * FREEDOM) - 0.5 * p * np.log(FREEDOM * np.pi)
    logs = np.log(mixture.share) + constant - scale - 0.5 * (FREEDOM + p) * np.log1p(away / FREEDOM)
    return logs, away


def _distance(lower: Array, away: Array) -> Array:
    return np.asarray(np.sum(scipy.linalg.solve_triangular(lower, away.T, lower=True) ** 2, axis=0))


def pooled_weights(log_target: Array, z: Array, rounds: list[tuple[int, Mixture]]) -> Array:
    """w_i = p(z_i) / sum_r (n_r / n) q_r(z_i), of sum 1: n_r draws of each round r, from its own mixture q_r.

    Cornuet et al. (2012), https://doi.org/10.1111/j.1467-9469.2011.00756.x.
    """
    sizes = np.array([size for size, _ in rounds], float)
    logs = np.stack([log_density(mixture, z) for _, mixture in rounds])
    log_weight = log_target - logsumexp(logs, axis=0, b=(sizes / sizes.sum())[:, None])
    weights = np.exp(log_weight - np.max(log_weight))
    return np.asarray(weights / weights.sum())


def adapt(target: Callable[[Array], Array], start: Mixture, seed: int) -> Mixture:
    """The start moved, reshaped and split until it resembles the density; target: z (m, p) -> log density (m,)."""
    random = np.random.default_rng(seed)
    mixture, before, power = start, 0.0, _power(start.centre.shape[1])
    rounds: list[tuple[int, Mixture]] = []
    parts: list[tuple[Array, Array]] = []
    for _ in range(ADAPTATION_ROUNDS):
        new = draw(mixture, random.random((EMULATED_DRAWS, start.centre.shape[1] + 2)))
        logs = power * target(new)
        rounds = [*rounds[1 - ROUNDS_POOLED :], (EMULATED_DRAWS, mixture)]
        parts = [*parts[1 - ROUNDS_POOLED :], (new, logs)]
        worth = effective_size(pooled_weights(logs, new, rounds[-1:])) / EMULATED_DRAWS
        if worth > WELL_ADAPTED or 0.5 < worth < LEAST_GAIN * before:
            break
        before = worth
        z, logs = (np.concatenate(part) for part in zip(*parts, strict=True))
        weights = tempered(pooled_weights(logs, z, rounds), EFFECTIVE_TO_FIT)
        equal = z[systematic_draws(weights, DRAWS_FITTED, random)]
        mixture = _grown(mixture, equal, min(COMPONENTS_ADDED, MOST_COMPONENTS - mixture.share.size), random)
        for _ in range(FIT_STEPS):
            mixture = _fitted(mixture, equal, effective_size(weights))
    return mixture


def _power(dimensions: int) -> float:
    """b < 1 with (b (2 - b))^(dimensions / 2) = 1 - TAIL_SHARE, the effective share of draws from p^b, p normal."""
    return float(1.0 - np.sqrt(1.0 - (1.0 - TAIL_SHARE) ** (2.0 / dimensions)))


def tempered(weights: Array, wanted: float) -> Array:
    """w^t of sum 1, with the largest t in 0 to 1 for which at least `wanted` of the draws are effective."""
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


def _grown(mixture: Mixture, z: Array, more: int, random: np.random.Generator) -> Mixture:
    """With `more` components at some of the draws z (m, p), half as wide as all of them together."""
    if more <= 0:
        return mixture
    spread = np.cov(z.T, ddof=0).reshape(z.shape[1], -1) / 4.0
    lower = np.linalg.cholesky(spread + 1e-6 * np.diag(np.diag(spread)) + 1e-300 * np.eye(z.shape[1]))
    k = mixture.share.size
    return Mixture(
        np.concatenate([mixture.share * k, np.ones(more)]) / (k + more),
        np.concatenate([mixture.centre, z[random.choice(len(z), more, replace=False)]]),
        np.concatenate([mixture.lower, np.tile(lower, (more, 1, 1))]),
    )


def _fitted(mixture: Mixture, z: Array, worth: float) -> Mixture:
    """One step of expectation and maximisation for a mixture of t's (Cappé et al. 2008, doi:10.1007/s11222-008-9059-x).

    z (m, p): draws of equal weight, worth that many independent ones. A component that few of them belong to keeps most
    of its shape.
    """
    logs, away = _parts(mixture, z)
    belongs = np.exp(logs - logsumexp(logs, axis=1, keepdims=True)) / len(z)
    share, p = belongs.sum(axis=0), z.shape[1]
    gain = belongs * (FREEDOM + p) / (FREEDOM + away)
    centre, lower = mixture.centre.copy(), mixture.lower.copy()
    for k in np.flatnonzero(share * worth > 1.0):
        centre[k] = gain[:, k] @ z / gain[:, k].sum()
        scatter = (z - centre[k]).T @ ((z - centre[k]) * gain[:, k, None])
        kept = 2.0 * p / worth
        lower[k] = np.linalg.cholesky((scatter + kept * lower[k] @ lower[k].T) / (share[k] + kept))
    share = (share + SHARED_EVENLY / share.size) / (1.0 + SHARED_EVENLY)
    return replace(mixture, share=share, centre=centre, lower=lower)
