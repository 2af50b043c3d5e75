"""A surrogate of a command that takes minutes a run: the built-in engine, and what the command has more than it as a
Gaussian process, learned from runs where the posterior is.

    f(z) = F(z) + d(u),   d = B' h(u) + g(u),   h = (1, u),   g ~ GP(0, k(u, u') S),   u = lower^-1 (z - centre)
    k(u, u') = exp(-|u - u'|^2 / (2 l^2)) + t^2 1[u = u']

F is the built-in engine, with the effects of the case; d is learned from f_c - F_0, predictions of the command less
those of the built-in engine without effects, at m places. B has a flat prior, S is the covariance between stations and
l, t maximise the restricted likelihood. With mean and variance of d at z, m(z) and v(z) S, the likelihood counts what
the surrogate does not know beside the errors C of the data:

    p(y | z) = N(y; F(z) + m(z), C + v(z) S)

Runs are added where they reduce the mean of v over the posterior most, a draw counting 1 + |e|^2, e its z and theta in
standard deviations off their means: its influence on means and standard deviations. They end when realisations of d
have posteriors alike.

References: multi-fidelity Gaussian processes, Kennedy and O'Hagan 2000, doi:10.1093/biomet/87.1.1; a posterior with the
variance of its surrogate, Stuart and Teckentrup 2018, doi:10.1090/mcom/3244; where to run, Cohn 1996,
doi:10.1016/0893-6080(95)00137-9. Not checked against them.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np
import pandas as pd
from scipy.linalg import cho_solve, solve_triangular
from scipy.spatial.distance import cdist

from vegglue.arrays import Array, Mask
from vegglue.calibration.fit import fit_from
from vegglue.calibration.noise import Noise, with_more_error
from vegglue.case.parameter_space import middle_value, theta_at, thetas_at
from vegglue.engine.command import CommandRuns, command_predictions
from vegglue.engine.corrected import rows_of_stations, with_correction, without_effects
from vegglue.engine.interface import Model, linearise, predict
from vegglue.inference.importance_sampling import LogDensity, Mixture, Sample, sample
from vegglue.inference.posterior_modes import ModesAndErrors, distinct_modes
from vegglue.inference.weighted_statistics import effective_size, root_mean_square, weighted_median, weighted_sd
from vegglue.progress import Watch
from vegglue.results.posterior import Surrogate
from vegglue.wording.phases import LEARNING

# Runs of the command that are chosen together: as many may run at once, and each is chosen without the results of the
# others. Chosen, not measured.
RUNS_IN_A_SET = 4
# Lengths [standard deviations of the posterior] and squares of t [-] that the restricted likelihood is computed for.
# The longest is chosen: few runs cannot show a bend of the command beside them.
CORRELATION_LENGTHS, NUGGETS = np.geomspace(0.7, 4.0, 6), (1e-6, 1e-4, 1e-2, 0.1, 1.0, 10.0)
# Effective draws of the posterior at which runs are chosen, and below which they are drawn anew; realisations of d
# whose posteriors are compared. Chosen: they cost runs of the built-in engine.
MADE, FEWEST_EFFECTIVE, REALISATIONS = 400, 100, 64
# Standard error of a median [standard deviations of the posterior] and of a standard deviation [share of itself], over
# realisations of d, below which the surrogate is good enough: at two of them 0.1 and 15 %.
MEDIAN_WITHIN, SD_WITHIN = 0.05, 0.075
# Times that runs are added after that: what none of the runs shows is found by more of them only. Chosen after the
# brook with errors of 0.04 m/s: with one, standard deviations were off by up to 11 %, with two by 5 %.
SETTLED_FOR = 2
# Distance in u of two places that are one [-].
ALREADY_RUN = 1e-6
# Share of the variance that is added to its diagonal, so that it can be factored.
JITTER = 1e-9


@dataclass(frozen=True)
class Difference:
    """d of m runs, see the head of this file.

    Attributes
    ----------
    names : tuple of str
        Parameters of the command (q).
    station : DataFrame
        The stations (n rows).
    centre, lower : ndarray (q,), (q, q)
        u = lower^-1 (z - centre), z (q,) those of the command.
    u : ndarray (m, q)
        Places of the runs.
    length, nugget : float
        l and t^2.
    factor : ndarray (m, m)
        Lower Cholesky factor of K.
    projected : ndarray (m, q + 1)
        factor^-1 H.
    inner : ndarray (q + 1, q + 1)
        Lower Cholesky factor of its square.
    trend : ndarray (q + 1, n)
        B.
    weights : ndarray (m, n)
        K^-1 (D - H B).
    directions, size : ndarray (r, used stations), (r,)
        Whitened by C, S = directions' diag(size) directions.
    """

    names: tuple[str, ...]
    station: pd.DataFrame
    centre: Array
    lower: Array
    u: Array
    length: float
    nugget: float
    factor: Array
    projected: Array
    inner: Array
    trend: Array
    weights: Array
    directions: Array
    size: Array

    def places(self, model: Model, z: Array) -> Array:
        """u (k, q) of z (k, p) of a model that has the parameters of the command among its own."""
        own = z[:, [model.names.index(name) for name in self.names]]
        return _places(own, self.centre, self.lower)

    def mean(self, u: Array) -> Array:
        """m (k, n) at u (k, q)."""
        return np.asarray(_terms(u) @ self.trend + _correlation(u, self.u, self.length) @ self.weights)

    def covariance(self, u: Array) -> Array:
        """Of g and B at u (k, q), over S (k, k) [-]; its diagonal is v."""
        known, trend = self._parts(u)
        return np.asarray(_correlation(u, u, self.length) - known.T @ known + trend.T @ trend)

    def variance(self, u: Array) -> Array:
        """v (k,) [-]."""
        known, trend = self._parts(u)
        return np.asarray(np.maximum(1.0 - np.sum(known**2, axis=0) + np.sum(trend**2, axis=0), 0.0))

    def _parts(self, u: Array) -> tuple[Array, Array]:
        known = solve_triangular(self.factor, _correlation(self.u, u, self.length), lower=True)
        return known, solve_triangular(self.inner, _terms(u).T - self.projected.T @ known, lower=True)

    def at(self, model: Model, z: Array) -> tuple[Array, Array]:
        """What is added to predictions (n,) and slopes (n, p) of the built-in engine at z (p,)."""
        rows, columns = rows_of_stations(self.station, model.station), [model.names.index(name) for name in self.names]
        u = self.places(model, z[None])
        near = _correlation(u, self.u, self.length)[0]
        of_u = self.trend[1:] + (near[:, None] * (self.u - u) / self.length**2).T @ self.weights
        slope = np.zeros((rows.size, z.size))
        slope[:, columns] = np.append(np.linalg.solve(self.lower.T, of_u), np.zeros((len(columns), 1)), axis=1).T[rows]
        return np.append(self.mean(u)[0], 0.0)[rows], slope


def _places(own: Array, centre: Array, lower: Array) -> Array:
    return np.asarray(solve_triangular(lower, (own - centre).T, lower=True).T)


def _terms(u: Array) -> Array:
    return np.column_stack([np.ones(len(u)), u])


def _correlation(a: Array, b: Array, length: float) -> Array:
    return np.asarray(np.exp(-0.5 * cdist(a, b, "sqeuclidean") / length**2))


def gaussian_process(
    names: tuple[str, ...], station: pd.DataFrame, noise: Noise, centre: Array, lower: Array, z: Array, d: Array
) -> Difference:
    """d = f_c - F_0 from runs of the command, as a Gaussian process.

    The restricted likelihood is that of whitened differences which vary alike at all stations,

        (m - q - 1) ln tr(R' K^-1 R) + ln|K| + ln|H' K^-1 H|,   R = D - H B,

    so that large changes count most; S = R' K^-1 R / (m - q - 3) is the mean of its posterior.

    Parameters
    ----------
    names, station
        Parameters of the command, and the stations (n rows).
    centre : ndarray (q,)
    lower : ndarray (q, q)
        u = lower^-1 (z - centre).
    z : ndarray (m, q)
        Places of the runs [standard deviations of the prior].
    d : ndarray (m, n)
        Differences there [unit of each station].
    """
    u = _places(z, centre, lower)
    terms, whitened = _terms(u), noise.whiten(d[:, noise.rows].T).T
    free = len(u) - terms.shape[1]

    def fitted(length: float, nugget: float) -> tuple[float, list[Array]]:
        factor = np.linalg.cholesky(_correlation(u, u, length) + nugget * np.eye(len(u)))
        projected = solve_triangular(factor, terms, lower=True)
        inner = np.linalg.cholesky(projected.T @ projected)
        # Q' factor^-1 D: the part that no trend explains.
        left = solve_triangular(factor, whitened, lower=True)
        left -= projected @ cho_solve((inner, True), projected.T @ left)
        cost = free * np.log(max(np.sum(left**2), 1e-300)) + 2.0 * np.log(np.diag(factor)).sum()
        cost += 2.0 * np.log(np.diag(inner)).sum()
        return float(cost), [np.asarray(one, float) for one in (factor, projected, inner, left)]

    length, nugget = min(product(CORRELATION_LENGTHS, NUGGETS), key=lambda pair: fitted(*pair)[0])
    factor, projected, inner, left = fitted(length, nugget)[1]
    trend = cho_solve((inner, True), projected.T @ solve_triangular(factor, d, lower=True))
    _, singular, directions = np.linalg.svd(left, full_matrices=False)
    return Difference(
        names, station, centre, lower, u, float(length), nugget, factor, projected, inner, trend,
        cho_solve((factor, True), d - terms @ trend), directions, singular**2 / max(free - 2, 1),
    )  # fmt: skip


def log_posterior_under(noise: Noise, model: Model, difference: Difference, z: Array, prediction: Array) -> Array:
    """ln p(z | y) = ln N(y; F + m, C + v S) - |z|^2 / 2, up to a constant.

    Parameters
    ----------
    z : ndarray (k, p)
    prediction : ndarray (k, station)
        F + m [unit of each station], NaN without a flow.

    Returns
    -------
    ndarray (k,)
        -inf without a flow.
    """
    known = np.isfinite(prediction[:, noise.rows]).all(axis=1)
    left = noise.whiten((noise.value - prediction[np.ix_(known, noise.rows)]).T)
    along, error = _residuals_along(difference, difference.places(model, z[known]), left)
    misfit = np.sum(left**2, axis=0) - np.sum(along**2 * error / (1.0 + error) - np.log1p(error), axis=0)
    logs = np.full(len(z), -np.inf)
    logs[known] = -0.5 * misfit - 0.5 * np.sum(z[known] ** 2, axis=1)
    return logs


def _residuals_along(difference: Difference, u: Array, left: Array) -> tuple[Array, Array]:
    """Whitened residuals (used, k) along the directions of S (r, k), and v times the size of S there (r, k)."""
    return difference.directions @ left, np.outer(difference.size, difference.variance(u))


@dataclass(frozen=True)
class CommandToLearn:
    """A command, and where it has run.

    Attributes
    ----------
    run : ndarray (m, q)
        [standard deviations of the prior]
    failed : int
        Runs that failed.
    most : int
        Runs at most.
    """

    runs: CommandRuns
    run: Array
    failed: int
    most: int


@dataclass(frozen=True)
class Learned:
    """A surrogate of a command.

    Attributes
    ----------
    base : ModesAndErrors
        Its modes, with its engine and its mean error in the noise.
    density : callable
        z (k, p), predictions (k, station) -> ln p(z | y) up to a constant (k,).
    result : Surrogate
        What it rests on.
    """

    base: ModesAndErrors
    density: LogDensity
    result: Surrogate


def learn(command: CommandToLearn, base: ModesAndErrors, start: Mixture, watch: Watch) -> Learned:
    """Runs of the command until the posterior is known, or `command.most` are made.

    It is known when standard errors over realisations of d are below MEDIAN_WITHIN and SD_WITHIN, and stay so when runs
    are added SETTLED_FOR times.

    Parameters
    ----------
    base : ModesAndErrors
        Of the built-in engine, corrected where the command fits best.
    start : Mixture
        A first proposal for the posterior.
    watch : callable
        Is called with the progress of runs.
    """
    noise, model, best = base.noise, base.model, base.fits[0]
    case, bare = model.case, without_effects(model)
    own, random = [model.names.index(name) for name in bare.names], np.random.default_rng(case.simulate.seed)
    centre, lower = best.point.z[own], np.asarray(np.linalg.cholesky(best.covariance[np.ix_(own, own)]), float)
    middle = linearise(bare, centre)
    assert middle is not None  # the search for the best place solved it

    def difference_at(z: Array) -> Array:
        """f_c - F_0 (m, n) at z (m, q), NaN if the command failed or there is no flow."""
        thetas, why = thetas_at(bare.case, z), LEARNING.format(case.name)
        found, _ = command_predictions(command.runs, bare.case, model.station, thetas, watch, why)
        return found - predict(bare, [middle], z)

    first = difference_at(command.run)
    ran = np.isfinite(first).all(axis=1)
    z, d, lost = command.run[ran], first[ran], command.run[~ran]
    failed, settled, last = command.failed + len(lost), 0, float("nan")
    drawn: Sample | None = None
    built_in = np.zeros((0, len(model.station)))  # F at the draws
    while True:
        difference = gaussian_process(bare.names, model.station, noise, centre, lower, z, d)
        surrogate = replace(model, engine=with_correction(difference.at, "surrogate"))
        density = partial(log_posterior_under, noise, model, difference)
        if drawn is not None:
            values = built_in + difference.mean(difference.places(model, drawn.z))
            logs = np.log(np.maximum(drawn.weights, 1e-300)) + density(drawn.z, values) - drawn.log_density
            weights = np.exp(logs - logs.max()) / np.exp(logs - logs.max()).sum()
        if drawn is None or effective_size(weights) < FEWEST_EFFECTIVE:
            drawn = sample(partial(predict, surrogate, [best.point]), density, start, MADE, case.simulate.seed)
            values, weights = drawn.values, drawn.weights
            built_in = values - difference.mean(difference.places(model, drawn.z))
        u = difference.places(model, drawn.z)
        along, error = _residuals_along(difference, u, noise.whiten((noise.value - values[:, noise.rows]).T))
        shared = difference.covariance(np.concatenate([u, _places(lost, centre, lower)]))
        theta = np.column_stack([*theta_at(case, drawn.z).values()])
        apart = _errors_of_surrogate(theta, weights, along, error, difference.size, shared[: len(u), : len(u)], random)
        settled = settled + 1 if apart[0] < MEDIAN_WITHIN and apart[1] < SD_WITHIN else 0
        room = command.most - len(z) - failed
        if settled > SETTLED_FOR or room <= 0:
            break
        both = np.concatenate([drawn.z, theta], axis=1)
        away = (both - weights @ both) / np.sqrt(weights @ (both - weights @ both) ** 2)
        influence = weights * (1.0 + np.sum(away**2, axis=1))
        run = cdist(u, difference.u).min(axis=1) < ALREADY_RUN
        best_rows = _best_places(shared, influence, run, difference.nugget, min(RUNS_IN_A_SET, room))
        chosen = drawn.z[best_rows][:, own]
        new = difference_at(chosen)
        there = np.isfinite(new).all(axis=1)
        failed, lost = failed + int((~there).sum()), np.concatenate([lost, chosen[~there]])
        if there.any():
            off = new[there] - difference.mean(_places(chosen[there], centre, lower))
            last = root_mean_square(noise.whiten(off[:, noise.rows].T).ravel())
        z, d = np.concatenate([z, chosen[there]]), np.concatenate([d, new[there]])
    columns = noise.lower @ (difference.directions.T * np.sqrt(error @ weights))
    under = with_more_error(noise, columns)
    ends = [fit_from(surrogate, under, one.point.z, one.point) for one in base.fits]
    fits = tuple(distinct_modes([end for end in ends if end is not None]))
    flows = [
        sum(middle_value(case, one) for one in setting.discharge.values()) for setting in case.experiments.values()
    ]
    beyond = (0.5 * min(flows), 2.0 * max(flows)) if case.validation is None else (np.nan, np.nan)
    result = Surrogate(len(z) + failed, failed, int(settled > SETTLED_FOR), *apart, last, *beyond)
    return Learned(replace(base, model=surrogate, noise=under, fits=fits), density, result)


def _errors_of_surrogate(
    theta: Array, weights: Array, along: Array, error: Array, size: Array, shared: Array, random: np.random.Generator
) -> tuple[float, float]:
    """Standard errors of medians [standard deviations] and of standard deviations [-], the largest of any parameter.

    They are those over realisations of d at weighted draws theta (k, p); along, error (r, k): see `_residuals_along`;
    shared (k, k): covariance of d, over S.
    """
    factor = np.linalg.cholesky(shared + JITTER * (1.0 + np.trace(shared)) * np.eye(len(theta)))
    logs = np.log(np.maximum(weights, 1e-300)) + 0.5 * np.sum(along**2 / (1.0 + error) + np.log1p(error), axis=0)

    def statistics(weights: Array) -> list[list[float]]:
        return [[of(column, weights) for column in theta.T] for of in (weighted_median, weighted_sd)]

    found = []
    for _ in range(REALISATIONS):
        moved = along - np.sqrt(size)[:, None] * (random.standard_normal(along.shape) @ factor.T)
        each = logs - 0.5 * np.sum(moved**2, axis=0)
        found.append(statistics(np.exp(each - each.max())))
    median, sd = np.array(statistics(weights))
    off = (np.array(found) - [median, sd]) / sd
    return tuple(np.sqrt(np.mean(off**2, axis=0)).max(axis=1, initial=0.0).tolist())


def _best_places(shared: Array, influence: Array, run: Mask, nugget: float, count: int) -> list[int]:
    """Rows of draws after whose runs the sum of v times their influence is least, chosen one after the other.

    shared (k, k): covariance of d at the draws and, behind them, where the command failed: little is learned near them.
    run: draws that have been run, which would give the same again.
    """
    draws, chosen = influence.size, list[int]()
    for row in [*range(draws, len(shared)), *[-1] * count]:
        if row < 0:
            gain = influence @ shared[:draws, :draws] ** 2 / (np.diag(shared)[:draws] + nugget)
            gain[run] = -1.0
            gain[chosen] = -1.0
            row = int(np.argmax(gain))
            chosen.append(row)
        shared = shared - np.outer(shared[:, row], shared[row]) / (shared[row, row] + nugget)
    return chosen
