#!/bin/sh
# PBIAS has opposite signs in two hydrological libraries, and KGE is not one formula.
#
# Guess:      for a model that is 10 % too high, measures of the same name agree.
# Seen:       percent bias: hydroeval -10, spotpy +10. Bias: spotpy -0.3 while the mean error of HydroErr is +0.3.
#             KGE with default settings: spotpy and hydroeval 0.859 (2009), permetrics 0.900 (2012). Two of the four
#             want the model first, two the measurement; an exchange raises nothing.
# Matters:    the roughness goes the wrong way if the sign is taken from another library's documentation, and KGE of
#             0.86 and 0.90 in two reports are one and the same model.
# Documented: each library documents its own formula; no page compares them.
# Versions:   hydroeval 0.1.0, HydroErr 2.0.0, permetrics 2.1.0, spotpy 1.6.7, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    hydroeval==0.1.0 HydroErr==2.0.0 permetrics==2.1.0 spotpy==1.6.7 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import HydroErr
import hydroeval
import numpy as np
import spotpy.objectivefunctions as spot
from permetrics.regression import RegressionMetric

measured = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
model = 1.1 * measured
percent = {"hydroeval": float(hydroeval.evaluator(hydroeval.pbias, model, measured)[0]),
           "spotpy": float(spot.pbias(measured, model))}
bias = {"HydroErr me": float(HydroErr.me(model, measured)), "spotpy bias": float(spot.bias(measured, model))}
kge = {"hydroeval": float(hydroeval.evaluator(hydroeval.kge, model, measured)[0][0]),
       "spotpy": float(spot.kge(measured, model)),
       "permetrics": float(RegressionMetric(measured, model).KGE())}
names = ("hydroeval", "HydroErr", "permetrics", "spotpy")
print(", ".join(f"{name} {version(name)}" for name in names) + ": a model that is 10 % too high")
print("expected: one percent bias, one bias, one KGE")
print(f"seen: percent bias {percent}, bias {bias}, KGE {kge}")
assert np.isclose(percent["hydroeval"], -10.0) and np.isclose(percent["spotpy"], 10.0), "the behaviour has changed"
assert np.isclose(bias["HydroErr me"], 0.3) and np.isclose(bias["spotpy bias"], -0.3), "the behaviour has changed"
assert np.isclose(kge["spotpy"], 0.85858) and np.isclose(kge["permetrics"], 0.9), "the behaviour has changed"
PYTHON
