#!/bin/sh
# The samples of dynesty are not draws of the posterior: their mean lies between prior and posterior.
#
# Guess:      results.samples are samples of the posterior, as those of an MCMC sampler or of another nested one
#             (ultranest returns "samples" of equal weight).
# Seen:       they are all points from the prior inwards, each with a weight. Their mean roughness is 0.056 +- 0.036
#             where the posterior has 0.040 +- 0.002; samples_equal() and the weights give it. No error, and a
#             histogram of samples looks like a posterior with a long tail.
# Matters:    a roughness 40 % too high with an error 20 times too large, so that every model agrees with it.
# Documented: yes, among the results ("logwt", "importance_weights"); the name "samples" says nothing.
# Versions:   dynesty 3.1.0, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    dynesty==3.1.0 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import dynesty
import numpy as np

DISCHARGE = np.array([1.0, 1.5, 2.0, 3.0, 4.0])  # m3/s


def depths(n):
    """Normal depths in a channel 5 m wide with a slope of 0.001, by Manning."""
    return (n * DISCHARGE / (5.0 * np.sqrt(0.001))) ** 0.6


sampler = dynesty.NestedSampler(
    lambda parameters: -0.5 * np.sum(((depths(parameters[0]) - depths(0.04)) / 0.05) ** 2),
    lambda unit: 0.01 + 0.19 * unit, 1, nlive=200, rstate=np.random.default_rng(1))
sampler.run_nested(print_progress=False)
results = sampler.results
samples, equal = results.samples[:, 0], results.samples_equal(rstate=np.random.default_rng(1))[:, 0]
grid = np.linspace(0.01, 0.2, 20000)
weight = np.exp([-0.5 * np.sum(((depths(n) - depths(0.04)) / 0.05) ** 2) for n in grid])
mean = float(np.average(grid, weights=weight))
error = float(np.sqrt(np.average((grid - mean) ** 2, weights=weight)))
print(f"dynesty {version('dynesty')}: roughness from five depths, uniform prior from 0.01 to 0.2")
print(f"expected: samples with the mean and the standard deviation of the posterior, {mean:.4f} +- {error:.4f}")
print(f"seen: samples {samples.mean():.4f} +- {samples.std():.4f};"
      f" samples_equal {equal.mean():.4f} +- {equal.std():.4f}")
assert np.isclose(equal.mean(), mean, rtol=0.02) and np.isclose(equal.std(), error, rtol=0.15)
assert samples.mean() > 1.25 * mean and samples.std() > 10.0 * error, "the behaviour has changed"
PYTHON
