#!/bin/sh
# iminuit gives errors that are 41 % too large for a likelihood of one's own.
#
# Guess:      the error of a parameter is its standard deviation, for the sum of squares and for the negative logarithm
#             of the likelihood (half of it) alike, or iminuit asks which of them it minimises.
# Seen:       an error is the distance at which the function rises by errordef, 1 unless it is set: right for chi
#             squared, sqrt(2) too large for the likelihood. hesse and minos agree with each other. No warning. The
#             library's own cost functions set errordef themselves.
# Matters:    a roughness that is 0.0400 +- 0.0004 by least squares and 0.0400 +- 0.0006 by the equal likelihood.
# Documented: yes, under errordef ("0.5 for negative log-likelihood"); iminuit before 2.0 warned if it was not set.
# Versions:   iminuit 2.33.0, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check iminuit==2.33.0 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W error - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from iminuit import Minuit

DISCHARGE = np.array([1.0, 1.5, 2.0, 3.0, 4.0])  # m3/s


def depths(n):
    """Normal depths in a channel 5 m wide with a slope of 0.001, by Manning."""
    return (n * DISCHARGE / (5.0 * np.sqrt(0.001))) ** 0.6


measured = depths(0.04) + np.array([0.002, -0.001, 0.001, -0.002, 0.001])
functions = {
    "chi squared": lambda n: float(np.sum(((measured - depths(n)) / 0.01) ** 2)),
    "likelihood": lambda n: float(-np.sum(-0.5 * ((measured - depths(n)) / 0.01) ** 2)),
}
seen = {}
for name, function in functions.items():
    fit = Minuit(function, n=0.03)
    fit.migrad()
    fit.hesse()
    fit.minos()
    seen[name] = (float(fit.values["n"]), float(fit.errors["n"]), float(fit.merrors["n"].upper))
slope = (depths(0.0401) - depths(0.0399)) / 0.0002
expected = 0.01 / np.sqrt(np.sum(slope**2))
print(f"iminuit {version('iminuit')}: roughness from five depths with errors of 1 cm")
print(f"expected: standard deviation {expected:.6f} of both")
for name, (value, error, upper) in seen.items():
    print(f"seen, {name}: n = {value:.5f}, error {error:.6f} by hesse, {upper:.6f} by minos")
assert np.isclose(seen["chi squared"][1], expected, rtol=0.02)
assert np.isclose(seen["likelihood"][1] / seen["chi squared"][1], np.sqrt(2.0), rtol=0.01), "the behaviour has changed"
assert np.isclose(seen["likelihood"][2] / seen["chi squared"][2], np.sqrt(2.0), rtol=0.01), "the behaviour has changed"
PYTHON
