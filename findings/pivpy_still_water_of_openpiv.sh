#!/bin/sh
# PIVPy reads a velocity field that OpenPIV has written as still water, except where OpenPIV had masked it.
#
# Guess:      load_openpiv_txt reads what openpiv.tools.save writes: velocities outside the mask, none inside, and the
#             vectors that OpenPIV flagged as invalid are invalid.
# Seen:       OpenPIV writes 1 for a masked place, PIVPy takes 1 for a good one. A field of 0.4 m/s without a mask has
#             0.0 m/s everywhere; with one masked place that one alone keeps what OpenPIV wrote. The flags are
#             turned as well: OpenPIV's 0 (valid) is PIVPy's 0 (invalid), which clean() and the plots use. No warning.
# Matters:    a flume or river with a masked bank or stems: mean velocities of 0, or those of the places that the camera
#             could not see.
# Documented: otherwise. The docstring of save gives flags (0 is valid) and a mask that marks masked regions, also in
#             openpiv-python issue 260; PIVPy names its reader after this file.
# Versions:   openpiv 0.26.1, pivpy 0.4.0, xarray 2026.9.0, numpy 2.3.1, scipy 1.16.0, matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    openpiv==0.26.1 pivpy==0.4.0 xarray==2026.9.0 numpy==2.3.1 scipy==1.16.0 scikit-image==0.25.2 imageio==2.37.0 \
    matplotlib==3.10.3
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 300 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from openpiv import tools
from pivpy import io

x, y = np.meshgrid(np.arange(0.1, 0.5, 0.1), np.arange(0.4, 0.0, -0.1))  # m, y upwards
flume = np.full(x.shape, 0.4)  # m/s
stem, spike = (1, 2), (3, 0)


def read(flags=None, mask=None):
    """What PIVPy reads of the field as OpenPIV saves it: velocities and the flag of validity, in the order of the file."""
    tools.save("field_001.txt", x, y, flume, 0.0 * flume, flags, mask)
    field = io.load_openpiv_txt("field_001.txt")
    return field["u"].values[..., 0], field["chc"].values[..., 0]


plain, _ = read()
mask, flags = np.zeros(x.shape, bool), np.zeros(x.shape, int)
mask[stem], flags[spike] = True, 1
masked, _ = read(flags, mask)
_, validity = read(flags, np.ones(x.shape, bool))  # the only mask with which PIVPy keeps the flags
kept = [tuple(int(part) for part in place) for place in np.argwhere(masked > 0.0)]
valid = [tuple(int(part) for part in place) for place in np.argwhere(validity > 0.0)]
print(f"openpiv {version('openpiv')}, pivpy {version('pivpy')}: a field of 0.4 m/s at {x.size} places")
print(f"expected: a mean of 0.4 m/s; {x.size - 1} places with a masked stem at {stem}; all valid but {spike}")
print(f"seen: a mean of {plain.mean()} m/s; with a masked stem a velocity at {kept}; valid at {valid}")
assert plain.max() == 0.0, "the behaviour has changed"
assert kept == [stem] and valid == [spike], "the behaviour has changed"
PYTHON
