"""Pictures written as SVG text, of which a page needs many, and the palette of all pictures.

Every colour of the palette is drawn as a fixed light-mode value, so a file on disk stands on its own; in the page the
same values become CSS variables, which the page sets for light and for dark.
"""

import html
import math
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from vegglue.arrays import Array
from vegglue.wording.numbers import decimals, fixed

# name: (light, dark). Blue for the model, vermilion for measurements: distinct in every common colour blindness.
PALETTE = {
    "paper": ("#fefefe", "#15181c"),
    "ink": ("#1d2126", "#e9ebee"),
    "muted": ("#626b76", "#a3acb7"),
    "rule": ("#dde1e6", "#333a42"),
    "prior": ("#c6ccd3", "#4a525c"),
    "wide": ("#d5e4f2", "#1d3850"),
    "narrow": ("#9fc4e4", "#2f6491"),
    "model": ("#1c5d99", "#86c0f3"),
    "measured": ("#c4461b", "#ff8d5c"),
    "plants": ("#a9d3bd", "#2d5b49"),
    "stems": ("#1d6b4f", "#83cfae"),
    "earth": ("#cbbfae", "#4b443b"),
    "water": ("#e4f0f7", "#1c2d38"),
}
COLOUR = {name: light for name, (light, _) in PALETTE.items()}


def inline(svg: str, name: str, alt: str) -> str:
    """An SVG file as a part of a page: no prologue or metadata, ids of its own, colours of the page, a spoken text."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"<title>.*?</title>", "", body, flags=re.DOTALL)
    used = set(re.findall(r"(?:href=\"#|url\(#)([^\")]+)", body))
    body = re.sub(r' id="([^"]+)"', lambda found: f' id="{name}-{found[1]}"' if found[1] in used else "", body)
    body = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", body)
    for key, colour in COLOUR.items():
        body = body.replace(colour, f"var(--{key})")
    spoken = html.escape(alt, quote=True)
    body = re.sub(r"\n\s*", "\n", body)
    opening = re.compile(r'<svg[^>]*?(viewBox="[^"]+")[^>]*>')
    return opening.sub(lambda found: f'<svg role="img" aria-label="{spoken}" {found[1]}>', body, count=1)


def palette_css() -> tuple[str, str]:
    """The palette as CSS variables: light, dark."""
    light, dark = (";".join(f"--{name}:{pair[i]}" for name, pair in PALETTE.items()) for i in (0, 1))
    return light, dark


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


def axis_below(scale: Scale, ticks: Sequence[float], labels: Sequence[str], foot: float) -> list[str]:
    """Strokes and numbers below rows that end `foot` px down."""
    parts = []
    for tick, words in zip(ticks, labels, strict=True):
        at = float(scale(tick))
        parts.append(svg_element("path", d=f"M{at:.1f},{foot:g}v5", stroke=COLOUR["muted"]))
        anchor = "start" if at < 2.0 * CLOSE_TO_THE_EDGE else "middle"
        place = max(at - CLOSE_TO_THE_EDGE, 0.0) if anchor == "start" else at
        parts.append(svg_words(place, foot + 19, words, "muted", text_anchor=anchor))
    return parts


def _written(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)
