#!/bin/sh
# permetrics gives NSE 0 for a gauge that does not vary, for a perfect model and for a wrong one alike.
#
# Guess:      the efficiency is undefined (NaN or minus infinity) if all measured values are equal; a perfect model
#             scores 1.
# Seen:       0.0 for a model that is exact and for one that is ten times too high. Kling-Gupta efficiency likewise.
#             0 is the score of "as good as the mean" and enters averages over gauges as a number.
# Matters:    a regulated reach or a steady flume has constant levels. There the score cannot see the model.
# Documented: the defaults force_finite=True and finite_value=0.0 are listed among the parameters.
# Versions:   permetrics 2.1.0, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check permetrics==2.1.0 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from permetrics.regression import RegressionMetric

level = np.full(5, 1.0)
models = {"exact": level, "ten times too high": 10.0 * level, "with some scatter": level + [0.1, -0.1, 0.1, -0.1, 0.0]}
seen = {name: (float(RegressionMetric(level, model).NSE()), float(RegressionMetric(level, model).KGE()))
        for name, model in models.items()}
print(f"permetrics {version('permetrics')}: NSE and KGE at a gauge with the constant level of 1 m")
print("expected: 1 for the exact model, NaN or minus infinity for the others")
print(f"seen: {seen}")
assert all(scores == (0.0, 0.0) for scores in seen.values()), "the behaviour has changed"
PYTHON
