#!/bin/sh
# A largest lag of 0.5 m is half of the survey in scikit-gstat; of 50 cm it is 50 cm.
#
# Guess:      maxlag is a distance in the unit of the coordinates, so that a variogram does not depend on their unit.
# Seen:       values below 1 are a share of the largest distance. In a flume 4 m long, in metres, maxlag=0.5 uses pairs
#             up to 2 m, with lags of 0.4 m instead of 0.1 m; the same places in centimetres use 50 cm. No warning.
# Matters:    bed forms and plants in a flume are correlated over decimetres. The range fitted here is 2 m or 0.5 m.
# Documented: the docstring says that values between 0 and 1 are relative.
# Versions:   scikit-gstat 1.0.26, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    scikit-gstat==1.0.26 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from skgstat import Variogram

metres = np.linspace(0.0, 4.0, 161)
bed = 0.01 * np.sin(np.pi * metres)  # bed forms 1 cm high, 2 m long


def of(places, maxlag):
    variogram = Variogram(places, bed, maxlag=maxlag, n_lags=5)
    return np.round(variogram.bins, 3).tolist(), round(float(variogram.parameters[0]), 2)


seen = {"m": of(metres, 0.5), "cm": of(100.0 * metres, 50.0)}
print(f"scikit-gstat {version('scikit-gstat')}: one bed, largest lag 0.5 m, stated in m and in cm")
print("expected: lags 0.1 to 0.5 m and 10 to 50 cm; one range")
print(f"seen: lags and fitted range {seen}")
assert seen["cm"][0] == [10.0, 20.0, 30.0, 40.0, 50.0]
assert seen["m"][0] == [0.4, 0.8, 1.2, 1.6, 2.0], "the behaviour has changed"
assert seen["m"][1] > 1.5 * seen["cm"][1] / 100.0, "the behaviour has changed"
PYTHON
