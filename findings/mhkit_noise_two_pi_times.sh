#!/bin/sh
# With the noise of the probe given, the dissipation of an ADV depends on the unit of frequency.
#
# Guess:      a spectrum in rad/s, the default, or in Hz: with the noise level of the probe one dissipation.
# Seen:       dissipation_rate_LT83 takes noise^2 / (fs / 2) from the spectrum, the density of the noise per Hz. Per
#             rad/s it is 2 pi times smaller, so that a record with 1e-4 m2/s3 and 2 cm/s of noise has 1e-4 in Hz and
#             5e-6 to 8e-6 in rad/s. power_spectral_density, with the same noise, is right in both units.
# Matters:    dissipation around stems 10 to 20 times too small, and the worse the noisier the probe: much of the
#             spectrum falls below zero and is replaced by a small number, without a message.
# Documented: otherwise. The docstring says that psd may be in rad/s or Hz and that noise is in the unit of velocity.
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
from mhkit.dolfyn.adv.turbulence import ADVBinner

DISSIPATION, SPEED, NOISE, RATE, SAMPLES = 1e-4, 0.5, 0.02, 32, 32 * 600  # m2/s3, m/s, m/s, Hz
random = np.random.default_rng(3)
omega = 2.0 * np.pi * np.fft.rfftfreq(SAMPLES, 1.0 / RATE)
cascade = (DISSIPATION * SPEED) ** (2.0 / 3.0) * np.maximum(omega, 0.5) ** (-5.0 / 3.0)  # m2/s per rad, times alpha


def component(alpha):
    """Velocity with the spectrum alpha eps^(2/3) U^(2/3) omega^(-5/3), and the white noise of the probe."""
    phases = (random.normal(size=omega.size) + 1j * random.normal(size=omega.size)) / np.sqrt(2.0)
    amplitudes = np.sqrt(alpha * cascade * 2.0 * np.pi * RATE * SAMPLES / 2.0)
    return np.fft.irfft(amplitudes * phases, SAMPLES) + NOISE * random.normal(size=SAMPLES)


times = np.datetime64("2024-01-01", "ns") + np.arange(SAMPLES) * np.timedelta64(31250, "us")
record = xr.DataArray(
    [component(alpha) for alpha in (0.5, 0.67, 0.67)], {"dir": ["u", "v", "w"], "time": times}, ("dir", "time")
)
speed = xr.DataArray([SPEED], {"time": times[:1]}, ("time",))
binner = ADVBinner(SAMPLES, RATE, n_fft=2048)
print(f"mhkit {version('mhkit')}: u, v, w with a dissipation of {DISSIPATION} m2/s3 and a noise of 2 cm/s")
print("expected: 1e-4 m2/s3 in either unit")
seen = {}
for unit, band in (("Hz", [1.0, 2.0]), ("rad/s", [2.0 * np.pi, 4.0 * np.pi])):
    spectrum = binner.power_spectral_density(record, freq_units=unit)
    level = binner.doppler_noise_level(spectrum).values[:, :, None]
    seen[unit] = binner.dissipation_rate_LT83(spectrum, speed, freq_range=band, noise=level).values.ravel()
    cleaned = binner.power_spectral_density(record, freq_units=unit, noise=np.full(3, NOISE))
    before = binner.dissipation_rate_LT83(cleaned, speed, freq_range=band).values.ravel()
    print(f"seen in {unit}: noise level {np.round(level.ravel(), 3)} m/s, dissipation {seen[unit]};"
          f" with the noise taken out before {before}")
    assert np.allclose(level, NOISE, rtol=0.1) and np.allclose(before, DISSIPATION, rtol=0.15)
assert np.allclose(seen["Hz"], DISSIPATION, rtol=0.15) and (seen["rad/s"] < 0.2 * DISSIPATION).all(), "has changed"
density = NOISE**2 / (RATE / 2.0)  # per Hz; of the record in rad/s it is 2 pi times smaller
floor = float(binner.power_spectral_density(record).isel(freq=slice(-400, None)).mean())
assert np.isclose(density / floor, 2.0 * np.pi, rtol=0.15)
PYTHON
