"""Maps of a field of the flow as SVG: coloured cells, patches, stations and streamlines over their axes."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO

import matplotlib
import numpy as np
from matplotlib.image import imsave

from vegglue.arrays import Array
from vegglue.report.style import COLOUR, EDGE_COLOUR
from vegglue.report.svg_text import Scale, line_through, linear_scale, round_ticks, svg_element, svg_words, tick_labels

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
