"""The figures of one run: which there are, and those of parameters and run health; captions state the finding."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from textwrap import shorten

import numpy as np

from vegglue.case.schema import Reference
from vegglue.figures.posterior import (
    ReferenceValue,
    Unknown,
    draw_cylinder,
    draw_joint,
    draw_marginal,
    draw_mass_error,
    draw_weights,
)
from vegglue.figures.style import Picture
from vegglue.figures.typography import fixed, percent, plus_minus, short
from vegglue.inference.weighted_statistics import weighted_quantile
from vegglue.report_page.findings import MASS_LIMIT
from vegglue.report_page.flow_pictures import plans
from vegglue.report_page.key_numbers import as_power, estimate, largest_mass_error, plant_parameter, symbol
from vegglue.report_page.measured_pictures import discharges, residuals, sections, verticals
from vegglue.report_page.posterior_words import how_known
from vegglue.report_page.run import Run, picture

MOST_PAIRS = 6  # of parameters drawn together
LONGEST_LABEL = 24  # letters beside a mark, with which the axes of a marginal keep nine tenths of their width


def pictures(run: Run) -> dict[str, list[Picture]]:
    """All figures, written to run.folder/figures, by the part of the report they stand in."""
    return {
        "marginals": [*(_marginal(run, name) for name in run.posterior.parameters), *_corrected(run)],
        "joints": list(_joints(run)),
        "plants": list(_plants(run)),
        "sections": list(sections(run)),
        "residuals": list(residuals(run)),
        "verticals": list(verticals(run)),
        "discharge": list(discharges(run)),
        "flow": [drawn for experiment in run.flow for drawn in plans(run, experiment)],
        "health": [_weights(run), _mass_error(run)],
    }


def _unknown(run: Run, name: str) -> Unknown:
    (low, high), logarithmic = run.posterior.marginals.bounds[name], as_power(run.posterior, name)
    values = run.posterior.sample.theta[name]
    return Unknown(
        values,
        run.ensemble.parameters[name],
        float(low) if np.isfinite(low) and (low > 0 or not logarithmic) else float(values.min()),
        float(high) if np.isfinite(high) else float(values.max()),
        logarithmic,
        run.case.parameters[name].symbol or name,
        run.posterior.sample.unit[name],
    )


def _references(run: Run, name: str) -> list[ReferenceValue]:
    reference = run.case.reference
    if reference is None:
        return []
    found = []
    stated = reference.table.get(name, reference.table.get(f"log10_{name}"))
    if stated is not None:
        value, sd = stated if isinstance(stated, tuple) else (stated, np.nan)
        found.append(ReferenceValue(_source(reference), value if name in reference.table else 10**value, sd, "D"))
    if name in reference.made_with:
        found.append(ReferenceValue("made with", reference.made_with[name], np.nan, "X"))
    return found


def _source(reference: Reference) -> str:
    """Whose values they are: the first words of the source, as many as fit beside a mark."""
    return shorten(reference.source, LONGEST_LABEL, placeholder="").rstrip(" ,;:") or "reference"


def _marginal(run: Run, name: str) -> Picture:
    canopy = run.posterior.canopy
    references = [] if canopy is not None and canopy.parameter == name else _references(run, name)
    figure = draw_marginal(_unknown(run, name), run.posterior.sample.weights, references)
    width = percent(run.posterior.marginals.width_ratio[name])
    known = how_known(run.posterior, name)
    caption = f"{symbol(run.case, name)} = {estimate(run.posterior, name)}: {known}, {width} of the prior width."
    alt = (
        f"Prior and posterior density of {name}; {known}; marked: {', '.join(r.name for r in references) or 'nothing'}."
    )
    return picture(run, figure, f"posterior-{name}", caption, alt)


def _corrected(run: Run) -> Iterator[Picture]:
    """phi corrected to another canopy height, which is what values of others compare with."""
    canopy = run.posterior.canopy
    if canopy is None:
        return
    uncorrected = _unknown(run, canopy.parameter)
    kept = (canopy.phi > 0) & np.isfinite(canopy.phi)
    phi, weights = canopy.phi[kept], run.posterior.sample.weights[kept]
    references = _references(run, canopy.parameter)
    marked = [reference.value for reference in references]
    low, high = min([*marked, weighted_quantile(phi, weights, [0.001])[0]]), max([*marked, phi.max()])
    before = phi if np.array_equal(run.posterior.sample.theta[canopy.parameter], uncorrected.before) else np.zeros(0)
    unknown = replace(uncorrected, values=phi, before=before, low=low / 1.5, high=1.5 * high)
    caption = (
        f"{symbol(run.case, canopy.parameter)} corrected to a canopy of {canopy.to_height:g} m: "
        f"10<sup>{plus_minus(canopy.log10_median, canopy.log10_sd)}</sup>."
    )
    figure = draw_marginal(unknown, weights, references)
    yield picture(
        run, figure, f"posterior-{canopy.parameter}-corrected", caption, "Density of the corrected plant drag."
    )


def _joints(run: Run) -> Iterator[Picture]:
    names = run.posterior.parameters
    pairs = list(combinations(range(len(names)), 2))
    pairs.sort(key=lambda pair: -abs(np.nan_to_num(run.posterior.marginals.correlation[pair])))
    for i, j in pairs[:MOST_PAIRS]:
        r = run.posterior.marginals.correlation[i, j]
        marks = [
            (across.name, across.value, upward.value, across.marker.lower())
            for across in _references(run, names[i])
            for upward in _references(run, names[j])
            if across.name == upward.name
        ]
        tied = "rise together" if r > 0 else "trade off: one rises as the other falls"
        told = f" {tied if abs(r) >= 0.3 else 'hardly constrain each other'} (correlation {fixed(r, 2)})"
        if not run.posterior.claimed:
            told = ": too few members to tell how they constrain each other"
        figure = draw_joint(_unknown(run, names[i]), _unknown(run, names[j]), run.posterior.sample.weights, marks)
        both = f"{symbol(run.case, names[i])} and {symbol(run.case, names[j])}"
        caption = f"{both}{told}. Area of a disc: weight of a member; grey: prior."
        alt = f"Members in the plane of {names[i]} and {names[j]}, weighted by likelihood."
        yield picture(run, figure, f"joint-{names[i]}-{names[j]}", caption, alt)


def _plants(run: Run) -> Iterator[Picture]:
    name = plant_parameter(run.case)
    if name is None or run.cylinder is None:
        return
    unknown, posterior = _unknown(run, name), run.posterior
    corrected = posterior.canopy is not None and posterior.canopy.parameter == name
    inferred = posterior.canopy.phi if corrected and posterior.canopy else unknown.values
    kept = (inferred > 0) & np.isfinite(inferred)
    inferred, weights = inferred[kept], posterior.sample.weights[kept]
    spread = np.concatenate(
        [weighted_quantile(inferred, weights, [0.005, 0.995]), np.quantile(run.cylinder.draws, [0.005, 0.995])]
    )
    low, high = min(unknown.low, spread.min()), max(unknown.high, spread.max())
    figure = draw_cylinder(inferred, weights, run.cylinder.draws, low, high, unknown.symbol)
    ratio = float(weighted_quantile(inferred, weights, [0.5])[0]) / run.cylinder.quantile(0.5)
    how = f"{short(ratio, 2)} times" if posterior.marginals.identified[name] else "not told apart from"
    caption = (
        f"Inferred plant drag{', corrected for canopy height,' if corrected else ''} is {how} that of rigid cylinders "
        f"of the surveyed size, {plus_minus(run.cylinder.mean, run.cylinder.standard_deviation)} (medians compared)."
    )
    yield picture(run, figure, "plant-drag", caption, "Density of inferred plant drag beside that of rigid cylinders.")


def _weights(run: Run) -> Picture:
    sample, weighting = run.posterior.sample, run.posterior.weighting
    caption = (
        f"The posterior rests on {weighting.effective_size:,.0f} effective members of {sample.members:,}; the heaviest "
        f"carries {percent(weighting.largest_weight)}."
    )
    return picture(run, draw_weights(sample.weights), "weights", caption, "Cumulated weight of the members.")


def _mass_error(run: Run) -> Picture:
    worst = short(largest_mass_error(run.ensemble), 2)
    caption = f"The largest mass error of any member is {worst}; members are held to {short(MASS_LIMIT, 1)}."
    return picture(
        run, draw_mass_error(run.ensemble.mass_error, MASS_LIMIT), "mass-error", caption, "Histogram of mass errors."
    )
