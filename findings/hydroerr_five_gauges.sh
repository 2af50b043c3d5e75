#!/bin/sh
# The anomaly correlation of a perfect model is 0.80 at five gauges in HydroErr.
#
# Guess:      acc of a model that equals the measurements is 1, as the docstring says and as Pearson's r is, whatever the
#             number of gauges.
# Seen:       the sum over n is divided by n and by standard deviations over n - 1: a perfect model has (n - 1) / n, so
#             0.67 at three gauges, 0.80 at five and 0.99 at a hundred, where pearson_r is 1.
# Matters:    a reach with five gauges can never reach the score of one with a long record; with a bar of 0.9 no model of
#             it passes.
# Documented: the docstring gives the formula and the range from -1 to 1, in which 1 is a perfect correlation.
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

levels = {gauges: 2.0 - 0.1 * np.arange(gauges) for gauges in (3, 5, 100)}  # m, along a reach
seen = {gauges: float(HydroErr.acc(level, level)) for gauges, level in levels.items()}
pearson = {gauges: float(HydroErr.pearson_r(level, level)) for gauges, level in levels.items()}
print(f"HydroErr {version('HydroErr')}: anomaly correlation of a perfect model by number of gauges")
print(f"expected: 1 for each, as Pearson's r {({gauges: round(one, 3) for gauges, one in pearson.items()})}")
print(f"seen: {({gauges: round(one, 3) for gauges, one in seen.items()})}")
assert np.allclose(list(pearson.values()), 1.0)
assert np.allclose(list(seen.values()), [1.0 - 1.0 / gauges for gauges in seen]), "the behaviour has changed"
PYTHON
