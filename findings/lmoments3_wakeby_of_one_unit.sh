#!/bin/sh
# The Wakeby distribution that lmoments3 fits to annual floods is the fitted one only if its scale is 1.
#
# Guess:      distr.wak.lmom_fit followed by ppf gives the flood of a return period, in each unit, as it does for the
#             other eleven distributions of the library.
# Seen:       lmom_fit returns gamma in the unit of the data, and ppf multiplies it by scale once more. Floods with a
#             100-year flood of 806 m3/s have one of 159,636 m3/s; the same floods in 1000 m3/s one of 435 m3/s. The
#             parameters in Hosking's equation give 806 both times. No message.
# Matters:    a design flood at the inlet of a model that is 200 times too large, or half, by the unit.
# Documented: the equation of the class is Hosking's divided by scale, in which gamma has no unit; lmom_fit has no remark.
# Versions:   lmoments3 1.0.8, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    lmoments3==1.0.8 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from lmoments3 import distr

LOCATION, ALPHA, BETA, GAMMA, DELTA = 200.0, 300.0, 4.0, 80.0, 0.15  # m3/s, m3/s, -, m3/s, -
HUNDRED_YEARS = 0.99


def hosking(probability, location, alpha, beta, gamma, delta):
    """Quantile x = location + alpha / beta (1 - (1 - F)^beta) - gamma / delta (1 - (1 - F)^-delta)."""
    rest = 1.0 - probability
    return location + alpha / beta * (1.0 - rest**beta) - gamma / delta * (1.0 - rest**-delta)


right = hosking(HUNDRED_YEARS, LOCATION, ALPHA, BETA, GAMMA, DELTA)
floods = hosking((np.arange(10_000) + 0.65) / 10_000, LOCATION, ALPHA, BETA, GAMMA, DELTA)
fitted = {unit: distr.wak.lmom_fit(floods / unit) for unit in (1.0, 1000.0)}
seen = {unit: float(unit * distr.wak(**one).ppf(HUNDRED_YEARS)) for unit, one in fitted.items()}
by_hand = {
    unit: float(unit * hosking(HUNDRED_YEARS, one["loc"], one["scale"], one["beta"], one["gamma"], one["delta"]))
    for unit, one in fitted.items()
}
one = distr.wak.lmom_fit(floods / ALPHA)  # the unit in which the scale is 1
unity = float(ALPHA * distr.wak(**one).ppf(HUNDRED_YEARS))
gev = [float(unit * distr.gev(**distr.gev.lmom_fit(floods / unit)).ppf(HUNDRED_YEARS)) for unit in (1.0, 1000.0)]
print(f"lmoments3 {version('lmoments3')}: 100-year flood in m3/s from floods in units of 1 and of 1000 m3/s")
print(f"expected: {right:.0f}; the fitted parameters in Hosking's equation give {[round(q) for q in by_hand.values()]}")
print(f"seen: {[round(q) for q in seen.values()]}; with a scale of 1 {unity:.0f}; the GEV gives {[round(q) for q in gev]}")
assert all(abs(q / right - 1.0) < 0.01 for q in (*by_hand.values(), unity)) and abs(gev[0] / gev[1] - 1.0) < 1e-6
assert seen[1.0] > 100.0 * right and seen[1000.0] < 0.6 * right, "the behaviour has changed"
PYTHON
