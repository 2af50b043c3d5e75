"""The channel as the model has it, for vegglue check: bed, friction classes, plants, boundaries and stations."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch as Swatch
from matplotlib.patches import Polygon

from vegglue.arrays import Array
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.grid import edges
from vegglue.case.gridded_site import Site, in_experiment
from vegglue.case.parameter_space import Bounds
from vegglue.case.schema import Case
from vegglue.case.zones import corners_of
from vegglue.measurements.observations import Observations
from vegglue.pages.style import SMALL, canvas, label, save, styled
from vegglue.pages.svg import COLOUR
from vegglue.wording.sentences import phrase

# Half of the width of a letter, of a line and of a point in a plan 9.4 inches wide, over the axes [-].
HALF_LETTER, HALF_LINE, HALF_POINT = 0.0045, 0.035, 0.004


def freest(places: Sequence[tuple[float, float]], text: str, axes: Axes, taken: Array) -> tuple[float, float]:
    """Of places for the middle of a text the first that covers the fewest points; taken: x and y of these (n, 2)."""
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    width = limits[:, 1] - limits[:, 0]
    half = np.array([HALF_LETTER * len(text) + HALF_POINT, HALF_LINE])
    covered = [int((np.abs((taken - place) / width) < half).all(axis=1).sum()) for place in places]
    return places[int(np.argmin(covered))]


def along_an_edge(x: float, ends: Bounds) -> list[tuple[float, float]]:
    """Places at x between two ends [m]: in the middle, then nearer to either end."""
    low, high = ends
    return [(x, low + share * (high - low)) for share in (0.5, 0.7, 0.3, 0.9, 0.1)]


def about_a_patch(corners: Array, axes: Axes) -> list[tuple[float, float]]:
    """Its middle, then above and below it, then beside its middle along the channel. corners (k, 2) [m]."""
    (x, y), (low, high) = corners.mean(axis=0), (corners.min(axis=0), corners.max(axis=0))
    up = 1.5 * HALF_LINE * float(np.ptp(axes.get_ylim()))
    beside = [low[0] + share * (high[0] - low[0]) for share in (0.25, 0.75)]
    return [(x, y), (x, high[1] + up), (x, low[1] - up), *((float(place), y) for place in beside)]


CLASS_COLOURS = ("water", "earth", "prior", "narrow", "wide", "rule")
# Drawn upstream and downstream of patches and stations [m]: room to see the bed around them.
REACH_OF_INTEREST_MARGIN = 12.0
# Share of the grid [-] from which that reach is all but the whole, and is not drawn again.
ALL_BUT_WHOLE = 0.8


def save_channel_figure(case: Case, site: Site, observations: Observations, path: Path) -> None:
    """Write the channel to a PNG: all of it, and the reach with plants and stations enlarged."""
    save(draw_channel(case, site, observations), path, dots_per_inch=150)


@styled
def draw_channel(case: Case, site: Site, observations: Observations) -> Figure:
    """The whole grid (not to scale), the reach of interest if that is a part of it, and the bed across its middle."""
    along = [corner for patch in case.plants.patches for corner in corners_of(case, patch)[:, 0]]
    along += list(observations.table["x"])
    reach = case.grid.x
    if along:
        near = min(along) - REACH_OF_INTEREST_MARGIN, max(along) + REACH_OF_INTEREST_MARGIN
        reach = max(case.grid.x[0], near[0]), min(case.grid.x[1], near[1])
    (west, east), (low, high) = case.grid.x, reach
    apart = high - low < ALL_BUT_WHOLE * (east - west)
    heights = [1.0, 1.6, 1.4] if apart else [1.6, 1.4]
    figure, (whole, *between, across) = canvas(9.4, 7.2 if apart else 5.6, nrows=len(heights), height_ratios=heights)
    for axes in (whole, *between):
        _draw_plan(axes, case, site, observations)
    whole.set(xlim=case.grid.x, title=f"{case.title or case.name}: {phrase('label', 'channel')}")
    _draw_boundaries(whole, case, observations)
    for axes in between:
        whole.axvspan(low, high, fill=False, edgecolor=COLOUR["ink"], linewidth=0.8, linestyle=":")
        axes.set(xlim=reach, title=phrase("label", "reach"))
    nearest = between[0] if between else whole
    nearest.set(xlabel=phrase("label", "along"))
    for patch in case.plants.patches:
        places = about_a_patch(corners_of(case, patch), nearest)
        _name(nearest, places, patch.name, observations, "ink")
    shown: list[Line2D | Swatch] = [
        Swatch(color=_class_colour(i), label=name) for i, name in enumerate(site.class_names)
    ]
    if case.plants.patches:
        shown.append(Swatch(color=COLOUR["plants"], label=phrase("label", "plants")))
    shown.append(Line2D([], [], color=COLOUR["model"], linewidth=0.8, label="expected waterline"))
    if len(observations.table):
        shown.append(Line2D([], [], linestyle="", marker="o", markersize=3, color=COLOUR["measured"], label="station"))
    if not observations.table["used"].all():
        shown.append(Line2D([], [], linestyle="", marker="x", markersize=5, color=COLOUR["ink"], label="not used"))
    figure.legend(handles=shown, loc="outside lower left", ncols=6, fontsize=SMALL)
    _draw_section(across, case, site, 0.5 * (low + high))
    return figure


def _draw_plan(axes: Axes, case: Case, site: Site, observations: Observations) -> None:
    """Classes of friction, waterlines, patches and stations."""
    grid, table = site.grid, observations.table
    axes.imshow(
        site.friction_class.T, origin="lower", aspect="auto", interpolation="nearest", vmin=-0.5,
        extent=(*edges(grid.x, grid.dx)[[0, -1]], *edges(grid.y, grid.dy)[[0, -1]]),
        cmap=ListedColormap([_class_colour(index) for index in range(len(site.class_names))]),
        vmax=len(site.class_names) - 0.5,
    )  # fmt: skip
    for name, experiment in case.experiments.items():
        depth = expected_depth(case, in_experiment(site, name), experiment)
        if depth.min() < 0 < depth.max():
            axes.contour(grid.x, grid.y, depth.T, [0.0], colors=COLOUR["model"], linewidths=0.8)
    densest = max((patch.stems for patch in case.plants.patches), default=1.0)
    i, j = np.nonzero(site.main_patch >= 0)
    axes.plot(grid.x[i], grid.y[j], ",", color=COLOUR["stems"])
    for patch in case.plants.patches:
        corners, strength = corners_of(case, patch), 0.3 + 0.6 * patch.stems / densest
        axes.add_patch(Polygon(corners, facecolor=COLOUR["plants"], alpha=strength, edgecolor="none"))
        axes.add_patch(Polygon(corners, fill=False, edgecolor=COLOUR["stems"], linewidth=0.8))
    used = table["used"]
    axes.plot(table["x"][used], table["y"][used], "o", markersize=2.6, color=COLOUR["measured"])
    axes.plot(table["x"][~used], table["y"][~used], "x", markersize=4.5, color=COLOUR["ink"])
    axes.set(ylabel="y [m]", ylim=case.grid.y)


def _class_colour(index: int) -> str:
    return COLOUR[CLASS_COLOURS[index % len(CLASS_COLOURS)]]


def _name(
    axes: Axes, places: Sequence[tuple[float, float]], text: str, observations: Observations, colour: str
) -> None:
    """A text around the one of these places where it covers the fewest stations."""
    x, y = freest(places, text, axes, observations.table[["x", "y"]].to_numpy(float))
    label(axes, x, y, text, colour, ha="center", va="center", xytext=(0, 0))


def _draw_boundaries(axes: Axes, case: Case, observations: Observations) -> None:
    (west, east), (south, north) = case.grid.x, case.grid.y

    def inward(text: str) -> float:
        """How far from an end of the channel the middle of a text lies [m]."""
        return (HALF_LETTER * (len(text) + 1) + HALF_POINT) * (east - west)

    line: dict[str, Any] = {"linewidth": 3.0, "solid_capstyle": "butt", "clip_on": False}
    for name, inflow in case.inflows.items():
        if inflow.side == "west":
            low, high = inflow.range or case.grid.y
            axes.plot([west, west], [low, high], color=COLOUR["model"], **line)
            _name(axes, along_an_edge(west + inward(name), (low, high)), name, observations, "model")
        else:
            low, high = inflow.range or case.grid.x
            y = south if inflow.side == "south" else north
            axes.plot([low, high], [y, y], color=COLOUR["model"], **line)
            label(axes, 0.5 * (low + high), y, name, "model", xytext=(0, 6 if inflow.side == "south" else -10))
    low, high = case.outlet.range or case.grid.y
    axes.plot([east, east], [low, high], color=COLOUR["model"], **line)
    _name(axes, along_an_edge(east - inward("outlet"), (low, high)), "outlet", observations, "model")


def _draw_section(axes: Axes, case: Case, site: Site, x: float) -> None:
    i = int(np.abs(site.grid.x - x).argmin())
    bed = site.bed[i]
    axes.plot(site.grid.y, bed, color=COLOUR["ink"], linewidth=1.2)
    axes.plot(site.grid.y, bed, ".", markersize=3, color=COLOUR["ink"])
    for name, experiment in case.experiments.items():
        now = in_experiment(site, name)
        depth = expected_depth(case, now, experiment)[i]
        level = now.bed[i] + depth
        if now is not site:
            axes.plot(site.grid.y, now.bed[i], color=COLOUR["ink"], linewidth=0.6, linestyle="--")
        axes.fill_between(
            site.grid.y, now.bed[i], level, where=depth > 0, interpolate=True, color=COLOUR["water"], zorder=0
        )
        axes.plot(site.grid.y, np.where(depth > 0, level, np.nan), color=COLOUR["model"], linewidth=1.0)
        if (depth > 0).any():
            label(axes, site.grid.y[depth > 0][0], level[0], name, "model")
    axes.set(xlim=case.grid.y, xlabel="y [m]", ylabel="z [m]")
    axes.set_title(f"x = {site.grid.x[i]:.4g} m: {phrase('label', 'bed')}")
