#!/bin/sh
# A deeper pool below the crest multiplies the discharge of a contracted weir in fluids.
#
# Guess:      the discharge over a contracted rectangular weir is that of the head above the crest, h1^1.5. The pool
#             below the crest only slows the approach: ten times as deep, it changes less than 1 % of the discharge.
# Seen:       Q_weir_rectangular_SIA takes the height above the bed, (h1 + h2)^1.5. For 20 cm over a crest of 1 m in a
#             channel of 5 m: 0.4 m3/s with a pool of 0.2 m, 1.0 with 0.5 m and 5.7 with 2 m; with 4 cm over the crest
#             and 2 m also 5.7 m3/s. Kindsvater and Carter of the same module give 0.16 m3/s for all pools.
# Matters:    a discharge 3 to 37 times too large within the limits that the docstring states, and a gauge at a weir
#             whose discharge hardly changes with its level.
# Documented: the formula of the docstring has h^1.5, with h in no list. The docstring of a neighbour,
#             Q_weir_rectangular_full_SIA, warns of that function; this one warns of nothing.
# Versions:   fluids 1.3.1, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    fluids==1.3.1 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from fluids.open_flow import Q_weir_rectangular_Kindsvater_Carter, Q_weir_rectangular_SIA

HEAD, CREST, CHANNEL = 0.2, 1.0, 5.0  # m; width of the crest over that of the channel 0.2, the limit stated
pools = (0.2, 0.5, 2.0)  # m, h1 / h2 from 0.1 to 1, stated limit 2


def with_the_head(pool):
    """The formula of the docstring, with the head above the crest in h^1.5."""
    share, approach = (CREST / CHANNEL) ** 2, HEAD / (HEAD + pool)
    contracted = 1.0 + 0.064 * share + (0.00626 - 0.00519 * share) / (HEAD + 0.0016)
    return 0.544 * contracted * (1.0 + 0.5 * share**2 * approach**2) * CREST * np.sqrt(9.80665) * HEAD**1.5


expected = [with_the_head(pool) for pool in pools]
other = [Q_weir_rectangular_Kindsvater_Carter(HEAD, pool, CREST) for pool in pools]
seen = [Q_weir_rectangular_SIA(HEAD, pool, CREST, CHANNEL) for pool in pools]
low = Q_weir_rectangular_SIA(0.04, 2.0, CREST, CHANNEL)
print(f"fluids {version('fluids')}: 20 cm over a crest of 1 m in a channel of 5 m, pools of {pools} m below the crest")
print(f"expected: {np.round(expected, 3)} m3/s; Kindsvater and Carter: {np.round(other, 3)} m3/s")
print(f"seen: {np.round(seen, 3)} m3/s; with 4 cm over the crest and a pool of 2 m {low:.2f} m3/s")
assert np.ptp(expected) < 0.01 * expected[0] and np.allclose(expected, other, rtol=0.06)
assert np.allclose(np.divide(seen, expected), [((HEAD + pool) / HEAD) ** 1.5 for pool in pools], rtol=1e-6), "changed"
assert seen[2] > 30.0 * expected[2] and low > 4.0, "the behaviour has changed"
PYTHON
