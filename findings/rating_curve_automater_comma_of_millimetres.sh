#!/bin/sh
# rating-curve-automater reads a stage of "0,352" m as 352 m, and "0,35" m as 0.35 m.
#
# Guess:      a decimal comma is a decimal comma in each row, as the cleaning of the package announces; a number that
#             begins with "0," has no thousands.
# Seen:       a comma with one or two digits behind it is a decimal comma, one with three a separator of thousands. A
#             sheet with stages in millimetres of resolution, from 0,352 to 1,420 m, becomes 352 to 1420 m; a discharge
#             of 1,215 m3/s becomes 1215. In one column "0,35" stays 0.35. The report has no message.
# Matters:    stages are read to the millimetre. A whole column is a thousand times too large, which a curve in
#             logarithms fits as well as before; a mixed one has gaugings at 352 m beside 0.35 m.
# Documented: the cleaning lists decimal commas; the comment in the source calls three digits thousands.
# Versions:   rating-curve-automater 0.3.10, numpy 2.3.1, pandas 2.3.3, matplotlib 3.10.3, openpyxl 3.1.5, PyYAML 6.0.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    rating-curve-automater==0.3.10 numpy==2.3.1 pandas==2.3.3 matplotlib==3.10.3 openpyxl==3.1.5 PyYAML==6.0.2
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

from rating_curve_automater.loader import load_measurements

rows = ['2024-05-01,"0,35","1,2"', '2024-05-02,"0,352","1,215"', '2024-05-03,"0,610","2,871"', '2024-05-04,"0,905","5,061"',
        '2024-05-05,"1,420","12,50"']
Path("gaugings.csv").write_text("\n".join(["Date,Stage (m),Discharge (m3/s)", *rows]) + "\n")
table, report = load_measurements("gaugings.csv")
stages, discharges = table["stage_m"].tolist(), table["discharge_cms"].tolist()
print(f"rating-curve-automater {version('rating-curve-automater')}: gaugings with decimal commas, in m and m3/s")
print("expected: 0.35, 0.352, 0.61, 0.905, 1.42 m and 1.2, 1.215, 2.871, 5.061, 12.5 m3/s, or an error")
print(f"seen: {stages} m and {discharges} m3/s; messages {report.messages}")
assert stages == [0.35, 352.0, 610.0, 905.0, 1420.0], "the behaviour has changed"
assert discharges == [1.2, 1215.0, 2871.0, 5061.0, 12.5], "the behaviour has changed"
assert not report.messages, "the behaviour has changed"
PYTHON
