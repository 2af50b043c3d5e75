"""What an inference found, in plain sentences with numbers."""

import math
from collections.abc import Mapping
from itertools import combinations

import numpy as np

from vegglue.inference.leave_one_out import TRUSTED_BELOW
from vegglue.report.homogeneity_words import homogeneity_in_words
from vegglue.results.posterior import IDENTIFIED_BELOW, NEAR_BOUND, Posterior, Refinement

CLAIMED_FROM = 100  # effective members; below, no posterior is claimed
HEAVY_TAIL = 0.7  # of pareto_k, above which weighted means are not to be trusted
STRONG_CORRELATION = 0.7


def describe(posterior: Posterior, others: Mapping[str, object] | None = None) -> list[str]:
    """Sentences on the ensemble and its worth, each parameter, their correlation, the fit, whether experiments agree,
    the canopy correction. others: reference values of the case.
    """
    return [
        *(_ensemble(posterior) if posterior.refinement is None else drawn_in_words(posterior, posterior.refinement)),
        *_worth(posterior),
        *(sentence for name in posterior.parameters for sentence in _parameter(posterior, name)),
        *_correlations(posterior),
        *_misfit(posterior),
        *(unseen_in_words(posterior, posterior.refinement) if posterior.refinement else ()),
        *(homogeneity_in_words(posterior, posterior.transfer, others or {}) if posterior.transfer else ()),
        *_canopy(posterior),
    ]


def _ensemble(posterior: Posterior) -> list[str]:
    rule = "the root mean square residual of the best member" if posterior.sigma_rule == "best-member" else "known"
    sigma = " and ".join(f"{value:.3g} {UNIT_OF_KIND[kind]} for {kind}" for kind, value in posterior.sigma.items())
    threshold = ""
    if math.isfinite(posterior.threshold):
        threshold = f", {posterior.weighed} of them with weight (efficiency at least {posterior.threshold:g})"
    return [
        f"{posterior.members} members, {posterior.failed or 'none'} of them failed (no weight).",
        f"Weighed by the {posterior.likelihood} likelihood over {posterior.used} of {len(posterior.station)} stations"
        f"{threshold}; sigma is {sigma} ({rule}).",
    ]


def _worth(posterior: Posterior) -> list[str]:
    size = f"{posterior.effective_size:.3g}"
    sentences = [
        f"The weights are worth {size} equal members; the largest weight is {posterior.largest_weight:.2g}, the index "
        f"of their tail k-hat {posterior.pareto_k:.2g} (to be trusted below {HEAVY_TAIL})."
    ]
    if posterior.effective_size < CLAIMED_FROM:
        remedy = "refine around the best members (`infer --method refine`)"
        if posterior.refinement is not None:
            remedy = "narrow the priors or fix what the data do not tell"
        sentences.append(
            f"With {size} effective members, fewer than {CLAIMED_FROM}, no posterior is claimed: take the medians and "
            f"widths below as a first look, and {remedy} before resting anything on them."
        )
    return sentences


def how_known(posterior: Posterior, name: str) -> str:
    """Whether the data tell a parameter, which few members cannot say."""
    if posterior.effective_size < CLAIMED_FROM:
        return "too few members to tell"
    return "identified" if posterior.identified[name] else "not identified"


def _parameter(posterior: Posterior, name: str) -> list[str]:
    unit = posterior.unit[name].removesuffix("-")
    low, high = posterior.quantiles[name][[0, -1]]
    logarithm = ""
    if name in posterior.log10_median:
        logarithm = f" = 10^({posterior.log10_median[name]:.2f} ± {posterior.log10_sd[name]:.2f})"
    ratio = f"{100 * posterior.width_ratio[name]:.0f} % of the prior's"
    if not posterior.identified[name]:
        return [
            f"{name} is not identified: its 95 % range, {low:.3g} to {high:.3g} {unit}".rstrip()
            + f", is still {ratio} (identified means below {100 * IDENTIFIED_BELOW:g} %).",
            *_bounds(posterior, name),
        ]
    centre = f"{name}: median {posterior.median[name]:.3g} {unit}".rstrip() + logarithm
    spread = f"standard deviation {posterior.sd[name]:.2g}, 95 % range {low:.3g} to {high:.3g}, {ratio}"
    return [f"{centre}, {spread}.", *_bounds(posterior, name)]


