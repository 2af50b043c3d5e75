#!/bin/sh
# Two variables whose first 16 letters agree become one, and the other is gone when it is read back.
#
# Guess:      the format cuts names at 16 letters, so the writer makes them different or stops.
# Seen:       both are written under the same 16 letters without a warning. Read back there is one variable: the name
#             of both, with values of one of them.
# Matters:    "velocity_magnitude_max" and "velocity_magnitude_mean" of a HEC-RAS or D-Flow FM result end as one; which
#             of the two it is cannot be seen.
# Documented: the length of names is part of the format; no remark on equal names, no public thread found.
# Versions:   xarray-selafin 0.2.5, python-serafin 0.2.2, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    xarray-selafin==0.2.5 python-serafin==0.2.2 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import xarray as xr
import xarray_selafin.xarray_backend  # makes the writer known to xarray

xr.Dataset(
    {"velocity_magnitude_max": (("time", "node"), np.full((1, 4), 2.0)),
     "velocity_magnitude_mean": (("time", "node"), np.full((1, 4), 0.5))},
    coords={"x": ("node", [0.0, 1.0, 0.0, 1.0]), "y": ("node", [0.0, 0.0, 1.0, 1.0]),
            "time": np.array(["2024-01-01"], "datetime64[ns]")},
    attrs={"ikle2": np.array([[1, 2, 3], [2, 4, 3]])},
).selafin.write("extremes.slf")
back = xr.open_dataset("extremes.slf", engine="selafin")
seen = {name: float(back[name].values[0, 0]) for name in back}
print(f"xarray-selafin {version('xarray-selafin')}: a maximum of 2.0 m/s and a mean of 0.5 m/s are written")
print("expected: two variables, or an error at writing")
print(f"seen: {seen}")
assert len(seen) == 1 and set(seen) == {"velocity_magnitu"}, "the behaviour has changed"
PYTHON
