"""What an inference found, in sentences: one function for each fact, for the terminal and for the page."""

import math
from collections.abc import Mapping
from itertools import combinations

import numpy as np

from vegglue.inference.glue import sizes_as_stated
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT, root_mean_square
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import SET_ASIDE
from vegglue.pages.homogeneity_words import homogeneity_in_words
from vegglue.pages.prior_words import against_prior_in_words
from vegglue.pages.typography import PLAIN_TEXT, Notation
from vegglue.pages.validation_words import validation_in_words
from vegglue.results.posterior import CLAIMED_FROM, IDENTIFIED_BELOW, ErrorModel, Posterior, PosteriorModes, Refinement
from vegglue.results.verdict import MisfitTooSmall, is_too_small
from vegglue.wording.numbers import in_digits, so_many, telling_digits
from vegglue.wording.sentences import sentence

# |r| [-] above which a pair is told of: the other parameter then explains half the variance of each (r² = 0.49).
STRONG_CORRELATION = 0.7


def posterior_in_words(posterior: Posterior, others: Mapping[str, object] | None = None) -> list[str]:
    """All that is said of a posterior, as `vegglue infer --json` prints it, one sentence or two in each entry.

    In this order: the ensemble, its weights, each parameter, correlations, the fit, stations left out, whether the
    experiments agree, the corrected canopy. others: the reference table of the case, by key.
    """
    return [
        *(_ensemble(posterior) if posterior.refinement is None else search_in_words(posterior, posterior.refinement)),
        *weights_in_words(posterior),
        *(sentence for name in posterior.parameters for sentence in parameter_in_words(posterior, name)),
        *correlations_in_words(posterior),
        *fit_in_words(posterior),
        *(validation_in_words(posterior, posterior.refinement) if posterior.refinement else ()),
        *(homogeneity_in_words(posterior, posterior.transfer, others or {}) if posterior.transfer else ()),
        *canopy_in_words(posterior),
    ]


def _ensemble(posterior: Posterior) -> list[str]:
    settings, sample = posterior.settings, posterior.sample
    rule = "the root mean square residual of the best member" if settings.sigma_rule == "best-member" else "known"
    threshold = ""
    if math.isfinite(settings.threshold):
        threshold = f", {posterior.weighting.weighed} of them with weight (efficiency at least {settings.threshold:g})"
    return [
        f"{sample.members} members, {sample.failed or 'none'} of them failed (no weight).",
        f"Weighed by the {settings.likelihood} likelihood over {posterior.fit.used} of {len(posterior.station)} "
        f"stations{threshold}; sigma is {errors_by_kind(posterior.fit.sigma, 'for')} ({rule}).",
    ]


def errors_by_kind(errors: Mapping[str, float], preposition: str, notation: Notation = PLAIN_TEXT) -> str:
    """'0.012 m/s for velocity and 0.003 m for level'; errors: one for each kind of measurement [unit of the kind]."""
    known = ((kind_of(name), value) for name, value in errors.items())
    return " and ".join(
        f"{notation.number(value, 3)}{notation.unit(kind.unit)} {preposition} {kind.words}" for kind, value in known
    )


def measurement_error(posterior: Posterior, kind: str) -> float:
    """Root mean square standard error of the used stations of a kind [SI]; NaN when one is unknown."""
    station = posterior.station
    error = station.loc[station["used"] & (station["kind"] == kind), "standard_error"].to_numpy(float)
    return root_mean_square(error)


def weights_in_words(posterior: Posterior, notation: Notation = PLAIN_TEXT) -> list[str]:
    """How many equal members the weights are worth, and a warning where that is too few for a posterior."""
    weighting = posterior.weighting
    size = notation.number(weighting.effective_size, 3)
    tail = "too few stand out to tell the index k-hat of their tail"
    if math.isfinite(weighting.pareto_k):
        k_hat = notation.number(weighting.pareto_k, 2)
        tail = f"the index of their tail k-hat {k_hat} (to be trusted below {TRUSTED_K_HAT})"
    largest = notation.number(weighting.largest_weight, 2)
    sentences = [f"The weights are worth {size} equal members; the largest weight is {largest}, {tail}."]
    if not posterior.claimed:
        remedy = "refine around the best members (`infer --method refine`)"
        if posterior.refinement is not None:
            remedy = "narrow the priors or fix what the data do not tell"
        sentences.append(
            f"With {size} effective members, fewer than {CLAIMED_FROM}, no posterior is claimed: take the medians and "
            f"widths below as a first look, and {remedy} before resting anything on them."
        )
    return sentences


