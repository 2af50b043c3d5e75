#!/bin/sh
# A run without results has a Nash-Sutcliffe efficiency of 1 and a bias of 0 in SPOTPY.
#
# Guess:      a run whose predictions are NaN has no score (NaN), as by KGE and RMSE of the module, or a bad one.
# Seen:       nashsutcliffe sums the errors without those that are NaN and divides by the scatter of all measurements: a
#             failed run has 1.0, the best value that exists, and one that fails in the flood peak alone is better than
#             the same run with its peak. bias and pbias are 0. Five samplers return a failed run as the best one.
# Matters:    a flow model that does not converge, or dries up at the gauges, for small roughness: the calibration ends
#             there, at an efficiency of 1.00.
# Documented: the docstring gives the formula of Nash and Sutcliffe; no remark about NaN.
# Versions:   spotpy 1.6.7, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    spotpy==1.6.7 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import contextlib
import io
from importlib.metadata import version

import numpy as np
import spotpy
from spotpy import objectivefunctions as score

DISCHARGE = np.array([1.0, 1.2, 1.5, 4.0, 2.0])  # m3/s


def depths(n):
    """Normal depths in a channel 5 m wide with a slope of 0.001, by Manning."""
    return (n * DISCHARGE / (5.0 * np.sqrt(0.001))) ** 0.6


measured, rough = depths(0.04), depths(0.05)
peak_lost = np.where(DISCHARGE > 3.0, np.nan, rough)
failed = np.full(5, np.nan)
efficiency = {name: float(score.nashsutcliffe(measured, run)) for name, run in
              {"n = 0.05": rough, "without its peak": peak_lost, "failed": failed}.items()}
known = ~np.isnan(peak_lost)
by_pairs = 1.0 - np.sum((measured - rough)[known] ** 2) / np.sum((measured[known] - measured[known].mean()) ** 2)


class Site:
    n = spotpy.parameter.Uniform("n", 0.02, 0.06)

    def simulation(self, vector):
        return list(depths(vector[0])) if vector[0] > 0.03 else [np.nan] * 5

    def evaluation(self):
        return list(measured)

    def objectivefunction(self, simulation, evaluation):
        return score.nashsutcliffe(evaluation, simulation)


best = {}
for name in ("mc", "lhs", "dds", "mcmc", "rope"):
    with contextlib.redirect_stdout(io.StringIO()):
        sampler = getattr(spotpy.algorithms, name)(Site(), dbname=name, dbformat="ram", random_state=1)
        sampler.sample(300)
    runs = sampler.getdata()
    best[name] = float(runs["parn"][np.argmax(runs["like1"])])
print(f"spotpy {version('spotpy')}: depths of a model that fails for a roughness below 0.03; true 0.04")
print(f"expected: no efficiency of a failed run, {by_pairs:.2f} without the peak; a roughness near 0.04")
print(f"seen: efficiencies {({name: round(one, 2) for name, one in efficiency.items()})},"
      f" bias {score.bias(measured, failed)}, kge {score.kge(measured, failed)}")
print(f"seen: best roughness by sampler {({name: round(one, 3) for name, one in best.items()})}")
assert efficiency["failed"] == 1.0 and score.pbias(measured, failed) == 0.0, "the behaviour has changed"
assert efficiency["without its peak"] > efficiency["n = 0.05"] > by_pairs, "the behaviour has changed"
assert all(one <= 0.03 for one in best.values()), "the behaviour has changed"
PYTHON