def _bounds(posterior: Posterior, name: str) -> list[str]:
    sides = zip(("lower", "upper"), posterior.bounds[name], posterior.bound_mass[name], strict=True)
    hits = [side for side, hit in zip(sides, posterior.bound_hit[name], strict=True) if hit]
    return [
        f"{name} presses against the {side} bound of its prior, {bound:.3g}: {mass:.2g} of the posterior lies within "
        f"{100 * NEAR_BOUND:g} % of the prior's range of it ({NEAR_BOUND:g} if the data said nothing)."
        for side, bound, mass in hits
    ]


def tied(posterior: Posterior) -> list[tuple[int, int]]:
    """Pairs of parameters strongly correlated; none among few members, any two of which are correlated perfectly."""
    if posterior.effective_size < CLAIMED_FROM:
        return []
    strong = np.abs(np.nan_to_num(posterior.correlation)) > STRONG_CORRELATION
    return [(i, j) for i, j in combinations(range(len(posterior.parameters)), 2) if strong[i, j]]


def _correlations(posterior: Posterior) -> list[str]:
    names, matrix = posterior.parameters, posterior.correlation
    return [
        f"{names[i]} and {names[j]} are correlated ({matrix[i, j]:+.2f}): the data tell their combination better than "
        "either of them."
        for i, j in tied(posterior)
    ]


def _misfit(posterior: Posterior) -> list[str]:
    errors = " and ".join(f"{value:.3g} {UNIT_OF_KIND[kind]} in {kind}" for kind, value in posterior.rmse.items())
    used = posterior.station["used"].to_numpy(bool)
    value = posterior.station["value"].to_numpy(float)
    outside = (value < posterior.total_band[0]) | (value > posterior.total_band[-1])
    sentences = [
        f"The median prediction misses by {errors} (root mean square); {int(np.sum(outside & used))} of "
        f"{posterior.used} measurements lie outside the total 95 % band, {0.05 * posterior.used:.1f} are expected to."
    ]
    if math.isfinite(posterior.chi2) and posterior.refinement is None:
        sentences.append(
            f"Against the standard errors of the data, the best member has chi2 = {posterior.chi2:.3g} over "
            f"{posterior.used} stations."
        )
    return sentences


def _canopy(posterior: Posterior) -> list[str]:
    canopy = posterior.canopy
    if canopy is None:
        return []
    raw = f"{posterior.median[canopy.parameter]:.3g}"
    return [
        f"For a canopy of {canopy.to_height:g} m instead of {canopy.from_height:g} m (equal C at a depth of "
        f"{canopy.depth:g} m), the median of {canopy.parameter} goes from {raw} to {canopy.median:.3g} = "
        f"10^({canopy.log10_median:.2f} ± {canopy.log10_sd:.2f})."
    ]


UNIT_OF_KIND = {"velocity": "m/s", "level": "m"}
# Chances below which errors alone are not believed to explain what is seen.
DOUBTED, UNBELIEVED = 0.05, 0.001
# Stations that are named one by one, at most.
NAMED = 5


def drawn_in_words(posterior: Posterior, refined: Refinement) -> list[str]:
    """Sentences on the search, the modes, the draws and the errors they were weighed by."""
    many = refined.starts > 1
    starts = f"{refined.starts} of the best members were followed" if many else "The best member was followed"
    return [
        f"{starts} downhill and ended in {_modes(posterior, refined)}; {posterior.members} members were drawn around, "
        f"{posterior.failed or 'none'} of them failed (no weight).",
        *_errors_in_words(posterior, refined),
    ]


def _modes(posterior: Posterior, refined: Refinement) -> str:
    if refined.mode_chi2.size == 1:
        return "one mode"
    each = (
        f"{', '.join(f'{name} = {value:.3g}' for name, value in zip(posterior.parameters, theta, strict=True))} "
        f"with chi2 = {misfit:.4g} and weight {weight:.2g}"
        for theta, misfit, weight in zip(refined.mode_theta, refined.mode_chi2, refined.mode_weight, strict=True)
    )
    return f"{refined.mode_chi2.size} modes ({'; '.join(each)})"


