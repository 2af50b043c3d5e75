#!/bin/sh
# A terrain stored in centimetres with a scale of 0.01 becomes a hundred times as high when tiles are merged or exported.
#
# Guess:      rasterio.merge and a copy as ASCII grid keep the heights: apply scale and offset, or hand them on.
# Seen:       the merged file holds the stored numbers with a scale of 1; the ASCII grid holds the stored numbers as
#             well, its scale only in an .aux.xml that programs of hydraulics do not read. 100.12 m become 10012 m.
# Matters:    national terrains come as 16-bit integers with a scale. Their tiles are merged, or cut to the reach and
#             exported for a model; the steps of the bed are then a hundred times as high, and only a plot shows it.
# Documented: that read() does not apply scales is; of merge and of the ASCII grid nothing was found.
# Versions:   rasterio 1.4.4 (with its GDAL), numpy 2.3.1.
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
from rasterio.merge import merge
from rasterio.shutil import copy
from rasterio.transform import from_origin


def heights(name):
    """Heights of a file by the scale and the offset that it states [m]."""
    with rasterio.open(name) as file:
        return float(file.read(1)[0, 0]) * file.scales[0] + file.offsets[0], file.scales[0]


for number in range(2):
    place = from_origin(2690000.0 + 20.0 * number, 1240000.0, 1.0, 1.0)
    with rasterio.open(f"tile{number}.tif", "w", driver="GTiff", width=20, height=20, count=1, dtype="uint16",
                       crs="EPSG:2056", transform=place) as file:  # fmt: skip
        file.write(np.full((20, 20), 10012, np.uint16), 1)
        file.scales, file.offsets = [0.01], [0.0]
whole, _ = heights("tile0.tif")
merge(["tile0.tif", "tile1.tif"], dst_path="merged.tif")
merged, scale = heights("merged.tif")
copy("tile0.tif", "bed.asc", driver="AAIGrid")
grid = float(open("bed.asc").read().split()[-1])
print(f"rasterio {version('rasterio')}: tiles of {whole:g} m, 10012 with a scale of 0.01")
print(f"expected: {whole:g} m in the merged file and in the ASCII grid")
print(f"seen: {merged:g} m in the merged file (scale {scale:g}), {grid:g} m in the ASCII grid")
assert abs(whole - 100.12) < 1e-9
assert (merged, scale, grid) == (10012.0, 1.0, 10012.0), "the behaviour has changed"
PYTHON
