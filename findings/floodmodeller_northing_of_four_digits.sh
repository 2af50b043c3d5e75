#!/bin/sh
# A river section that floodmodeller-api reads and saves moves by up to 500 m northwards or southwards.
#
# Guess:      a .dat file that is opened and saved has its sections where they were, at least to the centimetre that its
#             columns of ten characters hold.
# Seen:       a number that has more than ten characters with three decimals is written with four digits: a northing of
#             5248123.25 m, which fills its column, comes back as 5.248e+06. Eastings and heights stay. A section that is
#             not touched moves as well, and points along a section that runs to the north fall together. No message.
# Matters:    northings have seven digits in UTM from 9 degrees north on. Sections of a saved model lie beside its terrain
#             and its cells of 2D.
# Documented: no remark on digits; no public thread found.
# Versions:   floodmodeller-api 0.5.8.post1, pandas 2.3.1, numpy 2.2.6, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    floodmodeller-api==0.5.8.post1 pandas==2.3.1 numpy==2.2.6 scipy==1.16.0
cd "$work"
TMPDIR="$work" timeout 100 "$work/venv/bin/python" -W ignore - 2> log <<'PYTHON' || { cat log; exit 1; }
import logging
from importlib.metadata import version
from pathlib import Path

from floodmodeller_api import DAT

logging.disable()

places = [(683421.37, 5248123.25), (683421.87, 5248126.25), (683422.37, 5248129.25)]  # m, on a map
rows = [f"{3.0 * number:10.3f}{height:10.3f}{0.03:10.3f} {1.0:9.3f}{'':10}{east:10.2f}{north:10.2f}"
        for number, (height, (east, north)) in enumerate(zip((102.5, 100.0, 102.5), places))]
Path("reach.dat").write_text("\n".join([
    "reach", "#REVISION#1", "         1     0.750     0.900     0.100     0.001        12SI",
    "    10.000     0.010     0.010     0.700     0.100     0.700     0.000", "RAD FILE", "", "END GENERAL",
    "RIVER", "SECTION", "S1", f"{0.0:10.3f}{'':10}{0.0001:10.6f}{1000.0:10.3f}", f"{3:10d}", *rows,
    "INITIAL CONDITIONS",
    " label   ?      flow     stage froude no  velocity     umode    ustate         z",
    f"{'S1':12} y" + 7 * f"{0.0:10.3f}", ""]))


def positions(file):
    section = DAT(file).sections["S1"].data
    return [(float(east), float(north)) for east, north in zip(section["Easting"], section["Northing"])]


read = positions("reach.dat")
DAT("reach.dat").save("saved.dat")
saved = positions("saved.dat")
print(f"floodmodeller-api {version('floodmodeller-api')}: eastings and northings of a section, read and saved")
print(f"expected: {read}")
print(f"seen: {saved}")
assert read == places
assert saved == [(east, 5248000.0) for east, _ in places], "the behaviour has changed"
PYTHON
