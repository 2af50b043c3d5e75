"""Maps of the flow of the median parameters as SVG: depth, velocity, streamlines, patches, stations, water level."""

import base64
import html
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.image import imsave

from vegglue.arrays import Array
from vegglue.case.text_files import told_apart
from vegglue.case.zones import corners_of
from vegglue.flow.sensor import FlowFields
from vegglue.measurements.kinds import WATER_LEVEL
from vegglue.normal_range import NORMAL95
from vegglue.pages.run import Run, file_name, planted_cells, published_svg, stamp
from vegglue.pages.style import COLOUR, EDGE_COLOUR, Picture
from vegglue.pages.svg import (
    Scale,
    area_between,
    line_through,
    linear_scale,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
)
from vegglue.pages.typography import short

# A map as wide as the page, its colours beside it [px].
MAP_LEFT, MAP_RIGHT, MAP_TOTAL, MAP_LETTERS = 52.0, 800.0, 902.0, 12.0
BAR_WIDTH, BAR_STEPS = 12.0, 24
# Points of a streamline at most: more than a screen resolves.
STREAM_POINTS = 400


@dataclass(frozen=True)
class MapFrame:
    """A window of the site (x0, x1, y0, y1) [m] and where it lies in the picture: head and foot [px]."""

    window: tuple[float, float, float, float]
    top: float
    foot: float

    @property
    def across(self) -> Scale:
        """x to px."""
        return linear_scale(self.window[0], self.window[1], MAP_LEFT, MAP_RIGHT)

    @property
    def down(self) -> Scale:
        """y to px."""
        return linear_scale(self.window[2], self.window[3], self.foot, self.top)


def coloured_cells(frame: MapFrame, x: Array, y: Array, field: Array, colours: str, title: str) -> list[str]:
    """The cells (nx, ny) of a field within the frame, from zero on, and the bar of its colours.

    x, y: centres of cells [m]; colours: a map of matplotlib; title: what it is, with its unit.
    """
    x0, x1, y0, y1 = frame.window
    dx, dy = float(x[1] - x[0]), float(y[1] - y[0])
    columns = np.flatnonzero((x >= x0 - dx) & (x <= x1 + dx))
    rows = np.flatnonzero((y >= y0 - dy) & (y <= y1 + dy))
    shown = field[np.ix_(columns, rows)]
    most = float(np.nanmax(shown)) if np.isfinite(shown).any() else 1.0
    ends = frame.across(np.array([x[columns[0]] - 0.5 * dx, x[columns[-1]] + 0.5 * dx]))
    edges = frame.down(np.array([y[rows[-1]] + 0.5 * dy, y[rows[0]] - 0.5 * dy]))
    picture = _as_png(shown.T[::-1] / most, colours)
    name = f"frame-{frame.top:g}"
    clip = svg_element("rect", x=MAP_LEFT, y=frame.top, width=MAP_RIGHT - MAP_LEFT, height=frame.foot - frame.top)
    image = svg_element(
        "image", x=float(ends[0]), y=float(edges[0]), width=float(ends[1] - ends[0]), height=float(edges[1] - edges[0]),
        preserveAspectRatio="none", style="image-rendering:pixelated", href=picture, clip_path=f"url(#{name})",
    )  # fmt: skip
    return [svg_element("clipPath", clip, id=name), image, *_bar(frame, most, colours, title)]


def _as_png(share: Array, colours: str) -> str:
    """Shares of the largest value (rows, columns) as a picture within the text; clear where NaN."""
    painted = matplotlib.colormaps[colours](np.nan_to_num(share), bytes=True)
    painted[~np.isfinite(share), 3] = 0
    file = BytesIO()
    imsave(file, painted, format="png")
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


