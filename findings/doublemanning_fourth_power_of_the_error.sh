#!/bin/sh
# The "SD" of a rating curve in doublemanning is the fourth power of the standard error: 0.0014 becomes 4e-12.
#
# Guess:      "SD: Manning's n" is the square root of the diagonal of the covariance of the fit, in the unit of n.
# Seen:       it is the square of the diagonal. For fifteen gaugings with errors of 5 % the roughness of 0.0315 is known
#             to 0.0014 by the covariance, and the file gives 4e-12 beside it; the coefficient of the floodplain, known
#             to 2.2, has 26. In US units the two change in other ratios than the parameters.
# Matters:    a roughness that is taken for exact beside a floodplain that is taken for unknown; weights made from them
#             decide any comparison of sites.
# Documented: otherwise, by the words "standard deviations" in the output. No public thread found.
# Versions:   doublemanning 1.0.0a0, numpy 1.26.4, scipy 1.11.4, pandas 2.2.3, scikit-learn 1.5.2 (newer ones raise).
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    doublemanning==1.0.0a0 numpy==1.26.4 scipy==1.11.4 pandas==2.2.3 matplotlib==3.9.4 scikit-learn==1.5.2 \
    PyYAML==6.0.2
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import sys
from functools import partial
from importlib.metadata import version

import numpy as np
import pandas as pd
from doublemanning import ManningFit
from scipy.optimize import curve_fit

stage = np.linspace(0.4, 3.2, 15)  # m, in a channel 20 m wide and 2 m deep
model = partial(ManningFit._manning, h_bank=2.0, channelwidth=20.0, slope=0.001)
error = 1.0 + 0.05 * np.random.default_rng(2).standard_normal(15)
discharge = model(stage, 0.035, 12.0, 1.6, 0.0) * error
pd.DataFrame({"Discharge": discharge, "Stage": stage}).to_csv("gaugings.csv", sep="\t", index=False)
sys.argv = ["doublemanning-fit", "-f", "gaugings.csv", "-b", "20", "-H", "2", "-s", "0.001", "-o", "curve.csv"]
ManningFit.main()
curve = pd.read_csv("curve.csv").iloc[0]
bounds = ([0.0, 0.0, 0.0, -np.inf], [0.2, np.inf, np.inf, np.inf])
_, covariance = curve_fit(model, stage, discharge, bounds=bounds)
names = ("Manning's n", "Floodplain discharge coefficient")
right = [float(np.sqrt(covariance[i, i])) for i in (0, 1)]
found = [float(curve[f"SD: {name}"]) for name in names]
print(f"doublemanning {version('doublemanning')}: standard deviations of Manning's n and of the coefficient of the floodplain")
print(f"expected: {right[0]:.2g} and {right[1]:.2g}")
print(f"seen: {found[0]:.2g} and {found[1]:.2g}, for n = {curve[names[0]]:.4f}")
assert np.allclose(found, np.power(right, 4), rtol=0.05), "the behaviour has changed"
assert found[0] < 1e-9, "the behaviour has changed"
PYTHON
