#!/bin/sh
# "Exponential, sill 1, range 30 m" is another field in each of four kriging libraries.
#
# Guess:      a variogram is its model, sill and range: fitted in one library, it can be handed to another.
# Seen:       the correlation at a distance of 30 m is 0.05 in PyKrige and scikit-gstat and 0.37 in GSTools and pyEMU;
#             of a Gaussian model 0.05, 0.02, 0.46 and 0.37. The spherical one is the same in all. The same three
#             points, kriged 10 m from the first, give 0.68 with variance 1.00 in PyKrige, 0.81 with 0.49 in GSTools.
# Matters:    a bed between surveyed cross-sections, or a prior of roughness along a reach (pyEMU), that is three times
#             as smooth as the survey shows, and standard errors of a bed that are 30 % too small.
# Documented: each library gives its own formula ("range", "effective range", "len_scale" with "rescale", "a"); no page
#             compares them.
# Versions:   PyKrige 1.7.3, gstools 1.7.0, scikit-gstat 1.0.26, pyemu 1.7.0, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    PyKrige==1.7.3 gstools==1.7.0 scikit-gstat==1.0.26 pyemu==1.7.0 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import gstools
import numpy as np
import pyemu
import skgstat.models
from pykrige import variogram_models
from pykrige.ok import OrdinaryKriging

SILL, RANGE = 1.0, 30.0
OF_PYEMU = {
    "exponential": pyemu.geostats.ExpVario, "gaussian": pyemu.geostats.GauVario, "spherical": pyemu.geostats.SphVario
}
names = ("PyKrige", "scikit-gstat", "gstools", "pyemu")


def correlation(kind):
    """At a distance of one range, in the order of the names."""
    krige = getattr(variogram_models, f"{kind}_variogram_model")([SILL, RANGE, 0.0], np.array([RANGE]))[0]
    gstat = getattr(skgstat.models, kind)(RANGE, RANGE, SILL)
    tools = getattr(gstools, kind.capitalize())(dim=2, var=SILL, len_scale=RANGE).correlation(RANGE)
    structure = pyemu.geostats.GeoStruct(variograms=[OF_PYEMU[kind](SILL, RANGE)])
    of_pyemu = structure.covariance((0.0, 0.0), (RANGE, 0.0))
    return [round(float(one), 2) for one in (1.0 - krige, 1.0 - gstat, tools, of_pyemu)]


seen = {kind: correlation(kind) for kind in OF_PYEMU}
x, y, value, place = np.array([0.0, 60.0, 200.0]), np.zeros(3), np.array([1.0, 0.0, 0.5]), np.array([10.0])
parameters = {"psill": SILL, "range": RANGE, "nugget": 0.0}
kriging = OrdinaryKriging(x, y, value, variogram_model="exponential", variogram_parameters=parameters)
of_krige = [float(one[0]) for one in kriging.execute("points", place, np.zeros(1))]
model = gstools.Exponential(dim=2, var=SILL, len_scale=RANGE)
of_tools = [float(one[0]) for one in gstools.krige.Ordinary(model, [x, y], value)([place, np.zeros(1)])]
print(", ".join(f"{name} {version(name)}" for name in names) + ": sill 1, range 30 m")
print("expected: one correlation at 30 m for each model, one kriged value")
print(f"seen: correlation at 30 m {seen}")
print(f"seen: value and variance at 10 m, PyKrige {np.round(of_krige, 2)}, gstools {np.round(of_tools, 2)}")
assert seen["spherical"] == [0.0] * 4
assert seen["exponential"] == [0.05, 0.05, 0.37, 0.37], "the behaviour has changed"
assert seen["gaussian"] == [0.05, 0.02, 0.46, 0.37], "the behaviour has changed"
assert np.allclose(of_krige, [0.681, 0.996], atol=1e-3) and np.allclose(of_tools, [0.805, 0.493], atol=1e-3), "changed"
PYTHON
