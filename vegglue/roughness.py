"""Friction of the bed by classes of roughness, compiled; the innermost axis of every array is the member."""

import math

import numpy as np

from vegglue.elementary import compiled, cube_root, logarithm
from vegglue.kernels import GRAVITY

MANNING, KEULEGAN, CHEZY = 0, 1, 2
LOG_SLOPE = 18.0 / math.log(10.0)
GAUSS_PLACE = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
GAUSS_WEIGHT = (5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0)


@compiled
def _manning(coefficient: float, depth: float) -> float:
    """C h = h^(7/6) / n [m^3/2/s]."""
    return depth * math.sqrt(cube_root(depth)) / coefficient


@compiled
def _keulegan(coefficient: float, depth: float, floor: float) -> float:
    """C h = 18 log10(max(12 h/k_s, floor)) h [m^3/2/s] (Keulegan 1938)."""
    return LOG_SLOPE * logarithm(max(12.0 * depth / coefficient, floor)) * depth


@compiled
def _wet_part(mean: float, reach: float) -> tuple[float, float]:
    """Least and greatest depth [m] of a cell of mean depth `mean` whose bed rises evenly by 2 w, where it is wet."""
    above = mean if mean > reach else 2.0 * math.sqrt(reach * max(mean, 0.0)) - reach
    return max(above - reach, 0.0), max(above + reach, 1e-30)


@compiled
def _carried(law: int, coefficient: float, depth: float, floor: float) -> float:
    """C h^(3/2) [m^2/s] of one depth."""
    if law == MANNING:
        return _manning(coefficient, depth) * math.sqrt(depth)
    if law == KEULEGAN:
        return _keulegan(coefficient, depth, floor) * math.sqrt(depth)
    return coefficient * depth * math.sqrt(depth)


@compiled
def _over_cell(drag, depth, reach, law, coefficient, floor, film):
    """k = g h^2 / <C h^(3/2)>^2 [1/m] of one cell, the mean over its wet part by three Gauss points.

    As in the subgrid friction of Volp et al. 2013, doi:10.1002/wrcr.20324: one slope of the surface drives each depth.
    """
    dry, (p1, p2, p3), (w1, w2, w3) = 0.1 * film, GAUSS_PLACE, GAUSS_WEIGHT
    for k in range(depth.size):
        c = coefficient[k]
        lowest, highest = _wet_part(depth[k] - dry, reach)
        span = highest - lowest
        h1, h2, h3 = lowest + span * p1, lowest + span * p2, lowest + span * p3
        carried = w1 * _carried(law, c, h1, floor) + w2 * _carried(law, c, h2, floor)
        carried += w3 * _carried(law, c, h3, floor)
        drag[k] = GRAVITY * (depth[k] / (carried * 0.5 * span / reach + _carried(law, c, dry, floor))) ** 2


@compiled
def _on_slope(drag, depth, reach, law, coefficient, floor, film):
    """The same, its law a constant in each loop, so that the compiler can do members side by side."""
    if law == MANNING:
        _over_cell(drag, depth, reach, MANNING, coefficient, floor, film)
    elif law == KEULEGAN:
        _over_cell(drag, depth, reach, KEULEGAN, coefficient, floor, film)
    else:
        _over_cell(drag, depth, reach, CHEZY, coefficient, floor, film)


@compiled
def _on_flat(drag, depth, law, coefficient, floor):
    """k = g / (C^2 h) [1/m] of one cell."""
    if law == MANNING:
        for k in range(depth.size):
            drag[k] = GRAVITY * depth[k] / _manning(coefficient[k], depth[k]) ** 2
    elif law == KEULEGAN:
        for k in range(depth.size):
            drag[k] = GRAVITY * depth[k] / _keulegan(coefficient[k], depth[k], floor) ** 2
    else:
        for k in range(depth.size):
            drag[k] = GRAVITY / (coefficient[k] ** 2 * depth[k])


@compiled
def class_drag(depth, reach, friction_class, law, coefficient, log_argument_minimum, film):
    """k = g / (C^2 h) [1/m] of the class laws; on a slope g h^2 / <C h^(3/2)>^2, the same for one depth throughout."""
    nx, ny, _ = depth.shape
    drag = np.empty(depth.shape)
    for i in range(nx):
        for j in range(ny):
            c = friction_class[i, j]
            if reach[i, j] > 4.0001 * film:
                _on_slope(drag[i, j], depth[i, j], reach[i, j], law[c], coefficient[c], log_argument_minimum, film)
            else:
                _on_flat(drag[i, j], depth[i, j], law[c], coefficient[c], log_argument_minimum)
    return drag
