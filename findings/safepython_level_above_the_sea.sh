#!/bin/sh
# Sobol' indices of SAFE depend on the datum of a level: 0.65 becomes 15.
#
# Guess:      variance-based indices do not change if a constant is added to the output: a depth and a level above the sea
#             have the same ones, up to the scatter of the sample.
# Seen:       vbsa_indices subtracts the square of a mean from a mean of products, both of the output as it is. With 3000
#             base runs the roughness has 0.65 of the variance of a depth, and 15 of that of the level 412 m higher; the
#             discharge has -9 and an input that is not used 3. Without the datum the three are 0.65, 0.35 and 0.01. The
#             error grows with the mean over the standard deviation. No warning.
# Matters:    screenings of levels in metres above the sea, or of discharges that vary by a few percent: parameters are
#             ranked by chance. Subtract the mean of the output first.
# Documented: the docstring gives the estimators, and no condition on the mean of the output.
# Versions:   safepython 0.2.0, numpy 2.3.1, scipy 1.16.0, matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    safepython==0.2.0 numpy==2.3.1 scipy==1.16.0 matplotlib==3.10.3
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from safepython.sampling import AAT_sampling
from safepython.VBSA import vbsa_indices, vbsa_resampling
from scipy import stats

np.random.seed(1)
ranges = [[0.02, 0.03], [0.5, 0.5], [0.0, 1.0]]  # lower bound and width: roughness, discharge in m2/s, an unused input
samples = vbsa_resampling(AAT_sampling("lhs", 3, stats.uniform, ranges, 6000))


def depth(inputs):
    """Normal depth in m of a wide channel with a slope of 0.001."""
    return (inputs[:, 0] * inputs[:, 1] / np.sqrt(0.001)) ** 0.6


def first_order(datum):
    return np.round(vbsa_indices(*(datum + depth(one) for one in samples), 3)[0], 2)


of_depth, of_level = first_order(0.0), first_order(412.0)
print(f"safepython {version('safepython')}: first-order indices of roughness, discharge and an unused input")
print(f"expected: {of_depth.tolist()} for the depth, and the same for the level")
print(f"seen: {of_level.tolist()} for the level of a bed 412 m above the sea")
assert np.allclose(of_depth, [0.65, 0.35, 0.0], atol=0.05)
assert np.all(np.abs(of_level - of_depth) > 2.0), "the behaviour has changed"
PYTHON
