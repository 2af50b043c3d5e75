#!/bin/sh
# In python-serafin the friction law number 3 of TELEMAC is another law.
#
# Guess:      get_us_equation, which gives the friction velocity of a TELEMAC result from its BOTTOM FRICTION, takes the
#             number of LAW OF BOTTOM FRICTION in the steering file: 2 Chezy, 3 Strickler, 4 Manning, 5 Nikuradse.
# Seen:       the laws are counted from 0: 3 is Nikuradse and 2 is Manning. A bed with Strickler's 30, 1 m/s and 1 m of
#             water has a shear stress of 160 Pa instead of 10.9, as by roughness elements of 30 m; Chezy's 50 gives
#             24.5 MPa. 4 and 5 give None. No message for 2 and 3.
# Matters:    shear stresses of a TELEMAC run fifteen times too large, from which grains and plants that are carried away
#             are found.
# Documented: the names of the four numbers, without a word of TELEMAC's; Strickler is STRICKLER_ID, 1.
# Versions:   python-serafin 0.2.2, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check python-serafin==0.2.2 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from serafin.variable import get_us_equation
from serafin.variable.variables_utils import do_calculation

DEPTH, SPEED, DENSITY, GRAVITY = 1.0, 1.0, 1000.0, 9.80665
cases = {  # number in a steering file: coefficient, and right shear stress in Pa
    2: (50.0, DENSITY * GRAVITY * SPEED**2 / 50.0**2),
    3: (30.0, DENSITY * GRAVITY * SPEED**2 / (30.0**2 * DEPTH ** (1.0 / 3.0))),
    4: (0.033, DENSITY * GRAVITY * SPEED**2 * 0.033**2 / DEPTH ** (1.0 / 3.0)),
}


def stress(number, coefficient):
    """Shear stress at the bed in Pa by the law of a number."""
    equation = get_us_equation(number)
    if equation is None:
        return None
    velocity = do_calculation(equation, [np.array([one]) for one in (coefficient, DEPTH, SPEED)])
    return round(float(DENSITY * velocity[0] ** 2), 1)


seen = {number: stress(number, coefficient) for number, (coefficient, _) in cases.items()}
print(f"python-serafin {version('python-serafin')}: shear stress in Pa by the number of the law in TELEMAC")
print(f"expected: {({number: round(right, 1) for number, (_, right) in cases.items()})}")
print(f"seen: {seen}")
assert abs(stress(1, 30.0) - cases[3][1]) < 0.1
assert seen == {2: 24516625.0, 3: 160.0, 4: None}, "the behaviour has changed"
PYTHON
