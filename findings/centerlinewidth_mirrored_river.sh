#!/bin/sh
# In centerline-width a river in metres is its mirror image, and transects are perpendicular in degrees.
#
# Guess:      the "relative distances" in metres from the first point of the left bank are x to the east and y to the
#             north, as the headings "X (from Longitude)" and "Y (from Latitude)" say; a river 100 m wide is 100 m wide.
# Seen:       x is the distance to the north and y to the east: a reach of 2 km to the east runs to the north, and its left
#             bank lies to the right. At 60 degrees of latitude a straight reach to the northeast is 105.5 m wide, and one
#             to the east 100 m. No message.
# Matters:    sections and meshes from these coordinates whose bends turn to the other side; widths of a river in the
#             north that are 5 % too large in one direction.
# Documented: "(x, y)", without the directions; "normal of the centerline".
# Versions:   centerline-width 2.0.1, numpy 2.3.1, scipy 1.16.0, pandas 2.3.1, pyproj 3.7.2, shapely 2.1.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    centerline-width==2.0.1 numpy==2.3.1 scipy==1.16.0 pandas==2.3.1 pyproj==3.7.2 shapely==2.1.1
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 200 "$work/venv/bin/python" -W ignore - 2> log <<'PYTHON' || { cat log; exit 1; }
import csv
from importlib.metadata import version
from statistics import median

import centerline_width
from pyproj import Geod

WIDTH, LENGTH, LATITUDE = 100.0, 2000, 60.0  # m, m, degrees
geodesic = Geod(ellps="WGS84")


def reach(direction):
    """A straight reach with banks by GPS every 25 m; its direction in degrees from north."""
    with open("banks.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["llat", "llon", "rlat", "rlon"])
        for distance in range(0, LENGTH + 1, 25):
            east, north, back = geodesic.fwd(10.0, LATITUDE, direction, distance)
            left, right = (geodesic.fwd(east, north, back + 180.0 + side, WIDTH / 2.0) for side in (-90.0, 90.0))
            rows.writerow([left[1], left[0], right[1], right[0]])
    return centerline_width.CenterlineWidth("banks.csv")


def width(river):
    """Median width in m."""
    return round(1000.0 * median(centerline_width.width(river, apply_smoothing=False).values()), 1)


east, northeast = reach(90.0), reach(45.0)
end = [round(one) for one in east.left_bank_relative_coordinates[-1]]
opposite = [round(one) for one in east.right_bank_relative_coordinates[0]]
east.save_centerline_csv(
    save_to_csv="line.csv", centerline_type="Evenly Spaced", coordinate_unit="Relative Distance")
with open("line.csv") as file:
    heading, *points = csv.reader(file)
span = {name.split("Distance ")[1]: round(max(float(point[k]) for point in points)) for k, name in enumerate(heading)}
print(f"centerline-width {version('centerline-width')}: 2 km to the east at {LATITUDE} degrees, and to the northeast")
print(f"expected: end of the left bank at [2000, 0] m, right bank at [0, -100] m, widths of {WIDTH} m")
print(f"seen: {end}, {opposite}, widths {width(east)} and {width(northeast)} m; largest values in the file {span}")
assert abs(width(east) - WIDTH) < 0.1
assert end == [0, LENGTH] and opposite == [-100, 0], "the behaviour has changed"
assert span["Y (from Latitude) (m)"] > 1900 and width(northeast) > 105.0, "the behaviour has changed"
PYTHON
