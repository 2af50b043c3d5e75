"""The posterior of weighted members: location and spread of each parameter and of each prediction, and phi of a
vegetation type for another canopy height, as Berends et al. (2020) corrected it.
"""

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.parameter_space import probability, quantile
from vegglue.case.schema import Case, Parameter
from vegglue.effects.physical_constants import GRAVITY
from vegglue.effects.plant_laws import above_canopy, baptist_chezy
from vegglue.errors import InputError
from vegglue.inference.weighted_statistics import (
    correlation,
    effective_size,
    mixture_quantile,
    pareto_shape,
    root_mean_square,
    stations_by_kind,
    systematic_draws,
    weighted_covariance,
    weighted_median,
    weighted_quantile,
    weighted_sd,
)
from vegglue.results.posterior import (
    CHAINS,
    DRAWS_PER_CHAIN,
    IDENTIFIED_BELOW,
    LEVELS,
    NEAR_BOUND,
    CorrectedCanopy,
    GoodnessOfFit,
    InferenceSettings,
    Marginals,
    Posterior,
    PredictiveDistribution,
    WeightedSample,
    WeightStatistics,
)

# Posterior mass near a bound from which a parameter may press against it; one left at a flat prior has NEAR_BOUND.
PRESSES_ABOVE = 0.05
# A bound cuts the 95 % range off if it lies within this share of the range from its end: for half a normal density at
# the bound the share is 0.014, for a normal density two standard deviations away from it 0.09.
CUT_OFF_WITHIN = 0.05


def posterior_of(
    settings: InferenceSettings,
    sample: WeightedSample,
    case: Case,
    station: pd.DataFrame,
    noise: Array,
    sigma: dict[str, float],
    factor: Array | None = None,
) -> Posterior:
    """The posterior of a weighted sample, without what only a refinement gives.

    Parameters
    ----------
    station : DataFrame
        All stations.
    noise : ndarray (station,)
        Standard deviation of their errors [m/s or m].
    sigma : dict of float
        Its root mean square by kind [unit of the kind].
    factor : ndarray (station, station), optional
        L with L L' the covariance of the errors, if they are correlated; NaN if a station is not used.

    Raises
    ------
    InputError
        If `canopy_correction` names a vegetation type whose phi is no parameter.
    """
    weights, predicted = sample.weights, predictive_distribution(sample, noise, settings.seed, factor)
    return Posterior(
        settings=settings,
        sample=sample,
        weighting=WeightStatistics(
            weighed=int(np.sum(weights > 0)),
            effective_size=effective_size(weights),
            largest_weight=float(weights.max()),
            pareto_k=pareto_shape(weights),
        ),
        marginals=marginals(sample.theta, case, weights),
        fit=goodness_of_fit(station, noise, sigma, predicted.model_band, sample.prediction[sample.best]),
        predicted=predicted,
        station=station,
        canopy=corrected_canopy(sample.theta, case, weights),
        refinement=None,
        transfer=None,
    )


