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
from vegglue.inference.statements import parameter_of, weight_statements
from vegglue.inference.weighted_statistics import effective_size, weighted_quantile
from vegglue.pages.flow_maps import plans
from vegglue.pages.measured_figures import canopy_profiles, discharges, residuals, verticals
from vegglue.pages.parameters import ParameterRow, as_power, parameter_rows, plant_parameter, study_value, symbols_of
from vegglue.pages.run import Run, published_picture
from vegglue.pages.style import HEIGHT, WIDTH, Picture, canvas, formula_labels, label, styled
from vegglue.pages.svg import COLOUR, FEWEST_TICKS, round_ticks
from vegglue.wording.numbers import no_formula, symbol_math, unit_math
from vegglue.wording.sentences import phrase

# Letters in a line beside the peak of a density: two lines each.
LETTERS_OF_DENSITY = 16
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
    """p(x) = sum_k w_k [N(x; x_k, b) + sum_c N(x; 2 c - x_k, b)],   b = 0.9 s n^(-1/5)

    Mirrored at the finite bounds c, so that no mass leaks out; n is the effective number of members, s the lesser of
    standard deviation and quartile distance / 1.34.

    Parameters
    ----------
    values, weights : ndarray (member,)
    low, high : float
        From where to where.
    bounds : (float, float)
        Of the values, infinite without.

    Returns
    -------
    ndarray, ndarray (2 DENSITY_POINTS,)
        Grid and density; half of the points lie where the values are: even ones alone draw a narrow density as wide as
        they stand apart.

    References
    ----------
    Silverman, for b; not checked against it.
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
    at, (left, reach) = int(np.argmax(posterior)), (float(grid[0]), float(np.ptp(grid)))
    right = grid[at] < left + 0.5 * reach
    side = {"ha": "left" if right else "right", "xytext": (7 if right else -7, -9)}
    label(axes, grid[at], posterior[at], "posterior", "model", **side)
    if prior.any():
        room = (grid > left + 0.05 * reach) & (grid < left + 0.83 * reach)  # for the word, which begins there
        gap = int(np.argmax(np.where(room, prior - posterior, -np.inf)))
        label(axes, grid[gap], 0.0, "prior", "muted", xytext=(0, 3))
    for place, reference in enumerate(references):
        value, height = float(parameter.coordinate(reference.value)), peak * (1.10 + 0.13 * place)
        error = None if np.isnan(reference.sd) else reference.sd
        axes.errorbar(value, height, xerr=error, fmt=reference.marker, markersize=5, color=COLOUR["ink"], elinewidth=1)
        axes.axvline(value, ymax=0.97, color=COLOUR["ink"], linewidth=0.5, dashes=(1, 2), zorder=0)
        leftward = value > 0.5 * (low + high)
        end = value - (error or 0) if leftward else value + (error or 0)
        label(axes, end, height, reference.name, ha="right" if leftward else "left", va="center",
              xytext=(-6 if leftward else 6, 0))  # fmt: skip
    axes.set(xlim=(low, high), ylim=(0, peak * (1.16 + 0.13 * len(references))), yticks=[])
    formula_labels(axes, parameter.title)
    axes.spines["left"].set_visible(False)
    if parameter.logarithmic:
        _powers(axes, "x")
    return figure


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
        (cylinder, np.ones(len(cylinder)), "cylinders", "stems", "plants", sides[0]),
        (inferred, weights, "inferred", "model", "wide", sides[1]),
    ):
        grid, height = density(np.log10(values), share, low, high, (low, high))
        axes.fill_between(grid, height, color=COLOUR[face], linewidth=0, alpha=0.75)
        axes.plot(grid, height, color=COLOUR[line], linewidth=1.4)
        at = int(np.argmax(height))
        text = textwrap.fill(phrase("label", name), LETTERS_OF_DENSITY)
        label(axes, grid[at], height[at], text, line, ha=side, xytext=(8 if side == "left" else -8, -8))
    axes.set(xlim=(low, high), yticks=[])
    formula_labels(axes, f"{symbol_math(symbol)} [–]")
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
        xlabel=phrase("label", "members"),
        ylabel=phrase("label", "weight"),
    )
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    return figure


# Pairs of parameters drawn together, the most correlated first: one row; strong correlations are stated in words.
PAIRS_DRAWN = 3
# Letters beside a mark, with which the axes of a marginal keep nine tenths of their width.
LONGEST_LABEL = 24
# Share of their range within which values come near a bound: a figure ends there.
DRAWN_TO_BOUND = 0.1


def pictures(run: Run) -> dict[str, list[Picture]]:
    """All figures, written to run.folder/figures, by their place in report.html.j2.

    A new figure of a part that exists is one more entry in its list; the template takes whatever it finds there.
    """
    weights = draw_weights(run.posterior.sample.weights)
    return {
        "marginals": [_draw_marginal(run, row) for row in parameter_rows(run)],
        "joints": list(_draw_joint_posteriors(run)),
        "plants": list(_draw_plant_drag(run)),
        "residuals": list(residuals(run)),
        "verticals": list(verticals(run)),
        "canopy_and_discharge": [*canopy_profiles(run), *discharges(run)],
        "flow": [drawn for experiment in run.flow for drawn in plans(run, experiment)],
        "health": [
            published_picture(run, weights, "weights", "caption_weights", next(weight_statements(run.posterior)))
        ],
    }


def _drawn_parameter(run: Run, name: str) -> DrawnParameter:
    (low, high), logarithmic = run.posterior.marginals.bounds[name], as_power(run.posterior, name)
    values = run.posterior.sample.theta[name]
    if run.ensemble is not None:
        prior = run.ensemble.parameters[name]
    else:
        assert run.posterior.refinement is not None  # without an ensemble nothing but draws is a posterior
        prior = run.posterior.refinement.draws.prior_theta[name]
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


def references_of(run: Run, name: str) -> list[ReferenceValue]:
    """Values of others that a figure marks: those that the table has, and what a synthetic record was made with."""
    reference = run.case.reference
    if reference is None:
        return []
    found = []
    if (stated := study_value(run.case, run.posterior, name)) is not None:
        on_axis, sd = stated
        value = 10.0**on_axis if as_power(run.posterior, name) else on_axis
        source = shorten(reference.source, LONGEST_LABEL, placeholder="").rstrip(" ,;:") or "reference"
        found.append(ReferenceValue(source, value, sd, "D"))
    if name in reference.made_with:
        found.append(ReferenceValue("made with", reference.made_with[name], np.nan, "X"))
    return found


def _draw_marginal(run: Run, row: ParameterRow) -> Picture:
    name, posterior, canopy = row.parameter.name, run.posterior, run.posterior.canopy
    drawn, references = _drawn_parameter(run, name), references_of(run, name)
    if row.corrected is not None and canopy is not None:  # phi of another canopy height, which values of others are of
        kept = (canopy.phi > 0) & np.isfinite(canopy.phi)
        phi, weights = canopy.phi[kept], posterior.sample.weights[kept]
        marked = [reference.value for reference in references]
        low, high = min([*marked, weighted_quantile(phi, weights, [0.001])[0]]), max([*marked, phi.max()])
        prior = phi if np.array_equal(posterior.sample.theta[name], drawn.prior) else np.zeros(0)
        drawn = replace(drawn, values=phi, prior=prior, low=low / 1.5, high=1.5 * high)
        figure = draw_marginal(drawn, weights, references)
        return published_picture(run, figure, f"posterior-{name}-corrected", "caption_corrected", row)
    if canopy is not None and canopy.parameter == name:
        references = []
    figure = draw_marginal(drawn, posterior.sample.weights, references)
    sources = [reference.name for reference in references]
    return published_picture(run, figure, f"posterior-{name}", "caption_marginal", row, sources)


def _draw_joint_posteriors(run: Run) -> Iterator[Picture]:
    posterior, symbols = run.posterior, symbols_of(run.case)
    names, correlation = posterior.parameters, posterior.marginals.correlation
    pairs = sorted(combinations(range(len(names)), 2), key=lambda pair: -abs(np.nan_to_num(correlation[pair])))
    for pair in pairs[:PAIRS_DRAWN]:
        one, other = (names[place] for place in pair)
        marks = [
            (first.name, first.value, second.value, first.marker.lower())
            for first in references_of(run, one)
            for second in references_of(run, other)
            if first.name == second.name
        ]
        drawn = _drawn_parameter(run, one), _drawn_parameter(run, other)
        figure = draw_joint(*drawn, posterior.sample.weights, marks)
        both = parameter_of(posterior, one, symbols), parameter_of(posterior, other, symbols)
        r = float(correlation[pair])
        yield published_picture(run, figure, f"joint-{one}-{other}", "caption_joint", *both, r, posterior.claimed)


def _draw_plant_drag(run: Run) -> Iterator[Picture]:
    name, cylinder, posterior = plant_parameter(run.case), run.cylinder, run.posterior
    if name is None or cylinder is None:
        return
    drawn = _drawn_parameter(run, name)
    corrected = posterior.canopy is not None and posterior.canopy.parameter == name
    inferred = posterior.canopy.phi if corrected and posterior.canopy else drawn.values
    kept = (inferred > 0) & np.isfinite(inferred)
    inferred, weights = inferred[kept], posterior.sample.weights[kept]
    spread = np.concatenate(
        [weighted_quantile(inferred, weights, [0.005, 0.995]), np.quantile(cylinder.draws, [0.005, 0.995])]
    )
    low, high = min(drawn.low, spread.min()), max(drawn.high, spread.max())
    figure = draw_cylinder(inferred, weights, cylinder.draws, low, high, drawn.symbol)
    ratio = float(weighted_quantile(inferred, weights, [0.5])[0]) / cylinder.quantile(0.5)
    yield published_picture(
        run, figure, "plant-drag", "caption_plant_drag", posterior.marginals.identified[name], ratio, corrected,
        cylinder.mean, cylinder.standard_deviation,
    )  # fmt: skip
