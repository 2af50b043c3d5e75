"""What a residual may be without anything missing: errors of the data, correlated along a section, and of the grid.

cov = s^2 D R D + E,   R_ij = rho^(d_ij / d) within a section of an experiment, E the error of discretisation,
E_ij = (c + (1 - c) 1_ij) g_i g_j, c the share that all stations have in common
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import scipy.special

from vegglue.arrays import Array
from vegglue.errors import InputError
from vegglue.measurements.kinds import kind_of

# How much of the difference between a grid and one of twice its size is taken as the error of the finer one [-]:
# 1/(2^p - 1) for an order p between one (at edges and at the waterline) and two. From 0.3 to 1 the sets for open-a to
# open-f are the same and amplitudes move by 1.5 %; with 0 something is found where nothing is hidden.
OF_DIFFERENCE = 0.6
# Share of that error which all stations have in common: where one grid is too fast, the misfit looks as its difference
# to another grid does, and is no evidence of anything missing.
COMMON = 0.5
# Difference of twice the log-likelihood above which stated errors count as too small (1 % of chi2 with one degree).
TOO_SMALL = 6.6
# Correlations, and sizes of what else there is, from the best of which the search for the likeliest begins.
RHO, SIZES = (0.03, 0.2, 0.4, 0.6, 0.8), (0.01, 0.1, 1.0, 10.0)
# Correlations among which the doubt about it is spread, and how likely none is before the data have spoken: as some.
CORRELATIONS, NONE = np.linspace(0.05, 0.95, 19), 0.5


@dataclass(frozen=True)
class Noise:
    """Errors of the used stations `rows` (n,): values (n,), standard errors (n,), places, and the covariance (n, n)."""

    rows: np.ndarray
    value: Array
    error: Array
    apart: Array  # |y_i - y_j| over the usual spacing, infinite between sections (n, n)
    grid: Array  # error of the grid (n,), zero when unknown
    common: float  # share of the grid's error that all stations have in common
    correlation: float
    scale: float
    lower: Array  # Cholesky factor of the covariance
    doubt: Array  # correlations that the residual leaves open, and the chance of each (2, k)

    def used(self, values: Array) -> Array:
        """Rows of the used stations, of (station, ...)."""
        return values[self.rows]

    def among_all(self, values: Array, stations: int) -> Array:
        """Values of the used stations (n,) among all, (station,), NaN for the others."""
        wide = np.full(stations, np.nan)
        wide[self.rows] = values
        return wide

    @property
    def of_data(self) -> Array:
        """Standard errors of the data (n,), made larger where they look too small."""
        return self.scale * self.error

    def residual(self, prediction: Array) -> Array:
        """Measured minus predicted (n,) of predictions (station,)."""
        return self.value - prediction[self.rows]

    def whiten(self, values: Array) -> Array:
        """W values: errors become independent and of size one; (n, ...)."""
        return np.asarray(scipy.linalg.solve_triangular(self.lower, values, lower=True))


def noise_of(station: pd.DataFrame, fallback: dict[str, float] | None = None) -> Noise:
    """Independent errors as stated in the data; fallback: by kind, where a station states none.

    Errors: InputError when a used station has neither.
    """
    used = station[station["used"].to_numpy(bool)]
    if used.empty:
        raise InputError("observations: no station is used, nothing can be inferred; `vegglue check CONFIG` says why.")
    error = used["standard_error"].to_numpy(float).copy()
    for kind, value in (fallback or {}).items():
        error[(used["kind"] == kind).to_numpy() & ~(error > 0)] = value
    if not (error > 0).all():
        first = used.iloc[int(np.flatnonzero(~(error > 0))[0])]
        column = kind_of(str(first["kind"])).error_column
        raise InputError(
            f"observations: expected a standard error above 0 at every used station, got none at x = {first['x']:g}, "
            f"y = {first['y']:g} m; add the column {column}, or `standard_error` to the observation."
        )
    zero = np.zeros(len(used))
    rows = np.flatnonzero(station["used"].to_numpy(bool))
    value = used["value"].to_numpy(float)
    known = np.array([[0.0], [1.0]])
    return _factored(Noise(rows, value, error, _apart(used), zero, COMMON, 0.0, 1.0, np.diag(error), known))


def with_grid_error(noise: Noise, difference: Array) -> Noise:
    """The same with the error of discretisation, from the difference (station,) to a grid of twice the cell size."""
    return _factored(replace(noise, grid=OF_DIFFERENCE * difference[noise.rows]))


def scattered(noise: Noise) -> Noise:
    """The same with an error of the grid that is each station's own: for predictions on that very grid.

    A common one leaves the fit free to shift all stations as a finer grid would, and with them all it predicts.
    """
    return _factored(replace(noise, common=0.0))


def with_correlation(noise: Noise, correlation: float, scale: float) -> Noise:
    known = np.array([[correlation], [1.0]])
    return _factored(replace(noise, correlation=correlation, scale=scale, doubt=known))


def discounted(noise: Noise, outliers: np.ndarray) -> Noise:
    """The same, but stations `outliers` (places among the used ones) count for next to nothing."""
    error = noise.error.copy()
    error[outliers] = 1e3 * noise.error[outliers]
    return _factored(replace(noise, error=error))


def estimated(noise: Noise, left: Array, explained: Array) -> Noise:
    """Correlation and scale of the errors by the likelihood of the residual `left` (n,), physics set aside.

        left ~ N(0, cov(rho, s) + t^2 F F')

    with F (n, k) all that calibration and missing effects could do to the predictions: what is smooth in that way is
    not taken for noise. rho >= 0; s only when the stated errors are too small beyond doubt.
    """
    cost = _cost_of(noise, left, explained)
    begin = [(cost(rho, 1.0, np.log(t)), np.log(rho / (0.98 - rho)), np.log(t)) for rho in RHO for t in SIZES]
    _, *start = min(begin)

    def best(scale_free: bool) -> tuple[float, float, float, float]:
        def unfold(x: Array) -> tuple[float, float, float]:
            rho, scale = 0.98 * scipy.special.expit(x[0]), np.exp(np.clip(x[2], -3.0, 3.0)) if scale_free else 1.0
            return float(rho), float(scale), float(np.clip(x[1], -20.0, 10.0))

        end = scipy.optimize.minimize(
            lambda x: cost(*unfold(x)),
            np.array([*start, 0.0][: 3 if scale_free else 2]),
            method="Nelder-Mead",
            options={"xatol": 0.02, "fatol": 0.02},
        )
        return float(end.fun), *unfold(end.x)

    fixed, free = best(False), best(True)
    _, rho, scale, log_t = free if fixed[0] - free[0] > TOO_SMALL and free[2] > 1.0 else fixed
    found = with_correlation(noise, rho if rho > 0.05 else 0.0, scale)
    return replace(found, doubt=_doubt(lambda level: cost(level, scale, log_t)))


def _cost_of(noise: Noise, left: Array, explained: Array) -> Callable[[float, float, float], float]:
    """-2 log-likelihood of rho, s and ln t, but for a constant."""
    gram = explained @ explained.T

    def cost(rho: float, scale: float, log_t: float) -> float:
        covariance = covariance_of(replace(noise, correlation=rho, scale=scale)) + np.exp(2.0 * log_t) * gram
        factor, lower = scipy.linalg.cho_factor(covariance, lower=True)
        return float(2.0 * np.log(np.diag(factor)).sum() + left @ scipy.linalg.cho_solve((factor, lower), left))

    return cost


def _doubt(cost: Callable[[float], float]) -> Array:
    """Correlations, none among them, and how likely each is (2, k); cost: -2 log-likelihood of one."""
    levels = np.concatenate([[0.0], CORRELATIONS])
    costs = np.array([cost(float(level)) for level in levels])
    before = np.where(levels == 0.0, NONE, (1.0 - NONE) / CORRELATIONS.size)
    chance = before * np.exp(-0.5 * (costs - costs.min()))
    return np.stack([levels, chance / chance.sum()])


def drawn_errors(noise: Noise, draws: int, random: np.random.Generator) -> Array:
    """Whitened errors (draws, n) whose correlation is one of those left open, as likely as it is.

    Independent and of size one only when the correlation is beyond doubt.
    """
    parts = []
    for level, many in zip(noise.doubt[0], random.multinomial(draws, noise.doubt[1]), strict=True):
        lower = _factored(replace(noise, correlation=float(level))).lower
        parts.append(random.standard_normal((many, noise.rows.size)) @ noise.whiten(lower).T)
    return np.concatenate(parts)


def _factored(noise: Noise) -> Noise:
    return replace(noise, lower=np.asarray(np.linalg.cholesky(covariance_of(noise))))


def covariance_of(noise: Noise) -> Array:
    """s^2 D R D + E of the used stations (n, n)."""
    related = np.eye(noise.rows.size) if noise.correlation == 0.0 else np.exp(noise.apart * np.log(noise.correlation))
    covariance = noise.scale**2 * related * np.outer(noise.error, noise.error)
    common = noise.common * np.outer(noise.grid, noise.grid)
    return np.asarray(covariance + common + np.diag((1.0 - noise.common) * noise.grid**2))


def _apart(used: pd.DataFrame) -> Array:
    """Distances along each section in units of the spacing of its stations; infinite across sections and kinds, and
    where errors of neighbours are not correlated.
    """
    apart = np.full((len(used), len(used)), np.inf)
    np.fill_diagonal(apart, 0.0)
    correlated = np.array([kind_of(str(name)).correlated for name in used["kind"]], dtype=bool)
    keys = used[["experiment", "section", "kind"]].astype(str).agg("\n".join, axis=1).to_numpy()
    for key in np.unique(keys[correlated]):
        here = np.flatnonzero(keys == key)
        y = used["y"].to_numpy(float)[here]
        spacing = np.median(np.diff(np.sort(y))) if here.size > 1 else 1.0
        apart[np.ix_(here, here)] = np.abs(y[:, None] - y[None]) / max(spacing, 1e-9)
    return apart
