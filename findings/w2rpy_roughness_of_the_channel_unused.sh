#!/bin/sh
# The channel_roughness of w2rpy's htab_2D is never read: channel and floodplain have the roughness of the floodplain.
#
# Guess:      with channel_area given, the channel has channel_roughness (0.035 unless set) and the rest "roughness".
# Seen:       the discharge of the channel is 30 ft3/s with channel_roughness 0.02, 0.035 and 0.1 alike, and halves if
#             the roughness of the floodplain is doubled. With 0.1 on the floodplain the channel carries a third of what
#             0.035 gives. No message.
# Matters:    rating curves of compound channels in which most of the water, that of the channel, flows over the plants
#             of the floodplain.
# Documented: otherwise. The docstring gives both roughnesses and the default of the second.
# Versions:   w2rpy 0.3.39, pysheds 0.5, numpy 2.2.6, scipy 1.16.0, pandas 2.3.3, geopandas 1.1.1, rasterio 1.4.4, numba
#             0.61.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    w2rpy==0.3.39 pysheds==0.5 numpy==2.2.6 scipy==1.16.0 pandas==2.3.3 requests==2.32.4 geopandas==1.1.1 \
    shapely==2.1.1 rasterio==1.4.4 matplotlib==3.10.3 numba==0.61.2 scikit-image==0.25.2
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import geopandas
import numpy as np
import rasterio
from shapely.geometry import LineString, box
from w2rpy import htab_2D

# A reach of 200 ft on a grid of 5 ft: a floodplain 1 ft above a channel 20 ft wide, in heights above the channel bed.
heights = np.ones((20, 40), "float32")
heights[8:12] = 0.0
profile = {"driver": "GTiff", "width": 40, "height": 20, "count": 1, "dtype": "float32", "nodata": -9999.0, "crs": "EPSG:2272",
           "transform": rasterio.transform.from_origin(0.0, 100.0, 5.0, 5.0)}
with rasterio.open("reach.tif", "w", **profile) as file:
    file.write(heights, 1)
line = geopandas.GeoDataFrame(geometry=[LineString([(0.0, 50.0), (200.0, 50.0)])], crs="EPSG:2272")
channel = geopandas.GeoDataFrame(geometry=[box(0.0, 40.0, 200.0, 60.0)], crs="EPSG:2272")


def discharge(floodplain, **options):
    """Discharge in ft3/s of the channel with 2 ft of water in it, for this roughness of the floodplain."""
    extents = geopandas.GeoDataFrame({"WSE": [2.0]}, geometry=[box(0.0, 0.0, 200.0, 100.0)], crs="EPSG:2272")
    found = htab_2D("reach.tif", extents, line, 0.001, floodplain, channel_area=channel, **options)
    return round(float(found["Qac"].iloc[0]), 1)


seen = {n: discharge(0.1, channel_roughness=n) for n in (0.02, 0.035, 0.1)}
doubled, default = discharge(0.2), discharge(0.1)
print(f"w2rpy {version('w2rpy')}: discharge in ft3/s of a channel, by its roughness, beside a floodplain with n = 0.1")
print("expected: proportional to 1 / channel_roughness, and the same for each roughness of the floodplain")
print(f"seen: {seen}; with n = 0.2 on the floodplain {doubled}")
assert len(set(seen.values())) == 1 and default == seen[0.02], "the behaviour has changed"
assert abs(doubled - 0.5 * default) < 0.2, "the behaviour has changed"
PYTHON
