#!/bin/sh
# In US units pyopenchannel's Chezy coefficient from Manning's n lacks the factor 1.486.
#
# Guess:      Manning's formula and Chezy's with the coefficient made from the same n give one discharge, in each unit
#             system, as both are documented to follow the current one.
# Seen:       the same in metres; in feet Manning's is 1.486 times as large: chezy_from_manning is R^(1/6) / n whatever
#             the units. The "optimal" hydraulic radius of a trapezoid is that of a depth of b / (2 sqrt 3), a third of
#             the depth of the half hexagon that is the best one.
# Matters:    a roughness in feet (HEC-RAS, SRH-2D) that is turned to Chezy's and gives depths 30 % too large.
# Documented: the docstring of chezy_from_manning says metres; nothing raises in feet.
# Versions:   pyopenchannel 0.6.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check pyopenchannel==0.6.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version
from math import sqrt

from pyopenchannel.hydraulics import ChezyEquation, HydraulicRadius, ManningEquation
from pyopenchannel.units import set_unit_system

WIDTH, DEPTH, SLOPE, N = 16.4, 1.31, 0.001, 0.03
area, radius = WIDTH * DEPTH, WIDTH * DEPTH / (WIDTH + 2.0 * DEPTH)
seen = {}
for system in ("SI", "US_CUSTOMARY"):
    set_unit_system(system)
    chezy = ChezyEquation.chezy_from_manning(N, radius)
    seen[system] = (ManningEquation.discharge(area, radius, SLOPE, N),
                    ChezyEquation.discharge(area, radius, SLOPE, chezy))
best = WIDTH * sqrt(3.0) / 4.0  # half of the depth of half a hexagon
optimal = HydraulicRadius.optimal_trapezoidal(WIDTH, 1.0 / sqrt(3.0))
print(f"pyopenchannel {version('pyopenchannel')}: discharge by Manning and by Chezy for one roughness")
print(f"expected: equal in both unit systems; best hydraulic radius of a trapezoid {best:.2f}")
print(f"seen: {({name: [round(q, 2) for q in one] for name, one in seen.items()})}; {optimal:.2f}")
assert abs(seen["SI"][0] / seen["SI"][1] - 1.0) < 1e-9
assert abs(seen["US_CUSTOMARY"][0] / seen["US_CUSTOMARY"][1] - 1.486) < 0.001, "the behaviour has changed"
assert optimal < 0.6 * best, "the behaviour has changed"
PYTHON
