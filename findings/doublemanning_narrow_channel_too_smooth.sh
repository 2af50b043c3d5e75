#!/bin/sh
# In doublemanning the area of Manning's formula is width times hydraulic radius: a narrow channel comes out half as
# rough.
#
# Guess:      gaugings that follow Manning's formula, A R^(2/3) S^(1/2) / n, in a rectangular channel give back their n.
# Seen:       the discharge is b R^(5/3) S^(1/2) / n. In a channel 5 m wide, up to 2 m deep, exact gaugings with n =
#             0.035 give 0.019 and a stage of zero flow 18 cm above the bed; in one of 20 m 0.028 and 7 cm, in one of
#             200 m 0.034. With use_depth, which is right in wide channels, the formula has b h^(5/3). No warning.
# Matters:    a roughness that depends on the width, and another curve above the highest gauging, with a residual that
#             looks like scatter.
# Documented: the docstring names Manning's equation and the hydraulic radius in place of the depth.
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
from importlib.metadata import version

import numpy as np
import pandas as pd
from doublemanning import ManningFit

stage = np.linspace(0.4, 1.9, 15)  # m, below the banks


def fitted(width):
    """Manning's n and the stage of zero flow, from exact gaugings of a rectangular channel with n = 0.035."""
    radius = stage * width / (width + 2.0 * stage)
    discharge = width * stage * radius ** (2.0 / 3.0) * 0.001**0.5 / 0.035
    pd.DataFrame({"Discharge": discharge, "Stage": stage}).to_csv("gaugings.csv", sep="\t", index=False)
    sys.argv = ["doublemanning-fit", "-f", "gaugings.csv", "-b", str(width), "-H", "2", "-s", "0.001", "-o", "curve.csv"]
    ManningFit.main()
    curve = pd.read_csv("curve.csv").iloc[0]
    return round(float(curve["Manning's n"]), 3), round(float(curve["Stage at Q = 0 [m]"]), 2)


seen = {width: fitted(width) for width in (5.0, 20.0, 200.0)}
print(f"doublemanning {version('doublemanning')}: n and stage of zero flow in m of gaugings with n = 0.035, by the width in m")
print("expected: 0.035 and 0 for each width")
print(f"seen: {seen}")
assert 0.030 < seen[200.0][0] < 0.036
assert seen[5.0][0] < 0.022, "the behaviour has changed"
PYTHON
