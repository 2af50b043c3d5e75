"""GLUE: weigh the members of an ensemble by how well they predict what was measured.

Beven and Binley (1992), https://doi.org/10.1002/hyp.3360060305; the Gaussian likelihood and its sigma as in
Berends et al. (2020), https://doi.org/10.1016/j.advwatres.2020.103675.
"""

import math
from typing import Any

import numpy as np
import pandas as pd

from vegglue.canopy import KARMAN
from vegglue.config import Case
from vegglue.ensemble import Ensemble
from vegglue.errors import InputError
from vegglue.kernels import GRAVITY
from vegglue.likelihood import Fit, fit_members, member_weights, root_mean_square, stations_by_kind
from vegglue.observations import Observations
from vegglue.posterior import (
    CHAINS,
    DRAWS,
    ENDS,
    IDENTIFIED_BELOW,
    LEVELS,
    NEAR_BOUND,
    PRESSES_ABOVE,
    CorrectedCanopy,
    Posterior,
)
from vegglue.prior import quantile
from vegglue.schema import Parameter
from vegglue.statistics import (
    Floats,
    correlation,
    effective_size,
    mixture_quantile,
    pareto_shape,
    systematic_draws,
    weighted_covariance,
    weighted_quantile,
)


def glue(ensemble: Ensemble, case: Case, observations: Observations) -> Posterior:
    """p(theta | u) ~ L(u | theta) p(theta): a member drawn from the prior weighs w_k = L_k / sum L.

    gaussian: L = prod_i (2 pi s_i^2)^(-1/2) exp(-(u_i - U_i)^2 / (2 s_i^2)) over the used stations i, with s the root
    mean square residual of the best member, one for each kind of measurement (best-member), or the standard errors of
    the data (known). nse and inverse-variance: see likelihood.py. `behavioural` is the smallest Nash-Sutcliffe
    efficiency of a member with weight, for any of the three; failed members have none.

    Errors: InputError when nothing can be weighed: stations other than those simulated, none used, no member solved,
    standard errors missing, sigma zero, no member above the threshold.
    """
    station = observations.table
    check_stations(ensemble, station)
    fit = fit_members(ensemble, station, case.infer.sigma)
    threshold = -np.inf if case.infer.behavioural is None else case.infer.behavioural
    weights = member_weights(fit, case.infer.likelihood, threshold)
    return Posterior(
        method="glue",
        likelihood=case.infer.likelihood,
        sigma_rule=case.infer.sigma,
        threshold=threshold,
        weights=weights,
        prediction=ensemble.prediction,
        station=station,
        refinement=None,
        transfer=None,
        canopy=corrected_canopy(ensemble.parameters, case, weights),
        **{name: getattr(fit, name) for name in ("best", "sigma", "noise", "efficiency", "log_likelihood")},
        ensemble_hash=ensemble.config_hash,
        seed=ensemble.seed,
        version=ensemble.version,
        **_counts(fit, weights, station),
        **marginals(ensemble.parameters, case, weights),
        **predictions(ensemble.prediction, fit.best, fit.noise, weights, station, ensemble.seed),
    )


def check_stations(ensemble: Ensemble, station: pd.DataFrame) -> None:
    """Errors: InputError when the stations are not those that were simulated, or none is used."""
    same = len(station) == len(ensemble.station) and all(
        np.array_equal(station[column].to_numpy(), ensemble.station[column].to_numpy())
        for column in ("experiment", "kind", "x", "y")
    )
    if not same:
        raise InputError(
            f"observations: the {len(station)} stations are not the {len(ensemble.station)} that were simulated; "
            "run `vegglue simulate CONFIG` again."
        )
    if not station["used"].any():
        raise InputError("observations: no station is used, nothing can be inferred; `vegglue check CONFIG` says why.")


def _counts(fit: Fit, weights: Floats, station: pd.DataFrame) -> dict[str, Any]:
    return {
        "members": len(weights),
        "failed": int(np.sum(~fit.solved)),
        "weighed": int(np.sum(weights > 0)),
        "used": int(station["used"].sum()),
        "effective_size": effective_size(weights),
        "largest_weight": float(weights.max()),
        "pareto_k": pareto_shape(weights),
    }


def marginals(theta: dict[str, Floats], case: Case, weights: Floats) -> dict[str, Any]:
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
        "median": {name: _median(values, weights) for name, values in theta.items()},
        "sd": {name: _sd(values, weights) for name, values in theta.items()},
        "quantiles": {name: weighted_quantile(values, weights, LEVELS) for name, values in theta.items()},
        "prior_quantiles": prior_quantiles,
        "log10_median": {name: _median(seen[name], weights) for name in logs},
        "log10_sd": {name: _sd(seen[name], weights) for name in logs},
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


def _seen(values: Floats, prior: Parameter) -> Floats:
    """The values on the scale on which the prior is flat or normal: their log10, or themselves."""
    with np.errstate(divide="ignore"):  # the lower bound of a lognormal prior is 0
        return np.log10(values) if _on_log_scale(prior) else values


