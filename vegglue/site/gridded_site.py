"""The site on its grid: bed level, friction class and plants of each cell, read off at cell centres."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vegglue.arrays import Array
from vegglue.case.schema import Case
from vegglue.site.bed import bed_levels
from vegglue.site.grid import Grid, build_grid
from vegglue.site.zones import cells_of_patch, friction_classes


@dataclass(frozen=True, eq=False)
class Site:
    """A site on its grid. bed: level of the bed (nx, ny) [m]; friction_class: index into class_names (nx, ny); patch:
    index into the patches of the case (nx, ny), -1 without plants.

    Compared by identity, so that what is computed of a site can be cached.
    """

    grid: Grid
    bed: Array
    friction_class: NDArray[np.int64]
    class_names: tuple[str, ...]
    patch: NDArray[np.int64]


def build_site(case: Case) -> Site:
    """The site of a case, read off at cell centres; where patches overlap, the later one counts.

    Errors: InputError when a cell has no bed level or a file cannot be read.
    """
    grid = build_grid(case)
    bed = bed_levels(case, grid)
    patch = np.full(bed.shape, -1, dtype=np.int64)
    for index, area in enumerate(case.plants.patches):
        patch[cells_of_patch(area, grid)] = index
    return Site(grid, bed, friction_classes(case, grid, bed), tuple(case.friction.classes), patch)
