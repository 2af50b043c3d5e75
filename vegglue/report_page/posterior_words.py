"""What an inference found, in plain sentences with numbers."""

import math
from collections.abc import Mapping
from itertools import combinations

import numpy as np

from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.measurements.kinds import kind_of
from vegglue.report_page.homogeneity_words import homogeneity_in_words
from vegglue.results.posterior import CLAIMED_FROM, IDENTIFIED_BELOW, NEAR_BOUND, Marginals, Posterior
from vegglue.results.refinement import ErrorModel, GroupsLeftOut, LeaveOneOut, MisfitTest, PosteriorModes, Refinement

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
    settings, sample = posterior.settings, posterior.sample
    rule = "the root mean square residual of the best member" if settings.sigma_rule == "best-member" else "known"
    sigma = of_kinds(posterior.fit.sigma, "for")
    threshold = ""
    if math.isfinite(settings.threshold):
        threshold = f", {posterior.weighting.weighed} of them with weight (efficiency at least {settings.threshold:g})"
    return [
        f"{sample.members} members, {sample.failed or 'none'} of them failed (no weight).",
        f"Weighed by the {settings.likelihood} likelihood over {posterior.fit.used} of {len(posterior.station)} "
        f"stations{threshold}; sigma is {sigma} ({rule}).",
    ]


def of_kinds(errors: Mapping[str, float], preposition: str) -> str:
    """0.012 m/s for velocity and 0.003 m for level: one error for each kind of measurement."""
    known = ((kind_of(name), value) for name, value in errors.items())
    return " and ".join(f"{value:.3g} {kind.unit} {preposition} {kind.words}" for kind, value in known)


def _worth(posterior: Posterior) -> list[str]:
    weighting = posterior.weighting
    size = f"{weighting.effective_size:.3g}"
    sentences = [
        f"The weights are worth {size} equal members; the largest weight is {weighting.largest_weight:.2g}, the index "
        f"of their tail k-hat {weighting.pareto_k:.2g} (to be trusted below {TRUSTED_K_HAT})."
    ]
    if not posterior.claimed:
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
    if not posterior.claimed:
        return "too few members to tell"
    return "identified" if posterior.marginals.identified[name] else "not identified"


def _parameter(posterior: Posterior, name: str) -> list[str]:
    unit, marginals = posterior.sample.unit[name].removesuffix("-"), posterior.marginals
    low, high = marginals.quantiles[name][[0, -1]]
    logarithm = ""
    if name in marginals.log10_median:
        logarithm = f" = 10^({marginals.log10_median[name]:.2f} ± {marginals.log10_sd[name]:.2f})"
    ratio = f"{100 * marginals.width_ratio[name]:.0f} % of the prior's"
    if not marginals.identified[name]:
        return [
            f"{name} is not identified: its 95 % range, {low:.3g} to {high:.3g} {unit}".rstrip()
            + f", is still {ratio} (identified means below {100 * IDENTIFIED_BELOW:g} %).",
            *_bounds(marginals, name),
        ]
    centre = f"{name}: median {marginals.median[name]:.3g} {unit}".rstrip() + logarithm
    spread = f"standard deviation {marginals.sd[name]:.2g}, 95 % range {low:.3g} to {high:.3g}, {ratio}"
    return [f"{centre}, {spread}.", *_bounds(marginals, name)]


def _bounds(marginals: Marginals, name: str) -> list[str]:
    sides = zip(("lower", "upper"), marginals.bounds[name], marginals.bound_mass[name], strict=True)
    hits = [side for side, hit in zip(sides, marginals.bound_hit[name], strict=True) if hit]
    return [
        f"{name} presses against the {side} bound of its prior, {bound:.3g}: {mass:.2g} of the posterior lies within "
        f"{100 * NEAR_BOUND:g} % of the prior's range of it ({NEAR_BOUND:g} if the data said nothing)."
        for side, bound, mass in hits
    ]


