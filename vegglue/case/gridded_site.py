"""The site on its grid: bed level and friction class of each cell, read off at its centre, and plants that cover it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.bed import bed_levels
from vegglue.case.grid import Grid, build_grid
from vegglue.case.schema import Case
from vegglue.case.zones import friction_classes, share_in_patch

# Nearer to an edge of its cell than this share of it [-], a place is on that edge: rounding errors are far smaller.
ON_AN_EDGE = 1e-6
# Inflows whose rims are kept: those of the experiments of a model and of its coarser ones.
RIMS_KEPT = 32


@dataclass(frozen=True, eq=False)
class Site:
    """A site on its grid. Compared by identity, so that what is computed of a site can be cached.

    Attributes
    ----------
    bed : ndarray (nx, ny)
        Level of the bed [m].
    friction_class : ndarray of int (nx, ny)
        Index into `class_names`.
    patch : ndarray of int (nx, ny)
        Index into the patches of the case, of the one that covers most of a cell, -1 without plants.
    cover : ndarray (nx, ny)
        Share of a cell that plants cover [-].
    own : mapping of Site
        The site in experiments with another bed, by their names.
    """

    grid: Grid
    bed: Array
    friction_class: NDArray[np.int64]
    class_names: tuple[str, ...]
    patch: NDArray[np.int64]
    cover: Array
    own: Mapping[str, "Site"] = field(default_factory=dict)

    @property
    def main_patch(self) -> NDArray[np.int64]:
        """The patch (nx, ny) of cells that plants cover half of or more, -1 elsewhere."""
        return np.where(self.cover >= 0.5, self.patch, -1)


@lru_cache(RIMS_KEPT)
def rims(site: Site, side: Literal["west", "south", "north"], start: int, stop: int) -> Array:
    """How high the rim of the hollow that each cell of an inflow lies in stands over its bed, 0 outside of one.

        W = max(z, min over the neighbours of W),    r = W - z,    W = z in the deepest of these cells and at the outlet

    A hollow is filled up to W before water flows on to the deepest of the cells or, past it, to the outlet.

    Parameters
    ----------
    site : Site
        With the bed z [m].
    side
        By which the water enters.
    start, stop : int
        It enters by the cells start .. stop - 1 of that side.

    Returns
    -------
    array (cell, 1)
        r [m], not to be written to.

    References
    ----------
    Planchon and Darboux (2002), doi:10.1016/S0341-8162(01)00164-3.
    """
    bed, cells = site.bed, np.arange(start, stop)
    sides: dict[str, tuple[Any, Any]] = {"west": (0, cells), "south": (cells, 0), "north": (cells, -1)}
    at = sides[side]
    deepest = int(np.argmin(bed[at]))
    entering, filled = np.full(cells.size, np.inf), np.full(bed.shape, np.inf)
    entering[deepest] = bed[at][deepest]
    filled[at], filled[-1] = entering, bed[-1]
    highest = np.maximum.accumulate
    along = np.concatenate([highest(bed[at][: deepest + 1][::-1])[::-1], highest(bed[at][deepest:])[1:]])
    while (along > bed[at]).any():  # else the bed falls to the deepest cell along the inflow itself
        beside = np.pad(filled, 1, constant_values=np.inf)
        lowest = np.minimum.reduce([beside[:-2, 1:-1], beside[2:, 1:-1], beside[1:-1, :-2], beside[1:-1, 2:]])
        lower = np.minimum(filled, np.maximum(bed, lowest))
        if np.array_equal(lower, filled):
            along = filled[at]
            break
        filled = lower
    return np.asarray(along - bed[at])[:, None]


def in_experiment(site: Site, experiment: str) -> Site:
    """The site as it was in an experiment: with the bed of its own if it has one."""
    return site.own.get(experiment, site)


def build_site(case: Case) -> Site:
    """The site of a case on its grid.

    Returns
    -------
    Site
        Of patches that overlap the later one counts; those that share a cell lie side by side in it.

    Raises
    ------
    InputError
        If a cell has no bed level, or a file cannot be read.
    """
    grid = build_grid(case)
    shape = grid.x.size, grid.y.size
    patch, cover = np.full(shape, -1, dtype=np.int64), np.zeros(shape)
    for index, area in enumerate(case.plants.patches):
        share = share_in_patch(case, area, grid)
        cover = np.minimum(cover + share, 1.0)
        patch[(share > 0.0) & (share >= cover - share)] = index

    def with_bed(experiment: str = "") -> Site:
        bed = bed_levels(case, grid, experiment)
        return Site(grid, bed, friction_classes(case, grid, bed), tuple(case.friction.classes), patch, cover)

    own = {name: with_bed(name) for name, one in case.experiments.items() if one.bed is not None}
    return replace(with_bed(), own=own)


def cells_at(site: Site, x: Array, y: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The cells that places lie in, the outermost beyond.

    On the edge of two cells across, that of the lower one: a station at the toe of a bank stands on the floor, on
    either side of the channel. On one along, that of the upstream one.

    Parameters
    ----------
    x, y : (n,) [m]

    Returns
    -------
    column, row : (n,), (n,)
    """
    grid = site.grid
    column = _index(x, grid.x, grid.dx, -1)
    south, north = (_index(y, grid.y, grid.dy, side) for side in (-1, 1))
    return column, np.where(site.bed[column, north] < site.bed[column, south], north, south)


def _index(at: Array, centres: Array, step: float, side: int) -> NDArray[np.int64]:
    """The cell a hair's breadth to one side (-1 or 1) of each point."""
    nearest = np.rint((at - centres[0]) / step + side * ON_AN_EDGE)
    return np.clip(nearest, 0, centres.size - 1).astype(np.int64)
