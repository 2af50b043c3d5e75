#!/bin/sh
# With Manning's n as its roughness AWIVE finds a thirtieth of the discharge.
#
# Guess:      get_water_flow with the surface velocities of the verticals, their depths and "roughness: Manning's n"
#             gives about 0.85 of the surface velocity times the area.
# Seen:       1/roughness is the exponent of a power law over the depth, so that the mean of a vertical is n / (1 + n)
#             of its surface velocity: of 10 m3/s below a surface at 1 m/s 0.34 m3/s are left at n = 0.035 and 0.20 at
#             0.02; a rougher bed carries more. With 6, the usual exponent as its denominator, it is 8.57. The second
#             column is "distance between depths" and read as places: verticals 1 m apart, given as distances, have 0
#             m3/s. No warning.
# Matters:    the discharge of a camera at a river, 25 times too small, or larger after the plants have grown.
# Documented: otherwise. The docstring says Manning's n and distances; in the configuration the setting is described as
#             Manning's roughness coefficient, and is 8 unless given.
# Versions:   awive 3.3.2 (its module water_flow, without the image libraries), numpy 1.26.4.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    awive==3.3.2 numpy==1.26.4
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from awive.algorithms.water_flow import get_water_flow

places = np.arange(10.0)
profile, distances = np.column_stack([np.ones(10), places]), np.ones((10, 2))  # 1 m deep, a vertical each metre
speeds = np.ones(10)  # m/s at the surface


def discharge(roughness, verticals=profile):
    """Discharge in m3/s at the depth of the survey."""
    return round(float(get_water_flow(verticals, speeds, 1.0, roughness, 1.0)), 2)


smooth, rough, power, apart = discharge(0.02), discharge(0.035), discharge(6.0), discharge(6.0, distances)
print(f"awive {version('awive')}: discharge in m3/s below a surface of 10 m at 1 m/s, 1 m deep")
print("expected: about 8.5 for n = 0.035, not less for n = 0.02; the same for verticals given by their distances")
print(f"seen: {rough} for 0.035, {smooth} for 0.02; {power} for 6; {apart} with distances")
assert power == 8.57
assert (smooth, rough, apart) == (0.2, 0.34, 0.0), "the behaviour has changed"
PYTHON