def identification(posterior: Posterior, name: str) -> str:
    """'identified', 'not identified', or that the members with weight are too few to say."""
    if not posterior.claimed:
        return "too few members to tell"
    return "identified" if posterior.marginals.identified[name] else "not identified"


def parameter_in_words(posterior: Posterior, name: str, notation: Notation = PLAIN_TEXT) -> list[str]:
    """Median, standard deviation and 95 % range of a parameter against its prior, and the bounds it presses against."""
    marginals, symbol = posterior.marginals, notation.parameter(name)
    unit, number = notation.unit(posterior.sample.unit[name]), notation.number
    ends = [float(value) for value in marginals.quantiles[name][[0, -1]]]
    digits = telling_digits(*ends)
    low, high = (number(value, digits) for value in ends)
    ratio = f"{notation.share(marginals.width_ratio[name])} of the prior's"
    if not marginals.identified[name]:
        return [
            f"{symbol} is not identified: its 95 % range, {low} to {high}{unit}, is still {ratio} (identified means "
            f"below {100 * IDENTIFIED_BELOW:g} %).",
            *against_prior_in_words(posterior, name, notation),
        ]
    power = ""
    if name in marginals.log10_median:
        power = f" = {notation.power_of_ten(marginals.log10_median[name], marginals.log10_sd[name])}"
    return [
        f"{symbol}: median {number(marginals.median[name], digits)}{unit}{power}, standard deviation "
        f"{number(marginals.sd[name], 2)}, 95 % range {low} to {high}, {ratio}.",
        *against_prior_in_words(posterior, name, notation),
    ]


def correlated_pairs(posterior: Posterior) -> list[tuple[int, int]]:
    """Pairs of parameters, by number, correlated more strongly than STRONG_CORRELATION.

    None among few members: any two of them are correlated perfectly.
    """
    if not posterior.claimed:
        return []
    strong = np.abs(np.nan_to_num(posterior.marginals.correlation)) > STRONG_CORRELATION
    return [(i, j) for i, j in combinations(range(len(posterior.parameters)), 2) if strong[i, j]]


def correlations_in_words(posterior: Posterior, notation: Notation = PLAIN_TEXT) -> list[str]:
    """One sentence for each strongly correlated pair of parameters."""
    names, matrix = [notation.parameter(name) for name in posterior.parameters], posterior.marginals.correlation
    return [
        f"{names[i]} and {names[j]} are correlated ({matrix[i, j]:+.2f}): the data tell their combination better than "
        "either of them."
        for i, j in correlated_pairs(posterior)
    ]


def fit_in_words(posterior: Posterior, notation: Notation = PLAIN_TEXT) -> list[str]:
    """Misfit of the median prediction and stations outside the total band; chi2 where the errors are known."""
    fit = posterior.fit
    used = posterior.station["used"].to_numpy()
    value = posterior.station["value"].to_numpy(float)
    outside = (value < posterior.predicted.total_band[0]) | (value > posterior.predicted.total_band[-1])
    sentences = [
        f"The median prediction misses by {errors_by_kind(fit.rmse, 'in', notation)} (root mean square); "
        f"{int(np.sum(outside & used))} of {fit.used} measurements lie outside the total 95 % band, "
        f"{0.05 * fit.used:.1f} are expected to."
    ]
    if aside := int((posterior.station["reason"] == SET_ASIDE).sum()):
        sentences.append(
            f"{so_many(aside, 'measurement')} of {len(posterior.station)} "
            f"{'is' if aside == 1 else 'are'} left out, as the diagnosis set {'it' if aside == 1 else 'them'} aside."
        )
    if math.isfinite(fit.chi2) and posterior.refinement is None:
        sentences.append(
            "Against the standard errors of the data, the best member has chi2 = "
            f"{notation.number(fit.chi2, 3)} over {fit.used} stations."
        )
        freedom = fit.used - len(posterior.parameters)
        if is_too_small(fit.chi2, freedom):
            small = sentence(MisfitTooSmall(fit.chi2, freedom))
            sentences.append(f"{small[:1].upper()}{small[1:]}")
    return sentences


