#!/bin/sh
# Two Gaussian likelihoods of SPOTPY: one is largest for the worst model, the other is random at still water.
#
# Guess:      functions of one module, both "Gaussian, with measurement errors", rank models alike and give one number
#             for one model.
# Seen:       gaussianLikelihoodHomoHeteroDataError is minus the sum of the densities, not their product: a model that
#             is 0.1 % off has -24.6, one that is threefold 0.0. Its docstring gives the product, and "maximizing ...
#             guides to the best model". logLikelihood without errors takes 10 % of each reading, and for a reading of
#             0 a random one from 0.01 to 0.1: with a warning, one model has another value in each call.
# Matters:    a sampler that maximises runs to the bound of the roughness; an acceptance step between two equal models
#             is decided by lot as soon as a probe reads 0 m/s.
# Documented: the docstring states the opposite of the first; the second is a warning without its consequence.
# Versions:   spotpy 1.6.7, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    spotpy==1.6.7 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from spotpy import likelihoods

measured = [0.4, 0.6, 0.5]
models = {factor: [factor * one for one in measured] for factor in (1.001, 1.1, 1.5, 3.0)}
of_log = [float(likelihoods.logLikelihood(measured, model)) for model in models.values()]
of_density = [
    float(likelihoods.gaussianLikelihoodHomoHeteroDataError(measured, model)) for model in models.values()
]
still, model = [0.0, 0.4, 0.5], [0.02, 0.41, 0.52]
np.random.seed(1)
again = [float(likelihoods.logLikelihood(still, model)) for _ in range(3)]
print(f"spotpy {version('spotpy')}: velocities of models that are 1.001, 1.1, 1.5 and 3 times the measured ones")
print("expected: both fall from the first model to the last; one value for one model")
print(f"seen: logLikelihood {np.round(of_log, 2)}")
print(f"seen: gaussianLikelihoodHomoHeteroDataError {np.round(of_density, 2)}")
print(f"seen: logLikelihood of one model, a reading being 0: {np.round(again, 2)}")
assert of_log == sorted(of_log, reverse=True)
assert of_density == sorted(of_density) and of_density[0] < -24.0, "the behaviour has changed"
assert len(set(again)) == 3, "the behaviour has changed"
PYTHON
