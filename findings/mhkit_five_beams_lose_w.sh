#!/bin/sh
# Of five beams the vertical variance is not that of the vertical beam; v'v' mixes two pairs of beams.
#
# Guess:      level and in line with the flow, w'w' is the variance of the vertical beam, and u'u' and v'v' are those of
#             their pairs, (b1 + b3 - 2 cos^2 b5) / (2 sin^2) (Dewey and Stringer 2007, whom the docstring cites).
# Seen:       with 10, 6 and 3 cm/s in u, v and w u'u' is right, v'v' is 1.9 times as large, and w'w' is -0.00006
#             instead of 0.0009 m2/s2: a bracket closes too late, so that w'w' becomes -2 u'w' less 2 % of the fifth
#             beam's variance. One beam of v'v' is of the pair of u'u'.
# Matters:    kinetic energy and anisotropy of turbulence from a five-beam ADCP (Signature) in a river: the vertical
#             variance, the purpose of the fifth beam, is negative or twice a shear stress.
# Documented: otherwise, by the papers of the docstring. Its default without noise raises TypeError; a noise of 0 is
#             given here. No public thread found.
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

SAMPLES, CELLS = 20000, 3
random = np.random.default_rng(1)
u, v, w = (random.normal(mean, scatter, (CELLS, SAMPLES)) for mean, scatter in ((1.0, 0.10), (0.0, 0.06), (0.0, 0.03)))
sine, cosine = np.sin(np.radians(25.0)), np.cos(np.radians(25.0))
beams = np.stack([u * sine, -v * sine, -u * sine, v * sine]) + w * cosine  # upward; x from beam 3 to 1, y from 2 to 4
times = np.datetime64("2024-01-01", "ns") + np.arange(SAMPLES) * np.timedelta64(125, "ms")
record = xr.Dataset(
    {"vel": (("beam", "range", "time"), beams), "vel_b5": (("range", "time"), w),
     "pitch": ("time", np.zeros(SAMPLES)), "roll": ("time", np.zeros(SAMPLES))},
    {"beam": [1, 2, 3, 4], "range": [1.0, 2.0, 3.0], "time": times},
    {"beam_angle": 25, "coord_sys": "beam", "inst_make": "Nortek", "inst_model": "Signature1000", "orientation": "up"},
)
no_noise = xr.DataArray([0.0], {"time": times[:1]}, ("time",))
tensor = ADPBinner(SAMPLES, 8).stress_tensor_5beam(record, noise=no_noise, orientation="up", tke_only=True)
seen = tensor.values[:, :, 0].mean(axis=1)
b1, b2, b3, b4, b5 = (one.var(axis=-1).mean() for one in (*beams, w))
by_pairs = [(one + other - 2.0 * cosine**2 * b5) / (2.0 * sine**2) for one, other in ((b1, b3), (b2, b4))]
expected = np.array([*by_pairs, b5])
print(f"mhkit {version('mhkit')}: level five-beam record with fluctuations of 10, 6 and 3 cm/s in u, v and w")
print(f"expected: u'u', v'v', w'w' {np.round(expected, 5)} m2/s2, k {expected.sum() / 2:.5f}")
print(f"seen: {np.round(seen, 5)} m2/s2, k {seen.sum() / 2:.5f}")
assert np.allclose(expected, [0.0100, 0.0036, 0.0009], rtol=0.02)
assert np.isclose(seen[0], expected[0], rtol=1e-6)
assert np.isclose(seen[1], (b2 + b1 - 2.0 * cosine**2 * b5) / (2.0 * sine**2), rtol=1e-6), "the behaviour has changed"
of_pair = (b3 - b1) / (2.0 * sine * cosine)  # -2 u'w'
assert np.isclose(seen[2], of_pair - 2.0 * sine**5 * cosine * b5, rtol=1e-6), "the behaviour has changed"
assert abs(seen[2]) < 0.2 * expected[2], "the behaviour has changed"
PYTHON
