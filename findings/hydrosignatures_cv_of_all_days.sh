#!/bin/sh
# The coefficient of variation of floods in hydrosignatures is that of all days around the mean flood.
#
# Guess:      flood_moments returns mean, variation and skewness of the annual floods: if each year has a flood of 100
#             m3/s, the variation is 0.
# Seen:       0.95, and a skewness of -2.1: the mean is that of the annual maxima, but squares and cubes are summed
#             over every day of the record and divided by the number of days. Ten floods between 80 and 120 m3/s give
#             0.95 as well, where 0.13 is right.
# Matters:    a design flood at a gauge from mean and variation is about three times too large, and says nothing about
#             the floods, so that the boundary of the flow model is foreign to the river.
# Documented: the docstring names the moments of floods; no public thread found.
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
import pandas as pd

days = pd.date_range("2010-01-01", "2019-12-31")


def moments(floods):
    """Of ten years with 5 m3/s and one flood each, in March: by the library, and of the annual maxima."""
    flow = pd.DataFrame({"Q": 5.0}, index=days)
    for year, flood in zip(range(2010, 2020), floods, strict=True):
        flow.loc[f"{year}-03-01", "Q"] = flood
    found = hydrosignatures.hydrosignatures.flood_moments(flow).loc["Q"]
    expected = [float(np.mean(floods)), float(np.std(floods, ddof=1) / np.mean(floods))]
    return [float(found["MAF"]), float(found["CV"])], expected


equal, spread = moments(np.full(10, 100.0)), moments(np.linspace(80.0, 120.0, 10))
print(f"hydrosignatures {version('hydrosignatures')}: mean and variation of ten annual floods")
print(f"expected: {np.round(equal[1], 2)} for equal floods, {np.round(spread[1], 2)} for floods from 80 to 120 m3/s")
print(f"seen: {np.round(equal[0], 2)} and {np.round(spread[0], 2)}")
assert np.isclose(equal[0][0], 100.0) and np.isclose(spread[0][0], 100.0)
assert np.allclose([equal[0][1], spread[0][1]], 0.95, atol=0.02), "the behaviour has changed"
PYTHON
