"""Small pictures written as SVG text: elements, scales and ticks, for figures that a page needs many of.

Colours are those of the palette; `style.inline` makes a picture follow the page it stands in.
"""

import html
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.pages.style import COLOUR
from vegglue.wording.numbers import decimals, fixed

Scale = Callable[[Any], Array]  # values to places [px]
# A number this near to the left edge [px] begins there instead of standing amid its stroke.
CLOSE_TO_THE_EDGE = 10.0
# Width of a letter over its size [-]: the mean of names and numbers in bold Helvetica, so that plain ones have room.
LETTER_WIDTH = 0.58
# Fewer numbers on an axis show no scale.
FEWEST_TICKS = 2
FACE = "system-ui, 'Liberation Sans', Helvetica, Arial, sans-serif"


def svg_element(tag: str, content: str = "", **attributes: object) -> str:
    """One element; an underscore at the end or within a name of an attribute stands for nothing or for a hyphen."""
    given = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{html.escape(_written(value), quote=True)}"'
        for name, value in attributes.items()
    )
    return f"<{tag}{given}>{content}</{tag}>" if content else f"<{tag}{given}/>"


def svg_words(x: float, y: float, text: str, colour: str = "ink", **attributes: object) -> str:
    """Words at a place [px], in a colour of the palette."""
    return svg_element("text", html.escape(text), x=x, y=y, fill=COLOUR[colour], **attributes)


def within_width(words: str, width: float, size: float) -> str:
    """Words that fit in a width [px] in letters of a size [px]: without their middle where they are too long, as names
    differ at their ends.
    """
    most = int(width / (LETTER_WIDTH * size))
    if len(words) <= most:
        return words
    half = (most - 1) // 2
    return f"{words[:half].rstrip()}…{words[len(words) - half :].lstrip()}"


def svg_document(width: float, height: float, content: Iterable[str], title: str, size: float) -> str:
    """A picture of so many px, its letters `size` px high, spoken of as the title."""
    # A page keeps nothing of the outermost element but its view: the letters are those of a group.
    return svg_element(
        "svg",
        svg_element("title", html.escape(title)) + svg_element("g", "".join(content), font_family=FACE, font_size=size),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {_written(width)} {_written(height)}",
        width=width,
        height=height,
    )


def line_through(x: Array, y: Array) -> str:
    """The path of a line, broken where a coordinate is no number."""
    pieces, pen = [], "M"
    for across, down in zip(x, y, strict=True):
        if not (math.isfinite(across) and math.isfinite(down)):
            pen = "M"
            continue
        pieces.append(f"{pen}{_written(float(across))},{_written(float(down))}")
        pen = "L"
    return "".join(pieces)


def area_between(x: Array, low: Array, high: Array) -> str:
    """The path of the area between two lines, without the places where one is no number."""
    known = np.isfinite(low) & np.isfinite(high)
    if known.sum() < 2:
        return ""
    return line_through(np.r_[x[known], x[known][::-1]], np.r_[high[known], low[known][::-1]]) + "Z"


def linear_scale(low: float, high: float, start: float, end: float) -> Scale:
    """low to high [any unit] onto start to end [px]."""
    slope = (end - start) / (high - low)
    return lambda value: start + slope * (np.asarray(value, float) - low)


def round_ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers from low to high, at most so many."""
    rough = (high - low) / max(most - 1, 1)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 5, 10, 20) if (high - low) / (factor * power) < most)
    first = math.ceil(low / step - 1e-9)
    return [step * k for k in range(first, math.floor(high / step + 1e-9) + 1)]


def tick_labels(ticks: Sequence[float]) -> list[str]:
    """Each with as many decimals as the step between them needs."""
    places = decimals(ticks[1] - ticks[0], 1) if len(ticks) > 1 else 2
    return [fixed(value, places) for value in ticks]


def axis_below(
    scale: Scale, ticks: Sequence[float], labels: Sequence[str], foot: float, width: float, unit: str
) -> list[str]:
    """Strokes and numbers below rows that end `foot` px down, the unit at the right of a picture `width` px wide."""
    parts = [svg_words(width, foot + 19, unit, "muted", text_anchor="end")] if unit else []
    for tick, words in zip(ticks, labels, strict=True):
        at = float(scale(tick))
        parts.append(svg_element("path", d=f"M{at:.1f},{foot:g}v5", stroke=COLOUR["muted"]))
        anchor = "start" if at < 2.0 * CLOSE_TO_THE_EDGE else "middle"
        place = max(at - CLOSE_TO_THE_EDGE, 0.0) if anchor == "start" else at
        parts.append(svg_words(place, foot + 19, words, "muted", text_anchor=anchor))
    return parts


def _written(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)
