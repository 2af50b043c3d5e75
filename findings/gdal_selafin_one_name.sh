#!/bin/sh
# All time steps of a SELAFIN file have one layer name in GDAL, so that each name reads the first step.
#
# Guess:      the layers result_p2024_01_01_00_00_00, ... are named after the time of their step.
# Seen:       the name holds the date of the header only. Three steps an hour apart have three layers with one name, and
#             reading by name gives the first step each time; by number the steps differ.
# Matters:    a flood map or a depth at gauges taken from a TELEMAC result in QGIS, geopandas or fiona is that of the start
#             of the run, the initial condition, in each frame.
# Documented: otherwise. The page of the driver says that the elapsed seconds are added to the date of the header.
# Versions:   pyogrio 0.13.0 (with GDAL 3.12.4), xarray-selafin 0.2.5, python-serafin 0.2.2, xarray 2026.9.0,
#             geopandas 1.2.0, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pyogrio==0.13.0 xarray-selafin==0.2.5 python-serafin==0.2.2 xarray==2026.9.0 geopandas==1.2.0 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pyogrio
import xarray as xr
import xarray_selafin.xarray_backend  # makes the writer known to xarray

depths = np.array([0.1, 0.5, 0.9])  # m, at 0, 1 and 2 hours, the same at all nodes
xr.Dataset(
    {"H": (("time", "node"), np.repeat(depths[:, None], 4, axis=1))},
    coords={"x": ("node", [0.0, 1.0, 0.0, 1.0]), "y": ("node", [0.0, 0.0, 1.0, 1.0]),
            "time": np.datetime64("2024-01-01", "ns") + np.arange(3) * np.timedelta64(1, "h")},
    attrs={"ikle2": np.array([[1, 2, 3], [2, 4, 3]])},
).selafin.write("result.slf")
with xr.open_dataset("result.slf", engine="selafin") as opened:
    hours = ((opened.time - opened.time[0]) / np.timedelta64(1, "h")).values.tolist()
names = [str(name) for name, kind in pyogrio.list_layers("result.slf") if kind == "Point"]


def depth(layer):
    return round(float(pyogrio.read_dataframe("result.slf", layer=layer).iloc[0, 0]), 3)


by_name, by_number = [depth(name) for name in names], [depth(number) for number in range(3)]
print(f"pyogrio {version('pyogrio')} with GDAL {pyogrio.__gdal_version__}: depths {depths} m at {hours} hours")
print(f"expected: three names, and the depths {depths} by name")
print(f"seen: names {names}, depths by name {by_name}, by number {by_number}")
assert hours == [0.0, 1.0, 2.0] and by_number == [0.1, 0.5, 0.9]
assert len(set(names)) == 1 and by_name == [0.1, 0.1, 0.1], "the behaviour has changed"
PYTHON
