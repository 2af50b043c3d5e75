"""One parameter in several posteriors at one glance: medians and 95 % ranges row by row, and values of others."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.report.style import COLOUR
from vegglue.report.svg_text import (
    FEWEST_TICKS,
    Scale,
    axis_below,
    linear_scale,
    round_ticks,
    svg_document,
    svg_element,
    svg_words,
    tick_labels,
    within_width,
)

# The picture [px], legible on a telephone of 360 px; the height of a row, of its words in it, and of the foot.
INTERVALS_WIDTH, INTERVALS_LETTERS, ROW, WORDS, FOOT = 460.0, 13.0, 40.0, 18.0, 28.0
START, END = 12.0, 440.0
# Share of the range that stays free beyond its ends.
FREE_BEYOND = 0.06
# Range of an axis with one value, over that value: enough for round numbers on both sides of it.
ALONE = 0.1


@dataclass(frozen=True)
class DrawnInterval:
    """A value and the range it is given; both ends are the value where nobody said. others: not a posterior of ours."""

    low: float
    centre: float
    high: float
    others: bool = False


def draw_interval_rows(rows: Mapping[str, DrawnInterval], logarithmic: bool, title: str) -> str:
    """SVG text. rows: intervals of one unit by what they are of; logarithmic: equal ratios are equally long."""
    known = np.array([value for row in rows.values() for value in (row.low, row.centre, row.high)])
    ends = np.log10([known.min(), known.max()]) if logarithmic else np.array([known.min(), known.max()])
    spread = float(ends[1] - ends[0])
    if spread <= 1e-6 * abs(float(ends[1])):  # one value alone
        spread = ALONE * abs(float(ends[1])) or ALONE
    low, high = float(ends[0]) - FREE_BEYOND * spread, float(ends[1]) + FREE_BEYOND * spread
    place = linear_scale(low, high, START, END)

    def scale(value: Any) -> Array:
        return place(np.log10(value) if logarithmic else value)

    foot = ROW * len(rows) + 6.0
    ticks = _powers(low, high) if logarithmic else round_ticks(low, high, 6)
    labels = [f"{tick:.4g}" for tick in ticks]
    if not logarithmic or len(set(labels)) < len(labels):
        labels = tick_labels(ticks)
    parts = axis_below(scale, ticks, labels, foot, INTERVALS_WIDTH, "")
    for number, (words, row) in enumerate(rows.items()):
        parts += _row(scale, words, row, ROW * number + WORDS)
    return svg_document(INTERVALS_WIDTH, foot + FOOT, parts, title, INTERVALS_LETTERS)


def _powers(low: float, high: float) -> list[float]:
    """Powers of ten from 10^low to 10^high, with 2 and 5 times them where they are few; else round numbers."""
    factors = (1.0, 2.0, 5.0) if high - low < 2.0 else (1.0,)
    powers = range(int(np.floor(low)), int(np.ceil(high)) + 1)
    values = [factor * 10.0**power for power in powers for factor in factors]
    inside = [value for value in values if low <= np.log10(value) <= high]
    return inside if len(inside) >= FEWEST_TICKS else round_ticks(10.0**low, 10.0**high, 5)


def _row(scale: Scale, words: str, row: DrawnInterval, height: float) -> list[str]:
    """Words above a line from low to high with its centre: a dot of ours, a diamond of others."""
    colour = "measured" if row.others else "model"
    shown = within_width(words, INTERVALS_WIDTH, INTERVALS_LETTERS)
    parts = [svg_words(0.0, height - 4, shown, "muted" if row.others else "ink")]
    centre, level = float(scale(row.centre)), height + 9.0
    if row.high > row.low:
        line = f"M{float(scale(row.low)):.1f},{level:g}H{float(scale(row.high)):.1f}"
        dashes = {"stroke_dasharray": "5 3"} if row.others else {}
        parts.append(svg_element("path", d=line, stroke=COLOUR[colour], stroke_width=3, **dashes))
    if row.others:
        diamond = f"M{centre:.1f},{level - 6:g}l6,6l-6,6l-6,-6z"
        parts.append(svg_element("path", d=diamond, fill=COLOUR["paper"], stroke=COLOUR[colour], stroke_width=2))
    else:
        parts.append(svg_element("circle", cx=centre, cy=level, r=6.0, fill=COLOUR[colour]))
    return parts