def marginals(theta: dict[str, Array], case: Case, weights: Array) -> Marginals:
    """Location and spread of each parameter, what the data added to its prior, and the bounds it presses against.

    A bound is pressed against if it ends the 95 % range, and the mass near it is above PRESSES_ABOVE and, by three
    standard errors, above that of the prior.

    Parameters
    ----------
    theta : dict of ndarray (member,)
        By parameter [its unit].
    case : Case
        With the priors.
    weights : ndarray (member,)
        Of sum 1 [-].
    """
    priors = case.parameters
    scaled = {name: _on_flat_scale(values, priors[name]) for name, values in theta.items()}
    logs = [name for name in theta if _has_log_scale(priors[name])]
    prior_quantiles = {name: quantile(priors[name], LEVELS) for name in theta}
    bounds = {name: quantile(priors[name], (0.0, 1.0)) for name in theta}
    ratio, mass, hit, effective = {}, {}, {}, effective_size(weights)
    for name, values in scaled.items():
        of_prior, ends = (_on_flat_scale(some[name], priors[name]) for some in (prior_quantiles, bounds))
        of_posterior = weighted_quantile(values, weights, LEVELS)
        width = float(of_posterior[-1] - of_posterior[0])
        ratio[name] = width / float(of_prior[-1] - of_prior[0])
        near = NEAR_BOUND * (ends[1] - ends[0])
        mass[name] = np.full(2, np.nan)
        if np.isfinite(near):
            sides = values < ends[0] + near, values > ends[1] - near
            mass[name] = np.array([weights[side].sum() for side in sides])
        # Beyond chance: three standard errors above the mass of a parameter that is left at its prior.
        before = prior_mass_near_bounds(priors[name])
        beyond = np.maximum(PRESSES_ABOVE, before + 3.0 * np.sqrt(before * (1.0 - before) / effective))
        # The bound, and not the data, ends the 95 % range.
        cut_off = np.abs(of_posterior[[0, -1]] - ends) <= CUT_OFF_WITHIN * (of_posterior[-1] - of_posterior[0])
        hit[name] = (mass[name] > beyond) & cut_off
    return Marginals(
        median={name: weighted_median(values, weights) for name, values in theta.items()},
        sd={name: weighted_sd(values, weights) for name, values in theta.items()},
        quantiles={name: weighted_quantile(values, weights, LEVELS) for name, values in theta.items()},
        prior_quantiles=prior_quantiles,
        log10_median={name: weighted_median(scaled[name], weights) for name in logs},
        log10_sd={name: weighted_sd(scaled[name], weights) for name in logs},
        correlation=correlation(weighted_covariance(np.transpose(list(scaled.values())), weights)),
        width_ratio=ratio,
        identified={name: ratio[name] < IDENTIFIED_BELOW for name in theta},
        bounds=bounds,
        bound_mass=mass,
        bound_hit=hit,
    )


def _has_log_scale(prior: Parameter) -> bool:
    return prior.distribution in ("loguniform", "lognormal")


def _on_flat_scale(values: Array, prior: Parameter) -> Array:
    """The values on the scale on which the prior is flat or normal: their log10, or themselves."""
    with np.errstate(divide="ignore"):  # the lower bound of a lognormal prior is 0
        return np.log10(values) if _has_log_scale(prior) else values


def on_flat_scale(case: Case, theta: dict[str, Array]) -> Array:
    """x = log10(theta) of a log-uniform or lognormal prior, else theta: flat or normal before the data.

    Parameters
    ----------
    case : Case
        With the priors.
    theta : dict of ndarray (m,)
        By parameter [its unit].

    Returns
    -------
    ndarray (m, p)
        In the order of the parameters of the case [unit of the parameter, or -].
    """
    return np.column_stack([_on_flat_scale(theta[name], prior) for name, prior in case.parameters.items()])


def prior_mass_near_bounds(prior: Parameter) -> Array:
    """Mass of the prior within NEAR_BOUND of its range of either bound.

    Returns
    -------
    ndarray (2,)
        Low and high [-]: NEAR_BOUND of a flat prior, and more of one that ends where it is largest; NaN without both
        bounds.
    """
    low, high = _on_flat_scale(quantile(prior, (0.0, 1.0)), prior)
    if not np.isfinite(high - low):
        return np.full(2, np.nan)
    near = np.array([low, high]) + NEAR_BOUND * (high - low) * np.array([1.0, -1.0])
    below = probability(prior, 10.0**near if _has_log_scale(prior) else near)
    return np.array([below[0], 1.0 - below[1]])


def predictive_distribution(
    sample: WeightedSample, noise: Array, seed: int, factor: Array | None = None
) -> PredictiveDistribution:
    """Bands at all stations, and draws of f(theta) + e of equal weight.

        e = noise * normal,   or   L normal with L L' the covariance of the errors

    Parameters
    ----------
    noise : ndarray (station,)
        Standard deviation of the errors [unit of each station].
    factor : ndarray (station, station), optional
        L.
    """
    prediction, weights, random = sample.prediction, sample.weights, np.random.default_rng(seed)
    draws = systematic_draws(weights, CHAINS * DRAWS_PER_CHAIN, random).reshape(CHAINS, DRAWS_PER_CHAIN)
    normal = random.standard_normal((*draws.shape, prediction.shape[1]))
    weighed = weights > 0
    return PredictiveDistribution(
        model_band=weighted_quantile(prediction, weights, LEVELS),
        total_band=mixture_quantile(prediction[weighed], weights[weighed], noise, LEVELS),
        draws=draws,
        predictive=prediction[draws] + (noise * normal if factor is None else normal @ factor.T),
    )


