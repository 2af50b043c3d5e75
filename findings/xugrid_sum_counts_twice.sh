#!/bin/sh
# The method "sum" of xugrid's OverlapRegridder counts a cell in full for each cell that it touches.
#
# Guess:      stems, volumes or loads summed onto another mesh keep their total: a cell that lies in two cells is
#             shared by its areas, which the regridder stores.
# Seen:       four cells with 1, 2, 3 and 4 stems onto three wider ones: 3, 5 and 4 stems, 12 in place of 10. The cell
#             on the common edge is counted on both sides. "mean" is weighted by area. No warning.
# Matters:    stems of a survey on the mesh of a model, or volumes on a coarser one, that grow with the number of
#             edges: triangles of about the size of the cells get two to three times the number.
# Documented: the class lists the methods and says that areas of overlap are stored and can be used in several ways.
# Versions:   xugrid 0.15.3, numba-celltree 0.4.2, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3, xarray 2025.7.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    xugrid==0.15.3 numba-celltree==0.4.2 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3 xarray==2025.7.1
cd "$work"
timeout 300 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import xarray as xr
import xugrid


def strip(edges):
    """Rectangles 1 m wide between edges along x."""
    x, y = np.meshgrid(np.asarray(edges, float), [0.0, 1.0])
    below, above = np.arange(x.size).reshape(2, -1)
    cells = np.column_stack([below[:-1], below[1:], above[1:], above[:-1]])
    return xugrid.Ugrid2d(x.ravel(), y.ravel(), -1, cells)


fine, coarse = strip([0.0, 1.0, 2.0, 3.0, 4.0]), strip([0.0, 1.5, 3.0, 4.0])
stems = xugrid.UgridDataArray(xr.DataArray([1.0, 2.0, 3.0, 4.0], dims=[fine.face_dimension]), fine)
seen = {method: xugrid.OverlapRegridder(stems, coarse, method=method).regrid(stems).values
        for method in ("sum", "mean")}
shared = seen["mean"] * coarse.area / fine.area[0]
print(f"xugrid {version('xugrid')}: 1, 2, 3 and 4 stems on cells of 1 m2, summed onto cells of {coarse.area} m2")
print(f"expected: {np.round(shared, 2)}, together {shared.sum():.1f}, the number of stems")
print(f"seen: {seen['sum']}, together {seen['sum'].sum():.1f}")
assert np.isclose(shared.sum(), 10.0)
assert seen["sum"].tolist() == [3.0, 5.0, 4.0], "the behaviour has changed"
PYTHON