def tied(posterior: Posterior) -> list[tuple[int, int]]:
    """Pairs of parameters strongly correlated; none among few members, any two of which are correlated perfectly."""
    if not posterior.claimed:
        return []
    strong = np.abs(np.nan_to_num(posterior.marginals.correlation)) > STRONG_CORRELATION
    return [(i, j) for i, j in combinations(range(len(posterior.parameters)), 2) if strong[i, j]]


def _correlations(posterior: Posterior) -> list[str]:
    names, matrix = posterior.parameters, posterior.marginals.correlation
    return [
        f"{names[i]} and {names[j]} are correlated ({matrix[i, j]:+.2f}): the data tell their combination better than "
        "either of them."
        for i, j in tied(posterior)
    ]


def _misfit(posterior: Posterior) -> list[str]:
    fit = posterior.fit
    errors = of_kinds(fit.rmse, "in")
    used = posterior.station["used"].to_numpy(bool)
    value = posterior.station["value"].to_numpy(float)
    outside = (value < posterior.predicted.total_band[0]) | (value > posterior.predicted.total_band[-1])
    sentences = [
        f"The median prediction misses by {errors} (root mean square); {int(np.sum(outside & used))} of "
        f"{fit.used} measurements lie outside the total 95 % band, {0.05 * fit.used:.1f} are expected to."
    ]
    if math.isfinite(fit.chi2) and posterior.refinement is None:
        sentences.append(
            f"Against the standard errors of the data, the best member has chi2 = {fit.chi2:.3g} over "
            f"{fit.used} stations."
        )
    return sentences


def _canopy(posterior: Posterior) -> list[str]:
    canopy = posterior.canopy
    if canopy is None:
        return []
    raw = f"{posterior.marginals.median[canopy.parameter]:.3g}"
    return [
        f"For a canopy of {canopy.to_height:g} m instead of {canopy.from_height:g} m (equal C at a depth of "
        f"{canopy.depth:g} m), the median of {canopy.parameter} goes from {raw} to {canopy.median:.3g} = "
        f"10^({canopy.log10_median:.2f} ± {canopy.log10_sd:.2f})."
    ]


# Chances below which errors alone are not believed to explain what is seen.
DOUBTED, UNBELIEVED = 0.05, 0.001
# Stations that are named one by one, at most.
NAMED = 5


def drawn_in_words(posterior: Posterior, refined: Refinement) -> list[str]:
    """Sentences on the search, the modes, the draws and the errors they were weighed by."""
    modes, sample = refined.modes, posterior.sample
    starts = f"{modes.starts} of the best members were followed" if modes.starts > 1 else "The best member was followed"
    return [
        f"{starts} downhill and ended in {_modes(posterior, modes)}; {sample.members} members were drawn around, "
        f"{sample.failed or 'none'} of them failed (no weight).",
        *_errors_in_words(posterior, refined.error_model),
    ]


def _modes(posterior: Posterior, modes: PosteriorModes) -> str:
    if modes.mode_chi2.size == 1:
        return "one mode"
    each = (
        f"{', '.join(f'{name} = {value:.3g}' for name, value in zip(posterior.parameters, theta, strict=True))} "
        f"with chi2 = {misfit:.4g} and weight {weight:.2g}"
        for theta, misfit, weight in zip(modes.mode_theta, modes.mode_chi2, modes.mode_weight, strict=True)
    )
    return f"{modes.mode_chi2.size} modes ({'; '.join(each)})"


def _errors_in_words(posterior: Posterior, model: ErrorModel) -> list[str]:
    sizes = of_kinds(posterior.fit.sigma, "for")
    if model.errors == "estimated":
        estimate = (
            f"The errors are estimated from what the best place leaves, {sizes}: what the model misses counts as "
            "error, so its chi2 says nothing; give standard errors and `infer.sigma: known` to test the model."
        )
        return [estimate, *_correlated(model)]
    grid = (
        f"that of the grid ({model.grid_error:.2g} on the whole) among them"
        if math.isfinite(model.grid_error)
        else "without that of the grid, whose cells cannot be doubled"
    )
    sentences = [f"The errors are those stated with the data, {sizes}, {grid}.", *_correlated(model)]
    if model.scale > 1.0:
        sentences.append(
            f"They had to be multiplied by {model.scale:.2f}: stations beside each other scatter more than is stated."
        )
    return sentences


