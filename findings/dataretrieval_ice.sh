#!/bin/sh
# One hour of ice turns a USGS discharge into text, and a failed gauge stays at -999999 ft.
#
# Guess:      dataretrieval knows the codes of its own service: "Ice" and "Eqp" become NaN, -999999 becomes NaN, and a
#             site number keeps its leading zero as the docstring of the reader promises for codes.
# Seen:       the column with "Ice" is text throughout, sound readings too ("120" < "95"). The stage of -999999 is a
#             number among the others. Site 01491000 becomes 1491000, which is no site.
# Matters:    maxima and comparisons of text run without an error and are wrong. hydrofunctions, which reads the JSON
#             of the same service, gives NaN in both places.
# Documented: the codes are in the help pages of the USGS; read_rdb documents na_values nowhere, no thread found.
# Versions:   dataretrieval 1.4.0, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    dataretrieval==1.4.0 pandas==2.3.3 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

from dataretrieval.rdb import read_rdb

TABLE = """# USGS instantaneous values
agency_cd\tsite_no\tdatetime\ttz_cd\t69928_00060\t69928_00060_cd\t69929_00065\t69929_00065_cd
5s\t15s\t20d\t6s\t14n\t10s\t14n\t10s
USGS\t01491000\t2024-01-10 00:00\tEST\t95\tP\t3.21\tP
USGS\t01491000\t2024-01-10 00:15\tEST\t120\tP\t3.25\tP
USGS\t01491000\t2024-01-10 00:30\tEST\tIce\tP\t3.27\tP
USGS\t01491000\t2024-01-10 00:45\tEST\tEqp\tP\t-999999\tP
"""
data = read_rdb(TABLE)
discharge, stage = data["69928_00060"], data["69929_00065"]
print(f"dataretrieval {version('dataretrieval')}: discharges 95, 120, Ice, Eqp; stages 3.21, 3.25, 3.27, -999999")
print("expected: numbers with NaN in the places of the codes, site '01491000'")
print(f"seen: discharges {discharge.tolist()}, largest of the first two {max(discharge[:2])!r}; "
      f"lowest stage {stage.min()}; site {data['site_no'][0]!r}")
assert max(discharge[:2]) == "95", "the behaviour has changed"
assert stage.min() == -999999.0 and str(data["site_no"][0]) == "1491000", "the behaviour has changed"
PYTHON
