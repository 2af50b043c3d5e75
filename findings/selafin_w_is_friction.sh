#!/bin/sh
# A variable "W" of a 2D dataset is written as BOTTOM FRICTION.
#
# Guess:      a variable whose name is not in the tables of TELEMAC is written under its own name, as "MY" is.
# Seen:       names of one to three letters are looked up as short codes of TELEMAC: W is BOTTOM FRICTION in 2D, S is
#             FREE SURFACE, B is BOTTOM, Q is FLOWRATE. Read back by the same library the name is W again, so a round
#             trip looks right; a program of TELEMAC reads vertical velocities as roughness.
# Matters:    a depth-averaged result with u, v and w, or a weight or width W, copied to SELAFIN becomes a restart file
#             or a geometry with a roughness that nothing gave.
# Documented: the table of codes is in python-serafin; no remark in xarray-selafin, no public thread found.
# Versions:   xarray-selafin 0.2.5, python-serafin 0.2.2, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    xarray-selafin==0.2.5 python-serafin==0.2.2 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import re
from importlib.metadata import version

import numpy as np
import xarray as xr
import xarray_selafin.xarray_backend  # makes the writer known to xarray

values = (("time", "node"), np.full((1, 4), 0.01))
xr.Dataset(
    {"U": values, "V": values, "W": values, "MY": values},
    coords={"x": ("node", [0.0, 1.0, 0.0, 1.0]), "y": ("node", [0.0, 0.0, 1.0, 1.0]),
            "time": np.array(["2024-01-01"], "datetime64[ns]")},
    attrs={"ikle2": np.array([[1, 2, 3], [2, 4, 3]])},
).selafin.write("result.slf")
with open("result.slf", "rb") as file:  # names stand in records of 32 letters, 16 of the name and 16 of the unit
    content = file.read()
records = re.findall(rb"\x00\x00\x00\x20([\x20-\x7e]{16})[\x20-\x7e]{16}\x00\x00\x00\x20", content)
names = [record.decode().strip() for record in records]
again = list(xr.open_dataset("result.slf", engine="selafin"))
print(f"xarray-selafin {version('xarray-selafin')}: variables U, V, W and MY are written; read back {again}")
print("expected: VELOCITY U, VELOCITY V, W, MY in the file")
print(f"seen: {names}")
assert names[0] == "VELOCITY U" and names[3] == "MY"
assert names[2] == "BOTTOM FRICTION" and again == ["U", "V", "W", "MY"], "the behaviour has changed"
PYTHON
