#!/bin/sh
# laspy writes coordinates in whole centimetres: ripples of a flume bed become steps.
#
# Guess:      x, y and z are given and read as float64; a scan in metres comes back to the tenth of a millimetre, or
#             the scale of the file is chosen from the data.
# Seen:       the default scale is 0.01: heights of 1 to 6 mm come back as 0 and 10 mm, and points that are 4 mm apart
#             fall together. The same for every file made by laspy.create or an own header. Overflow raises, rounding
#             does not.
# Matters:    a scanned bed whose ripples, or stems of 4 mm, are gone, so that their roughness is looked for in n.
# Documented: the header has scales; the page on creating files sets them in its example without saying why.
# Versions:   laspy 2.7.0, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check laspy==2.7.0 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W error - <<'PYTHON'
from importlib.metadata import version

import laspy
import numpy as np

along = 0.004 * np.arange(25)  # m, a point each 4 mm
bed = 0.0035 + 0.0025 * np.sin(2.0 * np.pi * along / 0.05)  # m, ripples 5 mm high
scan = laspy.create()
scan.x, scan.y, scan.z = along, np.zeros_like(along), bed
scan.write("bed.las")
back = laspy.read("bed.las")
places, heights = np.unique(np.asarray(back.x)), np.unique(np.asarray(back.z))
print(f"laspy {version('laspy')}: 25 points at a distance of 4 mm on ripples from {bed.min():.4f} to {bed.max():.4f} m")
print("expected: 25 places and as many heights, to less than a millimetre")
print(f"seen: scale {back.header.scales.tolist()}, {places.size} places, heights {heights.tolist()} m")
assert back.header.scales.tolist() == [0.01] * 3, "the behaviour has changed"
assert places.size == 11 and np.allclose(heights, [0.0, 0.01]), "the behaviour has changed"
PYTHON
