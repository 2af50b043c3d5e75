"""Outlines of patches: their corners, and how far a point is from them."""

import numpy as np
from numpy.typing import NDArray

from vegglue.schema import Patch

Array = NDArray[np.float64]


def corners(patch: Patch) -> Array:
    """Corners of a patch in order, shape (corners, 2) [m]."""
    if patch.polygon is not None:
        return np.array(patch.polygon)
    (west, east), (south, north) = patch.x or (0.0, 0.0), patch.y or (0.0, 0.0)
    return np.array([[west, south], [east, south], [east, north], [west, north]])


def distance_to_outline(outline: Array, x: float, y: float) -> float:
    """d = min over sides of |p - (a + t (b - a))| with t in [0, 1] closest to p [m]."""
    start, side = outline, np.roll(outline, -1, axis=0) - outline
    from_start = np.array([x, y]) - start
    along = np.clip((from_start * side).sum(axis=1) / (side**2).sum(axis=1), 0.0, 1.0)
    return float(np.hypot(*(from_start - along[:, None] * side).T).min())
