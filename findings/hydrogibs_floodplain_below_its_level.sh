#!/bin/sh
# In hydrogibs water spreads over a floodplain before it has reached its level.
#
# Guess:      a Profile of straight lines between its corners has exact areas between them, as interp_S says: a
#             quadratic interpolation by the width of the surface.
# Seen:       the width and the wetted perimeter at the level of a flat floodplain hold the floodplain, and below it they
#             are interpolated down to the next corner. A channel 2 m deep with banks of 1:2 between floodplains of 38 m
#             has 37 m2 at a depth of 1 m, where 18 is right, and 116 m2 at 2.00 m, but 41 m2 at 2.01 m. The discharge is
#             65 % too large at 1 m and 2.3 times the right one at 2 m. No warning.
# Matters:    rating curves of design sections, and of surveys with few points on the banks, below bankfull. A roughness
#             that is fitted to a gauging by such a curve is 1.65 times too large at half the depth.
# Documented: the docstring gives the interpolation. With points on the banks 10 cm apart only the last 10 cm are wrong.
# Versions:   hydrogibs 0.0.91, numpy 2.3.1, scipy 1.16.0, pandas 2.3.1, matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    numpy==2.3.1 scipy==1.16.0 pandas==2.3.1 matplotlib==3.10.3 click==8.2.1
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps hydrogibs==0.0.91
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from hydrogibs.fluvial.profile import Profile

STRICKLER, SLOPE = 30.0, 0.001
depths = np.array([1.0, 2.0, 2.01])
stations, levels = [0.0, 0.0, 38.0, 42.0, 58.0, 62.0, 100.0, 100.0], [4.0, 2.0, 2.0, 0.0, 0.0, 2.0, 2.0, 4.0]


def exact(depth):
    """Area in m2 and discharge in m3/s with all water in the channel, or over the floodplains too."""
    over = max(depth - 2.0, 0.0)
    area = 16.0 * (depth - over) + 2.0 * (depth - over) ** 2 + 100.0 * over
    perimeter = 16.0 + 2.0 * np.sqrt(5.0) * (depth - over) + (76.0 + 2.0 * over if over else 0.0)
    return area, STRICKLER * area * (area / perimeter) ** (2.0 / 3.0) * np.sqrt(SLOPE)


def seen_in(stations, levels):
    profile = Profile(stations, levels, K=STRICKLER, Js=SLOPE)
    return np.column_stack([profile.interp_S(depths), profile.interp_Q(depths)])


right, corners = np.array([exact(depth) for depth in depths]), seen_in(stations, levels)
bank = np.linspace(0.1, 1.9, 19)  # points on both banks, 10 cm apart
many = seen_in([*stations[:3], *(42.0 - 2.0 * bank[::-1]), 42.0, 58.0, *(58.0 + 2.0 * bank), *stations[5:]],
               [*levels[:3], *bank[::-1], 0.0, 0.0, *bank, *levels[5:]])
print(f"hydrogibs {version('hydrogibs')}: area in m2 and discharge in m3/s at depths of {depths.tolist()} m")
print(f"expected: {right.round(1).tolist()}")
print(f"seen: {corners.round(1).tolist()} by its corners, {many.round(1).tolist()} with points on the banks")
assert np.allclose(many[0], right[0], rtol=0.01) and np.allclose(corners[2, 0], right[2, 0], rtol=0.01)
assert np.allclose(corners[:2, 0], [37.0, 116.0], rtol=0.01), "the behaviour has changed"
assert np.allclose(corners[:2, 1] / right[:2, 1], [1.65, 2.32], rtol=0.02), "the behaviour has changed"
PYTHON
