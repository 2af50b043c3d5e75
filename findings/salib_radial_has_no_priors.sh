#!/bin/sh
# The radial samplers of SALib ignore the priors: a roughness of 0.035 +- 0.002 is sampled from 0 to 1.
#
# Guess:      one problem with "dists" means the same for each sampler; if not, a sampler refuses it.
# Seen:       with a normal roughness and a uniform discharge from 2 to 3 m3/s radial.sample gives both parameters
#             values from 0 to 1, not even within the bounds, and radial_mc takes mean and standard deviation as two
#             bounds: roughness from 0.002 to 0.035. Without "dists" both samplers are right. No error, no warning.
# Matters:    total indices by sobol_jansen are those of another site: of the depth, roughness and discharge have 0.54
#             each, while with the priors of the problem they have 0.20 and 0.80.
# Documented: otherwise. The docstring takes "SALib problem specification"; an exception for "dists" is not named.
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
from SALib.analyze import sobol, sobol_jansen
from SALib.sample import radial
from SALib.sample import sobol as saltelli
from SALib.sample.radial import radial_mc

SETS = 4096
problem = {"num_vars": 2, "names": ["n", "Q"], "bounds": [[0.035, 0.002], [2.0, 3.0]], "dists": ["norm", "unif"]}
plain = {"num_vars": 2, "names": ["n", "Q"], "bounds": [[0.02, 0.05], [2.0, 3.0]]}


def depth(values):
    """Normal depth of a channel 5 m wide with a slope of 0.001, by Manning; 0 if roughness or discharge is 0."""
    return (values[:, 0] * values[:, 1] / (5.0 * np.sqrt(0.001))) ** 0.6


samples = {
    "sobol": saltelli.sample(problem, SETS, seed=1), "radial": radial.sample(problem, SETS, seed=1),
    "radial_mc": radial_mc.sample(problem, SETS, seed=1),
}
print(f"SALib {version('SALib')}: roughness 0.035 +- 0.002, discharge 2 to 3 m3/s")
for name, values in samples.items():
    ranges = " and ".join(f"{mean:.3f} ({low:.3f} to {high:.3f})" for mean, low, high in zip(
        values.mean(axis=0), values.min(axis=0), values.max(axis=0), strict=True))
    print(f"{name}: mean and range of roughness and discharge {ranges}")
random = np.random.default_rng(1)
one, other = (np.stack([random.normal(0.035, 0.002, 400000), random.uniform(2.0, 3.0, 400000)], 1) for _ in "ab")
mixed = np.stack([one[:, 0], other[:, 1]], 1), np.stack([other[:, 0], one[:, 1]], 1)  # another discharge, roughness
expected = [float(np.mean((depth(one) - depth(runs)) ** 2) / (2.0 * depth(one).var())) for runs in mixed[::-1]]
by_sobol = sobol.analyze(problem, depth(samples["sobol"]), seed=1)["ST"]
by_radial = sobol_jansen.analyze(problem, depth(samples["radial"]), SETS, seed=1)["ST"]
print(f"expected: total indices of the depth {np.round(expected, 2)}; by sobol {np.round(by_sobol, 2)}")
print(f"seen: by radial sampling and sobol_jansen {np.round(by_radial, 2)}")
for sampler in (radial, radial_mc):
    values = sampler.sample(plain, SETS, seed=1)
    assert values[:, 0].min() >= 0.02 and values[:, 0].max() <= 0.05 and values[:, 1].min() >= 2.0
of_radial, of_mc = samples["radial"], samples["radial_mc"][:, 0]
assert np.isclose(samples["sobol"][:, 0].mean(), 0.035, atol=1e-4) and np.allclose(by_sobol, expected, atol=0.03)
assert of_radial.min() == 0.0 and 0.99 < of_radial[:, 1].max() <= 1.0, "the behaviour has changed"
assert 0.002 <= of_mc.min() < 0.003 < 0.034 < of_mc.max() <= 0.035, "the behaviour has changed"
assert abs(by_radial[0] - expected[0]) > 0.25, "the behaviour has changed"
PYTHON
