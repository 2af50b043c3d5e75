#!/bin/sh
# The discharge of a transect is integrated over eastings: a boat that crosses from south to north carries nothing.
#
# Guess:      velocity along the river times the distance between the banks: 100 m, 4 m deep, at 1 m/s have 400 m3/s,
#             whatever the direction in which the river runs.
# Seen:       discharge uses the easting of the boat as its distance. A transect towards the east has 398 m3/s, towards
#             the north-east 282 and towards the north 0 m3/s; power falls with it. No warning.
# Matters:    the discharge of an ADCP survey on a river that does not run north or south, 30 % too small at 45 degrees.
# Documented: the docstring wants the first velocity along the flow and a UTM zone; a direction of the transect is not
#             named. A depth as DataArray, as the docstring has it, raises ValueError; it is an array here.
# Versions:   mhkit 1.1.2 (its module dolfyn, without the rest of its dependencies), Cartopy 0.26.0, numpy 2.3.1,
#             xarray 2025.7.1, pyproj 3.7.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    numpy==2.3.1 scipy==1.16.0 pandas==2.3.3 xarray==2025.7.1 matplotlib==3.10.3 Cartopy==0.26.0 pyproj==3.7.2
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps mhkit==1.1.2
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import xarray as xr
from mhkit.dolfyn.adp.discharge import discharge
from pyproj import Transformer

WIDTH, DEPTH, SPEED, PINGS = 100.0, 4.0, 1.0, 401  # m, m, m/s
to_degrees = Transformer.from_crs("EPSG:32610", "EPSG:4326", always_xy=True)
cells = np.arange(0.25, 6.0, 0.5)  # m below the surface
times = np.datetime64("2024-01-01", "ns") + np.arange(PINGS) * np.timedelta64(1, "s")


def of_transect(azimuth):
    """Discharge of a straight transect in this direction (degrees from north), the flow at right angles to it."""
    along = np.linspace(-WIDTH / 2.0, WIDTH / 2.0, PINGS)
    east, north = 500000.0 + along * np.sin(np.radians(azimuth)), 5200000.0 + along * np.cos(np.radians(azimuth))
    longitude, latitude = to_degrees.transform(east, north)
    velocity = np.zeros((3, cells.size, PINGS))
    velocity[0] = SPEED
    velocity[:, cells > DEPTH] = np.nan
    survey = xr.Dataset(
        {"vel": (("dir", "range", "time"), velocity), "latitude_gps": ("time_gps", latitude),
         "longitude_gps": ("time_gps", longitude)},
        {"dir": ["streamwise", "x", "vert"], "range": cells, "time": times, "time_gps": times},
        {"coord_sys": "principal"},
    )
    return float(discharge(survey, np.full(PINGS, DEPTH), 1000.0, mu=1e-3, utm_zone=10).discharge)


expected = WIDTH * DEPTH * SPEED
seen = {azimuth: of_transect(azimuth) for azimuth in (90, 60, 45, 30, 0)}
print(f"mhkit {version('mhkit')}: a river of 100 m and 4 m with 1 m/s, crossed in a direction from north")
print(f"expected: {expected:.0f} m3/s for all")
print(f"seen: {({azimuth: round(one) for azimuth, one in seen.items()})} m3/s")
assert np.isclose(seen[90], expected, rtol=0.01)
shares = [one / seen[90] for one in seen.values()]
assert np.allclose(shares, [np.sin(np.radians(azimuth)) for azimuth in seen], atol=0.01), "the behaviour has changed"
PYTHON
