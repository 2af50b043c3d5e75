"""Figures of parameters: marginal and joint posteriors, plant drag beside rigid cylinders, weights."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from textwrap import shorten
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.schema import Reference
from vegglue.inference.weighted_statistics import effective_size, weighted_quantile
from vegglue.pages.flow_maps import plans
from vegglue.pages.key_numbers import (
    as_power,
    estimate,
    identified_width,
    plant_parameter,
    study_value,
    symbol,
)
from vegglue.pages.measured_figures import canopy_profiles, discharges, residuals, verticals
from vegglue.pages.posterior_words import weights_in_words
from vegglue.pages.run import Run, published_picture
from vegglue.pages.style import COLOUR, HEIGHT, WIDTH, Picture, canvas, formula_labels, label, styled
from vegglue.pages.svg import FEWEST_TICKS, round_ticks
from vegglue.pages.typography import fixed, html_notation, no_formula, plus_minus, short, symbol_math, unit_math

# Points of a drawn density: its curve looks smooth at the width of a column.
DENSITY_POINTS = 240
# Width of the kernel of a density over the range drawn, at least [-]: a quarter of a pixel.
NARROWEST = 1e-3
# Members drawn for the prior, at most: the start of a Sobol' sequence is as even as the whole.
PRIOR_MEMBERS = 1024
# Members drawn for the posterior, at most: more discs cover each other, and the page grows.
POSTERIOR_MEMBERS = 400
# Letters of a name along an axis in one line: with its unit more of them run off the picture.
LONGEST_LINE = 26
# Three to a row of the page [inch].
NARROW_WIDTH = 3.4


@dataclass(frozen=True)
class DrawnParameter:
    """One parameter as it is drawn: its values (member,) and from where to where, on a logarithmic axis where
    `logarithmic`.

    prior: values drawn from the prior alone (n,), empty where the prior is not to be drawn; bounds: its ends, infinite
    where it has none.
    """

    values: Array
    prior: Array
    low: float
    high: float
    logarithmic: bool
    symbol: str
    unit: str
    bounds: tuple[float, float]

    @property
    def title(self) -> str:
        written = symbol_math(self.symbol)
        if len(self.symbol) > LONGEST_LINE and written == no_formula(self.symbol):
            lines = textwrap.wrap(written.replace("_", "_ "), LONGEST_LINE)
            written = "\n".join(line.replace("_ ", "_") for line in lines)
        return f"{written} [{unit_math(self.unit)}]"

    def coordinate(self, value: Array | float) -> Array:
        """Where a value is drawn: itself, or its common logarithm."""
        with np.errstate(divide="ignore"):  # a lower bound may be 0
            return np.log10(value) if self.logarithmic else np.asarray(value, float)


@dataclass(frozen=True)
class ReferenceValue:
    """A value of others to mark: its name in the figure, itself, and its sd on the drawn axis (or NaN)."""

    name: str
    value: float
    sd: float
    marker: str


def density(values: Array, weights: Array, low: float, high: float, bounds: tuple[float, float]) -> tuple[Array, Array]:
    """p(x) = sum_k w_k [N(x; x_k, b) + sum_c N(x; 2 c - x_k, b)] from low to high, b = 0.9 s n^(-1/5) (Silverman).

    Mirrored at the finite ones of the bounds c, so that no mass leaks out; n is the effective number of members, s the
    lesser of standard deviation and quartile distance / 1.34. Returns grid and density (2 DENSITY_POINTS,), half of its
    points where the values are: even ones alone draw a narrow density as wide as they stand apart.
    """
    share = weights / weights.sum()
    quartile = weighted_quantile(values, weights, [0.25, 0.75])
    sd = np.sqrt(share @ (values - share @ values) ** 2)
    spread = min(sd, float(np.ptp(quartile)) / 1.34) or sd
    width = max(0.9 * spread * effective_size(weights) ** -0.2, NARROWEST * (high - low))
    near = weighted_quantile(values, weights, [0.005, 0.995]) + 4.0 * width * np.array([-1.0, 1.0])
    start, end = np.clip(near, low, high)
    fine = np.linspace(start, end, DENSITY_POINTS)
    grid = np.sort(np.concatenate([np.linspace(low, high, DENSITY_POINTS), fine]))
    kept = share > 1e-8
    total = np.zeros(grid.size)
    for mirrored in (values[kept], *(2 * bound - values[kept] for bound in bounds if np.isfinite(bound))):
        total += np.exp(-0.5 * ((grid[:, None] - mirrored) / width) ** 2) @ share[kept]
    return grid, total / (width * np.sqrt(2 * np.pi))


@styled
def draw_marginal(parameter: DrawnParameter, weights: Array, references: Sequence[ReferenceValue]) -> Figure:
    """Prior (grey) and posterior (blue) density of one parameter, 50 and 95 % shaded, values of others marked."""
    figure, axes = canvas(NARROW_WIDTH, 2.7)
    values, prior_values = parameter.coordinate(parameter.values), parameter.coordinate(parameter.prior)
    low, high = (float(parameter.coordinate(bound)) for bound in (parameter.low, parameter.high))
    bounds = float(parameter.coordinate(parameter.bounds[0])), float(parameter.coordinate(parameter.bounds[1]))
    grid, posterior = density(values, weights, low, high, bounds)
    quantiles = weighted_quantile(values, weights, [0.025, 0.25, 0.5, 0.75, 0.975])
    prior = np.zeros(grid.size)
    if prior_values.size:
        prior = np.interp(grid, *density(prior_values, np.ones(len(prior_values)), low, high, bounds))
    axes.fill_between(grid, prior, color=COLOUR["prior"], linewidth=0)
    for (left, right), colour in ((quantiles[[0, 4]], "wide"), (quantiles[[1, 3]], "narrow")):
        inside = np.linspace(left, right, DENSITY_POINTS)
        axes.fill_between(inside, np.interp(inside, grid, posterior), color=COLOUR[colour], linewidth=0)
    axes.plot(grid, posterior, color=COLOUR["model"], linewidth=1.4)
    peak = float(posterior.max())
    axes.plot([quantiles[2]] * 2, [0, np.interp(quantiles[2], grid, posterior)], color=COLOUR["model"], linewidth=0.9)
    _name_densities(axes, grid, prior, posterior)
    for place, reference in enumerate(references):
        _mark(axes, parameter, reference, peak * (1.10 + 0.13 * place))
    axes.set(xlim=(low, high), ylim=(0, peak * (1.16 + 0.13 * len(references))), yticks=[])
    formula_labels(axes, parameter.title)
    axes.spines["left"].set_visible(False)
    if parameter.logarithmic:
        _powers(axes, "x")
    return figure


def _name_densities(axes: Axes, grid: Array, prior: Array, posterior: Array) -> None:
    at = int(np.argmax(posterior))
    left, reach = float(grid[0]), float(np.ptp(grid))
    right = grid[at] < left + 0.5 * reach
    side = {"ha": "left" if right else "right", "xytext": (7 if right else -7, -9)}
    label(axes, grid[at], posterior[at], "posterior", "model", **side)
    if not prior.any():
        return
    room = (grid > left + 0.05 * reach) & (grid < left + 0.83 * reach)  # for the word, which begins there
    gap = int(np.argmax(np.where(room, prior - posterior, -np.inf)))
    label(axes, grid[gap], 0.0, "prior", "muted", xytext=(0, 3))


def _mark(axes: Axes, parameter: DrawnParameter, reference: ReferenceValue, height: float) -> None:
    value = float(parameter.coordinate(reference.value))
    error = None if np.isnan(reference.sd) else reference.sd
    axes.errorbar(value, height, xerr=error, fmt=reference.marker, markersize=5, color=COLOUR["ink"], elinewidth=1)
    axes.axvline(value, ymax=0.97, color=COLOUR["ink"], linewidth=0.5, dashes=(1, 2), zorder=0)
    low, high = (float(parameter.coordinate(bound)) for bound in (parameter.low, parameter.high))
    left = value > 0.5 * (low + high)
    label(axes, value - (error or 0) if left else value + (error or 0), height, reference.name,
          ha="right" if left else "left", va="center", xytext=(-6 if left else 6, 0))  # fmt: skip


def _window(parameter: DrawnParameter, heavy: NDArray[np.int64], marked: Sequence[float]) -> tuple[float, float]:
    """The drawn range around the members that count and the marks, within the prior."""
    shown = parameter.coordinate(np.concatenate([parameter.values[heavy], marked]))
    low, high = (float(parameter.coordinate(bound)) for bound in (parameter.low, parameter.high))
    margin = 0.15 * float(np.ptp(shown)) + 0.05 * (high - low)
    return max(low, shown.min() - margin), min(high, shown.max() + margin)


def _powers(axes: Axes, which: str) -> None:
    """Name a drawn common logarithm by the value it stands for."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    ticks = np.add.outer(np.arange(np.floor(low), high + 1), np.log10(np.arange(1, 10)))
    inside = (ticks >= low - 1e-9) & (ticks <= high + 1e-9)
    steps = [0] if inside[:, 0].sum() >= 3 else [0, 2] if inside[:, [0, 2]].sum() >= 3 else [0, 1, 4]
    named = ticks[:, steps][inside[:, steps]]
    if named.size < FEWEST_TICKS:
        named = np.log10(round_ticks(10.0**low, 10.0**high, 5))
    axis.set_ticks(named)
    axis.set_ticks(ticks[inside], minor=True)
    axis.set_major_formatter(FuncFormatter(lambda power, _: f"{10.0**power:.3g}"))
    axis.set_minor_formatter(NullFormatter())


