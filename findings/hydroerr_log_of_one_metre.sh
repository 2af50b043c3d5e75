#!/bin/sh
# The logarithmic errors of HydroErr add 1 to each value: in metres they are hardly logarithmic, in millimetres they are.
#
# Guess:      rmsle of a model that is twice too deep is ln 2 = 0.69 in every unit, by the formula of its docstring,
#             ln(S / O); g_mean_diff is the ratio of the geometric means, 2.
# Seen:       depths of 2 to 8 cm: rmsle is 0.048 with metres, 0.68 with millimetres; male, msle and mean_var likewise.
#             g_mean_diff is 1.04 and 1.98: it averages the logarithms geometrically.
# Matters:    in a flume in metres the "relative" score is an absolute one: thin flow over the plants counts for nothing,
#             and a bar taken from discharges of a river is passed by a model that is wrong by a factor of two.
# Documented: the notes of rmsle say that each value is increased by one unit; the formula does not.
# Versions:   HydroErr 2.0.0, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    HydroErr==2.0.0 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import HydroErr
import numpy as np

measured = np.array([0.02, 0.03, 0.05, 0.08, 0.06])  # m
model = 2.0 * measured
names = ("rmsle", "male", "g_mean_diff")
seen = {unit: {name: float(getattr(HydroErr, name)(scale * model, scale * measured)) for name in names}
        for unit, scale in {"m": 1.0, "mm": 1000.0}.items()}
print(f"HydroErr {version('HydroErr')}: depths of a model that is twice too deep")
print(f"expected: rmsle and male {np.log(2.0):.3f}, ratio of geometric means 2, in each unit")
for unit, scores in seen.items():
    print(f"seen, in {unit}: {({name: round(one, 3) for name, one in scores.items()})}")
assert np.allclose(list(seen["m"].values()), [0.048, 0.044, 1.041], atol=1e-3), "the behaviour has changed"
assert np.allclose(list(seen["mm"].values()), [0.680, 0.680, 1.983], atol=1e-3), "the behaviour has changed"
PYTHON
