"""Figures from above and along the channel: depth, velocity, streamlines, patches, stations, water level."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.flow.sensor import FlowFields
from vegglue.normal_range import NORMAL95
from vegglue.report.field_map import (
    MAP_LEFT,
    MAP_LETTERS,
    MAP_RIGHT,
    MAP_TOTAL,
    MapFrame,
    coloured_cells,
    map_axes,
    outlined,
    station_dots,
    streamlines,
)
from vegglue.report.style import COLOUR
from vegglue.report.svg_text import area_between, line_through, svg_document, svg_element, svg_words

PlanWindow = tuple[float, float, float, float]
# Parts of equal discharge [-] between drawn streamlines; captions say a tenth.
STREAM_TUBES = 10
# Heights of the maps and of the profile of the whole channel, and what lies between them [px].
STRETCHED, PROFILE, GAP, HEAD, BELOW = 96.0, 150.0, 34.0, 24.0, 44.0
# Height of a reach [px] below which its streamlines run into one another: it is stretched to that.
LEAST_HEIGHT = 84.0


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


def stretch_of(window: PlanWindow) -> float:
    """How many times wider than at true scale a reach is drawn [-], so that it has LEAST_HEIGHT; 1 where it is wide."""
    return max(1.0, LEAST_HEIGHT / _true_height(window))


def _true_height(window: PlanWindow) -> float:
    x0, x1, y0, y1 = window
    return (MAP_RIGHT - MAP_LEFT) * (y1 - y0) / (x1 - x0)


def draw_reach(
    flow: FlowFields, window: PlanWindow, patches: Sequence[Outline], stations: Array, note: str = ""
) -> str:
    """SVG text: depth and velocity of a reach; between two streamlines flows a tenth of the water. See `stretch_of`.

    stations: x, y (station, 2) [m]; note: in the corner.
    """
    tall = stretch_of(window) * _true_height(window)
    upper, lower = MapFrame(window, HEAD, HEAD + tall), MapFrame(window, HEAD + tall + GAP, HEAD + 2 * tall + GAP)
    parts = [*_depth(upper, flow), *_velocity(lower, flow)]
    for frame in (upper, lower):
        parts += [
            *outlined(frame, [one.corners for one in patches]),
            *station_dots(frame, stations, float(np.clip(0.03 * tall, 1.3, 3.2))),
        ]
    for one in patches:
        place = float(upper.across(one.corners[:, 0].max())) + 5, float(upper.down(one.corners[:, 1].mean())) + 4
        halo: dict[str, Any] = {"stroke": COLOUR["paper"], "stroke_width": 3.0, "paint_order": "stroke"}
        parts.append(svg_words(*place, one.name, **halo))
    parts += [*map_axes(upper, along=False), *map_axes(lower, along=True), _noted(lower.foot + BELOW, note)]
    return svg_document(MAP_TOTAL, lower.foot + BELOW, parts, "Depth and velocity", MAP_LETTERS)


def draw_plan(
    flow: FlowFields, patches: Sequence[Outline], stations: Array, gauges: Gauges | None, note: str = ""
) -> str:
    """SVG text: the whole channel, depth, velocity (y stretched), and bed and water level along the deepest line."""
    window = wet_window(flow, (float(flow.x[0]), float(flow.x[-1])))
    tops = [HEAD + place * (STRETCHED + GAP) for place in range(3)]
    maps = [MapFrame(window, top, top + STRETCHED) for top in tops[:2]]
    parts = [*_depth(maps[0], flow), *_velocity(maps[1], flow, lines=False)]
    for frame in maps:
        parts += [*outlined(frame, [one.corners for one in patches]), *station_dots(frame, stations, 2.0)]
        parts += map_axes(frame, along=False)
    foot = tops[2] + PROFILE
    parts += [*_levels(flow, gauges, (tops[2], foot)), _noted(foot + BELOW, note)]
    return svg_document(MAP_TOTAL, foot + BELOW, parts, "The whole channel", MAP_LETTERS)


def _noted(height: float, note: str) -> str:
    return svg_words(MAP_TOTAL, height - 4, note, "muted", text_anchor="end")


def _depth(frame: MapFrame, flow: FlowFields) -> list[str]:
    return coloured_cells(frame, flow.x, flow.y, flow.depth, "viridis_r", "depth [m]")


def _velocity(frame: MapFrame, flow: FlowFields, lines: bool = True) -> list[str]:
    parts = coloured_cells(frame, flow.x, flow.y, np.hypot(flow.u, flow.v), "cividis", "velocity [m/s]")
    if not lines:
        return parts
    psi = stream_function(flow)
    middle = psi[len(flow.x) // 2]
    levels = np.linspace(middle.min(), middle.max(), STREAM_TUBES + 1)[1:-1]
    wet = np.where(np.isfinite(flow.depth), psi, np.nan)
    return [*parts, *streamlines(frame, flow.x, flow.y, wet, levels)]


def _levels(flow: FlowFields, gauges: Gauges | None, heights: tuple[float, float]) -> list[str]:
    """Bed and water level along the deepest line, and gauges with 95 % of their error over the band of the model."""
    along, deepest = np.arange(len(flow.x)), np.argmin(flow.bed, axis=1)
    bed, level = flow.bed[along, deepest], flow.level[along, deepest]
    lowest = float(bed.min()) - 0.08 * float(np.ptp(bed)) - 0.05
    highest = float(np.nanmax(level)) + 0.12 * (float(np.nanmax(level)) - lowest)
    frame = MapFrame((float(flow.x[0]), float(flow.x[-1]), lowest, highest), *heights)
    x, ground, water = frame.across(flow.x), frame.down(bed), frame.down(level)
    parts = [
        svg_element("path", d=area_between(x, ground, water), fill=COLOUR["water"]),
        svg_element("path", d=area_between(x, np.full(x.size, frame.foot), ground), fill=COLOUR["earth"]),
        svg_element("path", d=line_through(x, water), fill="none", stroke=COLOUR["model"], stroke_width=1.6),
        svg_words(MAP_LEFT + 10, float(np.nanmin(water)) - 5, "water level", "model"),
        svg_words(MAP_LEFT + 10, frame.foot - 8, "bed on the deepest line"),
    ]
    if gauges is not None:
        parts += _gauge_marks(frame, gauges)
    return [*parts, *map_axes(frame, along=True, title="level [m]")]


def _gauge_marks(frame: MapFrame, gauges: Gauges) -> list[str]:
    parts, error = [], NORMAL95 * np.nan_to_num(gauges.standard_error)
    for k, at in enumerate(frame.across(gauges.x)):
        if not np.isfinite(gauges.value[k]):
            continue
        low, high = (float(frame.down(edge[k])) for edge in (gauges.low, gauges.high))
        if np.isfinite(low) and np.isfinite(high):
            parts.append(
                svg_element("path", d=f"M{at:.1f},{low:.1f}V{high:.1f}", stroke=COLOUR["narrow"], stroke_width=6)
            )
        foot, head = (float(frame.down(gauges.value[k] + side * error[k])) for side in (-1, 1))
        parts.append(svg_element("path", d=f"M{at:.1f},{foot:.1f}V{head:.1f}", stroke=COLOUR["measured"]))
        parts.append(svg_element("circle", cx=float(at), cy=0.5 * (foot + head), r=3.6, fill=COLOUR["measured"]))
    last = float(frame.across(gauges.x[0])) + 8, float(frame.down(gauges.value[0])) + 16
    return [*parts, svg_words(*last, "gauges", "measured")]
