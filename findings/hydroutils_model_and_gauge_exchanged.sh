#!/bin/sh
# hydroutils hands the gauge to HydroErr as the model: the bias has the other sign, and the efficiency is another
# number.
#
# Guess:      nse(observed, simulated) and bias(observed, simulated) score the model against the gauge, as stat_error of
#             the same module does.
# Seen:       both arrays are passed on in this order to functions that take the model first. A model with half of the
#             measured flow above a base has an efficiency of -0.46 instead of 0.64, and a bias of +3.3 m3/s instead of
#             -3.3; one that is too high has a negative one. stat_error and pbias are right, so that one module has two
#             efficiencies. Kling-Gupta efficiency and volume error are exchanged as well; RMSE and correlation show
#             nothing.
# Matters:    a calibration by these functions is pulled towards too little flow, as the variance of the model stands in
#             the denominator, and the roughness is corrected in the wrong direction if it follows the bias.
# Documented: otherwise, by the names of the arguments. No public thread found.
# Versions:   hydroutils 0.2.0 (its module hydro_stat, without the rest of its dependencies), HydroErr 2.0.0, numpy
#             2.3.1, scipy 1.16.0, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    hydroutils==0.2.0 HydroErr==2.0.0 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3 python-dateutil==2.9.0.post0 \
    pytz==2025.2 six==1.17.0
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import importlib.util
import sys
from importlib.metadata import files, version

import numpy as np

# The package as a whole imports maps and plots; the module of scores does without.
place = next(file for file in files("hydroutils") if file.name == "hydro_stat.py").locate()
spec = importlib.util.spec_from_file_location("hydro_stat", place)
scores = importlib.util.module_from_spec(spec)
sys.modules["hydro_stat"] = scores
spec.loader.exec_module(scores)

hours = np.arange(48.0)
gauge = 5.0 + 30.0 * np.exp(-((hours - 20.0) / 6.0) ** 2)  # m3/s
model = 5.0 + 0.5 * (gauge - 5.0)
seen = {name: round(float(getattr(scores, name)(gauge, model)), 2) for name in ("nse", "bias", "kge")}
right = {name: round(float(value[0]), 2) for name, value in scores.stat_error(gauge[None], model[None]).items()}
print(f"hydroutils {version('hydroutils')}: scores of a model that has half of a flood")
print(f"expected: nse {right['NSE']}, bias {right['Bias']} m3/s, kge {right['KGE']}, as by stat_error of the same module")
print(f"seen: {seen}")
assert seen["bias"] == -right["Bias"] and right["Bias"] < 0.0, "the behaviour has changed"
assert seen["nse"] < 0.0 < right["NSE"], "the behaviour has changed"
PYTHON
