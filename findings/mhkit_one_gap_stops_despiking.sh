#!/bin/sh
# With one missing sample in a record the despiking after Goring and Nikora finds no spike at all.
#
# Guess:      missing samples (NaN, as a filter by correlation leaves them) are passed over.
# Seen:       all ten spikes of 80 cm/s are found in a record of 1,000 samples; with one sample NaN none is found. In
#             12,000 samples six of ten are: the record is cut into pieces of npt = 5,000, and those with a NaN pass
#             unchecked. No error, no warning; the mask says that the record is clean.
# Matters:    ADV records among plants are filtered by correlation first. Their variances and stresses then keep the
#             spikes that the second filter was to remove.
# Documented: the docstring names neither NaN nor an order of the filters; no public thread found.
# Versions:   mhkit 1.1.2 (its module dolfyn, without the rest of its dependencies), numpy 2.3.1, xarray 2025.7.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    numpy==2.3.1 scipy==1.16.0 pandas==2.3.3 xarray==2025.7.1 matplotlib==3.10.3
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps mhkit==1.1.2
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from mhkit.dolfyn.adv.clean import GN2002

SPIKE = 0.8  # m/s, sixteen standard deviations


def found(samples, gap):
    """How many of ten spikes are found in a record of correlated turbulence, 30 cm/s with 5 cm/s."""
    random = np.random.default_rng(1)
    eddies = np.zeros(samples)
    for sample, push in enumerate(random.normal(size=samples - 1), start=1):
        eddies[sample] = 0.9 * eddies[sample - 1] + push
    record = 0.3 + 0.05 * eddies / eddies.std()
    spikes = np.arange(1, 11) * samples // 11
    record[spikes] += SPIKE * (-1.0) ** np.arange(10)
    if gap:
        record[samples // 20] = np.nan
    return int(GN2002(record)[spikes].sum())


seen = {samples: (found(samples, False), found(samples, True)) for samples in (1000, 12000)}
print(f"mhkit {version('mhkit')}: spikes found of ten, without and with one missing sample")
print("expected: 10 and 10")
print(f"seen: {seen}")
assert all(whole == 10 for whole, _ in seen.values())
assert seen[1000][1] == 0 and 0 < seen[12000][1] < 10, "the behaviour has changed"
PYTHON
