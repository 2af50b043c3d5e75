"""Figures from above and along the channel: depth, velocity, streamlines, patches, stations, water level."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke

from vegglue.arrays import Array
from vegglue.figures.style import COLOUR, EDGE_COLOUR, WIDTH, canvas, label, styled
from vegglue.flow.sensor import FlowFields

PlanWindow = tuple[float, float, float, float]
# Parts of equal discharge [-] between drawn streamlines; captions say a tenth.
STREAM_TUBES = 10
MAP_WIDTH = 2 * WIDTH


@dataclass(frozen=True)
class Outline:
    """A plant patch: its name and corners (corner, 2) [m]."""

    name: str
    corners: Array


@dataclass(frozen=True)
class Gauges:
    """Levels along the channel, (station,) [m]: measured with standard error, and the modelled 95 % band."""

    x: Array
    value: Array
    standard_error: Array
    low: Array
    high: Array


def wet_window(flow: FlowFields, x: tuple[float, float]) -> PlanWindow:
    """The part x[0]..x[1] of the grid, as wide as the water in it: x and y ranges [m]."""
    inside = (flow.x >= x[0]) & (flow.x <= x[1])
    wet = np.flatnonzero(np.isfinite(flow.depth[inside]).any(axis=0))
    step = float(flow.y[1] - flow.y[0])
    return x[0], x[1], float(flow.y[wet[0]]) - step, float(flow.y[wet[-1]]) + step


def stream_function(flow: FlowFields) -> Array:
    """psi with d psi/dy = h u and d psi/dx = -h v, from the south edge on, (nx, ny) [m3/s]."""
    along, across = np.nan_to_num(flow.depth * flow.u), np.nan_to_num(flow.depth * flow.v)
    dx, dy = float(flow.x[1] - flow.x[0]), float(flow.y[1] - flow.y[0])
    edge = -np.cumsum(across[:, 0]) * dx
    return edge[:, None] + (np.cumsum(along, axis=1) - 0.5 * along) * dy


@styled
def draw_reach(flow: FlowFields, window: PlanWindow, patches: Sequence[Outline], stations: Array) -> Figure:
    """Depth and velocity of a reach at true scale, streamlines with a tenth of the discharge between each two.

    stations: x, y (station, 2) [m].
    """
    x0, x1, y0, y1 = window
    tall = (MAP_WIDTH - 1.2) * (y1 - y0) / (x1 - x0)
    figure, (upper, lower) = canvas(MAP_WIDTH, 2 * tall + 1.1, nrows=2, sharex=True)
    _draw_field(upper, flow, flow.depth, window, "viridis_r", "depth [m]")
    _draw_field(lower, flow, np.hypot(flow.u, flow.v), window, "cividis", "velocity [m/s]")
    _draw_streamlines(lower, flow)
    for axes in (upper, lower):
        axes.set_aspect("equal")
        _draw_patches(axes, patches)
        axes.plot(
            *stations.T, "o", markersize=2.6, color=COLOUR["measured"], markeredgecolor="white", markeredgewidth=0.4
        )
    for patch in patches:
        label(upper, patch.corners[:, 0].max(), patch.corners[:, 1].mean(), patch.name, va="center", xytext=(3, 0))
    lower.set_xlabel("x [m], flow to the right")
    return figure


@styled
def draw_plan(flow: FlowFields, patches: Sequence[Outline], stations: Array, gauges: Gauges | None) -> Figure:
    """The whole channel: depth, velocity (y stretched), and bed and water level along the deepest line."""
    window = wet_window(flow, (float(flow.x[0]), float(flow.x[-1])))
    figure, (upper, middle, lower) = canvas(MAP_WIDTH, 5.4, nrows=3, sharex=True)
    _draw_field(upper, flow, flow.depth, window, "viridis_r", "depth [m]")
    _draw_field(middle, flow, np.hypot(flow.u, flow.v), window, "cividis", "velocity [m/s]")
    for axes in (upper, middle):
        _draw_patches(axes, patches)
        axes.plot(*stations.T, "o", markersize=1.8, color=COLOUR["measured"], markeredgewidth=0)
    _draw_levels(lower, flow, gauges)
    lower.set_xlabel("x [m], flow to the right")
    return figure


def _draw_field(axes: Axes, flow: FlowFields, field: Array, window: PlanWindow, colours: str, title: str) -> None:
    x0, x1, y0, y1 = window
    columns = np.flatnonzero((flow.x >= x0 - 1) & (flow.x <= x1 + 1))
    rows = np.flatnonzero((flow.y >= y0 - 1) & (flow.y <= y1 + 1))
    shown = np.ma.masked_invalid(field[np.ix_(columns, rows)].T)
    mesh = axes.pcolormesh(flow.x[columns], flow.y[rows], shown, cmap=colours, rasterized=True, vmin=0)
    axes.figure.colorbar(mesh, ax=axes, label=title, pad=0.012, aspect=12, fraction=0.05).outline.set_visible(False)
    axes.set(xlim=(x0, x1), ylim=(y0, y1), ylabel="y [m]")


def _draw_streamlines(axes: Axes, flow: FlowFields) -> None:
    psi = stream_function(flow)
    levels = np.linspace(psi[len(flow.x) // 2].min(), psi[len(flow.x) // 2].max(), STREAM_TUBES + 1)[1:-1]
    shown = np.ma.masked_where(~np.isfinite(flow.depth), psi)
    axes.contour(flow.x, flow.y, shown.T, levels=levels, colors="white", linewidths=1.1, alpha=0.45)
    axes.contour(flow.x, flow.y, shown.T, levels=levels, colors=EDGE_COLOUR, linewidths=0.5)


def _draw_patches(axes: Axes, patches: Sequence[Outline]) -> None:
    for patch in patches:
        edge = Polygon(patch.corners, closed=True, fill=False, edgecolor=EDGE_COLOUR, linewidth=0.9)
        edge.set_path_effects([withStroke(linewidth=2, foreground="white", alpha=0.8)])
        axes.add_patch(edge)


def _draw_levels(axes: Axes, flow: FlowFields, gauges: Gauges | None) -> None:
    deepest = np.argmin(flow.bed, axis=1)
    along = np.arange(len(flow.x))
    bed, level = flow.bed[along, deepest], flow.level[along, deepest]
    axes.fill_between(flow.x, bed, level, color=COLOUR["water"], linewidth=0)
    axes.fill_between(
        flow.x, np.full_like(bed, bed.min() - 0.08 * np.ptp(bed) - 0.05), bed, color=COLOUR["earth"], linewidth=0
    )
    axes.plot(flow.x, level, color=COLOUR["model"], linewidth=1.2)
    label(axes, flow.x[len(flow.x) // 50], level[len(flow.x) // 50], "water level", "model", xytext=(0, 4))
    label(axes, flow.x[len(flow.x) // 50], bed[len(flow.x) // 50], "bed on the deepest line", xytext=(0, -10))
    if gauges is not None:
        axes.vlines(gauges.x, gauges.low, gauges.high, color=COLOUR["narrow"], linewidth=4)
        error = 1.96 * np.nan_to_num(gauges.standard_error)
        axes.errorbar(gauges.x, gauges.value, error, fmt="o", markersize=3.6, color=COLOUR["measured"], elinewidth=0.9)
        label(axes, gauges.x[0], gauges.value[0], "gauges", "measured", xytext=(6, -9))
    axes.margins(y=0.12)
    axes.set_ylabel("level [m]")
