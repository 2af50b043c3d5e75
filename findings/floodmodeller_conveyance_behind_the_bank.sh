#!/bin/sh
# The conveyance of a Flood Modeller section counts the ground outside its deactivation markers.
#
# Guess:      RIVER.conveyance of a section with the markers LEFT and RIGHT is that of the part between them, which is
#             active_data, and follows a marker that is set.
# Seen:       it is that of all points: 7962 m3/s at 2 m in a channel between embankments whose own conveyance is 1382,
#             with and without the markers. No message.
# Matters:    a rating curve of normal depth, or a check of the model, with 5.8 times the discharge of the channel,
#             because of a floodplain that the model does not use.
# Documented: "the same method as applied in Flood Modeller"; the difference is said to be the number of points at most.
# Versions:   floodmodeller-api 0.5.8.post1, pandas 2.3.1, numpy 2.2.6, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    floodmodeller-api==0.5.8.post1 pandas==2.3.1 numpy==2.2.6 scipy==1.16.0
cd "$work"
TMPDIR="$work" HOME="$work" timeout 200 "$work/venv/bin/python" -W ignore - 2> log <<'PYTHON' || { cat log; exit 1; }
import logging
from importlib.metadata import version

import numpy as np
import pandas as pd
from floodmodeller_api import DAT
from floodmodeller_api.units import RIVER

logging.disable()
ROUGHNESS, LEVEL = 0.03, 2.0  # s/m^(1/3), m
GROUND = [  # m across and above the bed: floodplain, embankment, channel, embankment, floodplain
    (0.0, 3.0), (0.1, 1.0), (100.0, 1.0), (100.1, 3.0), (110.0, 0.0), (120.0, 0.0), (129.9, 3.0), (130.0, 1.0), (229.9, 1.0),
    (230.0, 3.0)]
MARKED = {3: "LEFT", 6: "RIGHT"}
COLUMNS = ["X", "Y", "Mannings n", "Panel", "RPL", "Marker", "Easting", "Northing", "Deactivation", "SP. Marker"]


def section(marks):
    """Section as it is saved and read again."""
    rows = [
        [across, height, ROUGHNESS, False, 1.0, "", 0.0, 0.0, marks.get(place, ""), 0]
        for place, (across, height) in enumerate(GROUND)
    ]
    model = DAT()
    model.insert_unit(RIVER(name="S1", data=pd.DataFrame(rows, columns=COLUMNS)), add_at=-1)
    model.save("model.dat")
    return DAT("model.dat").sections["S1"]


def at_level(curve):
    return round(float(np.interp(LEVEL, curve.index, curve.to_numpy())))


side = LEVEL * (110.0 - 100.1) / 3.0  # m across each slope under water
area, perimeter = LEVEL * (10.0 + side), 10.0 + 2.0 * np.hypot(LEVEL, side)
right = round(area ** (5.0 / 3.0) / perimeter ** (2.0 / 3.0) / ROUGHNESS)
marked, unmarked = section(MARKED), section({})
between = list(marked.active_data["X"])
print(f"floodmodeller-api {version('floodmodeller-api')}: conveyance in m3/s at {LEVEL} m")
print(f"expected: {right}, of the ground from {between[0]} to {between[-1]} m")
print(f"seen: {at_level(marked.conveyance)}, without markers {at_level(unmarked.conveyance)}")
assert between == [across for across, _ in GROUND[3:7]]
assert at_level(marked.conveyance) == at_level(unmarked.conveyance) > 5 * right, "the behaviour has changed"
PYTHON
