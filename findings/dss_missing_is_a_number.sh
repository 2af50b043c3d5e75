#!/bin/sh
# hecdss pads what a DSS file does not hold with -3.4e38, as ordinary numbers.
#
# Guess:      a window of time beyond the record gives the record, or NaN for the missing hours.
# Seen:       the answer fills the window: each missing hour is -3.4028235e38, a finite number of the DSS format, in a
#             plain array without a mask. np.isfinite is true, the mean is about -2e38, no warning.
# Matters:    boundary conditions and gauge records come from HEC-RAS and HEC-HMS as DSS. A test for NaN or infinity
#             passes; in single precision the square of such a value overflows.
# Documented: the value is part of the format; pydsstools issue 8 leaves it to the user, and pydsstools has a mask
#             for it. hecdss has none; no remark in its documentation.
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
series = RegularTimeSeries.create(
    values=np.full(24, 2.0), times=[start + timedelta(hours=hour) for hour in range(24)],
    units="M3/S", data_type="INST-VAL", interval=3600, path=path,
)
HecDss.set_global_debug_level(0)
store = HecDss("weir.dss")
store.put(series)
values = store.get(path, datetime(2024, 1, 1, 20), datetime(2024, 1, 2, 4)).values
store.close()
print(f"hecdss {version('hecdss')}: 24 hours of 2 m3/s are stored, hours 20 to 28 are requested")
print("expected: four values, or NaN for the five hours that are not there")
print(f"seen: {values.tolist()}, mean {values.mean():.3g}, type {type(values).__name__}")
assert values[:4].tolist() == [2.0] * 4
assert len(values) == 9 and np.isfinite(values).all() and (values[4:] < -3.4e38).all(), "the behaviour has changed"
assert not isinstance(values, np.ma.MaskedArray), "the behaviour has changed"
PYTHON