def canopy_in_words(posterior: Posterior, notation: Notation = PLAIN_TEXT) -> list[str]:
    """The median of plant drag before and after it is corrected to another canopy height; [] without a correction."""
    canopy = posterior.canopy
    if canopy is None:
        return []
    return [
        f"For a canopy of {canopy.to_height:g} m instead of {canopy.from_height:g} m (equal C at a depth of "
        f"{canopy.depth:g} m), the median of {notation.parameter(canopy.parameter)} goes from "
        f"{notation.number(posterior.marginals.median[canopy.parameter], 3)} to {notation.number(canopy.median, 3)} = "
        f"{notation.power_of_ten(canopy.log10_median, canopy.log10_sd)}."
    ]


def search_in_words(posterior: Posterior, refined: Refinement) -> list[str]:
    """How a refined posterior was found: search, modes and draws first, then the errors they were weighed by."""
    modes, sample = refined.modes, posterior.sample
    one = "member" if posterior.settings.ensemble_hash else "point of the prior"
    many = one.replace("member", "members").replace("point", "points")
    starts = f"{modes.starts} of the best {many} were followed" if modes.starts > 1 else f"The best {one} was followed"
    return [
        f"{starts} downhill and ended in {_modes(posterior, modes)}; {sample.members} members were drawn around, "
        f"{sample.failed or 'none'} of them failed (no weight).",
        *_errors(posterior, refined.error_model),
    ]


def _modes(posterior: Posterior, modes: PosteriorModes) -> str:
    if modes.mode_chi2.size == 1:
        return "one mode"
    each = (
        f"{', '.join(f'{name} = {in_digits(value)}' for name, value in zip(posterior.parameters, theta, strict=True))} "
        f"with chi2 = {in_digits(misfit, 4)} and weight {in_digits(weight, 2)}"
        for theta, misfit, weight in zip(modes.mode_theta, modes.mode_chi2, modes.mode_weight, strict=True)
    )
    return f"{modes.mode_chi2.size} modes ({'; '.join(each)})"


def _errors(posterior: Posterior, model: ErrorModel) -> list[str]:
    sizes = errors_by_kind(posterior.fit.sigma, "for")
    if model.errors == "estimated":
        few = " and ".join(kind_of(name).words for name in sizes_as_stated(posterior.station))
        few = f" (that of {few} not, for want of readings)" if few else ""
        estimate = (
            f"The errors are estimated from what the best place leaves, {sizes}{few}: what the model misses counts as "
            "error, so its chi2 says nothing; give standard errors and `infer.sigma: known` to test the model."
        )
        return [estimate, *_neighbours(model)]
    grid = (
        f"with that of the grid ({in_digits(model.grid_error, 2)} on the whole) and that"
        if math.isfinite(model.grid_error)
        else "without that of the grid, whose cells cannot be doubled, with that"
    )
    stated = errors_by_kind({kind: measurement_error(posterior, kind) for kind in posterior.fit.sigma}, "for")
    sentences = [
        f"The errors are those stated with the data, {stated}; {grid} of the model itself, as far as it is allowed "
        f"to err, they are {sizes}.",
        *_neighbours(model),
    ]
    if model.scale > 1.0:
        sentences.append(
            f"They had to be multiplied by {model.scale:.2f}: stations beside each other scatter more than is stated."
        )
    return sentences


def _neighbours(model: ErrorModel) -> list[str]:
    if model.correlation == 0.0:
        return []
    return [f"Errors of neighbours along a section are correlated by {model.correlation:.2f} (estimated)."]
