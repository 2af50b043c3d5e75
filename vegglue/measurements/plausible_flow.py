"""The bounds that continuity and friction leave to the flow of an experiment, without solving it.

Rough on purpose: they tell cm/s from m/s and one datum from another, and no effect comes near to them.
"""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.case.channel_geometry import expected_depth
from vegglue.case.gridded_site import Site
from vegglue.case.parameter_space import Bounds, prior_range
from vegglue.case.schema import Case, Experiment

# Manning's n [s m^(-1/3)] above which no reach as a whole lies: weedy lowland brooks reach 0.3 to 0.5.
THICKEST_GROWTH = 0.5
# And below which none lies: planed wood and glass.
SMOOTHEST_WALLS = 0.01
# Velocity head of critical flow over its depth [-], Fr^2 / 2: no level lies further below that of the outlet. The same
# is left above what growth holds up, for gauges that are off by as much as an effect may find.
CRITICAL_HEAD = 0.5


@dataclass(frozen=True)
class PlausibleFlow:
    """Bounds for one experiment, at columns x (nx,) and rows y (ny,) of the grid [m].

    slowest and fastest (nx,): Q / A [m/s], inf where the section may be dry; lowest and highest (nx,): water level [m];
    smoothest and thickest (nx,): the same without what is left for gauges that are off, on smooth walls and in growth;
    floor (nx,): lowest bed of the section [m]; discharge: least, of one inflow alone, and most, of all [m3/s];
    depth: largest at the outlet [m]; level: at the outlet [m]; width: of the grid [m]; depths: expected (nx, ny) [m].
    """

    x: Array
    y: Array
    slowest: Array
    fastest: Array
    lowest: Array
    highest: Array
    smoothest: Array
    thickest: Array
    floor: Array
    discharge: Bounds
    depth: float
    level: Bounds
    width: float
    depths: Array

    def column(self, x: float) -> int:
        """Index of the column of cells nearest to x [m]."""
        return int(np.abs(self.x - x).argmin())

    def share_between(self, column: int, low: float, high: float) -> float:
        """Share of the wet area of a section that lies between y = low and high [m], in [0, 1]; 0 when it is dry."""
        wet = self.depths[column]
        return float(wet[(self.y >= low) & (self.y <= high)].sum() / wet.sum()) if wet.any() else 0.0


def plausible_flow(case: Case, site: Site, experiment: Experiment) -> PlausibleFlow:
    """U = Q / A(x) with A under the expected level, and z_out - h / 2 <= z <= z_highest + h / 2, see `_thickest`.

    Q and z_out within 95 % of their priors. A of `slowest` lies under a surface parallel to the floor, or that of the
    outlet where it is higher; A of `fastest` under the lower one that smooth walls leave, see `_smoothest`. Where
    plants hold the water up, A is larger and the flow slower.
    """
    level = prior_range(case, experiment.level)
    parts = [prior_range(case, value) for value in experiment.discharge.values()]
    least, most = min(low for low, _ in parts), sum(high for _, high in parts)
    deep = _depths(case, site, experiment, level[1])
    expected = _depths(case, site, experiment, level[0])
    smoothest = _smoothest(site, expected, level[0], least)
    shallow = np.minimum(expected, np.maximum(smoothest[:, None] - site.bed, 0.0))
    thickest = _thickest(site, deep, level[1], most)
    dy, floor = site.grid.dy, site.bed.min(axis=1)
    depth = float(deep[-1].max())
    with np.errstate(divide="ignore"):
        slowest, fastest = least / (dy * deep.sum(axis=1)), most / (dy * shallow.sum(axis=1))
    return PlausibleFlow(
        x=site.grid.x,
        y=site.grid.y,
        slowest=slowest,
        fastest=fastest,
        lowest=np.full(site.grid.x.size, level[0] - CRITICAL_HEAD * depth),
        highest=thickest + CRITICAL_HEAD * depth,
        smoothest=smoothest,
        thickest=thickest,
        floor=floor,
        discharge=(least, most),
        depth=depth,
        level=level,
        width=dy * site.grid.y.size,
        depths=deep,
    )


def _depths(case: Case, site: Site, experiment: Experiment, level: float) -> Array:
    return np.maximum(expected_depth(case, site, experiment.model_copy(update={"level": level})), 0.0)


def _smoothest(site: Site, depths: Array, level: float, discharge: float) -> Array:
    """z = max(z_out, z_floor + (n q / sqrt(S))^(3/5)) (nx,) [m].

    Above the backwater of its outlet a reach may flow at normal depth (Manning), least on smooth walls. S: fall of the
    floor over the length of the grid [-]; q: Q over the widest water [m2/s].
    """
    floor, grid = site.bed.min(axis=1), site.grid
    slope = float(floor[0] - floor[-1]) / (grid.dx * grid.x.size)
    width = grid.dy * float((depths > 0.0).sum(axis=1).max())
    normal = 0.0
    if slope > 0.0 and width > 0.0 and discharge > 0.0:
        normal = (SMOOTHEST_WALLS * discharge / width / slope**0.5) ** 0.6
    return np.maximum(level, floor + normal)


def _thickest(site: Site, depths: Array, level: float, discharge: float) -> Array:
    """z = z_floor + h with h^(13/3) = h_L^(13/3) + 13/3 n^2 q^2 (L - x), (nx,) [m]: water held up by growth all over.

    The integral of dh/dx = -n^2 q^2 / h^(10/3), friction after Manning on an even bed, at the thickest growth; on a bed
    that falls, h is smaller. z_floor: the highest floor from x to the outlet; q: Q over the narrowest water [m2/s].
    """
    grid = site.grid
    width = grid.dy * (depths > 0.0).sum(axis=1)
    unit_discharge = discharge / float(width[width > 0.0].min()) if (width > 0.0).any() else 0.0
    distance = grid.x[-1] + 0.5 * grid.dx - grid.x
    grown = 13.0 / 3.0 * (THICKEST_GROWTH * unit_discharge) ** 2 * distance
    depth = (max(float(depths[-1].max()), 0.0) ** (13.0 / 3.0) + grown) ** (3.0 / 13.0)
    sill = np.maximum.accumulate(site.bed.min(axis=1)[::-1])[::-1]
    return np.maximum(sill, level - depths[-1].max()) + depth
