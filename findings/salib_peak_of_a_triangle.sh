#!/bin/sh
# A triangular prior of roughness from 0.02 to 0.06 with its peak at 0.03 has its peak at 0.0212 in SALib.
#
# Guess:      the third number of a triangle is its peak in the unit of the parameter, as in numpy, chaospy and OpenTURNS.
# Seen:       it is a share of the width. A peak above 1 raises an error, but a roughness is below 1: 0.03 is taken as
#             3 % of the way from 0.02 to 0.06, and the median is 0.0321 in the place of 0.0355. The order of numpy,
#             (0.02, 0.03, 0.06), is accepted as well: a triangle from 0.02 to 0.03 with its peak at 0.0206.
# Matters:    roughness, porosity and shares of plant cover are all below 1. Indices of sensitivity are those of another
#             prior, and no message says so.
# Documented: in the docstring of an internal function ("percentage of width", e.g. 0.5) and among the examples.
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
from SALib.sample import latin

LOWER, PEAK, UPPER = 0.02, 0.03, 0.06  # s/m^(1/3)


def drawn(*numbers):
    """Median of the roughness and the middle of its fullest of 100 classes."""
    prior = {"num_vars": 1, "names": ["roughness"], "bounds": [list(numbers)], "dists": ["triang"]}
    members = latin.sample(prior, 100_000, seed=1)[:, 0]
    counts, edges = np.histogram(members, 100)
    fullest = counts.argmax()
    return round(float(np.median(members)), 4), round(float(edges[fullest : fullest + 2].mean()), 4)


def refused(*numbers):
    try:
        drawn(*numbers)
    except ValueError:
        return True
    return False


median = round(UPPER - ((UPPER - LOWER) * (UPPER - PEAK) / 2) ** 0.5, 4)
seen = {numbers: drawn(*numbers) for numbers in ((LOWER, UPPER, PEAK), (LOWER, PEAK, UPPER))}
share = drawn(LOWER, UPPER, (PEAK - LOWER) / (UPPER - LOWER))
print(f"SALib {version('SALib')}: triangle from {LOWER} to {UPPER}, peak at {PEAK}")
print(f"expected: median {median}, peak near {PEAK}; with the peak as a share of the width {share}")
print(f"seen: {seen}; in a unit a hundred times smaller refused: {refused(2.0, 6.0, 3.0)}")
assert abs(share[0] - median) < 2e-4 and abs(share[1] - PEAK) < 1.5e-3
assert refused(2.0, 6.0, 3.0)
assert abs(seen[LOWER, UPPER, PEAK][0] - 0.0321) < 2e-4, "the behaviour has changed"
assert abs(seen[LOWER, UPPER, PEAK][1] - 0.0212) < 1.5e-3, "the behaviour has changed"
assert seen[LOWER, PEAK, UPPER][0] < 0.024, "the behaviour has changed"
PYTHON
