"""Small pictures of sections: measured against modelled, before and after something was added, over the bed and plants.

Each is one SVG text; marks that a page may show or hide carry a class: `before`, `after`, `band`, `cursor`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.report.style import COLOUR
from vegglue.report.svg_text import (
    Scale,
    area_between,
    line_through,
    linear_scale,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
    within_width,
)

# A panel [px]: four of them stand side by side on a screen of 1,200; letters of the size of the captions.
PANEL_WIDTH, PANEL_HEIGHT, PANEL_LETTERS, NOTE_LETTERS = 240.0, 222.0, 11.5, 9.0
PANEL_LEFT, PANEL_RIGHT, PANEL_TOP, PANEL_LOWEST, PANEL_BED_TOP, PANEL_BED_FOOT = 28.0, 236.0, 24.0, 154.0, 160.0, 190.0
PANEL_TICKS = 5
PANEL_TITLE = 186.0  # room of the title [px], beside the unit
FAINT_LINE: dict[str, Any] = {"stroke_width": 0.9, "stroke_dasharray": "2 2.5"}
AXIS_CLEAR = 18.0  # of the name of the axis [px]
LARGE_DOT, SMALL_DOT = 3.6, 2.6
Edges = tuple[Array, Array]  # lower and upper


@dataclass(frozen=True)
class PanelGround:
    """What lies under a section, at cell centres y (cells,): level of the bed [m], and whether plants stand there."""

    y: Array
    bed: Array
    planted: NDArray[np.bool_]


@dataclass(frozen=True)
class SectionPanel:
    """One section of one experiment; (station,) each, ordered by y. error: 95 % of the standard error, NaN unknown;
    aside: set aside or not used; before: None where nothing was added; band: 95 % of the posterior, if any; core and
    total: 50 %, and 95 % with the residual error, where they are to be seen [SI].
    """

    title: str
    y: Array
    measured: Array
    error: Array
    aside: NDArray[np.bool_]
    before: Array | None
    after: Array
    band: Edges | None
    core: Edges | None
    total: Edges | None
    ground: PanelGround


@dataclass(frozen=True)
class DrawnPanel:
    """A panel as SVG text, and where its stations are in it [px]: across, and down of each line, NaN where unknown."""

    svg: str
    across: Array
    down: dict[str, Array]


def value_range(panels: Sequence[SectionPanel]) -> tuple[float, float]:
    """The range of values that holds all panels, from zero on where nothing flows back [unit of the values]."""
    values = np.concatenate([part for panel in panels for part in _all_values(panel)])
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    low = min(low, 0.0) if low < 0.4 * high else low
    margin = 0.06 * max(high - low, 1e-3)
    return (low - margin if low else 0.0), high + margin


def _all_values(panel: SectionPanel) -> list[Array]:
    error = np.nan_to_num(panel.error)
    edges = [edge for pair in (panel.band, panel.total) if pair is not None for edge in pair]
    before = [] if panel.before is None else [panel.before]
    return [panel.measured - error, panel.measured + error, panel.after, *before, *edges]


def draw_panel(panel: SectionPanel, values: tuple[float, float], unit: str, note: str = "") -> DrawnPanel:
    """The panel with values (low, high) from foot to head; note: in its corner."""
    margin = 0.08 * float(np.ptp(panel.y)) + 0.1
    ends = float(panel.y.min()) - margin, float(panel.y.max()) + margin
    across, down = linear_scale(*ends, PANEL_LEFT, PANEL_RIGHT), linear_scale(*values, PANEL_LOWEST, PANEL_TOP)
    parts = [
        *_ground(panel.ground, across, ends),
        *_axes(across, down, ends, values, unit),
        *_lines(panel, across, down),
        *_points(panel, across, down),
        _cursor(),
        svg_words(0.0, 13.0, within_width(panel.title, PANEL_TITLE, PANEL_LETTERS), font_weight="bold"),
        svg_words(PANEL_RIGHT, PANEL_HEIGHT - 3, note, "muted", font_size=NOTE_LETTERS, text_anchor="end"),
    ]
    places = {"measured": down(panel.measured), "after": down(panel.after)}
    if panel.before is not None:
        places["before"] = down(panel.before)
    svg = svg_document(PANEL_WIDTH, PANEL_HEIGHT, parts, panel.title, PANEL_LETTERS)
    return DrawnPanel(svg, across(panel.y), places)


def _axes(across: Scale, down: Scale, ends: tuple[float, float], values: tuple[float, float], unit: str) -> list[str]:
    parts = []
    ticks = round_ticks(*values, PANEL_TICKS)
    for tick, words in zip(ticks, tick_labels(ticks), strict=True):
        height = float(down(tick))
        parts.append(
            svg_element(
                "path", d=f"M{PANEL_LEFT:g},{height:.1f}H{PANEL_RIGHT:g}", stroke=COLOUR["rule"], stroke_width=0.7
            )
        )
        parts.append(svg_words(PANEL_LEFT - 5, height + 4, words, "muted", text_anchor="end"))
    places = [tick for tick in round_ticks(*ends, PANEL_TICKS) if across(tick) > PANEL_LEFT + AXIS_CLEAR]
    for tick, words in zip(places, tick_labels(places), strict=True):
        at = float(across(tick))
        parts.append(svg_element("path", d=f"M{at:.1f},{PANEL_BED_FOOT:g}v4", stroke=COLOUR["muted"], stroke_width=0.7))
        parts.append(svg_words(at, PANEL_BED_FOOT + 16, words, "muted", text_anchor="middle"))
    parts.append(svg_words(PANEL_RIGHT, 13.0, unit, "muted", text_anchor="end"))
    parts.append(svg_words(0.0, PANEL_BED_FOOT + 16, "y [m]", "muted"))
    return parts


def _ground(ground: PanelGround, across: Scale, ends: tuple[float, float]) -> list[str]:
    """The bed in a strip below, and the plants as shaded stretches through the panel."""
    step = float(ground.y[1] - ground.y[0])
    near = (ground.y > ends[0] - step) & (ground.y < ends[1] + step)
    y, bed = np.clip(ground.y[near], *ends), ground.bed[near]
    rise = max(float(np.ptp(bed)), 0.2)
    level = linear_scale(float(bed.min()) - 0.25 * rise, float(bed.min()) + rise, PANEL_BED_FOOT, PANEL_BED_TOP)
    x = across(y)
    parts = [
        svg_element("path", d=area_between(x, np.full(x.size, PANEL_BED_FOOT), level(bed)), fill=COLOUR["earth"]),
    ]
    planted = ground.planted[near].astype(int)
    starts = np.flatnonzero(np.diff(np.r_[0, planted, 0]) == 1)
    stops = np.flatnonzero(np.diff(np.r_[0, planted, 0]) == -1) - 1
    for start, stop in zip(starts, stops, strict=True):
        edges = across(np.clip(np.array([y[start] - 0.5 * step, y[stop] + 0.5 * step]), *ends))
        left, width = float(edges[0]), float(edges[1] - edges[0])
        parts.append(
            svg_element(
                "rect",
                x=left,
                y=PANEL_TOP,
                width=width,
                height=PANEL_BED_FOOT - PANEL_TOP,
                fill=COLOUR["plants"],
                opacity=0.45,
            )
        )
        parts.append(
            svg_words(left + 0.5 * width, PANEL_BED_TOP + 8, "plants", "stems", text_anchor="middle", font_size=10)
        )
    return parts


def _lines(panel: SectionPanel, across: Scale, down: Scale) -> list[str]:
    x = across(panel.y)
    parts = []
    for edges, colour in ((panel.band, "wide"), (panel.core, "narrow")):
        if edges is not None:
            area = area_between(x, down(edges[0]), down(edges[1]))
            parts.append(svg_element("path", class_="band", d=area, fill=COLOUR[colour]))
    for edge in panel.total or ():
        parts.append(
            svg_element("path", d=line_through(x, down(edge)), fill="none", stroke=COLOUR["model"], **FAINT_LINE)
        )
    if panel.before is not None:
        parts.append(
            svg_element(
                "path", class_="before", d=line_through(x, down(panel.before)), fill="none", stroke=COLOUR["muted"],
                stroke_width=1.8, stroke_dasharray="5 3",
            )
        )  # fmt: skip
    parts.append(
        svg_element(
            "path", class_="after", d=line_through(x, down(panel.after)), fill="none", stroke=COLOUR["model"],
            stroke_width=2,
        )
    )  # fmt: skip
    return parts


def _points(panel: SectionPanel, across: Scale, down: Scale) -> list[str]:
    """Measured values with their errors; hollow and crossed where they do not count."""
    parts = []
    for y, value, error, aside in zip(panel.y, panel.measured, panel.error, panel.aside, strict=True):
        if not np.isfinite(value):
            continue
        x, middle = float(across(y)), float(down(value))
        if np.isfinite(error):
            low, high = float(down(value - error)), float(down(value + error))
            parts.append(
                svg_element("path", d=f"M{x:.1f},{low:.1f}V{high:.1f}", stroke=COLOUR["measured"], stroke_width=1)
            )
        face = COLOUR["paper"] if aside else COLOUR["measured"]
        parts.append(svg_element("circle", cx=x, cy=middle, r=SMALL_DOT, fill=face, stroke=COLOUR["measured"]))
        if aside:
            cross = f"M{x - 5:.1f},{middle - 5:.1f}l10,10m0,-10l-10,10"
            parts.append(svg_element("path", d=cross, stroke=COLOUR["ink"], stroke_width=1.3))
    return parts


def _cursor() -> str:
    """What a page moves to the station that is read, hidden until then."""
    line = svg_element("path", d=f"M0,{PANEL_TOP:g}V{PANEL_BED_FOOT:g}", stroke=COLOUR["ink"], stroke_width=0.8)
    rings = "".join(
        svg_element("circle", class_=name, r=LARGE_DOT + 1.5, fill="none", stroke=COLOUR[colour], stroke_width=1.8)
        for name, colour in (("measured", "measured"), ("before", "muted"), ("after", "model"))
    )
    return svg_element("g", line + rings, class_="cursor", visibility="hidden")