def _correlated(model: ErrorModel) -> list[str]:
    if model.correlation == 0.0:
        return []
    return [f"Errors of neighbours along a section are correlated by {model.correlation:.2f} (estimated)."]


def unseen_in_words(posterior: Posterior, refined: Refinement) -> list[str]:
    """Sentences on the misfit under all errors, stations left out, bands, and stations that stand out."""
    return [
        *(() if refined.error_model.errors == "estimated" else _misfit_under_errors(refined.misfit)),
        *_scores(posterior, refined.leave_one_out, refined.groups),
        *_bands(refined.leave_one_out),
        *_outliers(posterior, refined.misfit),
    ]


def _misfit_under_errors(misfit: MisfitTest) -> list[str]:
    said = f"Under these errors chi2 = {misfit.chi2:.4g} with {misfit.freedom} degrees of freedom (p = "
    said += f"{misfit.p_misfit:.2g})"
    if misfit.p_misfit < UNBELIEVED:
        return [f"{said}: the errors do not explain what is left, something is missing in the model or in its data."]
    return [f"{said}: the errors {'hardly ' if misfit.p_misfit < DOUBTED else ''}explain what is left."]


def _scores(posterior: Posterior, alone: LeaveOneOut, groups: GroupsLeftOut) -> list[str]:
    doubtful = int(np.sum(alone.score_k > TRUSTED_K_HAT))
    doubt = f", {doubtful} of them not to be trusted (k-hat above {TRUSTED_K_HAT})" if doubtful else ""
    sentences = [
        f"Leaving each station out in turn, the log predictive density is {alone.elpd:.1f} ± "
        f"{alone.elpd_error:.1f} over {posterior.fit.used} stations{doubt}."
    ]
    shaky = [str(name) for name, k in zip(groups.left_out, groups.left_out_k, strict=True) if k > TRUSTED_K_HAT]
    if groups.left_out.size:
        each = groups.left_out_score / groups.left_out_stations
        worst = int(np.argmin(each))
        sentences.append(
            f"Of {groups.left_out.size} sections and experiments left out in turn, the one told worst from the others "
            f"is {groups.left_out[worst]} ({each[worst]:.2f} a station, {np.median(each):.2f} in the middle)."
        )
    if shaky:
        sentences.append(f"Without {', '.join(shaky)} the posterior moves too far for these draws: not to be trusted.")
    return sentences


def _bands(alone: LeaveOneOut) -> list[str]:
    said = (
        f"Predicted from all others, {100 * alone.inside50:.0f} % of the measurements lie within their 50 % band and "
        f"{100 * alone.inside95:.0f} % within that of 95 %"
    )
    if alone.p_calibration < DOUBTED:
        return [f"{said}; they fill their bands unevenly (p = {alone.p_calibration:.2g})."]
    return [f"{said}, as evenly as they should (p = {alone.p_calibration:.2g})."]


def _outliers(posterior: Posterior, misfit: MisfitTest) -> list[str]:
    many = int(misfit.outlier.sum())
    if many > NAMED:
        worst = int(np.nanargmax(np.abs(np.where(misfit.outlier, misfit.surprise, np.nan))))
        row = posterior.station.iloc[worst]
        return [
            f"{many} stations stand out by more than chance allows from what all others and the model tell, most "
            f"of all {row['experiment']} {row['section']} at x = {row['x']:g} m, y = {row['y']:g} m, by "
            f"{misfit.surprise[worst]:+.1f} of its errors: so many are no single errors but something missing."
        ]
    return [
        f"Station {row['experiment']} {row['section']} at x = {row['x']:g} m, y = {row['y']:g} m stands out by "
        f"{surprise:+.1f} of its errors from what all others and the model tell; it is kept."
        for (_, row), surprise in zip(
            posterior.station[misfit.outlier].iterrows(), misfit.surprise[misfit.outlier], strict=True
        )
    ]
