"""Where a label covers the fewest points of a drawing."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from vegglue.arrays import Array
from vegglue.case.parameter_space import Bounds

# Half of the width of a letter, of a line and of a point in a plan 9.4 inches wide, over the axes [-].
HALF_LETTER, HALF_LINE, HALF_POINT = 0.0045, 0.035, 0.004


def freest(places: Sequence[tuple[float, float]], text: str, axes: Axes, taken: Array) -> tuple[float, float]:
    """Of places for the middle of a text the first that covers the fewest points; taken: x and y of these (n, 2)."""
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    width = limits[:, 1] - limits[:, 0]
    half = np.array([HALF_LETTER * len(text) + HALF_POINT, HALF_LINE])
    covered = [int((np.abs((taken - place) / width) < half).all(axis=1).sum()) for place in places]
    return places[int(np.argmin(covered))]


def along_an_edge(x: float, ends: Bounds) -> list[tuple[float, float]]:
    """Places at x between two ends [m]: in the middle, then nearer to either end."""
    low, high = ends
    return [(x, low + share * (high - low)) for share in (0.5, 0.7, 0.3, 0.9, 0.1)]


def about_a_patch(corners: Array, axes: Axes) -> list[tuple[float, float]]:
    """Its middle, then above and below it, then beside its middle along the channel. corners (k, 2) [m]."""
    (x, y), (low, high) = corners.mean(axis=0), (corners.min(axis=0), corners.max(axis=0))
    up = 1.5 * HALF_LINE * float(np.ptp(axes.get_ylim()))
    beside = [low[0] + share * (high[0] - low[0]) for share in (0.25, 0.75)]
    return [(x, y), (x, high[1] + up), (x, low[1] - up), *((float(place), y) for place in beside)]
