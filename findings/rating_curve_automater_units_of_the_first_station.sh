#!/bin/sh
# In a sheet of two stations rating-curve-automater takes the units of the first one for both.
#
# Guess:      stage and discharge are converted by the heads of their own columns, as in a sheet of one station.
# Seen:       two stations side by side, "Stage, m" and "Q, cms", then "Stage, cm" and "Q, lps", are put below each
#             other, and only the heads of the first are read: 30 cm and 1000 l/s at the second station are 30 m and
#             1000 m3/s. With the stations exchanged, metres and m3/s of the other become 0.003 m and 0.001 m3/s. The
#             report names one unit.
# Matters:    a weir in l/s beside a river section in m3/s, in one sheet: one of the two rating curves is wrong by a
#             factor of a thousand in discharge and a hundred in stage.
# Documented: the docstring says that units can still be detected after the stations are put below each other.
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

river, weir = "{x} readings,Stage{s} m,Q{s} cms", "{x} readings,Stage{s} cm,Q{s} lps"
in_river, at_weir = ["a,0.3,1.0", "a,0.4,2.0", "a,0.5,3.0"], ["b,30,1000", "b,40,2000", "b,50,3000"]


def second(heads, rows):
    """Stages and discharges of the second station of the sheet, and its messages about units."""
    named = [head.format(x=name, s="") for head, name in zip(heads, ("Upper", "Lower"))]
    lines = [f"2024-05-0{i + 1},{left},{right}" for i, (left, right) in enumerate(zip(*rows))]
    Path("sheet.csv").write_text("\n".join([",".join(["Date", *named]), *lines]) + "\n")
    table, report = load_measurements("sheet.csv")
    lower = table[table["site"] == "Lower"]
    return lower["stage_m"].round(4).tolist(), lower["discharge_cms"].round(4).tolist(), report.messages[1:]


weir_second, river_second = second((river, weir), (in_river, at_weir)), second((weir, river), (at_weir, in_river))
print(f"rating-curve-automater {version('rating-curve-automater')}: a river section and a weir of the same stages and flows")
print("expected: [0.3, 0.4, 0.5] m and [1.0, 2.0, 3.0] m3/s for the second station in both sheets")
print(f"seen: the weir second {weir_second}; the river second {river_second}")
assert weir_second[:2] == ([30.0, 40.0, 50.0], [1000.0, 2000.0, 3000.0]), "the behaviour has changed"
assert river_second[:2] == ([0.003, 0.004, 0.005], [0.001, 0.002, 0.003]), "the behaviour has changed"
PYTHON
