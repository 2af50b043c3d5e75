#!/bin/sh
# Without further settings pymcmcstat samples with an error of the measurements of 1, in whatever unit.
#
# Guess:      a DRAM chain that is given data and a sum of squares finds the scatter of the measurements from the
#             residuals, as its namesake in MATLAB is used, or asks for it.
# Seen:       five depths near 0.4 m that fit to 2 mm: the variance of the errors is taken as 1 m2 and stays there. The
#             chain wanders over the whole prior: roughness 0.07 +- 0.04. With updatesigma=True 0.0400 +- 0.0001.
#             With depths in millimetres the default gives 0.0400 +- 0.00004. No warning.
# Matters:    a posterior that is the prior although the data fit well, or, with levels in millimetres, one that is far
#             too narrow.
# Documented: the options list updatesigma=False; that sigma2 is then 1 is only in the source.
# Versions:   pymcmcstat 1.9.1, numpy 1.26.4, scipy 1.10.1 (newer ones do not import), statsmodels 0.14.4.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pymcmcstat==1.9.1 numpy==1.26.4 scipy==1.10.1 pandas==2.3.3 statsmodels==0.14.4
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pymcmcstat.MCMC import MCMC

DISCHARGE = np.array([1.0, 1.5, 2.0, 3.0, 4.0])  # m3/s


def depths(n):
    """Normal depths in a channel 5 m wide with a slope of 0.001, by Manning."""
    return (n * DISCHARGE / (5.0 * np.sqrt(0.001))) ** 0.6


measured = depths(0.04) + np.array([0.002, -0.001, 0.001, -0.002, 0.001])  # m


def posterior(scale, **options):
    """Mean and standard deviation of the roughness; the depths are multiplied by a scale."""
    chain = MCMC(rngseed=1)
    chain.data.add_data_set(DISCHARGE, scale * measured)
    chain.parameters.add_model_parameter(name="n", theta0=0.03, minimum=0.01, maximum=0.2)
    chain.simulation_options.define_simulation_options(nsimu=4000, verbosity=0, waitbar=False, **options)
    chain.model_settings.define_model_settings(
        sos_function=lambda n, data: np.sum((data.ydata[0].ravel() - scale * depths(n[0])) ** 2))
    chain.run_simulation()
    draws = chain.simulation_results.results["chain"][1000:, 0]
    return float(draws.mean()), float(draws.std())


seen = {"default, m": posterior(1.0), "default, mm": posterior(1000.0),
        "updatesigma, m": posterior(1.0, updatesigma=True)}
print(f"pymcmcstat {version('pymcmcstat')}: roughness from depths that fit to 2 mm, uniform prior from 0.01 to 0.2")
print("expected: one mean and one standard deviation, near 0.04 and 0.0001")
print(f"seen: {({name: (round(mean, 4), round(error, 5)) for name, (mean, error) in seen.items()})}")
assert np.isclose(seen["updatesigma, m"][0], 0.04, rtol=0.02) and seen["updatesigma, m"][1] < 0.0005
assert seen["default, m"][1] > 0.02, "the behaviour has changed"
assert seen["default, mm"][1] < 0.7 * seen["updatesigma, m"][1], "the behaviour has changed"
PYTHON