def _bar(frame: MapFrame, most: float, colours: str, title: str) -> list[str]:
    left, step = MAP_RIGHT + 14, (frame.foot - frame.top) / BAR_STEPS
    palette = matplotlib.colormaps[colours]((np.arange(BAR_STEPS) + 0.5) / BAR_STEPS, bytes=True)
    parts = [
        svg_element(
            "rect", x=left, y=frame.foot - (k + 1) * step, width=BAR_WIDTH, height=step + 0.5,
            fill=f"rgb({red},{green},{blue})",
        )
        for k, (red, green, blue, _) in enumerate(palette.tolist())
    ]  # fmt: skip
    height, ticks = linear_scale(0.0, most, frame.foot, frame.top), round_ticks(0.0, most, 4)
    for tick, words in zip(ticks, tick_labels(ticks), strict=True):
        parts.append(svg_words(left + BAR_WIDTH + 5, float(height(tick)) + 4, words, "muted"))
    parts.append(svg_words(MAP_TOTAL, frame.top - 5, title, text_anchor="end"))
    return parts


def map_axes(frame: MapFrame, along: bool, title: str = "y [m]") -> list[str]:
    """Ticks at the left, and below where `along`, with the names of the axes."""
    x0, x1, y0, y1 = frame.window
    parts = [svg_words(MAP_LEFT - 48, frame.top - 5, title)]
    ticks = round_ticks(y0, y1, 5)
    for tick, words in zip(ticks, tick_labels(ticks), strict=True):
        height = float(frame.down(tick))
        parts.append(svg_element("path", d=f"M{MAP_LEFT - 5:g},{height:.1f}h4", stroke=COLOUR["muted"]))
        parts.append(svg_words(MAP_LEFT - 8, height + 4, words, "muted", text_anchor="end"))
    ticks = round_ticks(x0, x1, 9) if along else []
    for tick, words in zip(ticks, tick_labels(ticks), strict=True):
        at = float(frame.across(tick))
        parts.append(svg_element("path", d=f"M{at:.1f},{frame.foot + 1:g}v4", stroke=COLOUR["muted"]))
        parts.append(svg_words(at, frame.foot + 18, words, "muted", text_anchor="middle"))
    if along:
        parts.append(svg_words(MAP_RIGHT, frame.foot + 34, "x [m], flow to the right", text_anchor="end"))
    return parts


def outlined(frame: MapFrame, corners: Sequence[Array]) -> list[str]:
    """Outlines (corner, 2) [m] with a light edge, so that they stand out from any colour."""
    parts = []
    for one in corners:
        path = line_through(frame.across(one[:, 0]), frame.down(one[:, 1])) + "Z"
        for colour, width in (("white", 3.0), (EDGE_COLOUR, 1.2)):
            parts.append(svg_element("path", d=path, fill="none", stroke=colour, stroke_width=width))
    return parts


def station_dots(frame: MapFrame, places: Array, radius: float) -> list[str]:
    """Dots at places (station, 2) [m]."""
    return [
        svg_element(
            "circle", cx=float(x), cy=float(y), r=radius, fill=COLOUR["measured"], stroke="white", stroke_width=0.5
        )
        for x, y in zip(frame.across(places[:, 0]), frame.down(places[:, 1]), strict=True)
    ]


