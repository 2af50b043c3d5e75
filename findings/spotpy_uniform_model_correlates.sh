#!/bin/sh
# A model with one velocity everywhere has a rank correlation of 1 in the non-parametric KGE of SPOTPY.
#
# Guess:      ranks of equal values are their mean (Spearman), so that a model without any pattern has no correlation
#             and a model with the measured pattern is better.
# Seen:       kge_non_parametric ranks equal values in the order of the measurements, as if the model had them right:
#             one velocity everywhere has a correlation of 1.0 and KGE 0.90; a model with the measured pattern, two
#             neighbours exchanged, has 0.94 and KGE 0.88. scipy gives NaN and 0.94. A model that alternates between
#             two velocities has 0.37, by scipy -0.10.
# Matters:    a calibration by this score prefers a uniform flow to one with the shadow of plants. Readings or depths
#             that are rounded, in a model or an export, raise the score as well.
# Documented: the docstring names the paper (Pool et al. 2018), which takes the Spearman rank correlation. A comment in
#             the code has the version of scipy, switched off.
# Versions:   spotpy 1.6.7, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    spotpy==1.6.7 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from scipy.stats import spearmanr
from spotpy.objectivefunctions import kge_non_parametric

measured = np.array([0.31, 0.42, 0.55, 0.60, 0.48, 0.37])  # m/s, across a channel with plants at its banks
models = {
    "uniform": np.full(6, measured.mean()),
    "two neighbours exchanged": np.array([0.33, 0.46, 0.66, 0.65, 0.52, 0.40]),
    "two values": np.where(np.arange(6) % 2, 0.40, 0.50),
}
seen = {}
for name, model in models.items():
    score, correlation, _, _ = kge_non_parametric(measured, model, return_all=True)
    seen[name] = (float(score), float(correlation), float(spearmanr(measured, model).statistic))
print(f"spotpy {version('spotpy')}: KGE and correlation; expected, by scipy")
for name, (score, correlation, by_scipy) in seen.items():
    print(f"{name}: {score:.2f}, {correlation:.2f}; {by_scipy:.2f}")
ties = np.argsort(np.lexsort((measured, models["two values"])))  # equal values ranked as the measurements are
assert np.isclose(seen["two values"][1], np.corrcoef(ties, np.argsort(np.argsort(measured)))[0, 1]), "has changed"
assert seen["uniform"][1] == 1.0 and np.isnan(seen["uniform"][2]), "the behaviour has changed"
assert seen["uniform"][0] > seen["two neighbours exchanged"][0], "the behaviour has changed"
assert np.isclose(seen["two neighbours exchanged"][1], seen["two neighbours exchanged"][2])
PYTHON
