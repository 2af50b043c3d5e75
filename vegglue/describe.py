"""What an inference found, in plain sentences with numbers."""

import math
from collections.abc import Mapping
from itertools import combinations

import numpy as np

from vegglue.describe_refined import UNIT_OF_KIND, drawn, unseen
from vegglue.describe_transfer import told
from vegglue.posterior import IDENTIFIED_BELOW, NEAR_BOUND, Posterior

CLAIMED_FROM = 100  # effective members; below, no posterior is claimed
HEAVY_TAIL = 0.7  # of pareto_k, above which weighted means are not to be trusted
STRONG_CORRELATION = 0.7


def describe(posterior: Posterior, others: Mapping[str, object] | None = None) -> list[str]:
    """Sentences on the ensemble and its worth, each parameter, their correlation, the fit, whether experiments agree,
    the canopy correction. others: reference values of the case.
    """
    return [
        *(_ensemble(posterior) if posterior.refinement is None else drawn(posterior, posterior.refinement)),
        *_worth(posterior),
        *(sentence for name in posterior.parameters for sentence in _parameter(posterior, name)),
        *_correlations(posterior),
        *_misfit(posterior),
        *(unseen(posterior, posterior.refinement) if posterior.refinement else ()),
        *(told(posterior, posterior.transfer, others or {}) if posterior.transfer else ()),
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
