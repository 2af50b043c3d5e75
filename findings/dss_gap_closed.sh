#!/bin/sh
# hecdss closes a gap in a regular series: readings after it move to earlier times.
#
# Guess:      values and times that are handed over together stay together; a gap of ten hours is stored as missing.
# Seen:       RegularTimeSeries.create takes the list of times, "put" stores the first time and the values one after
#             another. Readings of 20:00 to 23:00 come back at 10:00 to 13:00. No error, no warning.
# Matters:    gauges fail during floods. A discharge or stage with a gap that passes through a DSS file has its
#             flood earlier, and a calibration against it blames the roughness.
# Documented: no remark in the documentation of "create"; no public thread found.
# Versions:   hecdss 0.1.33, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check hecdss==0.1.33 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from datetime import datetime, timedelta
from importlib.metadata import version

import numpy as np
from hecdss import HecDss, RegularTimeSeries

start, path = datetime(2024, 1, 1), "/BROOK/WEIR/FLOW//1Hour/OBS/"
hours = [*range(10), *range(20, 24)]
series = RegularTimeSeries.create(
    values=np.array(hours, float), times=[start + timedelta(hours=hour) for hour in hours],
    units="M3/S", data_type="INST-VAL", interval=3600, path=path,
)
HecDss.set_global_debug_level(0)
store = HecDss("weir.dss")
store.put(series)
back = store.get(path)
seen = [(time - start) / timedelta(hours=1) for time in back.times]
store.close()
print(f"hecdss {version('hecdss')}: hours written {hours}; each value equals its hour")
print(f"expected: values {hours} at the same hours, or missing values between")
print(f"seen: values {back.values.astype(int).tolist()} at hours {np.array(seen).astype(int).tolist()}")
assert back.values.tolist() == [float(hour) for hour in hours]
assert seen == [float(hour) for hour in range(14)], "the behaviour has changed"
PYTHON
