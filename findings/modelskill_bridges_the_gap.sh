#!/bin/sh
# modelskill compares the gauge with a straight line where the model has no results.
#
# Guess:      hours in which a run failed, dried or was not stored have no pairs: the score is that of the hours that
#             exist, and the number of pairs says so.
# Seen:       of a perfect model of a tide twelve hours of twenty-five are missing, left out or NaN. All 25 hours are
#             matched, the twelve with the line across the gap: RMSE 0.59 m in place of 0. With max_model_gap of two hours
#             there are 13 pairs and 0. A model with its first and last hour alone scores at a steady gauge as one that
#             ran throughout. No warning.
# Matters:    a run that fails at the peak is scored by a peak that it never computed: too bad, or perfect.
# Documented: max_model_gap=None is listed ("e.g. for event-based model results"), not what it does to NaN.
# Versions:   modelskill 1.3.2, mikeio 3.1.0, numpy 2.3.1, pandas 2.3.3, xarray 2025.7.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    modelskill==1.3.2 mikeio==3.1.0 numpy==2.3.1 pandas==2.3.3 xarray==2025.7.1
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import modelskill
import numpy as np
import pandas as pd

times = pd.date_range("2024-01-01", periods=25, freq="1h")
tide = pd.DataFrame({"level": 2.0 + np.sin(4.0 * np.pi * np.arange(25) / 24.0)}, index=times)  # m
failed = tide.copy()
failed.iloc[7:19] = np.nan
ends, steady = tide.iloc[[0, -1]] * 0.0 + 2.0, tide * 0.0 + 2.0


def score(gauge, model, **options):
    """Number of pairs and RMSE in m."""
    found = modelskill.match(
        modelskill.PointObservation(gauge, name="gauge"), modelskill.PointModelResult(model, name="run"), **options)
    return int(found.n_points), round(float(found.skill().to_dataframe()["rmse"].iloc[0]), 2)


seen = {"NaN": score(tide, failed), "left out": score(tide, failed.dropna()),
        "NaN, largest gap 2 h": score(tide, failed, max_model_gap=7200.0),
        "two hours of a day, steady": score(steady, ends)}
print(f"modelskill {version('modelskill')}: pairs and RMSE in m of a perfect model without twelve of its 25 hours")
print("expected: 13 pairs and 0; 2 pairs for a model of two hours")
print(f"seen: {seen}")
assert seen["NaN, largest gap 2 h"] == (13, 0.0)
assert seen["NaN"] == seen["left out"] == (25, 0.59), "the behaviour has changed"
assert seen["two hours of a day, steady"] == (25, 0.0), "the behaviour has changed"
PYTHON
