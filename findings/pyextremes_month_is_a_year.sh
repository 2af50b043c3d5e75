#!/bin/sh
# For pyextremes the month that a record has after its last whole year is a year, with its low water as the flood of the
# year.
#
# Guess:      annual maxima are those of calendar or water years, and a year that is not in the record has none.
# Seen:       years begin at the first reading, and the rest at the end is one more. Of 20 years with floods from 60 to
#             140 m3/s and 30 days of 3 m3/s there are 21 annual floods, the last of 3 m3/s, and the flood of 100 years
#             by a Gumbel distribution grows from 204 to 260 m3/s, as the scatter of the floods seems larger. If the
#             record begins between two days of a flood, its two halves are floods of two years. min_last_block=0.9
#             drops the last block. No warning.
# Matters:    records end on the day of the download. The design flood at the inlet, or the ice-free share of a site,
#             changes with that day.
# Documented: min_last_block is documented ("if None, the last block is always used"); that years start at the first
#             reading is not said at get_extremes.
# Versions:   pyextremes 2.6.1, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3, matplotlib 3.10.3, emcee 3.1.6.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pyextremes==2.6.1 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3 matplotlib==3.10.3 emcee==3.1.6 tqdm==4.67.1
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pandas as pd
from pyextremes import EVA

days = pd.date_range("2000-10-01", "2020-10-30")
flow = pd.Series(3.0, days, name="discharge")
floods = 100.0 + 40.0 * np.sin(np.arange(20.0) * 2.4)
for year, flood in zip(range(2001, 2021), floods):
    flow[f"{year}-04-15"] = flood  # m3/s


def annual(record, **options):
    """Number of annual floods, the smallest of them, and the flood of 100 years by a Gumbel distribution, in m3/s."""
    found = EVA(record)
    found.get_extremes("BM", block_size="365.2425D", **options)
    found.fit_model(distribution="gumbel_r")
    return (len(found.extremes), round(float(found.extremes.min()), 1),
            round(float(found.get_return_value(100.0)[0]), 1))


whole, seen, dropped = annual(flow[:"2020-09-30"]), annual(flow), annual(flow, min_last_block=0.9)
print(f"pyextremes {version('pyextremes')}: annual floods, the smallest and the flood of 100 years in m3/s, of 20 years and 30 days")
print(f"expected: {whole}, as of the 20 years")
print(f"seen: {seen}; with min_last_block=0.9 {dropped}")
assert whole == dropped and whole[0] == 20
assert seen[0] == 21 and seen[1] == 3.0 and abs(seen[2] - whole[2]) > 5.0, "the behaviour has changed"
PYTHON
