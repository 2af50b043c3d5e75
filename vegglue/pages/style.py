"""How figures look: one palette, one face, and pictures that follow the page they stand in (light, dark, paper); and
small pictures written as SVG text, of which a page needs many.

Every colour of the palette is drawn as a fixed light-mode value, so a file on disk stands on its own; in the page the
same values become CSS variables, which the page sets for light and for dark.
"""

import html
import math
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import wraps
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib
import numpy as np
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from vegglue.arrays import Array
from vegglue.whole_files import write_file
from vegglue.wording.numbers import decimals, fixed
from vegglue.wording.remedies import MAKE_ROOM

Drawing = ParamSpec("Drawing")
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
EDGE_COLOUR = "#101010"  # lines over a coloured field: the same on a light and on a dark page
WIDTH, HEIGHT = 4.7, 3.1  # one column of the page [inch]
SMALL = 7.5  # direct labels [pt]


def _settings() -> dict[str, Any]:
    # The first of some sober faces that is installed; DejaVu Sans comes with matplotlib and fills missing glyphs.
    installed = {font.name for font in font_manager.fontManager.ttflist}
    wanted = ("Source Sans 3", "Inter", "Helvetica", "Arial", "Liberation Sans")
    face = [*[name for name in wanted if name in installed][:1], "DejaVu Sans"]
    ink, muted = COLOUR["ink"], COLOUR["muted"]
    return {
        "font.family": face,
        "font.size": 9,
        # A name, title or section may hold any sign: it is no formula. Those that are stand in `formula_labels`.
        "text.parse_math": False,
        "mathtext.fontset": "custom",
        "mathtext.rm": face[0],
        "mathtext.it": f"{face[0]}:italic",
        "mathtext.cal": face[0],  # never used; its own default is seldom installed, and then complained about
        "mathtext.fallback": "stixsans",
        "text.color": ink,
        "axes.labelcolor": ink,
        "axes.edgecolor": muted,
        "axes.facecolor": "none",
        "axes.linewidth": 0.7,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.titlesize": 9.5,
        "axes.titlelocation": "left",
        "axes.titleweight": "bold",
        "axes.grid": False,
        "axes.axisbelow": True,
        "grid.color": COLOUR["rule"],
        "grid.linewidth": 0.6,
        "xtick.color": muted,
        "ytick.color": muted,
        "xtick.labelcolor": ink,
        "ytick.labelcolor": ink,
        "xtick.major.width": 0.7,
        "ytick.major.width": 0.7,
        "lines.solid_capstyle": "round",
        "figure.facecolor": COLOUR["paper"],
        "savefig.facecolor": COLOUR["paper"],
        "savefig.dpi": 200,
        "figure.dpi": 200,
        "svg.fonttype": "path",  # glyphs as outlines: the same on every machine, no font needed by the reader
        "svg.hashsalt": "vegglue",  # the same picture, the same file
    }


@contextmanager
def _styled_context() -> Iterator[None]:
    """Nothing of a `matplotlibrc` counts: one in the folder of a stranger could have texts set by LaTeX.

    Signs that no font here has are drawn as boxes, which is enough: matplotlib would complain of each in a line.
    """
    with matplotlib.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"Glyph \d+ .*missing from")
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_settings())  # type: ignore[arg-type]  # its keys are a literal type of 300 names
        yield


def styled(draw: Callable[Drawing, Figure]) -> Callable[Drawing, Figure]:
    """A drawing function that draws in this style, whatever the settings of its caller."""

    @wraps(draw)
    def drawn(*args: Drawing.args, **keywords: Drawing.kwargs) -> Figure:
        with _styled_context():
            return draw(*args, **keywords)

    return drawn


def canvas(width: float = WIDTH, height: float = HEIGHT, **subplots: Any) -> tuple[Figure, Any]:
    """A figure of width x height [inch] and its axes."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(**subplots)


def label(axes: Axes, x: float, y: float, text: str, colour: str = "ink", **keywords: Any) -> None:
    """A direct label at a data point; haloed, so lines may pass under it; `keywords` as of matplotlib's annotate."""
    settings: dict[str, Any] = {
        "xytext": (4, 4),
        "textcoords": "offset points",
        "fontsize": SMALL,
        "color": COLOUR[colour],
        "zorder": 8,
    } | keywords
    text_ = axes.annotate(text, (x, y), **settings)
    text_.set_path_effects([withStroke(linewidth=2.2, foreground=COLOUR["paper"])])


def formula_labels(axes: Axes, across: str = "", upward: str = "") -> None:
    """Labels of the axes that hold mathtext, of `symbol_math` and `unit_math`; all other text is drawn as it is."""
    for text, write in ((across, axes.set_xlabel), (upward, axes.set_ylabel)):
        if text:
            write(text, parse_math=True)


def save(figure: Figure, path: Path, dots_per_inch: float = 200) -> None:
    """Write a figure by itself, PNG or SVG by the ending of `path`, in a folder that is made if need be."""
    drawn = BytesIO()
    with _styled_context():
        _lay_out(figure)
        figure.savefig(drawn, format=path.suffix.removeprefix("."), dpi=dots_per_inch)
    write_file(path, drawn.getvalue(), MAKE_ROOM)


@dataclass(frozen=True)
class Picture:
    """A figure for the page: file name without ending, caption (HTML), spoken text, inline SVG, width [px]."""

    name: str
    caption: str
    alt: str
    svg: str
    width: int


def publish(figure: Figure, folder: Path, name: str, caption: str, alt: str, note: str = "") -> Picture:
    """Write folder/name.svg with `note` in its corner, and return the picture for the page."""
    with _styled_context():
        if note:
            figure.suptitle(note, x=0.995, ha="right", fontsize=SMALL - 0.5, color=COLOUR["muted"])
        _lay_out(figure)
        text = StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None, "Title": name, "Description": alt})
    drawn = publish_text(text.getvalue(), folder, name, caption, alt)
    return replace(drawn, width=round(96 * figure.get_size_inches()[0]))


def _lay_out(figure: Figure) -> None:
    """Lay out once, for pixels, whose letters are measured fast; savefig would draw the whole figure a second time."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)


def publish_text(svg: str, folder: Path, name: str, caption: str, alt: str) -> Picture:
    """Write folder/name.svg, a picture that is SVG text already, and return it for the page."""
    write_file(folder / f"{name}.svg", svg.encode(), MAKE_ROOM)
    width = re.search(r'viewBox="0 0 ([\d.]+)', svg)
    return Picture(name, caption, alt, inline(svg, name, alt), round(float(width[1])) if width else 0)


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
