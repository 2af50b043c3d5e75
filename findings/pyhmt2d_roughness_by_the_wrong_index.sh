#!/bin/sh
# The rating curve of pyHMT2D takes the roughness of its k-th stage from the k-th place on the left bank.
#
# Guess:      generate_rating_curve_based_on_Mannings_equation weights Manning's n of the wetted places; a section and
#             its mirror image have one rating curve, and low flow in the channel has the roughness of the channel.
# Seen:       with 9 stages and 101 places stage k has the roughness of place k, so that only the left tenth of the
#             section is used. A channel with 0.03 between floodplains with 0.10 and 0.05 carries 5.4 m3/s at 1 m, where
#             17.9 is right, and 10.8 if the floodplains are exchanged. With as many stages as places low flow has the
#             left bank and the flood the right one. No message.
# Matters:    a boundary condition by rating curve of a model with plants on a bank: a discharge wrong by the ratio of
#             two roughnesses.
# Documented: the docstring gives Manning's n by station, and no rule how it is averaged.
# Versions:   pyHMT2D 2.0.0 (without the rest of its dependencies; a module of Python that 3.9 removed is given to it
#             under its old name), numpy 2.3.1, scipy 1.16.0, h5py 3.14.0, vtk 9.5.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    pyHMT2D==2.0.0 numpy==2.3.1 scipy==1.16.0 h5py==3.14.0 vtk==9.5.0 meshio==5.3.5 affine==2.4.0 rich==14.0.0 \
    markdown-it-py==3.0.0 mdurl==0.1.2 pygments==2.19.2
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import sys
import xml.etree.ElementTree
from importlib.metadata import version

import numpy as np

sys.modules["xml.etree.cElementTree"] = xml.etree.ElementTree
from pyHMT2D.Misc.tools import generate_rating_curve_based_on_Mannings_equation

stations = np.array([0.0, 38.0, 42.0, 58.0, 62.0, 100.0])
heights = np.array([2.0, 2.0, 0.0, 0.0, 2.0, 2.0])  # a channel 2 m deep between two floodplains
zones = np.array([0.0, 38.0, 38.001, 62.0, 62.001, 100.0])
left_rough, right_rough = np.array([0.10, 0.10, 0.03, 0.03, 0.05, 0.05]), np.array([0.05, 0.05, 0.03, 0.03, 0.10, 0.10])


def at_one_metre(roughness):
    """Discharge in m3/s with 1 m of water, all of it in the channel, and the one by Manning's formula with n = 0.03."""
    stage, discharge, area, perimeter, *_ = generate_rating_curve_based_on_Mannings_equation(
        stations, heights, 2.0, zones, roughness, 0.001, 9, nResample=101, units="SI")
    row = int(np.argmin(abs(stage - 1.0)))
    right = area[row] * (area[row] / perimeter[row]) ** (2.0 / 3.0) * 0.001**0.5 / 0.03
    return round(float(discharge[row]), 1), round(float(right), 1)


section, mirrored = at_one_metre(left_rough), at_one_metre(right_rough)
print(f"pyHMT2D {version('pyHMT2D')}: discharge in m3/s with 1 m of water in a channel with n = 0.03")
print(f"expected: {section[1]}, and the same with the roughnesses of the floodplains exchanged")
print(f"seen: {section[0]}, and {mirrored[0]} with the floodplains exchanged")
assert section[1] == mirrored[1]
assert abs(section[0] - 0.3 * section[1]) < 0.1 and abs(mirrored[0] - 0.6 * section[1]) < 0.1, "the behaviour has changed"
PYTHON
