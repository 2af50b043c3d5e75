"""One cross-section: from verticals to the discharge through it, by linear interpolation and by fitted profiles.

Both rules are linear in what was measured, so they are written as weights and the errors follow exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.measurements.vertical_profile import Column, linear_weights


@dataclass(frozen=True)
class CrossSection:
    """Regular cells across the channel: centres y (cells,), bed level (cells,) and the flat water level [m]."""

    y: Array
    bed: Array
    surface: float

    @property
    def width(self) -> float:
        """Width of a cell [m]."""
        return float(self.y[1] - self.y[0])

    @property
    def depth(self) -> Array:
        """h = max(surface - bed, 0) (cells,) [m]."""
        return np.maximum(self.surface - self.bed, 0.0)


@dataclass(frozen=True)
class Discharge:
    """Discharge and its standard error [m3/s], and what the error is made of.

    sampling: of the verticals, from their own standard errors; spacing: from how badly each is told by its neighbours
    (this contains the sampling error); rule: of the profile assumed where nothing was measured.
    standard_error^2 = max(sampling, spacing)^2 + rule^2.
    """

    value: float
    standard_error: float
    sampling: float
    spacing: float
    rule: float


def grid_weights(section: CrossSection, position: Array, columns: Sequence[Column], step: float) -> list[Array]:
    """w, per vertical (points,), with Q = sum(w u): the rule `paper` [m2].

    Points are interpolated linearly on a regular (y, z) grid of cells at most `step` [m] high: upward in each vertical
    (zero at the bed, constant from the highest point to the surface), then across at each level between verticals,
    to zero where that level meets the bed or the bank. Q = sum of velocity x cell area.
    Source: Berends et al. (2020), section 3.1, which does not say what was assumed at the surface and at the banks.
    """
    lowest = float(section.bed.min())
    count = int(np.ceil((section.surface - lowest) / step))
    height = (section.surface - lowest) / count
    levels = lowest + height * (np.arange(count) + 0.5)
    bed = section.surface - np.array([column.depth for column in columns])
    reach = np.array([_reach(section, position, bed < level, level) for level in levels])
    return [
        height * reach[:, index] @ (linear_weights(column.height, levels - bed[index]))
        for index, column in enumerate(columns)
    ]


def _reach(section: CrossSection, position: Array, wet: Array, level: float) -> Array:
    """Width [m] over which each vertical (columns,) counts at this level: the area under its hat function."""
    dry = section.y[section.bed >= level]
    nodes = np.concatenate([position[wet], dry])
    order = np.argsort(nodes)
    result = np.zeros(len(position))
    cells = section.y[section.bed < level]
    for index in np.flatnonzero(wet):
        hat = (nodes == position[index]).astype(float)
        result[index] = section.width * np.interp(cells, nodes[order], hat[order]).sum()
    return result


def conveyance_weights(section: CrossSection, position: Array, depth: Array) -> Array:
    """w (columns,) with Q = sum(w U) [m2]: U / sqrt(h) is linear across, constant beyond the outermost verticals.

    That is a constant Froude number between vertical and bank, so the velocity goes to zero with the depth.
    Source: Le Coz et al. (2012), doi 10.1016/j.flowmeasinst.2012.05.001.
    """
    flow = section.width * section.depth**1.5
    hats = [np.interp(section.y, position, unit) for unit in np.eye(len(position))]
    return np.array([float(flow @ hat) for hat in hats]) / np.sqrt(depth)


def neighbour_error(position: Array, average: Array) -> float:
    """s^2 = mean((U_i - sum_j w_j U_j)^2 / (1 + sum_j w_j^2)): the error of one vertical, told by its neighbours [m/s].

    w are the weights of the cubic through the two nearest verticals on either side at position_i (of the straight line
    through the nearest ones when there are fewer than five), so that smooth curvature across the channel does not count
    as error; jumps, as at the edge of plants, do. NaN below three verticals.
    Source: the interpolated variance estimator of Cohn, Kiang and Mason (2013), doi
    10.1061/(ASCE)HY.1943-7900.0000695, which takes the straight line.
    """
    count = len(position)
    reach = 2 if count >= 5 else 1
    if count < 3:
        return float("nan")
    squares = []
    for index in range(reach, count - reach):
        others = np.r_[index - reach : index, index + 1 : index + reach + 1]
        weights = _lagrange(position[others], position[index])
        squares.append((average[index] - weights @ average[others]) ** 2 / (1.0 + weights @ weights))
    return float(np.sqrt(np.mean(squares)))


def _lagrange(nodes: Array, at: float) -> Array:
    """Weights (nodes,) which give the polynomial through the nodes at one place."""
    gaps = nodes[:, None] - nodes + np.eye(len(nodes))
    return np.prod(np.where(np.eye(len(nodes), dtype=bool), 1.0, at - nodes) / gaps, axis=1)


def combine(value: float, sampling: float, spacing: float, rule: float) -> Discharge:
    """standard_error^2 = max(sampling, spacing)^2 + rule^2 [m3/s]; an unknown (NaN) spacing error is left out."""
    return Discharge(value, float(np.hypot(np.fmax(sampling, spacing), rule)), sampling, spacing, rule)
