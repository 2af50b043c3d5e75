#!/bin/sh
# A gauge in the lower or right half of a river cell has, in pysheds, the catchment of the next cell.
#
# Guess:      Grid.catchment with the coordinates of a gauge delineates the catchment of the cell in which the gauge is.
# Seen:       the coordinates are taken to the nearest upper left corner of a cell: a gauge in the right half of the river
#             cell has the cell beside the river and a catchment of 0.08 ha instead of 1.89 ha; one in its lower left
#             quarter that of the cell below. With snap="center" all are 1.89 ha. No message.
# Matters:    the discharge of a design flood, taken by the area of the catchment, that is a twentieth.
# Documented: "corner: numpy.around()", the default, and "center: numpy.floor()"; in nearest_cell that the first is the
#             nearest top-left corner, and the second the cell in which the point falls.
# Versions:   pysheds 0.5, numpy 2.2.6, scipy 1.16.0, pandas 2.3.1, numba 0.61.2, rasterio 1.4.3, scikit-image 0.25.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pysheds==0.5 numpy==2.2.6 scipy==1.16.0 pandas==2.3.1 numba==0.61.2 rasterio==1.4.3 scikit-image==0.25.2
cd "$work"
NUMBA_CACHE_DIR="$work" timeout 400 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from affine import Affine
from pysheds.grid import Grid
from pysheds.view import Raster, ViewFinder

CELL, CELLS, RIVER, ROW = 10.0, 20, 10, 15  # m; a valley that falls to the south along one column, a gauge in one row
south, east = np.mgrid[0:CELLS, 0:CELLS]
heights = 100.0 + 0.1 * abs(east - RIVER) + 0.05 * (CELLS - south)
view = ViewFinder(affine=Affine(CELL, 0.0, 0.0, 0.0, -CELL, CELL * CELLS), shape=heights.shape, nodata=np.nan)
dem = Raster(heights, viewfinder=view)
grid = Grid.from_raster(dem)
directions = grid.flowdir(dem)


def area(right, down, **options):
    """Catchment in m2 of a gauge at shares of the width and height of the river cell."""
    x, y = CELL * (RIVER + right), CELL * (CELLS - ROW - down)
    return float(grid.catchment(x=x, y=y, fdir=directions, xytype="coordinate", **options).sum()) * CELL**2


gauges = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
seen = [area(*gauge) for gauge in gauges]
within = [area(*gauge, snap="center") for gauge in gauges]
print(f"pysheds {version('pysheds')}: catchment in m2 of a gauge at {gauges} of the width and height of its cell")
print(f"expected: {within}, as with snap='center'")
print(f"seen: {seen}")
assert len(set(within)) == 1 and within[0] == seen[0]
assert seen[1] < 0.1 * within[1] and seen[3] < 0.1 * within[3] and seen[2] > within[2], "the behaviour has changed"
PYTHON
