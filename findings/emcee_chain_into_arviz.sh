#!/bin/sh
# A chain of emcee handed to ArviZ as it is has thirty times its effective sample size.
#
# Guess:      get_chain() of one parameter is an array of walkers and steps, and az.ess and az.rhat take such an array.
# Seen:       emcee gives (step, walker), ArviZ reads (chain, draw): each step becomes a chain. The effective sample
#             size of 20 walkers and 500 steps is 10,000, more than the number of samples; transposed it is 300. R-hat
#             is 1.03 instead of 1.06. az.from_emcee turns the axes. No error; the names of the axes do not exist in
#             the array.
# Matters:    standard errors of a posterior mean that are six times too small, and chains that pass as converged.
# Documented: emcee: "(n_steps, n_walkers, n_dim)"; ArviZ: "(chain, draw)". Each is right.
# Versions:   emcee 3.1.6, arviz 0.23.4, numpy 2.3.1, scipy 1.16.0, xarray 2025.7.1, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    emcee==3.1.6 arviz==0.23.4 numpy==2.3.1 scipy==1.16.0 xarray==2025.7.1 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import arviz
import emcee
import numpy as np

DISCHARGE = np.array([1.0, 1.5, 2.0, 3.0, 4.0])  # m3/s
WALKERS, STEPS = 20, 500


def depths(n):
    """Normal depths in a channel 5 m wide with a slope of 0.001, by Manning."""
    return (n * DISCHARGE / (5.0 * np.sqrt(0.001))) ** 0.6


def posterior(parameters):
    (n,) = parameters
    return -0.5 * np.sum(((depths(n) - depths(0.04)) / 0.05) ** 2) if 0.01 < n < 0.2 else -np.inf


np.random.seed(1)
sampler = emcee.EnsembleSampler(WALKERS, 1, posterior)
sampler.run_mcmc(np.linspace(0.03, 0.06, WALKERS)[:, None], STEPS)
chain = sampler.get_chain()[:, :, 0]
size = {"as it is": float(arviz.ess(chain)), "transposed": float(arviz.ess(chain.T)),
        "from_emcee": float(arviz.ess(arviz.from_emcee(sampler))["var_0"])}
rhat = {"as it is": float(arviz.rhat(chain)), "transposed": float(arviz.rhat(chain.T))}
print(f"emcee {version('emcee')}, arviz {version('arviz')}: roughness, {WALKERS} walkers, {STEPS} steps")
print("expected: the effective sample size of the chain, smaller than its 10,000 samples")
print(f"seen: shape of the chain {chain.shape}, effective sample size"
      f" {({name: round(one) for name, one in size.items()})},"
      f" R-hat {({name: round(one, 3) for name, one in rhat.items()})}")
assert chain.shape == (STEPS, WALKERS)
assert np.isclose(size["transposed"], size["from_emcee"])
assert size["as it is"] > 20.0 * size["transposed"], "the behaviour has changed"
assert rhat["as it is"] < rhat["transposed"], "the behaviour has changed"
PYTHON
