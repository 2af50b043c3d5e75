#!/bin/sh
# In ratingcurve an error of 20 % of a gauging is one of 60 % at a river and of 3 % in a flume.
#
# Guess:      q_sigma, the "discharge uncertainty in units of discharge", is the standard error of a gauging in the
#             likelihood: 20 % are a standard deviation of 0.18 of ln Q whatever the range of the gaugings.
# Seen:       discharges enter as logarithms in units of their own standard deviation, the errors as logarithms alone.
#             At a river with 0.05 to 200 m3/s, where ln Q has a standard deviation of 2.5, 20 % become 0.46 of ln Q, a
#             factor of 1.6; in a flume from 20 to 32 l/s they become 0.03. No message.
# Matters:    stated errors that are 2.5 times too large at a river, and seven times too small in a flume, where a poor
#             gauging weighs nearly as much as a good one beside the scatter that is fitted.
# Documented: otherwise. The docstring says units of discharge, a comment in the source that the error is put on a log
#             scale. Its maintainer names percentages geometric errors of a fit in logarithms (bdrc issue 3).
# Versions:   ratingcurve 1.1.0, pymc 5.28.1 and what it needs.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    ratingcurve==1.1.0 pymc==5.28.1
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from ratingcurve.ratings import PowerLawRating


def of_logarithm(discharges):
    """The standard deviation of ln Q that the likelihood has for an error of 20 %, apart from its own scatter."""
    rating = PowerLawRating(segments=1)
    rating.build_model(np.linspace(1.0, 2.0, discharges.size), discharges, 0.2 * discharges)
    scatter = rating.model["model_q"].owner.inputs[-1]
    standard = scatter.eval({rating.model["sigma"]: np.array(0.0)})
    return round(float(np.mean(standard) * rating.q_transform.std_), 3)


river, flume = of_logarithm(np.geomspace(0.05, 200.0, 20)), of_logarithm(np.geomspace(0.020, 0.032, 20))
print(f"ratingcurve {version('ratingcurve')}: standard deviation of ln Q for gaugings with an error of 20 %")
print(f"expected: {np.log(1.2):.3f} for both")
print(f"seen: {river} with 0.05 to 200 m3/s, {flume} with 20 to 32 l/s")
assert river > 0.4 and flume < 0.05, "the behaviour has changed"
PYTHON
