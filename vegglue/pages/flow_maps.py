"""Maps of the flow of the median parameters as SVG: depth, velocity, streamlines, patches, stations, water level."""

import base64
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import matplotlib
import numpy as np
from matplotlib.image import imsave

from vegglue.arrays import Array
from vegglue.case.text_files import told_apart
from vegglue.case.zones import corners_of
from vegglue.flow.sensor import FlowFields
from vegglue.measurements.kinds import WATER_LEVEL
from vegglue.normal_range import NORMAL95
from vegglue.pages.run import SYNTHETIC, Run, file_name, is_synthetic, planted_cells, published_picture
from vegglue.pages.style import EDGE_COLOUR, Picture
from vegglue.pages.svg import (
    COLOUR,
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
from vegglue.wording.sentences import phrase

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
    share = shown.T[::-1] / most
    painted = matplotlib.colormaps[colours](np.nan_to_num(share), bytes=True)
    painted[~np.isfinite(share), 3] = 0
    file = BytesIO()
    imsave(file, painted, format="png")
    picture = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
    name = f"frame-{frame.top:g}"
    clip = svg_element("rect", x=MAP_LEFT, y=frame.top, width=MAP_RIGHT - MAP_LEFT, height=frame.foot - frame.top)
    image = svg_element(
        "image", x=float(ends[0]), y=float(edges[0]), width=float(ends[1] - ends[0]), height=float(edges[1] - edges[0]),
        preserveAspectRatio="none", style="image-rendering:pixelated", href=picture, clip_path=f"url(#{name})",
    )  # fmt: skip
    parts = [svg_element("clipPath", clip, id=name), image]
    left, step = MAP_RIGHT + 14, (frame.foot - frame.top) / BAR_STEPS
    palette = matplotlib.colormaps[colours]((np.arange(BAR_STEPS) + 0.5) / BAR_STEPS, bytes=True)
    for k, (red, green, blue, _) in enumerate(palette.tolist()):
        fill, top = f"rgb({red},{green},{blue})", frame.foot - (k + 1) * step
        parts.append(svg_element("rect", x=left, y=top, width=BAR_WIDTH, height=step + 0.5, fill=fill))
    height, ticks = linear_scale(0.0, most, frame.foot, frame.top), round_ticks(0.0, most, 4)
    for tick, words in zip(ticks, tick_labels(ticks), strict=True):
        parts.append(svg_words(left + BAR_WIDTH + 5, float(height(tick)) + 4, words, "muted"))
    return [*parts, svg_words(MAP_TOTAL, frame.top - 5, title, text_anchor="end")]


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
        parts.append(svg_words(MAP_RIGHT, frame.foot + 34, phrase("label", "along"), text_anchor="end"))
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
# Parts of equal discharge [-] between drawn streamlines; captions state a tenth.
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
    return max(1.0, LEAST_HEIGHT / true_height(window))


def true_height(window: PlanWindow) -> float:
    """Height of a window as wide as the map at true scale [px]."""
    x0, x1, y0, y1 = window
    return (MAP_RIGHT - MAP_LEFT) * (y1 - y0) / (x1 - x0)


def draw_reach(
    flow: FlowFields, window: PlanWindow, patches: Sequence[Outline], stations: Array, note: str = ""
) -> str:
    """SVG text: depth and velocity of a reach; between two streamlines flows a tenth of the water. See `stretch_of`.

    stations: x, y (station, 2) [m]; note: in the corner.
    """
    tall, speed = stretch_of(window) * true_height(window), np.hypot(flow.u, flow.v)
    upper, lower = MapFrame(window, HEAD, HEAD + tall), MapFrame(window, HEAD + tall + GAP, HEAD + 2 * tall + GAP)
    parts = [
        *coloured_cells(upper, flow.x, flow.y, flow.depth, "viridis_r", "depth [m]"),
        *coloured_cells(lower, flow.x, flow.y, speed, "cividis", "velocity [m/s]"),
    ]
    psi = stream_function(flow)
    middle = psi[len(flow.x) // 2]
    levels = np.linspace(middle.min(), middle.max(), STREAM_TUBES + 1)[1:-1]
    parts += streamlines(lower, flow.x, flow.y, np.where(np.isfinite(flow.depth), psi, np.nan), levels)
    for frame in (upper, lower):
        parts += [
            *outlined(frame, [one.corners for one in patches]),
            *station_dots(frame, stations, float(np.clip(0.03 * tall, 1.3, 3.2))),
        ]
    for one in patches:
        place = float(upper.across(one.corners[:, 0].max())) + 5, float(upper.down(one.corners[:, 1].mean())) + 4
        halo: dict[str, Any] = {"stroke": COLOUR["paper"], "stroke_width": 3.0, "paint_order": "stroke"}
        parts.append(svg_words(*place, one.name, **halo))
    parts += [
        *map_axes(upper, along=False),
        *map_axes(lower, along=True),
        svg_words(MAP_TOTAL, lower.foot + BELOW - 4, note, "muted", text_anchor="end"),
    ]
    return svg_document(MAP_TOTAL, lower.foot + BELOW, parts, "Depth and velocity", MAP_LETTERS)


def draw_plan(
    flow: FlowFields, patches: Sequence[Outline], stations: Array, gauges: Gauges | None, note: str = ""
) -> str:
    """SVG text: the whole channel, depth, velocity (y stretched), and bed and water level along the deepest line."""
    window = wet_window(flow, (float(flow.x[0]), float(flow.x[-1])))
    tops, speed = [HEAD + place * (STRETCHED + GAP) for place in range(3)], np.hypot(flow.u, flow.v)
    maps = [MapFrame(window, top, top + STRETCHED) for top in tops[:2]]
    parts = [
        *coloured_cells(maps[0], flow.x, flow.y, flow.depth, "viridis_r", "depth [m]"),
        *coloured_cells(maps[1], flow.x, flow.y, speed, "cividis", "velocity [m/s]"),
    ]
    for frame in maps:
        parts += [*outlined(frame, [one.corners for one in patches]), *station_dots(frame, stations, 2.0)]
        parts += map_axes(frame, along=False)
    foot = tops[2] + PROFILE
    parts += draw_levels(flow, gauges, (tops[2], foot))
    parts += [svg_words(MAP_TOTAL, foot + BELOW - 4, note, "muted", text_anchor="end")]
    return svg_document(MAP_TOTAL, foot + BELOW, parts, "The whole channel", MAP_LETTERS)


def draw_levels(flow: FlowFields, gauges: Gauges | None, heights: tuple[float, float]) -> list[str]:
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
        svg_words(MAP_LEFT + 10, frame.foot - 8, phrase("label", "deepest")),
    ]
    parts += map_axes(frame, along=True, title="level [m]")
    if gauges is None:
        return parts
    error = NORMAL95 * np.nan_to_num(gauges.standard_error)
    for k, at in enumerate(frame.across(gauges.x)):
        if not np.isfinite(gauges.value[k]):
            continue
        low, high = (float(frame.down(edge[k])) for edge in (gauges.low, gauges.high))
        if np.isfinite(low) and np.isfinite(high):
            band = f"M{at:.1f},{low:.1f}V{high:.1f}"
            parts.append(svg_element("path", d=band, stroke=COLOUR["narrow"], stroke_width=6))
        below, head = (float(frame.down(gauges.value[k] + side * error[k])) for side in (-1, 1))
        parts.append(svg_element("path", d=f"M{at:.1f},{below:.1f}V{head:.1f}", stroke=COLOUR["measured"]))
        parts.append(svg_element("circle", cx=float(at), cy=0.5 * (below + head), r=3.6, fill=COLOUR["measured"]))
    last = float(frame.across(gauges.x[0])) + 8, float(frame.down(gauges.value[0])) + 16
    return [*parts, svg_words(*last, "gauges", "measured")]


# Drawn upstream and downstream of the outermost patch and station [m]: room for the wake of a patch.
REACH_MARGIN = 8.0


def plans(run: Run, experiment: str) -> Iterator[Picture]:
    """The reach of patches and stations, and the whole channel."""
    flow, table, planted = run.flow[experiment], run.observations.table, planted_cells(run, experiment)
    called = told_apart({name: file_name(name) for name in run.case.experiments})[experiment]
    rows, built_in = table[table["experiment"] == experiment], run.case.of_another_model
    stations, note = rows[["x", "y"]].drop_duplicates().to_numpy(float), SYNTHETIC if is_synthetic(run.case) else ""
    here = [run.case.plants.patches[index] for index in np.unique(run.site.patch[planted])]
    patches = [Outline(patch.name, corners_of(run.case, patch)) for patch in here]
    places = np.concatenate([stations[:, 0], *[outline.corners[:, 0] for outline in patches]])
    if len(places):
        start, end = places.min() - REACH_MARGIN, places.max() + REACH_MARGIN
        window = wet_window(flow, (max(float(flow.x[0]), start), min(float(flow.x[-1]), end)))
        drawn = draw_reach(flow, window, patches, stations, note)
        speeds = speeds_of(flow, window, planted, run.site.friction_class)
        said = experiment, stretch_of(window), built_in, *speeds
        yield published_picture(run, drawn, f"reach-{called}", "caption_reach", *said)
    gauges, levels = None, rows[rows["kind"] == WATER_LEVEL]
    if len(levels):
        low, high = run.posterior.predicted.model_band[[0, -1]][:, levels.index.to_numpy()]
        x, value, error = (levels[name].to_numpy(float) for name in ("x", "value", "standard_error"))
        gauges = Gauges(x, value, error, low, high)
    drawn = draw_plan(flow, patches, stations, gauges, note)
    wet = np.isfinite(flow.depth).any(axis=1)
    level, depth = np.nanmean(flow.level[wet], axis=1), np.nanmax(flow.depth[wet], axis=1)
    along = level[0] - level[-1], float(np.ptp(flow.x[wet])), depth[0], depth[-1]
    yield published_picture(run, drawn, f"channel-{called}", "caption_channel", experiment, built_in, *along)


def speeds_of(
    flow: FlowFields, window: PlanWindow, planted: np.ndarray, friction_class: np.ndarray
) -> tuple[float | None, float | None]:
    """Mean speed [m/s] among the plants of a window, and on like bed beside them; None without plants."""
    speed = np.hypot(flow.u, flow.v)
    inside = ((flow.x >= window[0]) & (flow.x <= window[1]))[:, None] & np.isfinite(speed)
    ground = np.isin(friction_class, np.unique(friction_class[planted]))
    if not (planted & inside).any():
        return None, None
    return float(speed[planted & inside].mean()), float(speed[~planted & inside & ground].mean())
