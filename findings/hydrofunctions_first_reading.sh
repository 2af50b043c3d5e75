#!/bin/sh
# If the first reading of a gauge is off its interval, hydrofunctions loses all the others.
#
# Guess:      a table of a gauge holds each reading at its time, whatever the spacing.
# Seen:       the answer of the service is put on a regular grid that begins at the first reading, and a reading that
#             is not on the grid is dropped. A day of readings each quarter of an hour, the first at 0:02 in the place
#             of 0:00, comes back as 96 rows with one number; 95 rows are marked as missing at the gauge. An odd
#             reading later in the record is dropped alone. No warning.
# Matters:    a gauge that restarts, or a request that begins with a reading of a visit, gives a record that looks
#             like a failure of the gauge. The discharge of the calibrated day is not there, or is one number.
# Documented: the qualifier hf.missing is described; no remark that readings are dropped, no public thread found.
# Versions:   hydrofunctions 0.2.4, pandas 2.3.3, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    hydrofunctions==0.2.4 pandas==2.3.3 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import warnings
from importlib.metadata import version

from hydrofunctions.hydrofunctions import extract_nwis_df


def answer(times):
    """The answer of the service, in its JSON, for discharges of 10, 11, 12, ... ft3/s at these times."""
    values = [{"value": str(10 + i), "qualifiers": ["P"], "dateTime": f"2024-01-10T{time}:00.000-05:00"}
              for i, time in enumerate(times)]
    source = {
        "siteName": "A BROOK", "siteCode": [{"value": "01234500", "network": "NWIS", "agencyCode": "USGS"}],
        "geoLocation": {"geogLocation": {"srs": "EPSG:4326", "latitude": 40.0, "longitude": -75.0}},
        "timeZoneInfo": {"defaultTimeZone": {"zoneOffset": "-05:00", "zoneAbbreviation": "EST"},
                         "daylightSavingsTimeZone": {"zoneOffset": "-04:00", "zoneAbbreviation": "EDT"},
                         "siteUsesDaylightSavingsTime": True},
    }
    variable = {
        "variableCode": [{"value": "00060", "variableID": 1}], "variableName": "Streamflow",
        "variableDescription": "Discharge, cubic feet per second", "unit": {"unitCode": "ft3/s"},
        "noDataValue": -999999.0, "options": {"option": [{"name": "Statistic", "optionCode": "00000"}]},
    }
    series = {"sourceInfo": source, "variable": variable, "name": "USGS:01234500:00060:00000",
              "values": [{"value": values, "qualifier": [{"qualifierCode": "P"}],
                          "method": [{"methodDescription": "", "methodID": 7}]}]}
    return {"value": {"queryInfo": {}, "timeSeries": [series]}}


def kept(times):
    """Numbers in the table, its rows, and the warnings of hydrofunctions."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        table = extract_nwis_df(answer(times))[0]
    own = [one for one in caught if "hydro" in one.category.__module__]
    return int(table.iloc[:, 0].notna().sum()), len(table), [str(one.message) for one in own]


quarters = [f"{hour:02}:{minute:02}" for hour in range(24) for minute in (0, 15, 30, 45)]
regular, late = kept(quarters), kept(["00:02", *quarters[1:]])
odd = kept([*quarters[:40], "09:50", *quarters[40:]])
print(f"hydrofunctions {version('hydrofunctions')}: a day each quarter of an hour; the first at 0:02; one more at 9:50")
print("expected: 96, 96 and 97 numbers")
print(f"seen: {regular[0]}, {late[0]} and {odd[0]} numbers in {regular[1]}, {late[1]} and {odd[1]} rows; "
      f"warnings {late[2]}")
assert regular[0] == 96
assert late[0] == 1 and odd[0] == 96, "the behaviour has changed"
assert not late[2], "the behaviour has changed"
PYTHON
