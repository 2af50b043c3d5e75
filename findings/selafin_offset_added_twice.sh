#!/bin/sh
# A SELAFIN file with offsets that is opened and written lies twice as far from the origin.
#
# Guess:      a file that is opened and written unchanged is the same file.
# Seen:       TELEMAC keeps single-precision coordinates near 0 and writes the offsets X_ORIG, Y_ORIG into the header.
#             Opening adds them to x and y; writing stores these sums and the offsets too. x = 683000 m becomes 1366000 m,
#             and 2049000 m after the next copy; x, stored in 32 bits, loses its digits on the way.
# Matters:    a subset of a result, a changed roughness or a restart file that is 700 km from its survey.
# Documented: no remark in the documentation; no public thread found.
# Versions:   xarray-selafin 0.2.5, python-serafin 0.2.2, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    xarray-selafin==0.2.5 python-serafin==0.2.2 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import struct
from importlib.metadata import version

import numpy as np
import xarray as xr
import xarray_selafin.xarray_backend  # makes the writer known to xarray

depth = (("time", "node"), np.full((1, 4), 0.5))
xr.Dataset(
    {"H": depth},
    coords={"x": ("node", [0.0, 1.0, 0.0, 1.0]), "y": ("node", [0.0, 0.0, 1.0, 1.0]),
            "time": np.array(["2024-01-01"], "datetime64[ns]")},
    attrs={"ikle2": np.array([[1, 2, 3], [2, 4, 3]])},
).selafin.write("local.slf")
with open("local.slf", "rb") as file:
    content = bytearray(file.read())
place = content.find(struct.pack(">i", 40)) + 4  # the record of ten integers; the third and fourth are the offsets
header = list(struct.unpack(">10i", content[place : place + 40]))
header[2:4] = 683000, 247000
content[place : place + 40] = struct.pack(">10i", *header)
with open("copy 0.slf", "wb") as file:
    file.write(content)
seen = []
for copy in range(3):
    with xr.open_dataset(f"copy {copy}.slf", engine="selafin") as opened:
        seen.append((float(opened.x[0]), float(opened.y[0])))
        opened.selafin.write(f"copy {copy + 1}.slf")
print(f"xarray-selafin {version('xarray-selafin')}: a mesh with the offsets 683000, 247000 m, opened and written twice")
print("expected: the first node stays at 683000, 247000 m")
print(f"seen: {seen}")
assert seen[0] == (683000.0, 247000.0)
assert seen[1] == (1366000.0, 494000.0) and seen[2] == (2049000.0, 741000.0), "the behaviour has changed"
PYTHON
