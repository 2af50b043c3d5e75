#!/bin/sh
# pint reads "ppt" as picopints, "cft" as hundredths of a foot and "deg C" as degrees times coulomb.
#
# Guess:      units of discharge, salinity and temperature that stand in every export either have their meaning or
#             raise an error.
# Seen:       ppt (parts per thousand) is 4.7e-16 m3, cft (cubic feet) is 3 mm, "deg C" is an angle times a charge,
#             M (as in DEPTH [M]) is mol/l and "m N" (metres above Normal) is newton metres. Each is a legal quantity.
#             The common cfs, cms, m3/s and ft3/s are not known at all and raise.
# Matters:    a reader that trusts "pint knows the unit" accepts headers of instruments with a wrong meaning;
#             a check of dimensions is needed besides.
# Documented: prefixes and units are in the definition file of the package.
# Versions:   pint 0.25.3 (0.26.2, for Python 3.12, is the same).
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check pint==0.25.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import pint

registry = pint.UnitRegistry()
meaning = {"ppt": "picopint", "cft": "centifoot", "deg C": "coulomb * degree", "M": "molar", "m N": "meter * newton"}
seen = {text: str(registry.Quantity(1.0, text).units) for text in meaning}
unknown = []
for text in ("cfs", "cms", "m3/s", "ft3/s"):
    try:
        registry.Quantity(1.0, text)
    except pint.UndefinedUnitError:
        unknown.append(text)
print(f"pint {version('pint')}: units as they stand in exports of instruments and gauges")
print("expected: parts per thousand, cubic feet, degrees Celsius, metres, metres; or an error for each")
print(f"seen: {seen}; unknown: {unknown}")
assert seen == meaning, "the behaviour has changed"
assert unknown == ["cfs", "cms", "m3/s", "ft3/s"], "the behaviour has changed"
PYTHON
