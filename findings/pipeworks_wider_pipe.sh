#!/bin/sh
# A pipe whose diameter is set again in pipeworks has an area that is pi times too large.
#
# Guess:      Section(length, 2.0), and Section(length, 1.0) followed by set_diam(2.0), are the same pipe.
# Seen:       set_diam sets the area to pi^2/4 d^2, the constructor to pi/4 d^2: 9.87 ft2 for 3.14. The discharge under
#             pressure and that of the orifice are 3.14 times too large, the velocity is right. No message.
# Matters:    the inflow of a flume or of a reach below a dam, from a rating curve for which diameters were tried.
# Documented: "Sets the area [ft] and updates radius and area."
# Versions:   pipeworks 0.0.3, pandas 2.3.1, numpy 2.3.1, scipy 1.16.0, matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pipeworks==0.0.3 pandas==2.3.1 numpy==2.3.1 scipy==1.16.0 matplotlib==3.10.3
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pipeworks import Section

LENGTH, DIAMETER = 100.0, 2.0  # ft


def discharges(pipe):
    """Area in ft2, and discharge in ft3/s under 11 ft of head and through the orifice, and velocity in ft/s."""
    pipe.set_pressurized_params(C=120.0, K=1.5, z1=10.0, z2=0.0)
    pipe.calc_pressurized(1.0)
    pipe.calc_orifice()
    last = pipe.rating_press.iloc[-1]
    return [round(float(one), 2) for one in (pipe.area, last["Q"], pipe.rating_orifice["Q"].iloc[-1], last["V"])]


built, widened, by_area = Section(LENGTH, DIAMETER), Section(LENGTH, DIAMETER / 2.0), Section(LENGTH, DIAMETER / 2.0)
widened.set_diam(DIAMETER)
by_area.set_area(np.pi / 4.0 * DIAMETER**2)
right, seen, same = discharges(built), discharges(widened), discharges(by_area)
print(f"pipeworks {version('pipeworks')}: area in ft2, discharge under pressure and of the orifice in ft3/s, velocity in ft/s")
print(f"expected: {right}, as by set_area")
print(f"seen: {seen}")
assert same == right and abs(right[0] - np.pi) < 0.01
assert np.allclose(seen[:3], np.pi * np.array(right[:3]), rtol=1e-3) and seen[3] == right[3], "the behaviour has changed"
PYTHON
