#!/bin/sh
# The stage that HydRating returns for a discharge is wrong by twice the stage of zero flow.
#
# Guess:      inverse of a rating model is the inverse: the stage of the discharge at 2.0 m is 2.0 m, whatever the
#             datum.
# Seen:       the stage of zero flow is subtracted where it has to be added. With 0.4 m the answer is 1.2 m, with a
#             gauge in metres above sea level (zero flow at 411.3 m) it is -409.7 m, with zero flow at 0 it is right.
# Matters:    the stage of a design flood, or of the discharge of a model run: below the bed, or plausible and 0.8 m too
#             low.
# Documented: the docstring gives the inverse of the formula above it. A comment in the source says that it has not been
#             tested with a stage of zero flow.
# Versions:   hydrating 0.0.5, lmfit 1.3.4, numpy 2.4.4, scipy 1.16.0, pandas 3.0.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    hydrating==0.0.5 lmfit==1.3.4 numpy==2.4.4 scipy==1.16.0 pandas==3.0.2 matplotlib==3.10.9
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from hydrating.models import PowerLaw


def there_and_back(zero):
    """The stage that is returned for the discharge at 1.6 m above this stage of zero flow."""
    curve = {"a": 8.0, "h0": zero, "b": 1.6}
    return round(float(PowerLaw.inverse(PowerLaw.func(np.array([zero + 1.6]), **curve), None, **curve)[0]), 3)


seen = {zero: there_and_back(zero) for zero in (0.0, 0.4, 411.3)}
print(f"hydrating {version('hydrating')}: stage of the discharge at 1.6 m above zero flow, by the stage of zero flow")
print("expected: 1.6, 2.0 and 412.9 m")
print(f"seen: {seen}")
assert seen[0.0] == 1.6
assert seen[0.4] == 1.2 and seen[411.3] == -409.7, "the behaviour has changed"
PYTHON
