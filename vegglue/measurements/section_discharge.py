"""One cross-section: from verticals to the discharge through it, by linear interpolation and by fitted profiles.

Both rules are linear in what was measured, so they are written as weights and the errors follow exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.measurements.vertical_profile import Column, linear_weights

# Cells of the regular grid a section is summed on, along y and z [m].
GRID_STEP = 0.02


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
    """Discharge and its standard error [m3/s], see `combine`."""

    value: float
    standard_error: float


def grid_weights(section: CrossSection, position: Array, columns: Sequence[Column], step: float) -> list[Array]:
    """w, for each vertical (points,) [m2], with Q = sum(w u) [m3/s]: the rule `paper`.

    position (columns,): y of the verticals [m]; columns: their points; step: largest height of a grid cell [m].
    Points are interpolated linearly on a regular (y, z) grid of cells at most `step` high: upward in each vertical
    (zero at the bed, constant from the highest point to the surface), then across at each level between verticals,
    to zero where that level meets the bed or the bank. Q = sum of velocity x cell area.
    Source: Berends et al. (2020), section 3.1, which does not say what was assumed at the surface and at the banks.
    """
    lowest = float(section.bed.min())
    count = int(np.ceil((section.surface - lowest) / step))
    height = (section.surface - lowest) / count
    levels = lowest + height * (np.arange(count) + 0.5)
    bed = section.surface - np.array([column.depth for column in columns])
    widths = np.array([_width_of_each(section, position, bed < level, level) for level in levels])
    return [
        height * widths[:, index] @ (linear_weights(column.height, levels - bed[index]))
        for index, column in enumerate(columns)
    ]


def _width_of_each(section: CrossSection, position: Array, wet: Array, level: float) -> Array:
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
    """w (columns,) [m2] with Q = sum(w U) [m3/s]: U / sqrt(h) is linear across, constant beyond the outermost ones.

    position and depth (columns,): y and water depth h of the verticals [m]. Between the outermost vertical and the bank
    that is a constant Froude number, so that the velocity goes to zero with the depth.
    Source: Le Coz et al. (2012), doi 10.1016/j.flowmeasinst.2012.05.001.
    """
    flow = section.width * section.depth**1.5
    hats = [np.interp(section.y, position, unit) for unit in np.eye(len(position))]
    return np.array([float(flow @ hat) for hat in hats]) / np.sqrt(depth)


def neighbour_error(position: Array, average: Array) -> float:
    """s with s^2 = mean((U_i - sum_j w_j U_j)^2 / (1 + sum_j w_j^2)): the error of one vertical [m/s].

    position (columns,): y of the verticals [m]; average U (columns,) [m/s]. The weights w predict U_i from its
    neighbours by the cubic through two on either side, or by the straight line through one on either side when there
    are fewer than five verticals. Smooth curvature across the channel then does not count as error; jumps, as at the
    edge of plants, do. NaN below three verticals.
    Source: the interpolated variance estimator of Cohn, Kiang and Mason (2013), doi
    10.1061/(ASCE)HY.1943-7900.0000695, which takes the straight line.
    """
    count = len(position)
    each_side = 2 if count >= 5 else 1
    if count < 3:
        return float("nan")
    squares = []
    for index in range(each_side, count - each_side):
        others = np.r_[index - each_side : index, index + 1 : index + each_side + 1]
        weights = _lagrange(position[others], position[index])
        squares.append((average[index] - weights @ average[others]) ** 2 / (1.0 + weights @ weights))
    return float(np.sqrt(np.mean(squares)))


def _lagrange(nodes: Array, at: float) -> Array:
    """Weights (nodes,) which give the polynomial through the nodes at one place."""
    gaps = nodes[:, None] - nodes + np.eye(len(nodes))
    return np.prod(np.where(np.eye(len(nodes), dtype=bool), 1.0, at - nodes) / gaps, axis=1)


def combine(value: float, sampling: float, spacing: float, rule: float) -> Discharge:
    """standard_error^2 = max(sampling, spacing)^2 + rule^2 [m3/s]; an unknown (NaN) spacing error is left out.

    sampling: from the standard errors of the verticals; spacing: from how far each vertical lies from what its
    neighbours predict, which contains the sampling error; rule: from the profile assumed where nothing was measured.
    """
    return Discharge(value, float(np.hypot(np.fmax(sampling, spacing), rule)))


def section_discharges(
    section: CrossSection, columns: Sequence[Column], good: pd.DataFrame, error: float
) -> dict[str, Discharge]:
    """Q = sum_i w_i u_i [m3/s] by both rules, from the verticals that are used.

    columns: their points; good: their profiles (rows of Observations.profiles); error: of one vertical, as its
    neighbours tell it [m/s].
    """
    position, scatter = good["y"].to_numpy(), good["scatter"].fillna(1.0)
    grid = grid_weights(section, position, columns, GRID_STEP)
    paper = sum(float(weights @ column.velocity) for weights, column in zip(grid, columns, strict=True))
    errors = [
        factor * float(np.linalg.norm(weights * column.standard_error))
        for weights, column, factor in zip(grid, columns, scatter, strict=True)
    ]
    area = conveyance_weights(section, position, good["depth"].to_numpy())
    profile = float(area @ good["fitted"].to_numpy())
    spacing = error * float(np.linalg.norm(area))
    return {
        "paper": combine(paper, float(np.linalg.norm(errors)), spacing, abs(paper - profile) / float(np.sqrt(3.0))),
        "profile": combine(profile, float(np.linalg.norm(area * good["fitted_error"].to_numpy())), spacing, 0.0),
    }
