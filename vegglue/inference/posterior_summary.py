"""What weighted members say of each parameter and of each prediction."""

import math
from typing import Any

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.prior import quantile
from vegglue.case.schema import Case, Parameter
from vegglue.inference.likelihood import root_mean_square, stations_by_kind
from vegglue.inference.weighted_statistics import (
    correlation,
    effective_size,
    mixture_quantile,
    systematic_draws,
    weighted_covariance,
    weighted_quantile,
)
from vegglue.results.posterior import CHAINS, DRAWS_PER_CHAIN, ENDS, IDENTIFIED_BELOW, LEVELS, NEAR_BOUND, PRESSES_ABOVE


def marginals(theta: dict[str, Array], case: Case, weights: Array) -> dict[str, Any]:
    """Everything said of each parameter, by its name."""
    priors = case.parameters
    seen = {name: _seen(values, priors[name]) for name, values in theta.items()}
    logs = [name for name in theta if _on_log_scale(priors[name])]
    prior_quantiles = {name: quantile(priors[name], LEVELS) for name in theta}
    prior_range = {name: _range(_seen(prior_quantiles[name], priors[name])) for name in theta}
    ratio = {name: _range(weighted_quantile(seen[name], weights, LEVELS)) / prior_range[name] for name in theta}
    ends = {name: _seen(quantile(priors[name], (0.0, 1.0)), priors[name]) for name in theta}
    mass = {name: _mass_near_bounds(seen[name], weights, ends[name]) for name in theta}
    return {
        "parameters": tuple(theta),
        "unit": {name: priors[name].unit for name in theta},
        "theta": theta,
        "median": {name: median_of(values, weights) for name, values in theta.items()},
        "sd": {name: sd_of(values, weights) for name, values in theta.items()},
        "quantiles": {name: weighted_quantile(values, weights, LEVELS) for name, values in theta.items()},
        "prior_quantiles": prior_quantiles,
        "log10_median": {name: median_of(seen[name], weights) for name in logs},
        "log10_sd": {name: sd_of(seen[name], weights) for name in logs},
        "correlation": correlation(weighted_covariance(np.transpose(list(seen.values())), weights)),
        "width_ratio": ratio,
        "identified": {name: ratio[name] < IDENTIFIED_BELOW for name in theta},
        "bounds": {name: quantile(priors[name], (0.0, 1.0)) for name in theta},
        "bound_mass": mass,
        "bound_hit": {
            name: (mass[name] > _pressing_mass(effective_size(weights))) & _ended(seen[name], weights, ends[name])
            for name in theta
        },
    }


def _on_log_scale(prior: Parameter) -> bool:
    return prior.distribution in ("loguniform", "lognormal")


def _seen(values: Array, prior: Parameter) -> Array:
    """The values on the scale on which the prior is flat or normal: their log10, or themselves."""
    with np.errstate(divide="ignore"):  # the lower bound of a lognormal prior is 0
        return np.log10(values) if _on_log_scale(prior) else values


def on_flat_scale(case: Case, theta: dict[str, Array]) -> Array:
    """Values (m,) of each parameter on the scale on which its prior is flat or normal, (m, p)."""
    return np.column_stack([_seen(theta[name], prior) for name, prior in case.parameters.items()])


def _range(quantiles: Array) -> float:
    return float(quantiles[-1] - quantiles[0])


def median_of(values: Array, weights: Array) -> float:
    return float(weighted_quantile(values, weights, [0.5])[0])


def sd_of(values: Array, weights: Array) -> float:
    if not np.isfinite(values[weights > 0]).all():
        return float("nan")
    return float(np.sqrt(weighted_covariance(values[:, None], weights)[0, 0]))


def _mass_near_bounds(seen: Array, weights: Array, ends: Array) -> Array:
    """Posterior mass within NEAR_BOUND of the prior's range of its low and high bound [-]; NaN without both bounds."""
    low, high = ends
    near = NEAR_BOUND * (high - low)
    if not np.isfinite(near):
        return np.full(2, np.nan)
    return np.array([weights[seen < low + near].sum(), weights[seen > high - near].sum()])


def _ended(seen: Array, weights: Array, ends: Array) -> np.ndarray:
    """Whether each bound, and not the data, ends the 95 % range: the range begins within ENDS of its length of it."""
    quantiles = weighted_quantile(seen, weights, LEVELS)
    apart = np.abs(quantiles[[0, -1]] - ends)
    return np.asarray(apart <= ENDS * (quantiles[-1] - quantiles[0]))


def _pressing_mass(effective: float) -> float:
    """Mass near a bound that is not chance: three standard errors above what a parameter left at its prior has [-]."""
    return max(PRESSES_ABOVE, NEAR_BOUND + 3 * math.sqrt(NEAR_BOUND * (1 - NEAR_BOUND) / effective))


def predictions(
    prediction: Array,
    best: int,
    noise: Array,
    weights: Array,
    station: pd.DataFrame,
    seed: int,
    lower: Array | None = None,
) -> dict[str, Any]:
    """Bands, residuals and equal-weight draws at all stations; lower: factor of the errors' covariance if correlated.

    prediction: (member, station); noise: standard deviation of the errors (station,); lower: (station, station).
    """
    random = np.random.default_rng(seed)
    draws = systematic_draws(weights, CHAINS * DRAWS_PER_CHAIN, random).reshape(CHAINS, DRAWS_PER_CHAIN)
    model_band = weighted_quantile(prediction, weights, LEVELS)
    value, errors = station["value"].to_numpy(float), station["standard_error"].to_numpy(float)
    residual, best_residual = value - model_band[LEVELS.index(0.5)], value - prediction[best]
    kinds, weighed = stations_by_kind(station), weights > 0
    normal = random.standard_normal((*draws.shape, len(station)))
    return {
        "model_band": model_band,
        "total_band": mixture_quantile(prediction[weighed], weights[weighed], noise, LEVELS),
        "residual": residual,
        "best_residual": best_residual,
        "rmse": {kind: root_mean_square(residual[rows]) for kind, rows in kinds.items()},
        "best_rmse": {kind: root_mean_square(best_residual[rows]) for kind, rows in kinds.items()},
        "chi2": float(np.sum((best_residual / errors)[station["used"].to_numpy(bool)] ** 2)),
        "draws": draws,
        "predictive": prediction[draws] + (noise * normal if lower is None else normal @ lower.T),
    }
