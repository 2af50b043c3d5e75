#!/bin/sh
# hydroevents fills a day without water by the mean of its neighbours, and reversed flow as well.
#
# Guess:      preprocessing that cleans and fills a record fills what is missing. A reading of 0 is a reading, and a
#             reversed flow is one or becomes missing.
# Seen:       up to 24 readings of 0 in a row, and all negative ones, are first made missing and then filled with the
#             mean of five readings on each side. A brook that falls to 0 for 20 hours between 0.4 and 0.2 m3/s has 0.3
#             m3/s in all of them; five hours at -3 m3/s between flows of 2 m3/s are 2 m3/s. A flood that is missing for
#             two days at its peak is a level line. A count in the summary is all that shows it.
# Matters:    tidal slack, pumped reaches and intermittent brooks: the calibrated low flow does not exist, and the
#             volume of a day is wrong.
# Documented: zero_threshold=24 and max_gap=48 are in the signature, in readings, whatever their spacing.
# Versions:   hydroevents 0.1.3, numpy 2.3.1, pandas 2.3.3, scipy 1.16.0, scikit-learn 1.7.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    hydroevents==0.1.3 numpy==2.3.1 pandas==2.3.3 scipy==1.16.0 scikit-learn==1.7.0 joblib==1.5.1 \
    threadpoolctl==3.6.0 python-dateutil==2.9.0.post0 pytz==2025.2 six==1.17.0 matplotlib==3.10.3 contourpy==1.3.2 \
    cycler==0.12.1 fonttools==4.58.4 kiwisolver==1.4.8 packaging==25.0 pillow==11.3.0 pyparsing==3.2.3
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pandas as pd
from hydroevents.preprocessing import preprocess_streamflow

hours = pd.date_range("2024-06-01", periods=120, freq="1h")


def filled(values, hidden):
    """Smallest and largest discharge in m3/s that these hours have after preprocessing."""
    found = preprocess_streamflow(pd.DataFrame({"Date": hours, "Q": values}))[0]["Q"].to_numpy()[hidden]
    return round(float(found.min()), 2), round(float(found.max()), 2)


part = slice(50, 70)
dry = np.where(np.arange(120) < 50, 0.4, 0.2)
dry[part] = 0.0
ebb = np.full(120, 2.0)
ebb[50:55] = -3.0
flood = 5.0 + 40.0 * np.exp(-((np.arange(120.0) - 60.0) / 12.0) ** 2)
flood[36:84] = np.nan
seen = filled(dry, part), filled(ebb, slice(50, 55)), filled(flood, slice(36, 84))
print(f"hydroevents {version('hydroevents')}: m3/s in 20 dry hours, five hours at -3 m3/s, two missing days around a flood of 45 m3/s")
print("expected: 0 m3/s; -3 m3/s or missing; missing")
print(f"seen: from {seen[0][0]} to {seen[0][1]}, from {seen[1][0]} to {seen[1][1]}, from {seen[2][0]} to {seen[2][1]}")
assert seen[0] == (0.3, 0.3) and seen[1] == (2.0, 2.0), "the behaviour has changed"
assert seen[2][0] == seen[2][1], "the behaviour has changed"
PYTHON
