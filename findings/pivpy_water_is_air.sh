#!/bin/sh
# PIVPy dissipates the energy of a flume with the viscosity of air, and its kinetic energy lacks the half.
#
# Guess:      the dissipation of a measured field in m and s is that of water, or the viscosity has to be given;
#             kinetic_energy() is (u2 + v2)/2, as tke() of the same library has the half.
# Seen:       nu is 1.5e-5 m2/s if it is not given, fifteen times that of water, and the dissipation fifteen times too
#             large. kinetic_energy() is u2 + v2; the mean of tke() is half the sum of the variances.
# Matters:    dissipation and energy behind plants in a flume: a mixing length or a balance of turbulent kinetic energy
#             compared with a model is off by these factors, and no unit or message shows it.
# Documented: the default stands in the signature, without a fluid; the docstring of kinetic_energy has no formula.
# Versions:   pivpy 0.4.0, xarray 2026.9.0, numpy 2.3.1, scipy 1.16.0, matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pivpy==0.4.0 xarray==2026.9.0 numpy==2.3.1 scipy==1.16.0 matplotlib==3.10.3
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pivpy.pivpy  # makes the accessor known to xarray
import xarray as xr

WATER = 1.0e-6  # m2/s, at 20 degrees C
x = np.linspace(0.0, 0.1, 21)
random = np.random.default_rng(1)
fields = 0.4 + random.normal(0.0, 0.05, (2, 21, 21, 50))  # u, v over y, x, t in m/s
flume = xr.Dataset(
    {name: (("y", "x", "t"), field) for name, field in zip(("u", "v"), fields)}
    | {"chc": (("y", "x", "t"), np.ones((21, 21, 50)))},
    coords={"x": x, "y": x, "t": np.arange(50)},
)


def mean(**kwargs):
    return float(flume.copy(deep=True).piv.dissipation(**kwargs)["w"].mean())


ratio = mean() / mean(nu=WATER)
squares = float((flume.u**2 + flume.v**2).mean())
energy = float(flume.copy(deep=True).piv.kinetic_energy()["w"].mean()) / squares
variances = float((flume.u.var("t") + flume.v.var("t")).mean())
turbulent = float(flume.copy(deep=True).piv.tke()["w"].mean()) / variances
print(f"pivpy {version('pivpy')}: a field in m and m/s")
print("expected: dissipation of water; kinetic energy 0.5 times the squares")
print(f"seen: dissipation {ratio:.1f} times that of water")
print(f"seen: kinetic energy {energy:.2f} times the squares, tke {turbulent:.2f} times the variances")
assert abs(ratio - 15.0) < 1e-6, "the behaviour has changed"
assert abs(energy - 1.0) < 1e-6 and abs(turbulent - 0.5) < 1e-6, "the behaviour has changed"
PYTHON
