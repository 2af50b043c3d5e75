"""How figures drawn by matplotlib look: the palette of `svg`, one face, and pictures that follow the page they stand
in (light, dark, paper).
"""

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import wraps
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from vegglue.pages.svg import COLOUR, inline
from vegglue.whole_files import write_file
from vegglue.wording.remedies import MAKE_ROOM

Drawing = ParamSpec("Drawing")
EDGE_COLOUR = "#101010"  # lines over a coloured field: the same on a light and on a dark page
WIDTH, HEIGHT = 4.7, 3.1  # one column of the page [inch]
SMALL = 7.5  # direct labels [pt]


@contextmanager
def _styled_context() -> Iterator[None]:
    """Nothing of a `matplotlibrc` counts: one in the folder of a stranger could have texts set by LaTeX.

    Signs that no font here has are drawn as boxes, which is enough: matplotlib would complain of each in a line.
    """
    # The first of some sober faces that is installed; DejaVu Sans comes with matplotlib and fills missing glyphs.
    installed = {font.name for font in font_manager.fontManager.ttflist}
    wanted = ("Source Sans 3", "Inter", "Helvetica", "Arial", "Liberation Sans")
    face = [*[name for name in wanted if name in installed][:1], "DejaVu Sans"]
    ink, muted = COLOUR["ink"], COLOUR["muted"]
    settings: dict[str, Any] = {
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
    with matplotlib.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"Glyph \d+ .*missing from")
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(settings)  # type: ignore[arg-type]  # its keys are a literal type of 300 names
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