def goodness_of_fit(
    station: pd.DataFrame, noise: Array, sigma: dict[str, float], model_band: Array, best: Array
) -> GoodnessOfFit:
    """Measured minus predicted by the median and by the best member, and their root mean squares by kind.

    noise, and best, the predictions of the best member: (station,); model_band: (level, station).
    """
    value, errors = station["value"].to_numpy(float), station["standard_error"].to_numpy(float)
    used, kinds = station["used"].to_numpy(), stations_by_kind(station)
    residual, best_residual = value - model_band[LEVELS.index(0.5)], value - best
    return GoodnessOfFit(
        used=int(used.sum()),
        chi2=float(np.sum((best_residual / errors)[used] ** 2)),
        sigma=sigma,
        rmse={kind: root_mean_square(residual[rows]) for kind, rows in kinds.items()},
        best_rmse={kind: root_mean_square(best_residual[rows]) for kind, rows in kinds.items()},
        noise=noise,
        residual=residual,
    )


def correct_phi_for_canopy(
    phi: Array, from_height: float, to_height: float, depth: float, bare_chezy: float | Array
) -> Array:
    """phi' with C(phi', to_height) = C(phi, from_height) at the same depth h, C of `baptist_chezy`.

        phi' = 2 g ((C - C_above)^-2 - 1/C_b^2), C_above the part of the water above plants of to_height

    Berends et al. (2020) corrected D3b like this and do not print the formula: equal C is the natural reading.

    Parameters
    ----------
    phi : array
        Of any shape [-].
    from_height, to_height : float
        Heights h_d of the canopy [m].
    depth : float
        h [m].
    bare_chezy : float or array
        C_b of the bed [m^1/2/s].

    Returns
    -------
    array
        phi' [-]: 0 if even the bare bed would be too rough, infinite if no plants would be rough enough.

    References
    ----------
    Baptist et al. (2007), https://doi.org/10.1080/00221686.2007.9521778.
    """
    chezy = np.vectorize(baptist_chezy, otypes=[np.float64])(phi, from_height, depth, bare_chezy)
    within = chezy - above_canopy(to_height, depth)
    with np.errstate(divide="ignore"):
        corrected = 2 * GRAVITY * (np.maximum(within, 0.0) ** -2 - 1 / np.square(bare_chezy))
    return np.maximum(corrected, 0.0)


def corrected_canopy(theta: dict[str, Array], case: Case, weights: Array) -> CorrectedCanopy | None:
    """phi of the vegetation type that `canopy_correction` names, see `correct_phi_for_canopy`.

    Parameters
    ----------
    theta : dict of ndarray (m,)
        Parameters of all members [unit of each].
    weights : ndarray (m,)
        [-]

    Returns
    -------
    CorrectedCanopy or None
        None without that key.

    Raises
    ------
    InputError
        If that phi is no parameter.
    """
    wanted = case.canopy_correction
    if wanted is None:
        return None
    stand = case.plants.stands[wanted.stand]
    if not isinstance(stand.phi, str):
        raise InputError(f"canopy_correction: phi of the stand {wanted.stand} is a number; make it a parameter.")
    bare = theta[stand.bare_chezy] if isinstance(stand.bare_chezy, str) else stand.bare_chezy
    raw = theta[stand.phi]
    phi = correct_phi_for_canopy(raw, wanted.from_height, wanted.to_height, wanted.depth, bare)
    with np.errstate(divide="ignore"):
        log10_phi = np.log10(phi)
    return CorrectedCanopy(
        parameter=stand.phi,
        from_height=wanted.from_height,
        to_height=wanted.to_height,
        depth=wanted.depth,
        phi=phi,
        median=weighted_median(phi, weights),
        sd=weighted_sd(phi, weights),
        quantiles=weighted_quantile(phi, weights, LEVELS),
        log10_median=weighted_median(log10_phi, weights),
        log10_sd=weighted_sd(log10_phi, weights),
    )
