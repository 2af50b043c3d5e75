"""The error ladder at one glance: a row for each way of judging, its errors from the first model to the last."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from vegglue.figures.style import COLOUR
from vegglue.figures.svg_text import (
    Scale,
    axis_below,
    linear_scale,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
)
from vegglue.figures.typography import short

# The picture [px], its letters legible on a telephone of 360 px, too; the height of a row, and of the foot.
ROWS_WIDTH, ROWS_LETTERS, ROW_HEIGHT, ROWS_FOOT = 460.0, 13.0, 54.0, 50.0
ROWS_START, ROWS_END = 10.0, 430.0
DOT_RADIUS = 6.5
# Errors closer than this [px] have their numbers on both sides of the dots.
CROWDED = 46.0
# The axis ends this much beyond the largest error: room for its number.
BEYOND = 1.12
# Numbers stand out from what lies under them.
NUMBER_HALO: dict[str, Any] = {"stroke": COLOUR["paper"], "stroke_width": 4, "paint_order": "stroke"}


def draw_error_rows(rows: Mapping[str, Sequence[float]], floor: float, unit: str, title: str) -> str:
    """SVG text. rows: errors of each model in turn, by what they are judged on; floor: the error of measuring, NaN
    unknown; all in one unit.
    """
    shown = np.array([value for values in rows.values() for value in values] + [floor])
    end, foot = BEYOND * float(np.nanmax(shown)), ROW_HEIGHT * len(rows)
    scale = linear_scale(0.0, end, ROWS_START, ROWS_END)
    ticks = round_ticks(0.0, end, 5)
    parts = [*axis_below(scale, ticks, tick_labels(ticks), foot, ROWS_WIDTH, unit), *_floor(scale, floor, foot)]
    for place, (words, values) in enumerate(rows.items()):
        parts += _row(scale, words, values, ROW_HEIGHT * place + 38.0)
    return svg_document(ROWS_WIDTH, foot + ROWS_FOOT, parts, title, ROWS_LETTERS)


def _floor(scale: Scale, floor: float, foot: float) -> list[str]:
    """A line where errors of measuring alone lie, named below the axis, and broken where the words of rows stand."""
    if not np.isfinite(floor):
        return []
    at = float(scale(floor))
    rows = round(foot / ROW_HEIGHT)
    beside_words = "".join(f"M{at:.1f},{ROW_HEIGHT * row + 24:g}v26" for row in range(rows))
    line = svg_element("path", d=f"{beside_words}M{at:.1f},{foot:g}v26", stroke=COLOUR["ink"], stroke_dasharray="3 3")
    words = f"errors of measuring alone: {short(floor, 2)}"
    right = at > 0.5 * ROWS_WIDTH
    return [line, svg_words(at - 5 if right else at + 5, foot + 40, words, text_anchor="end" if right else "start")]


def _row(scale: Scale, words: str, values: Sequence[float], height: float) -> list[str]:
    """From the first model, hollow, to the last, full; those between as strokes."""
    parts = [
        svg_words(0.0, height - 20, words, **NUMBER_HALO),
        svg_element("path", d=f"M{ROWS_START:g},{height:g}H{ROWS_END:g}", stroke=COLOUR["rule"]),
    ]
    known = [float(value) for value in values if np.isfinite(value)]
    if not known:
        return parts
    places = [float(scale(value)) for value in known]
    parts += [
        svg_element("path", d=f"M{a:.1f},{height:g}H{b:.1f}", stroke=COLOUR["narrow"], stroke_width=4)
        for a, b in pairwise(places)
    ]
    parts += [
        svg_element("path", d=f"M{at:.1f},{height - 6:g}v12", stroke=COLOUR["model"], stroke_width=2)
        for at in places[1:-1]
    ]
    if len(known) > 1:
        parts.append(_dot(places[0], height, COLOUR["paper"], "muted"))
        parts.append(_number(places[0], known[0], height, "muted", places[0] < places[-1]))
    parts.append(_dot(places[-1], height, COLOUR["model"], "model"))
    parts.append(_number(places[-1], known[-1], height, "model", len(known) > 1 and places[-1] <= places[0]))
    return parts


def _dot(at: float, height: float, face: str, colour: str) -> str:
    return svg_element("circle", cx=at, cy=height, r=DOT_RADIUS, fill=face, stroke=COLOUR[colour], stroke_width=2.2)


def _number(at: float, value: float, height: float, colour: str, to_the_left: bool) -> str:
    """The error beside its dot, away from the other; over the line between both where there is no room on the left."""
    left = to_the_left and at > CROWDED + ROWS_START
    place, anchor = (at - 11, "end") if left else (at + 11, "start")
    return svg_words(place, height + 5, short(value, 2), colour, text_anchor=anchor, font_weight="bold", **NUMBER_HALO)
