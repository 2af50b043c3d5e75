#!/bin/sh
# UTide with the dates of matplotlib gives phases that are wrong by 244 degrees.
#
# Guess:      date2num gives the days that epoch="python" stands for, as in the examples of both; or the mistake shows.
# Seen:       since matplotlib 3.3 date2num counts from 1970, UTide's "python" from the year 1: the tide is analysed as
#             one of the year 54. Amplitude of M2 1.02 instead of 1.04, phase 60 instead of 305 degrees. Without an
#             epoch floats give no constituent at all, without an error. Arrays of datetime64 are right.
# Matters:    levels at the seaward edge of a marsh, predicted with dates, that are eight hours off; the fit of the record
#             itself is perfect, as the same wrong days go in and out.
# Documented: both epochs are documented; no page of UTide names the change of matplotlib.
# Versions:   utide 0.4.0, matplotlib 3.10.3, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    utide==0.4.0 matplotlib==3.10.3 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import utide
from matplotlib.dates import date2num

hours = np.arange(60 * 24)
times = np.datetime64("2024-01-01T00:00") + hours * np.timedelta64(1, "h")
level = np.cos(2.0 * np.pi * hours / 12.4206012 - 1.0)  # m, M2 alone


def lunar(days, **epoch):
    """Amplitude in m and phase in degrees of M2, none if it is not found."""
    found = utide.solve(days, level, lat=51.0, verbose=False, **epoch)
    if "M2" not in found.name:
        return ()
    place = list(found.name).index("M2")
    return round(float(found.A[place]), 3), round(float(found.g[place]), 1)


seen = {"datetime64": lunar(times), "date2num, epoch python": lunar(date2num(times), epoch="python"),
        "date2num, no epoch": lunar(date2num(times)),
        "date2num, epoch 1970": lunar(date2num(times), epoch="1970-01-01")}
print(f"utide {version('utide')}, matplotlib {version('matplotlib')}: amplitude and phase of M2 from one record")
print(f"expected: {seen['datetime64']} for all, or an error")
print(f"seen: {seen}")
assert seen["datetime64"] == seen["date2num, epoch 1970"]
assert np.allclose(seen["date2num, epoch python"], (1.019, 60.0), atol=0.5), "the behaviour has changed"
assert seen["date2num, no epoch"] == (), "the behaviour has changed"
PYTHON
