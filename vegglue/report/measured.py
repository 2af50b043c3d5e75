"""Figures of measurements: across a section, in the vertical, and what the model leaves of them.

Every function takes plain arrays and tables and returns a matplotlib Figure; nothing here knows a run or a page.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import ndtri

from vegglue.arrays import Array
from vegglue.normal_range import NORMAL95
from vegglue.report.style import COLOUR, HEIGHT, SMALL, WIDTH, canvas, formula_labels, label, styled
from vegglue.report.typography import plus_minus


@dataclass(frozen=True)
class Vertical:
    """One vertical: where it stands, its points above the bed, and the curve drawn through them; [m], [m/s]."""

    y: float
    bed: float
    depth: float
    planted: bool
    height: Array
    velocity: Array
    used: NDArray[np.bool_]
    curve_height: Array
    curve_velocity: Array


@styled
def draw_verticals(verticals: Sequence[Vertical], canopy: tuple[float, float] | None, stretch: float) -> Figure:
    """Point velocities over the height in the section: each vertical drawn where it stands, 1 m/s as `stretch` m.

    canopy: height above the bed and its standard error [m], drawn where given.
    """
    figure, axes = canvas(2 * WIDTH, HEIGHT + 0.5)
    verticals = sorted(verticals, key=lambda vertical: vertical.y)
    bed = np.array([[vertical.y, vertical.bed] for vertical in verticals])
    bottom = bed[:, 1].min()
    surface = float(np.median([vertical.bed + vertical.depth for vertical in verticals]))
    axes.fill_between(bed[:, 0], bottom - 0.06, bed[:, 1], color=COLOUR["earth"], linewidth=0)
    axes.axhline(surface, color=COLOUR["model"], linewidth=0.8)
    label(axes, bed[0, 0], surface, "water surface", "model", xytext=(0, 3))
    for vertical in verticals:
        _draw_vertical(axes, vertical, stretch)
    among = np.array([[vertical.y, vertical.bed] for vertical in verticals if vertical.planted])
    if canopy is not None and among.size:
        place, top = among[:, 0], among[:, 1] + canopy[0]  # of plants on the bed that they stand on
        ends = np.r_[place[0] - 0.1, place, place[-1] + 0.4 * stretch], np.r_[top[0], top, top[-1]]
        axes.plot(*ends, color=COLOUR["stems"], linewidth=1.2)
        text = f"canopy {plus_minus(*canopy)} m"
        label(axes, float(place.mean()), float(top.mean()), text, "stems", ha="center", xytext=(0, -11))
    foot = axes.get_ylim()[0]
    start = float(bed[:, 0].min())
    axes.annotate(
        "", (start + 0.5 * stretch, foot), (start, foot), arrowprops={"arrowstyle": "|-|,widthA=.2,widthB=.2"}
    )
    label(axes, start + 0.25 * stretch, foot, "0.5 m/s", "ink", ha="center", xytext=(0, 4))
    axes.set_xlabel("y of the vertical [m], velocity to the right of it")
    axes.set_ylabel("z [m]")
    return figure


def _draw_vertical(axes: Axes, vertical: Vertical, stretch: float) -> None:
    z = vertical.bed + vertical.height
    axes.plot([vertical.y] * 2, [vertical.bed, vertical.bed + vertical.depth], color=COLOUR["rule"], linewidth=0.7)
    curve = vertical.y + stretch * vertical.curve_velocity
    axes.plot(curve, vertical.bed + vertical.curve_height, color=COLOUR["model"], linewidth=0.9)
    for chosen, face in ((vertical.used, COLOUR["measured"]), (~vertical.used, COLOUR["paper"])):
        axes.plot(
            vertical.y + stretch * vertical.velocity[chosen],
            z[chosen],
            "o",
            markersize=2.6,
            color=COLOUR["measured"],
            markerfacecolor=face,
            markeredgewidth=0.7,
        )


@styled
def draw_canopy_profiles(inside: Sequence[Vertical], canopy: tuple[float, float] | None) -> Figure:
    """Velocity against height above the bed for the verticals inside plants, with the canopy height."""
    figure, axes = canvas(WIDTH, HEIGHT + 0.3)
    for vertical in inside:
        axes.plot(vertical.curve_velocity, vertical.curve_height, color=COLOUR["model"], linewidth=0.9)
        axes.plot(vertical.velocity, vertical.height, "o", markersize=3, color=COLOUR["measured"])
    depth = max(vertical.depth for vertical in inside)
    slowest, fastest = (pick(np.concatenate([vertical.velocity for vertical in inside])) for pick in (np.min, np.max))
    axes.set_xlim(min(0.0, 1.12 * slowest), max(0.1, 1.12 * fastest))
    right = axes.get_xlim()[1]
    if canopy is not None:
        height, error = canopy
        axes.axhspan(height - error, height + error, color=COLOUR["plants"], linewidth=0, zorder=0)
        axes.axhline(height, color=COLOUR["stems"], linewidth=0.9, zorder=0)
        text = f"canopy\n{plus_minus(height, error)} m"
        label(axes, right, height, text, "stems", ha="right", va="top", xytext=(0, -7))
    axes.axhline(depth, color=COLOUR["model"], linewidth=0.8)
    label(axes, right, depth, "water surface", "model", ha="right", xytext=(0, 3))
    axes.set(xlabel="velocity [m/s]", ylabel="height above the bed [m]", ylim=(0, depth * 1.12))
    return figure


@styled
def draw_residuals(place: Array, axis: str, residual: Array, zone: Sequence[str], unit: str) -> Figure:
    """Measured minus modelled of each station against its place on an axis, x or y; a marker for each zone."""
    figure, axes = canvas()
    axes.axhline(0, color=COLOUR["muted"], linewidth=0.8)
    axes.vlines(place, 0, residual, color=COLOUR["measured"], linewidth=0.8)
    names = list(dict.fromkeys(zone))
    for marker, name in zip(cycle("osD^vP"), names, strict=False):
        chosen = np.array([other == name for other in zone])
        axes.plot(place[chosen], residual[chosen], marker, markersize=4.4, color=COLOUR["measured"])
        last = int(np.argmax(np.where(chosen, np.abs(residual), -1)))
        side = 7 if residual[last] >= 0 else -12
        label(axes, place[last], residual[last], name, "measured", ha="center", xytext=(0, side))
    axes.margins(y=0.18)
    formula_labels(axes, f"{axis} [m]", f"measured − modelled [{unit}]")
    return figure


@styled
def draw_quantiles(standardised: Array, names: Sequence[str]) -> Figure:
    """Ordered residuals over their error against normal quantiles; off the line means not the error assumed."""
    figure, axes = canvas()
    order = np.argsort(standardised)
    expected = ndtri((np.arange(len(order)) + 0.5) / len(order))
    reach = 1.1 * max(np.abs(expected).max(), np.abs(standardised).max())
    axes.plot([-reach, reach], [-reach, reach], color=COLOUR["model"], linewidth=1)
    axes.plot(expected, standardised[order], "o", markersize=4.2, color=COLOUR["measured"])
    for place, side, offset in ((0, "left", (5, -11)), (len(order) - 1, "right", (-5, 6))):
        text = names[order[place]]
        label(axes, expected[place], standardised[order[place]], text, "measured", ha=side, xytext=offset)
    label(axes, 0.45 * reach, 0.45 * reach, "as assumed", "model", xytext=(7, -9))
    axes.set(xlabel="normal quantile [–]", ylabel="residual / error [–]")
    return figure


@styled
def draw_discharge(rows: Sequence[tuple[str, float, float]], spread: tuple[float, float, float]) -> Figure:
    """Measured discharges (name, value, standard error) beside that of the model (quantiles 2.5, 50, 97.5 %)."""
    figure, axes = canvas(WIDTH, 0.9 + 0.34 * (len(rows) + 1))
    low, middle, high = spread
    axes.axvspan(low, high, color=COLOUR["wide"], linewidth=0)
    axes.axvline(middle, color=COLOUR["model"], linewidth=1.3)
    for place, (_, value, error) in enumerate(rows):
        axes.errorbar(
            value, place, xerr=NORMAL95 * error, fmt="o", markersize=4.2, color=COLOUR["measured"], elinewidth=0.9
        )
    label(axes, middle, -0.6, "model", "model", xytext=(4, -8))
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows])
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set(xlabel="discharge [m³/s], bars 95 %", ylim=(len(rows) - 0.5, -0.6))
    axes.tick_params(labelsize=SMALL + 0.5)
    return figure
