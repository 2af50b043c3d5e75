#!/bin/sh
# A gauging that is switched off takes part in the rating curve of HydRating as before.
#
# Guess:      add_data(enabled="used") keeps gaugings with False out of the fit: the column "flags if a measurement is
#             used or not in the fitting".
# Seen:       the name of the column is stored and never read. With seven gaugings on a curve and one behind ice,
#             switched off, the discharge at 3.0 m is 20 % lower than without the row, the same as with all eight.
#             Method, grade and uncertainty are stored as well and do nothing. No message.
# Matters:    gaugings with backwater from plants or ice are kept in the table and switched off. Their discharges stay
#             in the curve, and the roughness that is calibrated to it is too large.
# Documented: otherwise, in the docstring of add_data.
# Versions:   hydrating 0.0.5, lmfit 1.3.4, numpy 2.4.4, scipy 1.16.0, pandas 3.0.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    hydrating==0.0.5 lmfit==1.3.4 numpy==2.4.4 scipy==1.16.0 pandas==3.0.2 matplotlib==3.10.9
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pandas as pd
from hydrating import RatingCurve
from hydrating.models import PowerLaw

stage = np.array([0.6, 0.8, 1.1, 1.5, 1.9, 2.3, 2.8, 2.6])  # m
discharge = 8.0 * (stage - 0.4) ** 1.6
discharge[-1] *= 0.5  # behind ice
table = pd.DataFrame({"h": stage, "q": discharge, "used": [True] * 7 + [False]})


def at_three_metres(gaugings, **columns):
    """Discharge in m3/s at 3.0 m by the fitted curve."""
    curve = RatingCurve(PowerLaw, {"a": 8.0, "h0": 0.4, "b": 1.6})
    curve.add_data(gaugings, "h", "q", **columns)
    curve.fit()
    return round(float(curve.predict(np.array([3.0]))[0]), 1)


off, all_eight = at_three_metres(table, enabled="used"), at_three_metres(table)
without = at_three_metres(table[table["used"]])
print(f"hydrating {version('hydrating')}: discharge in m3/s at 3.0 m")
print(f"expected: {without} with the gauging behind ice switched off, as without its row")
print(f"seen: {off} with it switched off, {all_eight} with all eight")
assert off == all_eight and off < 0.9 * without, "the behaviour has changed"
PYTHON
