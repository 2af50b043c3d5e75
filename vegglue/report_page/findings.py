"""What a run found, in plain words with numbers: sentences (HTML) generated from the posterior, worst news first."""

import html
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vegglue.case.schema import Case
from vegglue.figures.typography import NARROW, count, fixed, interval, percent, plus_minus, short, unit_html
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.measurements.kinds import kind_of
from vegglue.measurements.observations import Observations
from vegglue.measurements.plant_survey import RigidCylinder
from vegglue.report_page.homogeneity_words import homogeneity_in_words, rejected
from vegglue.report_page.key_numbers import (
    as_power,
    estimate,
    largest_mass_error,
    measurement_error,
    plant_parameter,
    pressed_side,
    symbol,
    unexplained_error,
    with_unit,
)
from vegglue.report_page.posterior_words import UNBELIEVED, drawn_in_words, tied, unseen_in_words
from vegglue.report_page.run import Run, patches_drawn
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import CLAIMED_FROM, Posterior
from vegglue.solver.status import STATUS_WORDS, members_with

MASS_LIMIT = 1e-4  # of |Q/Q_in - 1|: what a stored member is held to


@dataclass(frozen=True)
class Finding:
    """One sentence or two (HTML), about one subject; `doubt` marks what limits the use of the result."""

    subject: str
    text: str
    doubt: bool = False


def findings(run: Run) -> list[Finding]:
    """All sentences, those that limit the use of the result first."""
    case, observations, posterior = run.case, run.observations, run.posterior
    said = [
        *(_parameter(case, posterior, name) for name in posterior.parameters),
        *_correlations(case, posterior),
        *_plants(case, posterior, run.cylinder),
        *_canopy(run),
        *(_residual(posterior, kind) for kind in posterior.fit.sigma),
        *_coverage(posterior),
        *_refined(posterior),
        *_transfer(case, posterior),
        *_flagged(observations),
        *_discharge(case, observations),
        _weights(posterior),
        _members(run.ensemble),
        _mass(run.ensemble),
    ]
    return sorted(said, key=lambda finding: not finding.doubt)


def _parameter(case: Case, posterior: Posterior, name: str) -> Finding:
    marginals = posterior.marginals
    low, high = marginals.quantiles[name][0], marginals.quantiles[name][-1]
    unit = f"{NARROW}{unit_html(posterior.sample.unit[name])}".rstrip()
    span = interval(low, high) if not as_power(posterior, name) else f"{short(low, 2)} to {short(high, 2)}"
    text = f"{symbol(case, name)} = {estimate(posterior, name)} (95{NARROW}% range {span}{unit})"
    share = percent(marginals.width_ratio[name])
    side = pressed_side(posterior, name)
    if side:
        mass = marginals.bound_mass[name][("lower", "upper").index(side)]
        tells = "below" if side == "upper" else "above"
        text += (
            f". It presses against the {side} bound of its prior ({percent(mass)} of the weight is near it): "
            f"the data bound it from {tells} only, and the bound, not the data, ends the range"
        )
    if not marginals.identified[name]:
        text += f". It is not identified: the 95{NARROW}% range is still {share} as wide as before the measurements"
    elif not side:
        text += f", {share} of the width it had before the measurements"
    return Finding("parameter", text + ".", doubt=bool(side) or not marginals.identified[name])


def _correlations(case: Case, posterior: Posterior) -> Iterator[Finding]:
    symbols, matrix = [symbol(case, name) for name in posterior.parameters], posterior.marginals.correlation
    pairs = [f"{symbols[i]} and {symbols[j]} ({fixed(matrix[i, j], 2)})" for i, j in tied(posterior)]
    if pairs:
        said = "The stations know combinations of parameters better than each alone. Correlated in the posterior are"
        yield Finding("trade-off", f"{said} {', '.join(pairs)}.")


def _plants(case: Case, posterior: Posterior, cylinder: RigidCylinder | None) -> Iterator[Finding]:
    name = plant_parameter(case)
    if posterior.canopy is not None:
        canopy = posterior.canopy
        corrected = plus_minus(canopy.log10_median, canopy.log10_sd)
        yield Finding(
            "canopy",
            f"Corrected from a canopy of {canopy.from_height:g} m to one of {canopy.to_height:g} m at a depth of "
            f"{canopy.depth:g} m (equal Chézy coefficient), {symbol(case, canopy.parameter)} becomes "
            f"10<sup>{corrected}</sup>; uncorrected it is {estimate(posterior, canopy.parameter)}.",
        )
    if name is None or cylinder is None:
        return
    inferred = posterior.marginals.median[name] if posterior.canopy is None else posterior.canopy.median
    median = cylinder.quantile(0.5)
    if not posterior.marginals.identified[name]:
        said = "the flow at these stations cannot tell whether that is so"
    else:
        said = f"the flow asks for {short(inferred / median, 2)} times as much"
    yield Finding(
        "plants",
        f"Rigid cylinders of the surveyed size would have {symbol(case, name)} = "
        f"{plus_minus(cylinder.mean, cylinder.standard_deviation)} (median {short(median, 2)}); {said}. "
        f"{html.escape(cylinder.assumption)}",
    )


def _canopy(run: Run) -> Iterator[Finding]:
    for (experiment, section), canopy in run.observations.canopy_height.items():
        where = f"the verticals inside the plants at {html.escape(section)} ({html.escape(experiment)})"
        if not np.isfinite(canopy.value):
            yield Finding("canopy", f"No canopy height could be read off {where}: {html.escape(canopy.reason)}.")
            continue
        used = ", ".join(
            f"{height:g}{NARROW}m" for height in np.unique(patches_drawn(run, experiment).canopy_height.round(3))
        )
        height = plus_minus(canopy.value, canopy.standard_error)
        yield Finding("canopy", f"Read off {where}, the canopy is {height}{NARROW}m high; the model was given {used}.")


