#!/bin/sh
# The time mean of a MIKE file drops each place that dries once with skipna=True, and keeps it with skipna=False.
#
# Guess:      generic.avg_time(skipna=True), the default, is the mean of the times at which a place is wet, as
#             generic.quantile with the same word and value, and nanmean of what mikeio reads.
# Seen:       of a reach of four places over four hours, the one that is dry in the second hour has a median of 3 and no mean
#             by skipna=True; by skipna=False it has the mean of its wet hours and no median. The one that is dry in the
#             first hour has no mean by either, although it is wet in the other three. No message.
# Matters:    mean depths and velocities of banks, bars and marshes are empty in the file of means, while its quantiles
#             have them: differences of both, or a map of them, are those of the deep channel alone.
# Documented: otherwise. The docstring says that missing values are excluded by skipna=True, and that this is the default.
# Versions:   mikeio 3.1.0, mikecore 0.2.2, numpy 2.2.6, scipy 1.16.0, pandas 2.3.3, xarray 2025.7.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    mikeio==3.1.0 mikecore==0.2.2 numpy==2.2.6 scipy==1.16.0 pandas==2.3.3 xarray==2025.7.1 matplotlib==3.10.3 \
    tqdm==4.67.1
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 300 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import mikeio
import numpy as np
import pandas as pd
from mikeio import generic

DRY = np.nan
speeds = np.array([[1.0, DRY, 2.0, DRY], [1.0, 2.0, DRY, DRY], [1.0, 2.0, 3.0, DRY], [1.0, 2.0, 4.0, DRY]])
places = ["always wet", "dry at first", "dry once later", "always dry"]
speed = mikeio.DataArray(
    speeds,
    time=pd.date_range("2026-05-01", periods=4, freq="h"),
    item=mikeio.ItemInfo("Current speed", mikeio.EUMType.Current_Speed),
    geometry=mikeio.Grid1D(nx=4, dx=1.0),
)
mikeio.Dataset([speed]).to_dfs("reach.dfs1")


def read(name):
    """The only time of a file, in m/s; None where there is no value."""
    return [None if np.isnan(one) else round(float(one), 2) for one in mikeio.read(name)[0].to_numpy().ravel()]


def mean(skipna):
    """The time mean of the reach by its file."""
    generic.avg_time("reach.dfs1", "mean.dfs1", skipna=skipna)
    return read("mean.dfs1")


def median(skipna):
    """The median of the reach by its file."""
    generic.quantile("reach.dfs1", "median.dfs1", 0.5, skipna=skipna)
    return read("median.dfs1")


skipped, kept = mean(True), mean(False)
print(f"mikeio {version('mikeio')}: time mean in m/s of places that are {', '.join(places)}")
print("expected: [1.0, 2.0, 3.0, None] with skipna=True, [1.0, None, None, None] with skipna=False")
print(f"seen: {skipped} with skipna=True, {kept} with skipna=False; medians {median(True)} and {median(False)}")
assert median(True) == [1.0, 2.0, 3.0, None] and median(False) == [1.0, None, None, None]
assert skipped == [1.0, None, None, None], "the behaviour has changed"
assert kept == [1.0, None, 3.0, None], "the behaviour has changed"
PYTHON
