#!/bin/sh
# A log-uniform roughness from 0.02 to 0.06 is one from 1.02 to 1.06 in two libraries, and Gamma(2, 0.5) has the mean 1 or 4.
#
# Guess:      a prior is its name and its numbers; written for one library, it can be handed to another.
# Seen:       LogUniform(0.02, 0.06) lies in 0.02 to 0.06 in scipy and SALib; chaospy and OpenTURNS take the numbers
#             as logarithms, without a message, although both are positive. Gamma(2, 0.5) is a shape with a scale in
#             chaospy and numpy (mean 1), with a rate in OpenTURNS (mean 4), and with a shift in scipy (mean 2.5).
#             Gumbel(2, 0.5) has the mean 1.65 in OpenTURNS (scale first) and 2.29 in scipy.
# Matters:    a roughness of 1.02 to 1.06 s/m^(1/3) is thirty times too large, and one library draws what another
#             analyses. Ranges of rates and floods are off by factors.
# Documented: each library documents its own numbers; no page that compares them was found.
# Versions:   chaospy 4.3.21, openturns 1.27.post1, SALib 1.6.0, scipy 1.16.0, numpy 2.3.1, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    chaospy==4.3.21 numpoly==1.3.9 openturns==1.27.post1 SALib==1.6.0 scipy==1.16.0 numpy==2.3.1 pandas==2.3.3
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import chaospy
import numpy as np
import openturns
import scipy.stats
from SALib.sample import latin

LOWER, UPPER, DRAWS = 0.02, 0.06, 100_000


def ends(members):
    return round(float(members.min()), 2), round(float(members.max()), 2)


members = latin.sample(
    {"num_vars": 1, "names": ["roughness"], "bounds": [[LOWER, UPPER]], "dists": ["logunif"]}, DRAWS, seed=1
)
reach = openturns.LogUniform(LOWER, UPPER).getRange()
log_uniform = {
    "scipy": ends(np.array(scipy.stats.loguniform(LOWER, UPPER).support())),
    "SALib": ends(members),
    "chaospy": ends(np.array([chaospy.LogUniform(LOWER, UPPER).lower, chaospy.LogUniform(LOWER, UPPER).upper])),
    "OpenTURNS": ends(np.array([reach.getLowerBound()[0], reach.getUpperBound()[0]])),
}
gamma = {
    "numpy": round(float(np.random.default_rng(1).gamma(2.0, 0.5, DRAWS).mean()), 1),
    "chaospy": round(float(chaospy.E(chaospy.Gamma(2.0, 0.5))), 2),
    "OpenTURNS": round(openturns.Gamma(2.0, 0.5).getMean()[0], 2),
    "scipy": round(float(scipy.stats.gamma(2.0, 0.5).mean()), 2),
}
gumbel = {
    "OpenTURNS": round(openturns.Gumbel(2.0, 0.5).getMean()[0], 2),
    "scipy": round(float(scipy.stats.gumbel_r(2.0, 0.5).mean()), 2),
}
print(", ".join(f"{name} {version(name)}" for name in ("chaospy", "openturns", "SALib", "scipy")))
print(f"expected: one range for LogUniform({LOWER}, {UPPER}); one mean for Gamma(2, 0.5) and for Gumbel(2, 0.5)")
print(f"seen: {log_uniform}")
print(f"seen: Gamma {gamma}; Gumbel {gumbel}")
assert log_uniform["scipy"] == log_uniform["SALib"] == (LOWER, UPPER), "the behaviour has changed"
assert log_uniform["chaospy"] == log_uniform["OpenTURNS"] == (1.02, 1.06), "the behaviour has changed"
assert gamma == {"numpy": 1.0, "chaospy": 1.0, "OpenTURNS": 4.0, "scipy": 2.5}, "the behaviour has changed"
assert gumbel == {"OpenTURNS": 1.65, "scipy": 2.29}, "the behaviour has changed"
PYTHON
