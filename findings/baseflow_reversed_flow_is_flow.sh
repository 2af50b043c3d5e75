#!/bin/sh
# Water that flows upstream is discharge in the package baseflow: its sign is dropped, and days without a reading are
# closed up.
#
# Guess:      a negative discharge (tide, backwater of the receiving river) is refused, or set to missing; a gap of
#             readings ends the recession before it.
# Seen:       the first step takes the absolute value: ten days at -6 m3/s are ten days of a flood of 6 m3/s, with up to
#             2.6 m3/s of base flow, and the index of base flow is divided by absolute flows as well. Days that are
#             missing are taken out, so that the filters run from the day before a gap to the day after it as if it were
#             one. No message.
# Matters:    gauges near a confluence or an estuary, whose reversed days are the ones in which the base flow is 0;
#             records with a gap during a flood.
# Documented: no remark in the docstrings; no public thread found.
# Versions:   baseflow 0.1.0, numpy 2.2.6, pandas 2.3.3, numba 0.61.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    baseflow==0.1.0 numpy==2.2.6 pandas==2.3.3 numba==0.61.2 tqdm==4.67.1
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pandas as pd
from baseflow.separation import single

days = pd.date_range("2024-01-01", periods=120)
flow = pd.Series(2.0, days)
flow.iloc[60:70] = -6.0
gap = pd.Series(8.0 * 0.95 ** np.arange(120.0), days)
gap.iloc[40:60] = np.nan


def by_filter(record):
    """Base flow in m3/s after Lyne and Hollick."""
    return single(record, method="LH", return_kge=False)[0]["LH"]


reversed_days, turned = by_filter(flow), by_filter(flow.abs())
short, joined = by_filter(gap), by_filter(pd.Series(gap.dropna().to_numpy(), days[:100]))
print(f"baseflow {version('baseflow')}: 2 m3/s for 120 days, ten of them at -6 m3/s; a recession without twenty of its days")
print("expected: an error, missing days, or a base flow of 0 in the ten days; the record before the gap separate from the rest")
print(f"seen: base flow {reversed_days.iloc[60:70].max():.1f} m3/s in the ten days, as for +6 m3/s: "
      f"{bool(np.allclose(reversed_days, turned))}; the gap closed up: {bool(np.allclose(short, joined))}")
assert reversed_days.iloc[60:70].max() > 2.4 and np.allclose(reversed_days, turned), "the behaviour has changed"
assert len(short) == 100 and np.allclose(short.to_numpy(), joined.to_numpy()), "the behaviour has changed"
PYTHON
