"""Which size of what is missing a set of measurements would show, and what each piece of it adds.

    P(T^2 > t^2) = 1 - F(t^2; 1, l^2),   l = |g| |S_perp|

T is the score of a fingerprint S whose gain is g; its square has a noncentral chi2 distribution with one degree of
freedom. t is the threshold of a diagnosis, and |S_perp| the length of the fingerprint after what calibration can mimic
is projected out, see `score_test`. If g itself is normal around zero with a plausible size s,

    P(T^2 > t^2) = 2 Phi(-t / (1 + a^2)^(1/2)),   a = s |S_perp|.

Measurements whose own errors are independent add their information. With columns X = D^(-1/2) [J, U, S], J the slopes
of the parameters, U the columns of all shared errors (covariance D + U U') and D the own errors,

    A = sum over pieces of X' X,   |S_perp|^2 = A_SS - A_SN (1 + A_NN)^-1 A_NS,   N = [J, U],

since parameters and shared errors have standard normal priors (Woodbury's identity). All other measurements are as if N
were N (1 + A_NN)^(-1/2) and S were S - N (1 + A_NN)^-1 A_NS: given what is measured, n of them more add

    S' (1 + N N')^-1 S

to |S_perp|^2, equations as few as they are. So a piece is added without the measurements themselves.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from vegglue.arrays import Array, Mask
from vegglue.calibration.score_test import prior_shrinkage

# Chance with which what is called detectable before measuring is detected [-].
PLANNED_POWER = 0.9
# Largest score that is looked for [standard errors]: no data have more, and a longer fingerprint hides nothing.
LARGEST_SCORE = 1e6
# Halvings of an interval of lengths or of scores, which leave 1e-12 of it.
ROOT_HALVINGS = 40
# Shared errors whose standard deviation is below this share of a station's own error count as its own [-].
SMALL_SHARE = 0.05
# Independent patterns of shared errors that are kept at most. Chosen: those left out are counted as own errors.
MOST_PATTERNS = 120


def lowest(enough: Callable[[Array], Mask], low: Array, high: Array) -> Array:
    """The value from which on a condition holds, by halving.

    Parameters
    ----------
    enough : callable
        Values (...,) -> whether it holds (...,).
    low, high : ndarray (...,)
        Between which it begins to hold.

    Returns
    -------
    ndarray (...,)
        To (high - low) 2^-ROOT_HALVINGS.
    """
    for _ in range(ROOT_HALVINGS):
        middle = 0.5 * (low + high)
        reached = enough(middle)
        low, high = np.where(reached, low, middle), np.where(reached, middle, high)
    return high


def detection_chance(length: Array, threshold: Array, only_sign: np.ndarray | int = 0) -> Array:
    """Chance that a score exceeds a threshold.

        P = Phi(l - t) + Phi(-l - t)

    Parameters
    ----------
    length : array
        l, standard errors by which the score is shifted [-].
    threshold : array
        t [standard errors].
    only_sign : array of int
        Nonzero if only a score of one sign counts: the second term is then absent.

    Returns
    -------
    array
        [-], one minus the noncentral chi2 distribution of t^2 with one degree of freedom and noncentrality l^2.
    """
    other = np.where(np.asarray(only_sign) == 0, ndtr(-np.abs(length) - threshold), 0.0)
    return np.asarray(ndtr(np.abs(length) - threshold) + other)


def detected_length(threshold: Array, chance: float = PLANNED_POWER) -> Array:
    """l at which `detection_chance` is `chance`, by halving.

    Parameters
    ----------
    threshold : ndarray
        t [standard errors].
    chance : float
        [-]

    Returns
    -------
    ndarray
        [standard errors]
    """

    def enough(length: Array) -> Mask:
        return np.asarray(detection_chance(length, threshold) >= chance)

    return lowest(enough, np.zeros_like(threshold), threshold + 10.0)


def chance_over_prior(size: Array, threshold: Array) -> Array:
    """2 Phi(-t / (1 + a^2)^(1/2)),   a = s |S_perp|: chance that an effect with a normal gain is detected.

    Parameters
    ----------
    size : ndarray (c,)
        a [-].
    threshold : ndarray (c,)
        t [standard errors].

    Returns
    -------
    ndarray (c,)
        [-]
    """
    return np.asarray(2.0 * ndtr(-threshold / np.hypot(1.0, size)))


def chance_to_separate(squared_distance: Array) -> Array:
    """Phi(D / 2): chance that the true one of two equally probable hypotheses has the larger likelihood.

    Parameters
    ----------
    squared_distance : ndarray
        D^2, D the standard errors by which their predictions differ.

    Returns
    -------
    ndarray
        [-]
    """
    return np.asarray(ndtr(0.5 * np.sqrt(squared_distance)))


def single_threshold(size: Array, log_prior: Array, level: float) -> Array:
    """t^2 = 2 (level - ln prior + 1/2 ln(1 + a^2)) (1 + a^2) / a^2: the score of one hypothesis that passes by itself.

    Parameters
    ----------
    size : ndarray (c,)
        a [-].
    log_prior : ndarray (c,)
        ln prior [-].
    level : float
        ln of the sum of Bayes factors to be passed [-].

    Returns
    -------
    ndarray (c,)
        t, at most LARGEST_SCORE [standard errors].
    """
    needed = np.maximum(2.0 * (level - log_prior) + np.log1p(size**2), 0.0)
    return np.asarray(np.minimum(np.sqrt(needed / np.maximum(prior_shrinkage(size), 1e-300)), LARGEST_SCORE))


def own_and_shared(own_variance: Array, shared: Array) -> tuple[Array, Array]:
    """The covariance D + U U' of errors with fewer columns.

    Parameters
    ----------
    own_variance : array (n,)
        D, squares of the errors of each measurement by itself.
    shared : array (n, k)
        U.

    Returns
    -------
    tuple of array (n,) and array (n, r)
        D' and U' with at most MOST_PATTERNS columns. What U' lacks is in D', so that each measurement keeps its
        variance.

    References
    ----------
    Halko et al. (2011), doi:10.1137/090771806, for the range of many columns; not checked against it.
    """
    if not shared.size:
        return own_variance, np.zeros((own_variance.size, 0))
    white = shared / np.sqrt(own_variance)[:, None]
    if min(white.shape) > 2 * MOST_PATTERNS:  # the range of U by random vectors
        random = np.random.default_rng(0).standard_normal((white.shape[1], 2 * MOST_PATTERNS))
        basis, _ = np.linalg.qr(white @ random)
        within = basis.T @ white
        squares, left = np.linalg.eigh(within @ within.T)
        left, strength = basis @ left[:, ::-1], np.sqrt(np.maximum(squares[::-1], 0.0))
    else:
        left, strength, _ = np.linalg.svd(white, full_matrices=False)
    kept = np.flatnonzero(strength > SMALL_SHARE)[:MOST_PATTERNS]
    columns = left[:, kept] * strength[kept]
    rest = np.maximum((white**2).sum(axis=1) - (columns**2).sum(axis=1), 0.0)
    return own_variance * (1.0 + rest), columns * np.sqrt(own_variance)[:, None]


@dataclass(frozen=True)
class PossibleMeasurements:
    """Measurements at some places, given those that are made.

    Attributes
    ----------
    squares : ndarray (..., c)
        |S_perp|^2 of each trace, of those that are made [-].
    nuisances : ndarray (..., N, q)
        Of each measurement, over its own error [-].
    traces : ndarray (..., N, c)
        Of each measurement, over its own error [1 per unit of gain].
    """

    squares: Array
    nuisances: Array
    traces: Array

    @property
    def lengths(self) -> Array:
        """|S_perp| of each trace (..., c) [standard errors per unit of gain]."""
        return np.asarray(np.sqrt(np.maximum(self.squares, 0.0)))

    def made(self, rows: np.ndarray, kept: np.ndarray | None = None) -> "PossibleMeasurements":
        """Those that are kept, all if None, with some of them made, by K = N_r N_r' = V k V' of their nuisances.

        N - N N_r' V f V' N_r,   S - N N_r' (1 + K)^-1 S_r,   f = [1 - (1 + k)^(-1/2)] / k
        """
        of_errors, of_traces = self.nuisances[..., rows, :], self.traces[..., rows, :]
        nuisances, traces = (
            (self.nuisances, self.traces) if kept is None else (self.nuisances[..., kept, :], self.traces[..., kept, :])
        )
        between = nuisances @ of_errors.swapaxes(-1, -2)
        strength, vectors = np.linalg.eigh(of_errors @ of_errors.swapaxes(-1, -2))
        root = np.sqrt(1.0 + np.maximum(strength, 0.0))[..., None]
        back = vectors.swapaxes(-1, -2)
        mixed = back @ of_traces / root
        return PossibleMeasurements(
            self.squares + (mixed**2).sum(axis=-2),
            nuisances - between @ (vectors @ (back @ of_errors / (root * (1.0 + root)))),
            traces - between @ (vectors @ (mixed / root)),
        )

    def with_each(self, pieces: np.ndarray) -> Array:
        """Squares of |S_perp| with one of some pieces made, each of as many measurements: rows (m, n); (..., m, c)."""
        of_errors, of_traces = self.nuisances[..., pieces, :], self.traces[..., pieces, :]
        covariance = of_errors @ of_errors.swapaxes(-1, -2) + np.eye(pieces.shape[1])
        added = (of_traces * np.linalg.solve(covariance, of_traces)).sum(axis=-2)
        return np.asarray(self.squares[..., None, :] + added)


def possible_measurements(own_variance: Array, nuisances: Array, traces: Array) -> PossibleMeasurements:
    """N / D^(1/2) and S / D^(1/2) of measurements of which none is made.

    Parameters
    ----------
    own_variance : ndarray (..., N)
        D [squared unit of the station].
    nuisances : ndarray (..., N, q)
        [J, U] [unit of the station].
    traces : ndarray (..., N, c)
        S [unit of the station per unit of gain].
    """
    error = np.sqrt(own_variance)[..., None]
    nothing = np.zeros((*traces.shape[:-2], traces.shape[-1]))
    return PossibleMeasurements(nothing, nuisances / error, traces / error)


def trace_lengths(own_variance: Array, nuisances: Array, traces: Array) -> Array:
    """|S_perp| of each trace with all measurements made.

    Parameters
    ----------
    own_variance, nuisances, traces
        As of `possible_measurements`.

    Returns
    -------
    ndarray (c,)
        [standard errors per unit of gain]
    """
    possible = possible_measurements(own_variance, nuisances, traces)
    return possible.made(np.arange(own_variance.size)).lengths


def squared_distance(first: Array, second: Array, both: Array) -> Array:
    """D^2 = (G_SS G_TT - G_ST^2) / max(G_SS, G_TT): least distance of two traces S and T, the size of one of them free.

    Parameters
    ----------
    first, second, both : ndarray (...,)
        G_SS, G_TT, and that of S + T [-].

    Returns
    -------
    ndarray (...,)
        [-]
    """
    cross = 0.5 * (both - first - second)
    return np.asarray(np.maximum(first * second - cross**2, 0.0) / np.maximum(np.maximum(first, second), 1e-300))
