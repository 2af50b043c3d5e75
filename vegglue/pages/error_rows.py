"""The error ladder at one glance: a row for each way of judging, its errors from the first model to the last."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from vegglue.pages.style import COLOUR
from vegglue.pages.svg import (
    Scale,
    axis_below,
    linear_scale,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
)
from vegglue.pages.typography import short

# The picture [px], its letters legible on a telephone of 360 px, too; the height of a row, and of the foot.
ROWS_WIDTH, ROWS_LETTERS, ROW_HEIGHT, ROWS_FOOT = 460.0, 13.0, 54.0, 50.0
ROWS_START, ROWS_END = 24.0, 430.0
DOT_RADIUS = 6.5
# Width of a digit of a number [px], bold; from the middle of a dot to its number; and the height of the dots in a row.
DIGIT, ASIDE, DOTS_IN_ROW = 8.0, 11.0, 38.0
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
    crossed = [_crossed(scale, values, floor) for values in rows.values()]
    parts = [*axis_below(scale, ticks, tick_labels(ticks), foot, ROWS_WIDTH, unit), *_floor(scale, floor, crossed)]
    for place, (words, values) in enumerate(rows.items()):
        parts += _row(scale, words, values, ROW_HEIGHT * place + DOTS_IN_ROW)
    return svg_document(ROWS_WIDTH, foot + ROWS_FOOT, parts, title, ROWS_LETTERS)


def _floor(scale: Scale, floor: float, crossed: Sequence[bool]) -> list[str]:
    """A line where errors of measuring alone lie, named below the axis; broken where words of a row stand, and where a
    number does: crossed, of each row.
    """
    if not np.isfinite(floor):
        return []
    at, foot = float(scale(floor)), ROW_HEIGHT * len(crossed)
    tops = [ROW_HEIGHT * row + 24 for row in range(len(crossed))]
    pieces = "".join(
        f"M{at:.1f},{top:g}v6M{at:.1f},{top + 22:g}v4" if broken else f"M{at:.1f},{top:g}v26"
        for top, broken in zip(tops, crossed, strict=True)
    )
    line = svg_element("path", d=f"{pieces}M{at:.1f},{foot:g}v26", stroke=COLOUR["ink"], stroke_dasharray="3 3")
    words = f"errors of measuring alone: {short(floor, 2)}"
    right = at > 0.5 * ROWS_WIDTH
    return [line, svg_words(at - 5 if right else at + 5, foot + 40, words, text_anchor="end" if right else "start")]


def _crossed(scale: Scale, values: Sequence[float], floor: float) -> bool:
    """Whether a number of a row stands where the errors of measuring lie."""
    at = float(scale(floor))
    for place, value, to_the_left in _numbered(scale, values):
        start, anchor = _beside(place, value, to_the_left)
        width = DIGIT * len(short(value, 2))
        left = start - width if anchor == "end" else start
        if left - 2 <= at <= left + width + 2:
            return True
    return False


def _numbered(scale: Scale, values: Sequence[float]) -> list[tuple[float, float, bool]]:
    """Place [px] and value of the first and the last known error of a row, and whether its number is to the left."""
    known = [float(value) for value in values if np.isfinite(value)]
    if not known:
        return []
    first, last = float(scale(known[0])), float(scale(known[-1]))
    ends = [(last, known[-1], len(known) > 1 and last <= first)]
    return [(first, known[0], first < last), *ends] if len(known) > 1 else ends


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
    *before, (last, value, to_the_left) = _numbered(scale, values)
    for first, error, left in before:
        parts.append(_dot(first, height, COLOUR["paper"], "muted"))
        parts.append(_number(first, error, height, "muted", left))
    parts.append(_dot(last, height, COLOUR["model"], "model"))
    parts.append(_number(last, value, height, "model", to_the_left))
    return parts


def _dot(at: float, height: float, face: str, colour: str) -> str:
    return svg_element("circle", cx=at, cy=height, r=DOT_RADIUS, fill=face, stroke=COLOUR[colour], stroke_width=2.2)


def _number(at: float, value: float, height: float, colour: str, to_the_left: bool) -> str:
    place, anchor = _beside(at, value, to_the_left)
    return svg_words(place, height + 5, short(value, 2), colour, text_anchor=anchor, font_weight="bold", **NUMBER_HALO)


def _beside(at: float, value: float, to_the_left: bool) -> tuple[float, str]:
    """Where a number begins or ends beside its dot, away from the other; to the right where there is no room."""
    room = at - ASIDE >= DIGIT * len(short(value, 2))
    return (at - ASIDE, "end") if to_the_left and room else (at + ASIDE, "start")
