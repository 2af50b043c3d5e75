#!/bin/sh
# The areas of a projected UGRID mesh are those of a sphere in uxarray, its metres taken for degrees.
#
# Guess:      a mesh whose coordinates are projection_x_coordinate in m has areas in m2: 400 cells of 2 m by 2 m have
#             4 m2 each, and the weighted mean of a depth over equal cells is its mean. Or the mesh is refused.
# Seen:       683,000 m are a longitude of 683,000 degrees. Cells of one size have areas from 0.00002 to 0.0011 on a
#             unit sphere, and weighted_mean and integrate use them: water of 1.05 m on average has 0.70 m, and
#             1680 m3 of it are 0.17. No warning.
# Matters:    mean depths, volumes and flooded shares of a river model on a map grid (D-Flow FM, an exported flow.nc).
#             xugrid 0.15 reads the same file with areas in m2.
# Documented: the pages say that only grids on a sphere are supported, and public threads ask for others; a file that
#             states metres is opened without a remark.
# Versions:   uxarray 2026.10.0, numpy 2.3.1, xarray 2026.9.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    uxarray==2026.10.0 numpy==2.3.1 xarray==2026.9.0
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import uxarray as ux
import xarray as xr

CELL, LONG, WIDE = 2.0, 40, 10  # m, cells to the north, cells to the east
x, y = np.meshgrid(683000.0 + CELL * np.arange(WIDE + 1), 5200040.0 + CELL * np.arange(LONG + 1))
number = np.arange(x.size).reshape(x.shape)
faces = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
depth = np.repeat(np.linspace(0.1, 2.0, LONG), WIDE)
axis = {name: {"standard_name": f"projection_{name}_coordinate", "units": "m"} for name in "xy"}
xr.Dataset({
    "mesh2d": ((), 0, {"cf_role": "mesh_topology", "topology_dimension": 2, "face_dimension": "face",
                       "node_coordinates": "node_x node_y", "face_node_connectivity": "face_nodes"}),
    "node_x": ("node", x.ravel(), axis["x"]), "node_y": ("node", y.ravel(), axis["y"]),
    "face_nodes": (("face", "corner"), faces, {"cf_role": "face_node_connectivity", "start_index": 0}),
    "depth": ("face", depth, {"units": "m", "mesh": "mesh2d", "location": "face"}),
}).to_netcdf("flow.nc")
opened = ux.open_dataset("flow.nc", "flow.nc")
areas = np.asarray(opened.uxgrid.face_areas)
mean, volume = float(opened["depth"].weighted_mean()), float(opened["depth"].integrate())
print(f"uxarray {version('uxarray')}: {faces.shape[0]} cells of {CELL} m by {CELL} m, {depth.mean():.2f} m of water")
print(f"expected: areas of {CELL**2:.0f} m2, mean depth {depth.mean():.2f} m, volume {CELL**2 * depth.sum():.0f} m3")
print(f"seen: longitudes {np.asarray(opened.uxgrid.node_lon)[:2]}, areas {areas.min():.5f} to {areas.max():.5f},"
      f" mean depth {mean:.2f} m, volume {volume:.2f}")
corners = np.stack([x.ravel()[faces], y.ravel()[faces]])
assert np.isclose(np.ptp(corners[0], axis=1) * np.ptp(corners[1], axis=1), CELL**2).all()
south, north = (np.sin(np.radians(end(corners[1], axis=1))) for end in (np.min, np.max))
on_sphere = np.radians(CELL) * np.abs(north - south)  # between parallels of that many degrees
assert np.allclose(areas, on_sphere, rtol=0.02) and areas.max() > 20.0 * areas.min(), "the behaviour has changed"
assert np.isclose(mean, np.sum(areas * depth) / areas.sum()) and mean < 0.75, "the behaviour has changed"
PYTHON
