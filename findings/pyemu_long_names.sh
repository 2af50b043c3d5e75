#!/bin/sh
# pyEMU cuts names at 12 and 20 letters when it writes a binary matrix; different parameters get the same name.
#
# Guess:      a matrix that is written and read by the same library keeps its names. Names of up to 200 letters are
#             allowed in PEST++ and pyEMU.
# Seen:       Matrix.to_binary cuts columns at 12 and rows at 20 letters without a warning. "roughness_reach_1" and
#             "roughness_reach_2" both come back as "roughness_re". to_ascii and to_coo keep whole names.
# Matters:    a Jacobian or an ensemble written for PEST++ cannot be matched with its control file, or is matched
#             with the wrong parameter, as soon as reaches or vegetation classes are numbered at the end.
# Documented: the lengths belong to the old format of PEST; pyemu issue 365 is about long names in both formats.
# Versions:   pyemu 1.7.0, numpy 2.3.1, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pyemu==1.7.0 numpy==2.3.1 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pyemu

rows = ["velocity_section_01_left", "velocity_section_01_right"]
columns = ["roughness_reach_1", "roughness_reach_2"]
matrix = pyemu.Jco(x=np.array([[1.0, 2.0], [3.0, 4.0]]), row_names=rows, col_names=columns)
matrix.to_binary("slopes.jco")
matrix.to_ascii("slopes.mat")
binary, text = pyemu.Jco.from_binary("slopes.jco"), pyemu.Matrix.from_ascii("slopes.mat")
print(f"pyemu {version('pyemu')}: rows {rows}, columns {columns}")
print("expected: the same names from the binary file")
print(f"seen: rows {binary.row_names}, columns {binary.col_names}")
assert text.row_names == rows and text.col_names == columns
assert binary.col_names == ["roughness_re"] * 2, "the behaviour has changed"
assert binary.row_names == ["velocity_section_01_"] * 2, "the behaviour has changed"
PYTHON
