#!/bin/sh
# The hydraulic table of w2rpy loses half of a trapezoid that is given by its four corners.
#
# Guess:      htab_1D cuts the section at the level of the water on both banks, so that four corners and a survey with a
#             point each 0.1 ft have one area and one discharge.
# Seen:       it does so on the right bank. On the left the dry point beside the water is left out, and the first wet one
#             is lifted to the surface. A trapezoid with a bed of 20 ft and 4 ft of water, (0, 5), (5, 0), (25, 0),
#             (30, 5), has 48 in the place of 96 ft2. With one more corner, in the middle of the bed, it has 68; with a
#             point each 0.1 ft it has 96. No message.
# Matters:    design sections and cross-sections of models are given by few corners: half of the area, and a rating
#             curve that depends on where the surveyor stood.
# Documented: no remark on the spacing of points; the docstring asks for stations and their elevations.
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

import numpy as np
from w2rpy import htab_1D


def area(stations, elevations):
    """Area in ft2 of 4 ft of water, from the last row of the table for a slope of 0.001 and grains of 0.1 ft."""
    return round(float(htab_1D(stations, elevations, 0.001, 0.1, max_depth=4.0)["A"].iloc[-1]), 1)


places = np.arange(0.0, 30.05, 0.1)
corners = area([0.0, 5.0, 25.0, 30.0], [5.0, 0.0, 0.0, 5.0])
middle = area([0.0, 5.0, 15.0, 25.0, 30.0], [5.0, 0.0, 0.0, 0.0, 5.0])
survey = area(places, np.maximum(np.maximum(5.0 - places, places - 25.0), 0.0))
print(f"w2rpy {version('w2rpy')}: area in ft2 of 4 ft of water in a trapezoid of 96 ft2")
print("expected: 96 by its corners, with one more in the middle of the bed, and by a point each 0.1 ft")
print(f"seen: {corners}, {middle} and {survey}")
assert [corners, middle, survey] == [48.0, 68.0, 96.0], "the behaviour has changed"
PYTHON