def streamlines(frame: MapFrame, x: Array, y: Array, psi: Array, levels: Array) -> list[str]:
    """Lines of equal psi (nx, ny) [m3/s], NaN where dry: in each column where psi first reaches a level."""
    inside = np.flatnonzero((x >= frame.window[0]) & (x <= frame.window[1]))
    columns = inside[:: -(-inside.size // STREAM_POINTS) or 1]
    parts = []
    for level in levels:
        place = first_crossing(y, psi[columns], float(level))
        path = line_through(frame.across(x[columns]), frame.down(place))
        for colour, width, opacity in (("white", 1.4, 0.4), (EDGE_COLOUR, 0.6, 1.0)):
            parts.append(
                svg_element("path", d=path, fill="none", stroke=colour, stroke_width=width, stroke_opacity=opacity)
            )
    return parts


def first_crossing(y: Array, values: Array, level: float) -> Array:
    """Where values (nx, ny) first rise through a level along y, (nx,) [m]; NaN where they do not."""
    reached = np.nan_to_num(values, nan=-np.inf) >= level
    upper = np.argmax(reached, axis=1)
    row, lower = np.arange(len(values)), np.maximum(upper - 1, 0)
    low, high = values[row, lower], values[row, upper]
    with np.errstate(divide="ignore", invalid="ignore"):
        place = y[lower] + (level - low) / (high - low) * (y[upper] - y[lower])
    return np.where(reached.any(axis=1) & (upper > 0), place, np.nan)


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


# Drawn upstream and downstream of the outermost patch and station [m]: room for the wake of a patch.
REACH_MARGIN = 8.0


def plans(run: Run, experiment: str) -> Iterator[Picture]:
    """The reach of patches and stations, and the whole channel."""
    flow, table = run.flow[experiment], run.observations.table
    called = told_apart({name: file_name(name) for name in run.case.experiments})[experiment]
    rows = table[table["experiment"] == experiment]
    stations = rows[["x", "y"]].drop_duplicates().to_numpy(float)
    patches = _outlines(run, experiment)
    places = np.concatenate([stations[:, 0], *[outline.corners[:, 0] for outline in patches]])
    if len(places):
        start, end = places.min() - REACH_MARGIN, places.max() + REACH_MARGIN
        reach = max(float(flow.x[0]), start), min(float(flow.x[-1]), end)
        window = wet_window(flow, reach)
        drawn = draw_reach(flow, window, patches, stations, stamp(run.case))
        alt = f"Plan of depth and velocity around the patches, experiment {experiment}."
        yield published_svg(run, drawn, f"reach-{called}", _reach_caption(run, experiment, window), alt)
    gauges = _gauges(run, rows[rows["kind"] == WATER_LEVEL])
    drawn = draw_plan(flow, patches, stations, gauges, stamp(run.case))
    alt = f"Depth, velocity and water level of experiment {experiment} along the whole channel."
    caption = channel_caption(flow, experiment, _of_engine(run))
    yield published_svg(run, drawn, f"channel-{called}", caption, alt)


def _outlines(run: Run, experiment: str) -> list[Outline]:
    present = np.unique(run.site.patch[planted_cells(run, experiment)])
    patches = [run.case.plants.patches[index] for index in present]
    return [Outline(patch.name, corners_of(run.case, patch)) for patch in patches]


def _reach_caption(run: Run, experiment: str, window: PlanWindow) -> str:
    flow, plants = run.flow[experiment], planted_cells(run, experiment)
    speed = np.hypot(flow.u, flow.v)
    inside = ((flow.x >= window[0]) & (flow.x <= window[1]))[:, None] & np.isfinite(speed)
    moves = ""
    ground = np.isin(run.site.friction_class, np.unique(run.site.friction_class[plants]))
    if (plants & inside).any():
        among, beside = speed[plants & inside].mean(), speed[~plants & inside & ground].mean()
        moves = (
            f" The water moves at {short(among, 2)} m/s among the plants and {short(beside, 2)} m/s on the bed beside."
        )
    scale = scale_in_words(stretch_of(window))
    return (
        f"<b>The reach of patches and stations, experiment {html.escape(experiment)}</b>, {scale}, "
        f"median parameters{_of_engine(run)}.{moves} Between two streamlines flows a tenth of the discharge; dots are "
        "stations."
    )


def scale_in_words(stretch: float) -> str:
    """How a plan is drawn that is so many times wider than at true scale [-]."""
    times = f"{stretch:.2g}"
    return "at true scale" if times == "1" else f"y stretched {times} times"


def _of_engine(run: Run) -> str:
    """Whose flow is drawn, where it is not that of the predictions: a command leaves none to draw."""
    return "" if run.case.engine is None else ", by the built-in engine"


def channel_caption(flow: FlowFields, experiment: str, engine: str) -> str:
    wet = np.isfinite(flow.depth).any(axis=1)
    level, depth = np.nanmean(flow.level[wet], axis=1), np.nanmax(flow.depth[wet], axis=1)
    return (
        f"<b>The whole channel, experiment {html.escape(experiment)}</b> (y stretched{engine}): the water level falls "
        f"{short(level[0] - level[-1], 2)} m over {short(np.ptp(flow.x[wet]))} m, the greatest depth goes from "
        f"{short(depth[0])} to {short(depth[-1])} m."
    )


def _gauges(run: Run, levels: pd.DataFrame) -> Gauges | None:
    if levels.empty:
        return None
    low, high = run.posterior.predicted.model_band[[0, -1]][:, levels.index.to_numpy()]
    x, value, error = (levels[column].to_numpy(float) for column in ("x", "value", "standard_error"))
    return Gauges(x, value, error, low, high)