def on_flat_scale(case: Case, theta: dict[str, Floats]) -> Floats:
    """Values (m,) of each parameter on the scale on which its prior is flat or normal, (m, p)."""
    return np.column_stack([_seen(theta[name], prior) for name, prior in case.parameters.items()])


def _range(quantiles: Floats) -> float:
    return float(quantiles[-1] - quantiles[0])


def _median(values: Floats, weights: Floats) -> float:
    return float(weighted_quantile(values, weights, [0.5])[0])


def _sd(values: Floats, weights: Floats) -> float:
    if not np.isfinite(values[weights > 0]).all():
        return float("nan")
    return float(np.sqrt(weighted_covariance(values[:, None], weights)[0, 0]))


def _mass_near_bounds(seen: Floats, weights: Floats, ends: Floats) -> Floats:
    """Posterior mass within NEAR_BOUND of the prior's range of its low and high bound [-]; NaN without both bounds."""
    low, high = ends
    near = NEAR_BOUND * (high - low)
    if not np.isfinite(near):
        return np.full(2, np.nan)
    return np.array([weights[seen < low + near].sum(), weights[seen > high - near].sum()])


def _ended(seen: Floats, weights: Floats, ends: Floats) -> np.ndarray:
    """Whether each bound, and not the data, ends the 95 % range: the range begins within ENDS of its length of it."""
    quantiles = weighted_quantile(seen, weights, LEVELS)
    apart = np.abs(quantiles[[0, -1]] - ends)
    return np.asarray(apart <= ENDS * (quantiles[-1] - quantiles[0]))


def _pressing_mass(effective: float) -> float:
    """Mass near a bound that is not chance: three standard errors above what a parameter left at its prior has [-]."""
    return max(PRESSES_ABOVE, NEAR_BOUND + 3 * math.sqrt(NEAR_BOUND * (1 - NEAR_BOUND) / effective))


def predictions(
    prediction: Floats,
    best: int,
    noise: Floats,
    weights: Floats,
    station: pd.DataFrame,
    seed: int,
    lower: Floats | None = None,
) -> dict[str, Any]:
    """Bands, residuals and equal-weight draws at all stations; lower: factor of the errors' covariance if correlated.

    prediction: (member, station); noise: standard deviation of the errors (station,); lower: (station, station).
    """
    random = np.random.default_rng(seed)
    draws = systematic_draws(weights, CHAINS * DRAWS, random).reshape(CHAINS, DRAWS)
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


def correct_phi_for_canopy(
    phi: Floats, from_height: float, to_height: float, depth: float, bare_chezy: float | Floats
) -> Floats:
    """phi' with C(phi', to_height) = C(phi, from_height) at the same depth h [-], C the Chézy coefficient of

        C = (1 / C_b^2 + phi / (2 g))^(-1/2) + sqrt(g) / kappa ln(max(h / h_d, 1))

    phi: any shape; heights h_d and depth h [m]; bare_chezy C_b [m^1/2/s]. 0 where even the bare bed would be too rough,
    infinite where no plants would be rough enough. Berends et al. (2020) corrected D3b like this and do not print the
    formula: equal C is the natural reading. C: Baptist et al. (2007), https://doi.org/10.1080/00221686.2007.9521778.
    """
    through_plants = (1 / np.square(bare_chezy) + phi / (2 * GRAVITY)) ** -0.5
    wanted = through_plants + _above(depth, from_height) - _above(depth, to_height)
    with np.errstate(divide="ignore"):
        corrected = 2 * GRAVITY * (np.maximum(wanted, 0.0) ** -2 - 1 / np.square(bare_chezy))
    return np.maximum(corrected, 0.0)


def _above(depth: float, canopy_height: float) -> float:
    """Part of C that the water above the plants adds [m^1/2/s]."""
    return math.sqrt(GRAVITY) / KARMAN * math.log(max(depth / canopy_height, 1.0))


def corrected_canopy(theta: dict[str, Floats], case: Case, weights: Floats) -> CorrectedCanopy | None:
    """phi of the stand that the case asks to correct, for all members; None when it asks for nothing."""
    asked = case.canopy_correction
    if asked is None:
        return None
    stand = case.plants.stands[asked.stand]
    if not isinstance(stand.phi, str):
        raise InputError(f"canopy_correction: phi of the stand {asked.stand} is a number; make it a parameter.")
    bare = theta[stand.bare_chezy] if isinstance(stand.bare_chezy, str) else stand.bare_chezy
    raw = theta[stand.phi]
    phi = correct_phi_for_canopy(raw, asked.from_height, asked.to_height, asked.depth, bare)
    with np.errstate(divide="ignore"):
        log10_phi = np.log10(phi)
    return CorrectedCanopy(
        parameter=stand.phi,
        from_height=asked.from_height,
        to_height=asked.to_height,
        depth=asked.depth,
        phi=phi,
        median=_median(phi, weights),
        sd=_sd(phi, weights),
        quantiles=weighted_quantile(phi, weights, LEVELS),
        log10_median=_median(log10_phi, weights),
        log10_sd=_sd(log10_phi, weights),
    )
