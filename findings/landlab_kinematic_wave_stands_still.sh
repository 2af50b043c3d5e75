#!/bin/sh
# The velocity of the kinematic wave of landlab is 0, and one Manning's n gives two depths in its two kinematic waves.
#
# Guess:      after run_one_step of KinwaveOverlandFlowModel the field water__velocity holds the velocity at the links, and
#             KinwaveImplicitOverlandFlow with the same roughness, also "Manning's", ends in the same steady depths.
# Seen:       the field stays 0 m/s, where discharge over depth is 0.10 m/s: the velocity is kept in another array. The
#             second component raises the depth to 1.5 instead of 5/3 unless depth_exp is given: 2.8 mm for 5.1 mm, with
#             the right discharge. No message.
# Matters:    shear stresses and travel times of runoff that are 0; depths among plants 44 % too small.
# Documented: water__velocity is an output with the unit m/s; 3/2 for "Darcy/Chezy" and 5/3 for Manning are named at
#             depth_exp, whose default is 1.5, and roughness is "Manning's".
# Versions:   landlab 2.10.1, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check landlab==2.10.1 numpy==2.3.1 scipy==1.16.0
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from landlab import RasterModelGrid
from landlab.components import KinwaveImplicitOverlandFlow, KinwaveOverlandFlowModel

RAIN, ROUGHNESS, SLOPE, SPACING, SECONDS = 36.0, 0.03, 0.01, 10.0, 6000  # mm/h, s/m^(1/3), -, m, s


def plane():
    """Five cells in a row that fall to the west."""
    grid = RasterModelGrid((3, 7), xy_spacing=SPACING)
    grid.set_closed_boundaries_at_grid_edges(True, True, False, True)
    grid.add_field("topographic__elevation", SLOPE * grid.node_x, at="node")
    grid.add_zeros("topographic__gradient", at="link")
    return grid


def outlet_depth(grid):
    return round(1000.0 * float(grid.at_node["surface_water__depth"][8]), 2)


explicit = plane()
wave = KinwaveOverlandFlowModel(explicit, precip_rate=RAIN, precip_duration=SECONDS / 3600.0, roughness=ROUGHNESS)
for _ in range(SECONDS):
    wave.run_one_step(1.0)
implicit = {}
for name, options in {"default": {}, "depth_exp 5/3": {"depth_exp": 5.0 / 3.0}}.items():
    grid = plane()
    wave = KinwaveImplicitOverlandFlow(grid, runoff_rate=RAIN, roughness=ROUGHNESS, **options)
    for _ in range(SECONDS // 10):
        wave.run_one_step(10.0)
    outflow = float(grid.at_node["surface_water_inflow__discharge"][7]) / SPACING
    implicit[name] = (outlet_depth(grid), round(outflow, 6))

discharge = 5.0 * SPACING * RAIN / 3.6e6  # m2/s
depth = (discharge * ROUGHNESS / SLOPE**0.5) ** 0.6
fastest = float(np.abs(explicit.at_link["water__velocity"]).max())
largest = round(float(np.abs(explicit.at_link["water__specific_discharge"]).max()), 6)
print(f"landlab {version('landlab')}: steady runoff at the outlet")
print(f"expected: {discharge / depth:.2f} m/s, {1000.0 * depth:.2f} mm and {discharge} m2/s in both")
print(f"seen: {fastest} m/s, {outlet_depth(explicit)} mm and {largest} m2/s; implicit {implicit}")
assert largest == discharge and abs(outlet_depth(explicit) - 1000.0 * depth) < 0.01
assert implicit["depth_exp 5/3"] == (outlet_depth(explicit), discharge)
assert fastest == 0.0 and implicit["default"] == (2.82, discharge), "the behaviour has changed"
PYTHON
