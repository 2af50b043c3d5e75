#!/bin/sh
# A terrain grid without a NODATA line has pits of -9999 m, and its heights are whole metres.
#
# Guess:      the header line NODATA_value of an ESRI ASCII grid is optional and -9999 is its default, as the makers of
#             the format state, so a reader masks -9999. Heights come back as floating point numbers.
# Seen:       GDAL, and with it rasterio, has no nodata value for such a file: -9999 is a height like any other, also in
#             a masked reading. A grid of whole numbers is of type int32, which
#             cannot hold NaN for its dry cells.
# Matters:    a bed with pits of ten kilometres. Interpolated to a mesh, a pit spreads to its neighbours and is then
#             no longer -9999.
# Documented: the format description of Esri gives the default; GDAL's page on AAIGrid has no default.
# Versions:   rasterio 1.4.4 (GDAL of its wheel), numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check rasterio==1.4.4 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import rasterio

HEADER = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
ROWS = "253 254 -9999\n252 251 250\n"


def opened(name, text):
    """Nodata value, type and masked heights of a grid."""
    with open(name, "w") as file:
        file.write(text)
    with rasterio.open(name) as grid:
        return grid.nodata, grid.dtypes[0], grid.read(1, masked=True)


declared = opened("declared.asc", HEADER + "NODATA_value -9999\n" + ROWS)
default = opened("default.asc", HEADER + ROWS)
print(f"rasterio {rasterio.__version__}, GDAL {rasterio.__gdal_version__}: the same grid with and without NODATA_value")
print("expected: one masked cell and a lowest height of 250 m in both")
print(f"seen: declared {declared[2].count()} heights, lowest {declared[2].min()}, {declared[1]}; "
      f"default {default[2].count()} heights, lowest {default[2].min()}, {default[1]}")
assert declared[2].count() == 5 and declared[2].min() == 250
assert default[0] is None and default[2].min() == -9999, "the behaviour has changed"
assert default[1] == "int32", "the behaviour has changed"
PYTHON
