"""What tests of figures look for: the points that were drawn, the words, and whether all of it stays on the sheet."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

ROUNDING = 1.5  # of the outline of a letter [dots]


def texts(axes: Axes) -> list[str]:
    return [text.get_text() for text in axes.texts]


def points(axes: Axes, marker: str = "o") -> list[tuple[float, float]]:
    """All points drawn with a marker, but those that are NaN."""
    lines = [line for line in axes.lines if line.get_marker() == marker]
    pairs = [(float(x), float(y)) for line in lines for x, y in zip(*line.get_data(), strict=True)]
    return [pair for pair in pairs if np.isfinite(pair).all()]


def off_the_sheet(figure: Figure) -> list[str]:
    """What is cut off by the edge of a figure once it is drawn: axes with all that hangs on them, words, legends."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    (wide, high), found = canvas.get_width_height(), []
    of_axes = {id(child) for axes in figure.axes for child in axes.findobj(Text)}
    loose = [one for one in figure.findobj(Text) if id(one) not in of_axes and one.get_text().strip()]
    for artist in (*[axes for axes in figure.axes if axes.get_visible()], *loose, *figure.findobj(Legend)):
        box = artist.get_tightbbox(canvas.get_renderer())
        if box is not None and min(box.x0, box.y0, wide - box.x1, high - box.y1) < -ROUNDING:
            found.append(f"{artist} at {box}")
    return found
