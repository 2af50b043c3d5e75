#!/bin/sh
# A bed sampled at a station beside the raster is 0 m.
#
# Guess:      a place outside a raster raises an error or gives NaN.
# Seen:       `sample` yields 0.0 if the file states no nodata value, and the nodata value if it does, as a number. The
#             right and lower edge, which `bounds` includes, are outside, too. The same with windows read `boundless`.
#             Only `masked=True` marks them.
# Matters:    verticals beyond the surveyed bed, or on the edge of a tile, stand over a bed of 0 m: metres of water in
#             a brook at 12 m. Behind a datum near 0 m (a delta) nothing looks wrong.
# Documented: the docstring of `masked` ("whether to mask samples that fall outside"); none gives the value without.
# Versions:   rasterio 1.4.4, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check rasterio==1.4.4 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import rasterio
from rasterio.transform import from_origin
from rasterio.windows import Window

PLACES = {"inside": (0.5, 0.5), "on the right edge": (4.0, 1.0), "5 m beside it": (-5.0, 1.0)}
seen = {}
for nodata in (None, -9999.0):
    grid = {"height": 3, "width": 4, "count": 1, "dtype": "float32", "transform": from_origin(0, 3, 1, 1)}
    with rasterio.open("bed.tif", "w", driver="GTiff", nodata=nodata, **grid) as file:
        file.write(np.full((1, 3, 4), 12.5, "float32"))
    with rasterio.open("bed.tif") as file:
        assert file.bounds.right == 4.0
        seen[nodata] = [float(one[0]) for one in file.sample(PLACES.values())]
        masked = [bool(np.ma.getmaskarray(one)[0]) for one in file.sample(PLACES.values(), masked=True)]
        beside = float(file.read(1, window=Window(-2, 0, 1, 1), boundless=True)[0, 0])
    assert masked == [False, True, True] and beside == seen[nodata][2], "the behaviour has changed"
print(f"rasterio {version('rasterio')}: a bed of 12.5 m, 4 m by 3 m, sampled {', '.join(PLACES)}")
print("expected: 12.5, then NaN or an error")
print(f"seen: {seen[None]}; with a nodata value {seen[-9999.0]}")
assert seen == {None: [12.5, 0.0, 0.0], -9999.0: [12.5, -9999.0, -9999.0]}, "the behaviour has changed"
PYTHON
