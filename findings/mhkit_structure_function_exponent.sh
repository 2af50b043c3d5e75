#!/bin/sh
# The dissipation of an ADCP by the structure function is fitted to r^2 / 3 instead of r^(2/3).
#
# Guess:      D(z, r) = 2.1 eps^(2/3) r^(2/3) + N, as the docstring has it: a record with exactly this structure gives
#             its eps, without noise N = 0, and the same for each range of r within the inertial range.
# Seen:       the line is fitted over "r ** 2 / 3", r squared over three. A record with 1e-4 m2/s3 and no noise has
#             2e-5 to r = 4 m, 5e-6 to 8 m, and a noise of 4 to 6 cm/s. The same D, which is returned and right, gives
#             1.0e-4 over r^(2/3).
# Matters:    dissipation behind plants or piers 2 to 20 times too small, by a factor that depends on the range chosen.
# Documented: otherwise. The docstring gives the equation with r^(2/3). No public thread found.
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
import xarray as xr
from mhkit.dolfyn.adp.turbulence import ADPBinner

DISSIPATION, CELL, CELLS, SAMPLES, RATE = 1e-4, 0.25, 60, 4096, 8.0  # m2/s3, m, cells, samples, Hz
height = 0.5 + CELL * np.arange(CELLS)
half = 0.5 * 2.1 * DISSIPATION ** (2.0 / 3.0) * np.abs(height[:, None] - height) ** (2.0 / 3.0)
values, vectors = np.linalg.eigh(2.0 * half.max() - half)  # covariance of velocities with this structure function
profiles = vectors * np.sqrt(values) @ np.random.default_rng(1).normal(size=(CELLS, SAMPLES))
times = np.datetime64("2024-01-01", "ns") + np.arange(SAMPLES) * np.timedelta64(125, "ms")
record = xr.DataArray(profiles, {"range": height, "time": times}, ("range", "time"), "vel")
print(f"mhkit {version('mhkit')}: along-beam velocities with a dissipation of {DISSIPATION} m2/s3, without noise")
seen = {}
for largest in (2.0, 4.0, 8.0):
    dissipation, noise, structure = ADPBinner(SAMPLES, RATE).dissipation_rate_SF(record, r_range=[2 * CELL, largest])
    r, fitted = structure.range_SF.values[2:], np.flatnonzero(np.isfinite(dissipation.values[:, 0]))
    slopes = [np.polyfit(r ** (2.0 / 3.0), structure.values[cell, 2:, 0], 1)[0] for cell in fitted]
    expected = float(np.median((np.array(slopes) / 2.1) ** 1.5))
    squared = [np.polyfit(r**2 / 3.0, structure.values[cell, 2:, 0], 1)[0] for cell in fitted]
    seen[largest] = float(np.nanmedian(dissipation))
    print(f"r to {largest} m: expected {expected:.1e} m2/s3; seen {seen[largest]:.1e} m2/s3 and"
          f" a noise of {100.0 * float(np.nanmedian(noise)):.1f} cm/s")
    assert np.isclose(expected, DISSIPATION, rtol=0.3)
    assert np.isclose(seen[largest], np.median((np.array(squared) / 2.1) ** 1.5), rtol=1e-6), "has changed"
assert seen[2.0] > 3.0 * seen[4.0] > 9.0 * seen[8.0] and seen[4.0] < 0.3 * DISSIPATION, "the behaviour has changed"
PYTHON
