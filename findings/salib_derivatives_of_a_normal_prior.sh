#!/bin/sh
# With normal priors the derivative-based screening of SALib takes mean and standard deviation for the bounds.
#
# Guess:      finite_diff moves each set by one per cent, and dgsm bounds the total index from above in each unit, for
#             normal and uniform priors alike ("dists" is read by both).
# Seen:       for n = 0.030 +- 0.003 and Q = 3.0 +- 0.3 m3/s the moved value is always the mean itself (larger than
#             0.003 is "outside"), and the width of the range is "0.003 minus 0.030": dgsm is 4.1, with uniform priors
#             0.61 (total index 0.50). With lognormal priors dgsm of the roughness is 73,000. No error, no warning.
#             dgsm_conf is not scaled at all: 1.9 beside an index of 0.61, and for Q 10,000 times smaller.
# Matters:    a screening of roughness and discharge that ranks them by their unit, with an interval of another number.
# Documented: the sampler and the analysis say nothing about "dists"; the manual gives the meaning of bounds by dists.
# Versions:   SALib 1.6.0, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    SALib==1.6.0 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from SALib.analyze import dgsm, sobol
from SALib.sample import finite_diff
from SALib.sample import sobol as pairs

half = np.sqrt(3.0)  # of the width of a uniform prior, in standard deviations
priors = {"unif": [[0.03 - 0.003 * half, 0.03 + 0.003 * half], [3.0 - 0.3 * half, 3.0 + 0.3 * half]],
          "norm": [[0.03, 0.003], [3.0, 0.3]],
          "lognorm": [[np.log(0.03), 0.1], [np.log(3.0), 0.1]]}


def depth(values):
    """Normal depth in a channel 5 m wide with a slope of 0.001, by Manning."""
    return (values[:, 0] * values[:, 1] / (5.0 * np.sqrt(0.001))) ** 0.6


index, interval, total = {}, {}, {}
for name, bounds in priors.items():
    problem = {"num_vars": 2, "names": ["n", "Q"], "bounds": bounds, "dists": [name, name]}
    sets = finite_diff.sample(problem, 1024, delta=0.01, seed=1)
    found = dgsm.analyze(problem, sets, depth(sets), seed=1)
    index[name], interval[name] = found["dgsm"], found["dgsm_conf"]
    sets = pairs.sample(problem, 1024, calc_second_order=False, seed=1)
    total[name] = sobol.analyze(problem, depth(sets), calc_second_order=False, seed=1)["ST"]
print(f"SALib {version('SALib')}: depth for a roughness 0.030 +- 0.003 and a discharge 3.0 +- 0.3 m3/s")
print("expected: equal indices of n and Q, somewhat above the total index, an interval in the same unit")
for name in priors:
    print(f"seen, {name}: dgsm {index[name]}, dgsm_conf {interval[name]}, total index {np.round(total[name], 2)}")
assert all(np.allclose(one, 0.5, atol=0.03) for one in total.values())
assert np.allclose(index["unif"], 0.608, atol=0.01)
assert (index["norm"] > 3.0).all() and index["lognorm"][0] > 10000.0, "the behaviour has changed"
assert interval["unif"][0] > 1000.0 * interval["unif"][1], "the behaviour has changed"
PYTHON