def _residual(posterior: Posterior, kind: str) -> Finding:
    error, miss = measurement_error(posterior, kind), posterior.fit.best_rmse[kind]
    text = f"The best member misses the {kind_of(kind).words} measurements by {with_unit(miss, kind)}, the median "
    text += f"prediction by {with_unit(posterior.fit.rmse[kind], kind)}"
    if not np.isfinite(error):
        return Finding("residual", f"{text}; without standard errors nothing can be said of what they ought to be.")
    if not unexplained_error(posterior, kind, miss):
        return Finding("residual", f"{text}, no more than the measurement error of {with_unit(error, kind)} explains.")
    return Finding(
        "residual",
        f"{text}. That is {short(miss / error, 2)} times the measurement error of {with_unit(error, kind)}: "
        "something the model does not have hides in the residual.",
        doubt=True,
    )


def _coverage(posterior: Posterior) -> Iterator[Finding]:
    used = posterior.station["used"].to_numpy(bool)
    value = posterior.station["value"].to_numpy(float)[used]
    inside = [
        int(np.sum((value >= band[0][used]) & (value <= band[-1][used])))
        for band in (posterior.predicted.model_band, posterior.predicted.total_band)
    ]
    yield Finding(
        "bands",
        f"Of {count(len(value), 'used station')}, {inside[0]} lie within the 95{NARROW}% range of the model alone and "
        f"{inside[1]} within that of model and residual error together.",
    )


def _refined(posterior: Posterior) -> Iterator[Finding]:
    refined = posterior.refinement
    if refined is None:
        return
    errors = refined.error_model.errors
    missing = errors == "stated" and refined.misfit.p_misfit < UNBELIEVED
    yield Finding("errors", html.escape(" ".join(drawn_in_words(posterior, refined)[1:])), doubt=errors == "estimated")
    yield Finding("draws", html.escape(drawn_in_words(posterior, refined)[0]))
    told = html.escape(" ".join(unseen_in_words(posterior, refined)))
    yield Finding("unseen", told, doubt=missing or bool(refined.misfit.outlier.any()))


def _transfer(case: Case, posterior: Posterior) -> Iterator[Finding]:
    if posterior.transfer is not None:
        sentences = homogeneity_in_words(posterior, posterior.transfer, case.reference.table if case.reference else {})
        yield Finding("transfer", html.escape(" ".join(sentences)), doubt=rejected(posterior.transfer))


def _flagged(observations: Observations) -> Iterator[Finding]:
    for _, row in observations.table[~observations.table["used"].astype(bool)].iterrows():
        yield Finding(
            "flagged",
            f"Not used: {html.escape(str(row['experiment']))} at x = {row['x']:g} m, y = {row['y']:g} m, "
            f"{html.escape(row['reason'])}.",
        )


def _discharge(case: Case, observations: Observations) -> Iterator[Finding]:
    for (experiment, section), rules in observations.discharge.items():
        given = list(case.experiments[experiment].discharge.values())
        prescribed = "" if any(isinstance(value, str) for value in given) else f"{sum(map(float, given)):.2f}"
        measured = rules["profile"]
        text = (
            f"The verticals at {html.escape(section)} ({html.escape(experiment)}) add up to "
            f"{plus_minus(measured.value, measured.standard_error)}{NARROW}m³/s"
        )
        if not prescribed:
            yield Finding("discharge", f"{text}; the discharge is itself a parameter.")
            continue
        off = (measured.value - float(prescribed)) / measured.standard_error
        yield Finding(
            "discharge",
            f"{text}; the model was given {prescribed}{NARROW}m³/s, {fixed(abs(off), 1)} standard errors "
            f"{'less' if off > 0 else 'more'}.",
            doubt=abs(off) > 2,
        )


def _weights(posterior: Posterior) -> Finding:
    weighting = posterior.weighting
    size = f"{max(weighting.effective_size, 1.0):,.0f}"
    text = (
        f"The weights are worth {size} of {posterior.sample.members:,} equal members; the heaviest carries "
        f"{percent(weighting.largest_weight)}"
    )
    few, long = not posterior.claimed, weighting.pareto_k > TRUSTED_K_HAT
    if few:
        text += f". Fewer than {CLAIMED_FROM} make the 95{NARROW}% ranges themselves uncertain: "
        text += "refine or simulate more members" if posterior.refinement is None else "narrow the priors"
    if long:
        text += f". The tail of the weights is long (k̂ = {fixed(weighting.pareto_k, 2)}, above {TRUSTED_K_HAT})"
    return Finding("weights", text + ".", doubt=few or long)


def _members(ensemble: Ensemble) -> Finding:
    newton, marched, failed = (members_with(ensemble.status, number) for number in STATUS_WORDS)
    text = f"{count(newton, 'member')} solved by Newton's method, {marched:,} by marching in time, {failed:,} failed"
    return Finding(
        "members", text + ("; they have no weight." if failed else "."), doubt=failed > 0.01 * len(ensemble.status)
    )


def _mass(ensemble: Ensemble) -> Finding:
    worst = largest_mass_error(ensemble)
    inside = worst < MASS_LIMIT
    return Finding(
        "mass",
        f"No member loses or gains more than {short(worst, 2)} of its discharge at any section, "
        f"{'below' if inside else 'above'} the limit of {short(MASS_LIMIT, 1)}.",
        doubt=not inside,
    )
