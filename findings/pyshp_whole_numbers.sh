#!/bin/sh
# A field of numbers in a shapefile keeps whole numbers only: a roughness of 0.035 is 0, also in a field of type F.
#
# Guess:      field("n", "N") or field("n", "F") and record(0.035) keep 0.035, or complain that it does not fit.
# Seen:       without decimal=... numbers are cut to whole ones: n = 0.035 is 0, 12.7 stems are 12. No warning.
# Matters:    patches with Manning's n or a drag of 0.9 are written as 0; a model of them runs, and has no friction.
#             Densities lose up to one stem per m2.
# Documented: yes, "By default the fourth decimal argument is set to zero, essentially creating an integer field"; that
#             values are cut and not rounded is not.
# Versions:   pyshp 3.1.6.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check pyshp==3.1.6
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import shapefile

written = {"n_plain": 0.035, "n_float": 0.035, "stems": 12.7, "n_stated": 0.035}
with shapefile.Writer("patches.shp") as writer:
    writer.field("n_plain", "N")
    writer.field("n_float", "F")
    writer.field("stems", "N", size=12)
    writer.field("n_stated", "N", decimal=4)
    writer.poly([[[0.0, 0.0], [0.0, 2.0], [2.0, 2.0], [0.0, 0.0]]])
    writer.record(**written)
with shapefile.Reader("patches.shp") as reader:
    read = reader.record(0).as_dict()
print(f"pyshp {version('pyshp')}: written {written}")
print(f"expected: {written}")
print(f"seen: {read}")
assert read["n_stated"] == 0.035
assert (read["n_plain"], read["n_float"], read["stems"]) == (0, 0, 12), "the behaviour has changed"
PYTHON
