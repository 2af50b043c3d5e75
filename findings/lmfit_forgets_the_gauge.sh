#!/bin/sh
# The standard error of lmfit does not depend on the error of the gauge: 1 mm or 5 cm give the same.
#
# Guess:      weights of 1 / sigma carry the error of the measurements into the standard error of the roughness: gauges
#             five times worse make it five times larger, as in a fit by hand or with iminuit.
# Seen:       the covariance is scaled so that the fit is perfect ("scale_covar"): with depths good to 1 cm or to 5 cm
#             the roughness is 0.0400 +- 0.00007, where the errors of the gauge give 0.0004 and 0.0020. Five depths
#             that happen to lie on the curve make the roughness six or thirty times too sure.
# Matters:    a roughness from few levels that is given without the error of the gauges, and differs "significantly"
#             from any other.
# Documented: scale_covar=True is the documented default; the docstring of "weights" does not mention it.
# Versions:   lmfit 1.3.4, iminuit 2.33.0, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    lmfit==1.3.4 iminuit==2.33.0 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import lmfit
import numpy as np
from iminuit import Minuit
from iminuit.cost import LeastSquares

discharge = np.array([1.0, 1.5, 2.0, 3.0, 4.0])  # m3/s


def depth(Q, n):
    """Normal depth in a channel 5 m wide with a slope of 0.001, by Manning."""
    return (n * Q / (5.0 * np.sqrt(0.001))) ** 0.6


measured = depth(discharge, 0.04) + np.array([0.002, -0.001, 0.001, -0.002, 0.001])
names, seen, by_hand = ("lmfit", "iminuit"), {}, {}
for error in (0.01, 0.05):  # of the gauges, m
    slope = (depth(discharge, 0.0401) - depth(discharge, 0.0399)) / 0.0002
    by_hand[error] = float(error / np.sqrt(np.sum(slope**2)))
    fit = lmfit.Model(depth).fit(measured, Q=discharge, n=0.03, weights=np.full(5, 1.0 / error))
    other = Minuit(LeastSquares(discharge, measured, error, depth), n=0.03)
    other.migrad()
    seen[error] = (float(fit.params["n"].stderr), float(other.errors["n"]))
print(", ".join(f"{name} {version(name)}" for name in names) + ": standard error of n by the error of the gauges in m")
print(f"expected: {({error: round(one, 5) for error, one in by_hand.items()})}")
for i, name in enumerate(names):
    print(f"seen, {name}: {({error: round(one[i], 5) for error, one in seen.items()})}")
assert all(np.isclose(one[1], by_hand[error], rtol=0.02) for error, one in seen.items())
assert np.isclose(seen[0.01][0], seen[0.05][0], rtol=1e-3), "the behaviour has changed"
assert seen[0.05][0] < by_hand[0.05] / 20.0, "the behaviour has changed"
PYTHON
