#!/bin/sh
# The discharge of landlab's OverlandFlow is that of one metre of width, although its unit is given as m3/s.
#
# Guess:      surface_water__discharge ("m3/s, volumetric discharge of surface water") of uniform flow grows with the
#             width of the cells: on a grid of 10 m it is five times that on a grid of 2 m.
# Seen:       the same number on both, 0.072, equal to Manning's discharge for each metre of width. The discharge that
#             passes a row of cells is ten times as large.
# Matters:    a discharge summed over a section, or compared with a gauge, that is too small by the size of the cells;
#             on a grid of 0.5 m it is too large.
# Documented: the table of variables says m3/s; no remark in the reference of the component.
# Versions:   landlab 2.10.1 with requireit 0.9.0, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    landlab==2.10.1 requireit==0.9.0 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from landlab import RasterModelGrid
from landlab.components import OverlandFlow

DEPTH, SLOPE, ROUGHNESS = 0.2, 0.001, 0.03


def discharge(cell):
    """At a link in the middle of a plane with uniform flow, in the unit of the component."""
    grid = RasterModelGrid((9, 60), xy_spacing=cell)
    bed = grid.add_zeros("topographic__elevation", at="node")
    bed[:] = SLOPE * (grid.x_of_node.max() - grid.x_of_node)
    grid.set_closed_boundaries_at_grid_edges(False, True, False, True)
    grid.add_full("surface_water__depth", DEPTH, at="node")
    flow, time = OverlandFlow(grid, mannings_n=ROUGHNESS, h_init=1e-5), 0.0
    while time < 200.0:
        step = flow.calc_time_step()
        flow.overland_flow(step)
        time += step
    return float(grid.at_link["surface_water__discharge"][grid.links_at_node[4 * 60 + 30, 0]])


by_metre = DEPTH ** (5.0 / 3.0) * np.sqrt(SLOPE) / ROUGHNESS
seen = {cell: discharge(cell) for cell in (2.0, 10.0)}
unit = OverlandFlow.var_units("surface_water__discharge")
print(f"landlab {version('landlab')}: uniform flow 0.2 m deep, surface_water__discharge in '{unit}'")
print(f"expected: {({cell: round(float(cell * by_metre), 3) for cell in seen})} m3/s by size of the cells in m")
print(f"seen: {({cell: round(one, 3) for cell, one in seen.items()})}")
assert unit == "m3/s", "the behaviour has changed"
assert np.allclose(list(seen.values()), by_metre, rtol=0.01), "the behaviour has changed"
PYTHON