def _errors_in_words(posterior: Posterior, refined: Refinement) -> list[str]:
    sizes = " and ".join(f"{value:.3g} {UNIT_OF_KIND[kind]} for {kind}" for kind, value in posterior.sigma.items())
    if refined.errors == "estimated":
        estimate = (
            f"The errors are estimated from what the best place leaves, {sizes}: what the model misses counts as "
            "error, so its chi2 says nothing; give standard errors and `infer.sigma: known` to test the model."
        )
        return [estimate, *_correlated(refined)]
    grid = (
        f"that of the grid ({refined.grid_error:.2g} on the whole) among them"
        if math.isfinite(refined.grid_error)
        else "without that of the grid, whose cells cannot be doubled"
    )
    sentences = [f"The errors are those stated with the data, {sizes}, {grid}.", *_correlated(refined)]
    if refined.scale > 1.0:
        sentences.append(
            f"They had to be multiplied by {refined.scale:.2f}: stations beside each other scatter more than is stated."
        )
    return sentences


def _correlated(refined: Refinement) -> list[str]:
    if refined.correlation == 0.0:
        return []
    return [f"Errors of neighbours along a section are correlated by {refined.correlation:.2f} (estimated)."]


def unseen_in_words(posterior: Posterior, refined: Refinement) -> list[str]:
    """Sentences on the misfit under all errors, stations left out, bands, and stations that stand out."""
    return [
        *_misfit_under_errors(refined),
        *_scores(posterior, refined),
        *_bands(refined),
        *_outliers(posterior, refined),
    ]


def _misfit_under_errors(refined: Refinement) -> list[str]:
    if refined.errors == "estimated":
        return []
    said = f"Under these errors chi2 = {refined.chi2:.4g} with {refined.freedom} degrees of freedom (p = "
    said += f"{refined.p_misfit:.2g})"
    if refined.p_misfit < UNBELIEVED:
        return [f"{said}: the errors do not explain what is left, something is missing in the model or in its data."]
    return [f"{said}: the errors {'hardly ' if refined.p_misfit < DOUBTED else ''}explain what is left."]


def _scores(posterior: Posterior, refined: Refinement) -> list[str]:
    doubtful = int(np.sum(refined.score_k > TRUSTED_BELOW))
    doubt = f", {doubtful} of them not to be trusted (k-hat above {TRUSTED_BELOW})" if doubtful else ""
    sentences = [
        f"Leaving each station out in turn, the log predictive density is {refined.elpd:.1f} ± "
        f"{refined.elpd_error:.1f} over {posterior.used} stations{doubt}."
    ]
    shaky = [str(name) for name, k in zip(refined.left_out, refined.left_out_k, strict=True) if k > TRUSTED_BELOW]
    if refined.left_out.size:
        each = refined.left_out_score / refined.left_out_stations
        worst = int(np.argmin(each))
        sentences.append(
            f"Of {refined.left_out.size} sections and experiments left out in turn, the one told worst from the others "
            f"is {refined.left_out[worst]} ({each[worst]:.2f} a station, {np.median(each):.2f} in the middle)."
        )
    if shaky:
        sentences.append(f"Without {', '.join(shaky)} the posterior moves too far for these draws: not to be trusted.")
    return sentences


def _bands(refined: Refinement) -> list[str]:
    said = (
        f"Predicted from all others, {100 * refined.inside50:.0f} % of the measurements lie within their 50 % band and "
        f"{100 * refined.inside95:.0f} % within that of 95 %"
    )
    if refined.p_calibration < DOUBTED:
        return [f"{said}; they fill their bands unevenly (p = {refined.p_calibration:.2g})."]
    return [f"{said}, as evenly as they should (p = {refined.p_calibration:.2g})."]


def _outliers(posterior: Posterior, refined: Refinement) -> list[str]:
    many = int(refined.outlier.sum())
    if many > NAMED:
        worst = int(np.nanargmax(np.abs(np.where(refined.outlier, refined.surprise, np.nan))))
        row = posterior.station.iloc[worst]
        return [
            f"{many} stations stand out by more than chance allows from what all others and the model tell, most "
            f"of all {row['experiment']} {row['section']} at x = {row['x']:g} m, y = {row['y']:g} m, by "
            f"{refined.surprise[worst]:+.1f} of its errors: so many are no single errors but something missing."
        ]
    return [
        f"Station {row['experiment']} {row['section']} at x = {row['x']:g} m, y = {row['y']:g} m stands out by "
        f"{surprise:+.1f} of its errors from what all others and the model tell; it is kept."
        for (_, row), surprise in zip(
            posterior.station[refined.outlier].iterrows(), refined.surprise[refined.outlier], strict=True
        )
    ]
