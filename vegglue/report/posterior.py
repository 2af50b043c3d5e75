"""Figures of parameters: marginal and joint posteriors, plant drag beside its rigid-cylinder estimate, weights."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.inference.weighted_statistics import effective_size, weighted_quantile
from vegglue.report.style import COLOUR, HEIGHT, WIDTH, canvas, formula_labels, label, styled
from vegglue.report.svg_text import FEWEST_TICKS, round_ticks
from vegglue.report.typography import no_formula, symbol_math, unit_math

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
