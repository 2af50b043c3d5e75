#!/bin/sh
# The flashiness after Baker in hydrosignatures is a mean of relative steps: a trickle decides it.
#
# Guess:      flashiness_index "following Baker et al. (2004)" is the sum of the steps from day to day divided by the
#             sum of the flows, as in that paper; it hardly changes with the flow of a dry week.
# Seen:       each step is divided by the flow of the day before, then averaged. A flood of 10 m3/s on a base flow of 1
#             m3/s has 0.10 by the library and 0.17 by Baker; on a trickle of 0.001 m3/s it has 100 and 1.98. Baker's
#             index cannot exceed 2.
# Matters:    reaches that are compared, or transferred, by flashiness: the class is that of their driest day.
# Documented: the docstring cites Baker et al. without a formula.
# Versions:   hydrosignatures 0.19.3, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3, xarray 2025.7.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    hydrosignatures==0.19.3 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3 xarray==2025.7.1
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import hydrosignatures
import numpy as np


def both(base):
    """The index of a hundred days with a base flow and one flood: by the library, and by Baker's formula."""
    flow = np.full(101, base)
    flow[50] = 10.0
    return (float(hydrosignatures.flashiness_index(flow)[0]),
            float(np.abs(np.diff(flow)).sum() / flow[1:].sum()))


seen = {base: both(base) for base in (1.0, 0.001)}
print(f"hydrosignatures {version('hydrosignatures')}: flashiness of a flood of 10 m3/s by base flow in m3/s")
print(f"expected, by Baker: {({base: round(one[1], 3) for base, one in seen.items()})}, never above 2")
print(f"seen: {({base: round(one[0], 3) for base, one in seen.items()})}")
assert np.isclose(seen[1.0][0], 0.099, atol=0.001) and seen[0.001][0] > 50.0, "the behaviour has changed"
assert np.isclose(seen[1.0][1], 0.165, atol=0.02) and seen[0.001][1] < 2.0
PYTHON
