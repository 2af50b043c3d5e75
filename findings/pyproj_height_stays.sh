#!/bin/sh
# Without a geoid grid pyproj returns the height of the satellite receiver as the height above sea level, unchanged.
#
# Guess:      a transformation from ellipsoidal to levelled heights that has no geoid model raises or gives infinity;
#             only_best=True makes sure of it.
# Seen:       the wheels hold no grid and may not fetch one. For EGM2008 and for NAVD88 a "ballpark" operation copies
#             the height, with only_best=True as well. For a projected system with German heights the default copies
#             the height and only_best=True gives infinity: two systems, two behaviours.
# Matters:    a bed surveyed by satellite is about 43 m too high in the Netherlands and about 33 m too low in Maryland
#             beside the gauge. A constant offset passes each check of shape.
# Documented: PROJ describes ballpark transformations; pyproj's page on advanced use describes only_best.
# Versions:   pyproj 3.7.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check pyproj==3.7.2
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

from pyproj import Transformer, network

network.set_network_enabled(False)
places = {  # from, to, latitude, longitude, ellipsoidal height
    "EGM2008": ("EPSG:4979", "EPSG:9518", (52.0, 5.0, 50.0)),
    "NAVD88": ("EPSG:6319", "EPSG:6349", (39.0, -76.0, 10.0)),
    "DHHN2016": ("EPSG:4979", "EPSG:25832+7837", (50.0, 9.0, 250.0)),
}
seen = {}
for name, (source, target, point) in places.items():
    heights = (Transformer.from_crs(source, target, only_best=best).transform(*point)[2] for best in (False, True))
    seen[name] = (point[2], *heights)
print(f"pyproj {version('pyproj')}, no geoid grid: ellipsoidal height, levelled height, and the same with only_best")
print("expected: infinity or an error wherever the height of the geoid is not known")
print(f"seen: {seen}")
assert seen["DHHN2016"] == (250.0, 250.0, float("inf")), "the behaviour has changed"
assert seen["EGM2008"] == (50.0, 50.0, 50.0) and seen["NAVD88"] == (10.0, 10.0, 10.0), "the behaviour has changed"
PYTHON
