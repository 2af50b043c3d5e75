#!/bin/sh
# HydroMT-SFINCS writes discharges and levels with two decimals, places with one: an inflow of 4 l/s is 0.
#
# Guess:      a forcing that is set as a table of float64 reaches the model as it is, or with digits relative to its
#             size.
# Seen:       an inflow of 4.1 to 4.9 l/s is written as 0.00 m3/s and 11.2 l/s as 0.01; levels of 0.1234 to 0.1299 m as
#             0.12 and 0.13, so that the slope of a tide or flood comes in steps of 1 cm; a source at x = 2.345 m moves
#             to 2.3 m, on a grid of 0.1 m into another column. No warning; in memory the forcing keeps its digits.
# Matters:    a flume, a brook or a plot of marsh without inflow, or with a surface slope made of steps.
# Documented: the format "%7.2f" is listed as the default of write_forcing; setup_discharge_forcing does not name it.
# Versions:   hydromt-sfincs 1.2.2, hydromt 0.10.1, numpy 2.3.1, pandas 2.3.3, xarray 2025.7.1, geopandas 1.1.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    hydromt-sfincs==1.2.2 hydromt==0.10.1 numpy==2.3.1 pandas==2.3.3 xarray==2025.7.1 geopandas==1.1.1
cd "$work"
timeout 300 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import logging
from importlib.metadata import version
from pathlib import Path

import geopandas
import numpy as np
import pandas as pd
from hydromt_sfincs import SfincsModel

logging.disable(logging.CRITICAL)
times = pd.date_range("2024-01-01", periods=4, freq="20min")
inflow, level = [0.0041, 0.0043, 0.0049, 0.0112], [0.1234, 0.1266, 0.1277, 0.1299]
place = geopandas.GeoDataFrame(index=[1], geometry=geopandas.points_from_xy([2.345], [3.456]), crs=25832)
model = SfincsModel(root="case", mode="w+")
model.setup_grid(x0=0, y0=0, dx=0.1, dy=0.1, nmax=50, mmax=50, rotation=0, epsg=25832)
model.config.update({name: "20240101 000000" for name in ("tref", "tstart")} | {"tstop": "20240101 010000"})
model.setup_discharge_forcing(timeseries=pd.DataFrame({1: inflow}, index=times), locations=place)
model.set_forcing_1d(df_ts=pd.DataFrame({1: level}, index=times), gdf_locs=place, name="bzs")
model.write_forcing()
del model  # its end prints an error if the interpreter ends first
seen = {end: np.loadtxt(Path("case", f"sfincs.{end}"), ndmin=2) for end in ("dis", "bzs", "src")}
print(f"hydromt-sfincs {version('hydromt-sfincs')}: inflow, level and place of a source as written")
print(f"expected: {inflow} m3/s, {level} m, (2.345, 3.456) m")
print(f"seen: {seen['dis'][:, 1].tolist()} m3/s, {seen['bzs'][:, 1].tolist()} m, {seen['src'][0].tolist()} m")
assert seen["dis"][:, 1].tolist() == [0.0, 0.0, 0.0, 0.01], "the behaviour has changed"
assert seen["bzs"][:, 1].tolist() == [0.12, 0.13, 0.13, 0.13], "the behaviour has changed"
assert seen["src"][0].tolist() == [2.3, 3.5], "the behaviour has changed"
PYTHON
