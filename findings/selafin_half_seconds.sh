#!/bin/sh
# xarray-selafin writes times in whole seconds: frames at 0.25 s become five frames of two times.
#
# Guess:      SELAFIN stores a time as a number of seconds with fractions, so 0.25 s comes back as 0.25 s.
# Seen:       the writer cuts the fraction off before it writes. Times 0, 0.25, 0.5, 0.75 and 1 s come back as 0, 0, 0,
#             0 and 1 s, and a selection by time raises an error as times are not unique. No warning at writing.
# Matters:    dam breaks, bores and flume runs are stored at tenths of a second. Speeds of a front from such a copy,
#             and a comparison with probes at 25 Hz, are wrong.
# Documented: not in its documentation; no public thread found.
# Versions:   xarray-selafin 0.2.5, python-serafin 0.2.2, xarray 2026.9.0 or as the interpreter allows, numpy 2.3.1.
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

seconds = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
times = np.datetime64("2024-01-01T00:00:00", "ns") + (1e9 * seconds).astype("timedelta64[ns]")
xr.Dataset(
    {"H": (("time", "node"), np.ones((5, 4)))},
    coords={"x": ("node", [0.0, 1.0, 0.0, 1.0]), "y": ("node", [0.0, 0.0, 1.0, 1.0]), "time": times},
    attrs={"ikle2": np.array([[1, 2, 3], [2, 4, 3]])},
).selafin.write("front.slf")
back = xr.open_dataset("front.slf", engine="selafin").time.values
seen = (back - back[0]) / np.timedelta64(1, "s")
print(f"xarray-selafin {version('xarray-selafin')}: times written {seconds} s")
print("expected: the same times")
print(f"seen: {seen} s")
assert np.array_equal(seen, np.floor(seconds)), "the behaviour has changed"
PYTHON
