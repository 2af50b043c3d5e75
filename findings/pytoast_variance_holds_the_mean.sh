#!/bin/sh
# The spectral variances and stresses of pytoast hold the mean velocity: 100 times too large in a river.
#
# Guess:      covariance(method="spectral_integral") is the area below the spectrum, so that without bounds it is close
#             to the covariance of the fluctuations, method="cov" of the same function.
# Seen:       the mean is not subtracted and the integral begins at the frequency 0: of a record with 50 cm/s and a
#             fluctuation of 5 cm/s, uu is 0.254 instead of 0.0025 m2/s2 and uw -0.0062 instead of -0.0008. A lower
#             bound of 0.02 Hz does not help (0.069), as the mean leaks into the first bins; the methods that remove
#             waves subtract it. No warning.
# Matters:    turbulence and stresses of a probe in a river or flume: a drag of plants from uw is 7 times too large, or
#             has the other sign, depending on the tilt of the probe.
# Documented: the docstring names an integral of the cross-spectrum over a range of frequencies, and no mean.
# Versions:   pytoast-core 0.1.0b3 (without the rest of its dependencies), numpy 2.3.1, scipy 1.16.0, pandas 2.3.3,
#             xarray 2025.7.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    pytoast-core==0.1.0b3 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3 xarray==2025.7.1 packaging==25.0 \
    python-dateutil==2.9.0.post0 pytz==2025.2 six==1.17.0
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pytoast.ocean.adv import ADV
from scipy.signal import lfilter


def turbulence(deviation, seed):
    """Five minutes at 32 Hz of correlated fluctuations with this standard deviation in m/s and mean 0."""
    noise = lfilter([1.0], [1.0, -0.95], np.random.default_rng(seed).standard_normal(10100))[500:]
    return deviation * (noise - noise.mean()) / noise.std()


u, v = turbulence(0.05, 1), turbulence(0.04, 2)
w = turbulence(0.03, 3) - 0.3 * u
np.save("burst.npy", {"u": u + 0.50, "v": v + 0.02, "w": w - 0.01}, allow_pickle=True)
probe = ADV("burst.npy", {"u1": "u", "u2": "v", "u3": "w"}, fs=32.0, z=0.1)
burst = probe.load_burst(0)


def moments(**options):
    """uu, ww and uw in m2/s2."""
    found = probe.covariance(burst, **options)
    return [round(float(found[key][0]), 4) for key in ("uu", "ww", "uw")]


plain, spectral = moments(), moments(method="spectral_integral")
bounded = moments(method="spectral_integral", f_low=0.02)
print(f"pytoast-core {version('pytoast-core')}: uu, ww and uw in m2/s2 of a record with a mean of 50 cm/s")
print(f"expected: {plain}, as by method='cov'")
print(f"seen: {spectral}, and from 0.02 Hz {bounded}")
assert abs(plain[0] - 0.0025) < 0.0001
assert 0.24 < spectral[0] < 0.27 and spectral[2] < 6.0 * plain[2], "the behaviour has changed"
assert bounded[0] > 0.05, "the behaviour has changed"
PYTHON