@styled
def draw_joint(
    across: DrawnParameter, upward: DrawnParameter, weights: Array, marks: Sequence[tuple[str, float, float, str]]
) -> Figure:
    """Members in the plane of two parameters: prior as dots, posterior as discs of area proportional to weight.

    marks: name, value across, value upward, marker.
    """
    figure, axes = canvas(NARROW_WIDTH, 3.0)
    x, y = across.coordinate(across.values), upward.coordinate(upward.values)
    prior = across.coordinate(across.prior)[:PRIOR_MEMBERS], upward.coordinate(upward.prior)[:PRIOR_MEMBERS]
    axes.plot(*prior, ".", markersize=2.2, markeredgewidth=0, color=COLOUR["prior"])
    heavy = np.flatnonzero(weights > 1e-3 * weights.max())
    discs = heavy[:: -(-heavy.size // POSTERIOR_MEMBERS)]  # draws of about equal weight are many: each n-th of them
    axes.scatter(
        x[discs], y[discs], 55 * weights[discs] / weights.max(), color=COLOUR["model"], alpha=0.55, linewidth=0
    )
    for place, (name, value_x, value_y, marker) in enumerate(marks):
        at = float(across.coordinate(value_x)), float(upward.coordinate(value_y))
        axes.plot(*at, marker, markersize=7, color=COLOUR["ink"], fillstyle="none", markeredgewidth=1.3, zorder=6)
        side: dict[str, Any] = (
            {"ha": "left", "xytext": (7, 5)} if place % 2 == 0 else {"ha": "right", "xytext": (-7, -11)}
        )
        label(axes, *at, name, **side)
    formula_labels(axes, across.title, upward.title)
    axes.set_xlim(*_window(across, heavy, [value for _, value, _, _ in marks]))
    axes.set_ylim(*_window(upward, heavy, [value for _, _, value, _ in marks]))
    for parameter, which in ((across, "x"), (upward, "y")):
        if parameter.logarithmic:
            _powers(axes, which)
    return figure


@styled
def draw_cylinder(inferred: Array, weights: Array, cylinder: Array, low: float, high: float, symbol: str) -> Figure:
    """Plant drag inferred from the flow beside the drag of rigid cylinders of the surveyed size, logarithmic axis."""
    figure, axes = canvas(WIDTH, HEIGHT)
    low, high = np.log10(low), np.log10(high)
    greater = weighted_quantile(inferred, weights, [0.5])[0] > np.median(cylinder)
    sides = ("right", "left") if greater else ("left", "right")
    for values, share, name, line, face, side in (
        (cylinder, np.ones(len(cylinder)), "rigid cylinders\n(plant survey)", "stems", "plants", sides[0]),
        (inferred, weights, "inferred\nfrom the flow", "model", "wide", sides[1]),
    ):
        grid, height = density(np.log10(values), share, low, high, (low, high))
        axes.fill_between(grid, height, color=COLOUR[face], linewidth=0, alpha=0.75)
        axes.plot(grid, height, color=COLOUR[line], linewidth=1.4)
        at = int(np.argmax(height))
        label(axes, grid[at], height[at], name, line, ha=side, xytext=(8 if side == "left" else -8, -8))
    axes.set(xlim=(low, high), yticks=[])
    formula_labels(axes, f"{symbol_math(symbol)} of the dense patches [–]")
    axes.set_ylim(0, axes.get_ylim()[1] * 1.05)
    axes.spines["left"].set_visible(False)
    _powers(axes, "x")
    return figure


@styled
def draw_weights(weights: Array) -> Figure:
    """Share of the posterior carried by the heaviest members: the fewer carry it, the less it is to be trusted."""
    figure, axes = canvas()
    cumulated = np.cumsum(np.sort(weights)[::-1]) / weights.sum()
    number = np.arange(1, len(weights) + 1)
    axes.plot(number, cumulated, color=COLOUR["model"], linewidth=1.5, drawstyle="steps-post")
    for share in (0.5, 0.95):
        at = int(np.searchsorted(cumulated, share))
        axes.plot([1, number[at], number[at]], [share, share, 0], color=COLOUR["muted"], linewidth=0.7, dashes=(3, 2))
        text = f"{100 * share:.0f} % in {number[at]:,} members"
        label(axes, 1.15, share, text, "ink", xytext=(0, 3))
    axes.set(
        xscale="log",
        xlim=(1, len(weights)),
        ylim=(0, 1.02),
        xlabel="members, heaviest first",
        ylabel="share of the weight [–]",
    )
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    return figure


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
