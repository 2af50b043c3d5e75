"""The pictures of a page: which there are, and those of parameters and run health; captions state the finding."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from textwrap import shorten

import numpy as np

from vegglue.case.schema import Reference
from vegglue.inference.weighted_statistics import weighted_quantile
from vegglue.report.flow_pictures import plans
from vegglue.report.key_numbers import (
    as_power,
    estimate,
    identified_width,
    plant_parameter,
    study_value,
    symbol,
)
from vegglue.report.measured_pictures import canopy_profiles, discharges, residuals, verticals
from vegglue.report.posterior import (
    DrawnParameter,
    ReferenceValue,
    draw_cylinder,
    draw_joint,
    draw_marginal,
    draw_weights,
)
from vegglue.report.posterior_words import weights_in_words
from vegglue.report.run import Run, published_picture
from vegglue.report.style import Picture
from vegglue.report.typography import fixed, html_notation, plus_minus, short

# Pairs of parameters drawn together, the most correlated first: one row; strong correlations are told in words.
PAIRS_DRAWN = 3
# |r| [-] below which two parameters are said hardly to constrain each other: they share less than a tenth of variance.
HARDLY_CORRELATED = 0.3
# Letters beside a mark, with which the axes of a marginal keep nine tenths of their width.
LONGEST_LABEL = 24
# Share of their range within which values come near a bound: a figure ends there.
DRAWN_TO_BOUND = 0.1


def pictures(run: Run) -> dict[str, list[Picture]]:
    """All figures, written to run.folder/figures, by their place in report.html.j2.

    A new figure of a part that exists is one more entry in its list; the template takes whatever it finds there.
    """
    return {
        "marginals": [*(_marginal(run, name) for name in run.posterior.parameters), *_canopy_corrected(run)],
        "joints": list(_joint_posteriors(run)),
        "plants": list(_plant_drag(run)),
        "residuals": list(residuals(run)),
        "verticals": list(verticals(run)),
        "canopy_and_discharge": [*canopy_profiles(run), *discharges(run)],
        "flow": [drawn for experiment in run.flow for drawn in plans(run, experiment)],
        "health": [_weights(run)],
    }


def _drawn_parameter(run: Run, name: str) -> DrawnParameter:
    (low, high), logarithmic = run.posterior.marginals.bounds[name], as_power(run.posterior, name)
    values, prior = run.posterior.sample.theta[name], _prior_values(run, name)
    return DrawnParameter(
        values,
        prior,
        *range_of_figure(np.concatenate([values, prior]), (float(low), float(high)), logarithmic),
        logarithmic,
        run.case.parameters[name].symbol or name,
        run.posterior.sample.unit[name],
        (float(low), float(high)),
    )


def range_of_figure(values: np.ndarray, bounds: tuple[float, float], logarithmic: bool) -> tuple[float, float]:
    """From where to where values of a parameter (n,) and its prior are drawn: to the bounds that they come near, else
    as far as they go. A prior may have bounds that it never comes near.
    """
    ends = np.array([values.min(), values.max()])
    with np.errstate(divide="ignore", invalid="ignore"):  # a lower bound may be 0
        there, wanted = (np.log10(some) if logarithmic else some for some in (ends, np.array(bounds)))
    span = float(np.ptp(there))
    near = np.isfinite(wanted) & ((np.abs(wanted - there) <= DRAWN_TO_BOUND * span) | (span == 0.0))
    low, high = np.where(near, bounds, ends)
    return float(low), float(high)


def _prior_values(run: Run, name: str) -> np.ndarray:
    """Members of the prior: those of the ensemble, or those that were drawn beside the posterior."""
    if run.ensemble is not None:
        return run.ensemble.parameters[name]
    assert run.posterior.refinement is not None  # without an ensemble nothing but draws is a posterior
    return run.posterior.refinement.draws.prior_theta[name]


def references_of(run: Run, name: str) -> list[ReferenceValue]:
    """Values of others that a figure marks: those that the table tells, and what a synthetic record was made with."""
    reference = run.case.reference
    if reference is None:
        return []
    found = []
    if (stated := study_value(run.case, run.posterior, name)) is not None:
        on_axis, sd = stated
        value = 10.0**on_axis if as_power(run.posterior, name) else on_axis
        found.append(ReferenceValue(_source(reference), value, sd, "D"))
    if name in reference.made_with:
        found.append(ReferenceValue("made with", reference.made_with[name], np.nan, "X"))
    return found


def _source(reference: Reference) -> str:
    """Whose values they are: the first words of the source, as many as fit beside a mark."""
    return shorten(reference.source, LONGEST_LABEL, placeholder="").rstrip(" ,;:") or "reference"


def _marginal(run: Run, name: str) -> Picture:
    canopy = run.posterior.canopy
    references = [] if canopy is not None and canopy.parameter == name else references_of(run, name)
    figure = draw_marginal(_drawn_parameter(run, name), run.posterior.sample.weights, references)
    identified = identified_width(run.posterior, name)
    caption = f"{symbol(run.case, name)} = {estimate(run.posterior, name)}: {identified}."
    marked = ", ".join(reference.name for reference in references) or "nothing"
    alt = f"Prior and posterior density of {name}; {identified}; marked: {marked}."
    return published_picture(run, figure, f"posterior-{name}", caption, alt)


def _canopy_corrected(run: Run) -> Iterator[Picture]:
    """phi corrected to another canopy height, which is what values of others compare with."""
    canopy = run.posterior.canopy
    if canopy is None:
        return
    uncorrected = _drawn_parameter(run, canopy.parameter)
    kept = (canopy.phi > 0) & np.isfinite(canopy.phi)
    phi, weights = canopy.phi[kept], run.posterior.sample.weights[kept]
    references = references_of(run, canopy.parameter)
    marked = [reference.value for reference in references]
    low, high = min([*marked, weighted_quantile(phi, weights, [0.001])[0]]), max([*marked, phi.max()])
    prior = phi if np.array_equal(run.posterior.sample.theta[canopy.parameter], uncorrected.prior) else np.zeros(0)
    drawn = replace(uncorrected, values=phi, prior=prior, low=low / 1.5, high=1.5 * high)
    caption = (
        f"{symbol(run.case, canopy.parameter)} corrected to a canopy of {canopy.to_height:g} m: "
        f"10<sup>{plus_minus(canopy.log10_median, canopy.log10_sd)}</sup>."
    )
    figure = draw_marginal(drawn, weights, references)
    yield published_picture(
        run, figure, f"posterior-{canopy.parameter}-corrected", caption, "Density of the corrected plant drag."
    )


def _joint_posteriors(run: Run) -> Iterator[Picture]:
    names = run.posterior.parameters
    pairs = list(combinations(range(len(names)), 2))
    pairs.sort(key=lambda pair: -abs(np.nan_to_num(run.posterior.marginals.correlation[pair])))
    for i, j in pairs[:PAIRS_DRAWN]:
        r = run.posterior.marginals.correlation[i, j]
        marks = [
            (first.name, first.value, second.value, first.marker.lower())
            for first in references_of(run, names[i])
            for second in references_of(run, names[j])
            if first.name == second.name
        ]
        dependence = "rise together" if r > 0 else "trade off: one rises as the other falls"
        if abs(r) < HARDLY_CORRELATED:
            dependence = "hardly constrain each other"
        finding = f" {dependence} (correlation {fixed(r, 2)})"
        if not run.posterior.claimed:
            finding = ": too few members to tell how they constrain each other"
        figure = draw_joint(
            _drawn_parameter(run, names[i]), _drawn_parameter(run, names[j]), run.posterior.sample.weights, marks
        )
        both = f"{symbol(run.case, names[i])} and {symbol(run.case, names[j])}"
        caption = f"{both}{finding}. Area of a disc: weight of a member; grey: prior."
        alt = f"Members in the plane of {names[i]} and {names[j]}, weighted by likelihood."
        yield published_picture(run, figure, f"joint-{names[i]}-{names[j]}", caption, alt)


def _plant_drag(run: Run) -> Iterator[Picture]:
    name = plant_parameter(run.case)
    if name is None or run.cylinder is None:
        return
    drawn, posterior = _drawn_parameter(run, name), run.posterior
    corrected = posterior.canopy is not None and posterior.canopy.parameter == name
    inferred = posterior.canopy.phi if corrected and posterior.canopy else drawn.values
    kept = (inferred > 0) & np.isfinite(inferred)
    inferred, weights = inferred[kept], posterior.sample.weights[kept]
    spread = np.concatenate(
        [weighted_quantile(inferred, weights, [0.005, 0.995]), np.quantile(run.cylinder.draws, [0.005, 0.995])]
    )
    low, high = min(drawn.low, spread.min()), max(drawn.high, spread.max())
    figure = draw_cylinder(inferred, weights, run.cylinder.draws, low, high, drawn.symbol)
    ratio = float(weighted_quantile(inferred, weights, [0.5])[0]) / run.cylinder.quantile(0.5)
    how = f"{short(ratio, 2)} times" if posterior.marginals.identified[name] else "not told apart from"
    caption = (
        f"Inferred plant drag{', corrected for canopy height,' if corrected else ''} is {how} that of rigid cylinders "
        f"of the surveyed size, {plus_minus(run.cylinder.mean, run.cylinder.standard_deviation)} (medians compared)."
    )
    yield published_picture(
        run, figure, "plant-drag", caption, "Density of inferred plant drag beside that of rigid cylinders."
    )


def _weights(run: Run) -> Picture:
    caption = weights_in_words(run.posterior, html_notation({}))[0]
    figure = draw_weights(run.posterior.sample.weights)
    return published_picture(run, figure, "weights", caption, "Cumulated weight of the members.")
