#!/bin/sh
# A normal prior in equadratures takes the variance, and a lognormal one has the median 1 whatever its parameters.
#
# Guess:      Parameter("gaussian", 0.03, 0.003) is a roughness of 0.030 +- 0.003, as in scipy, SALib, chaospy,
#             OpenTURNS and SPOTPY; a lognormal one takes a location and a spread.
# Seen:       0.003 is the variance: the standard deviation is 0.055, and 29 % of the samples are negative roughness.
#             The lognormal takes its first number for the spread of the logarithm and ignores the second: the mean is
#             1.005 for (0.1, 0.5) and for (0.1, 2.0). No error.
# Matters:    polynomial chaos for a roughness of 0.03 over negative roughness, or over one of 1.
# Documented: the docstring says that B is the variance of a gaussian; nothing about the lognormal.
# Versions:   equadratures 10, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    equadratures==10 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import equadratures
import numpy as np

priors = {"gaussian": (0.03, 0.003), "lognormal": (0.1, 0.5), "lognormal again": (0.1, 2.0)}
seen = {}
for name, (first, second) in priors.items():
    prior = equadratures.Parameter(
        distribution=name.split()[0], shape_parameter_A=first, shape_parameter_B=second, order=3)
    np.random.seed(1)
    samples = prior.get_samples(20000)
    seen[name] = (float(samples.mean()), float(samples.std()), float((samples < 0.0).mean()))
print(f"equadratures {version('equadratures')}: priors {priors}")
print("expected: gaussian 0.03 +- 0.003, none below 0; two lognormal priors that differ")
print("seen: " + ", ".join(f"{name} {mean:.3f} +- {spread:.3f}, {below:.0%} below 0"
                           for name, (mean, spread, below) in seen.items()))
assert np.isclose(seen["gaussian"][1], np.sqrt(0.003), rtol=0.03), "the behaviour has changed"
assert seen["gaussian"][2] > 0.25, "the behaviour has changed"
assert seen["lognormal"] == seen["lognormal again"] and np.isclose(seen["lognormal"][0], 1.005, atol=0.01), "changed"
PYTHON
