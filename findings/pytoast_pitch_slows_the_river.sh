#!/bin/sh
# In pytoast an ADCP of Teledyne that pitches by 10 degrees measures a river 6 % too slow: the turn is no rotation.
#
# Guess:      coord_transform_4_beam_rdi is the rotation of the maker's booklet. It keeps the length of a velocity, so
#             that water at 1 m/s is water at 1 m/s whatever the attitude of the boat.
# Seen:       one sign of the nine is exchanged, that of the instrument's z in the velocity to the north. Velocities of
#             the booklet's rotation come back as 0.985 m/s at 5 degrees of pitch, 0.940 at 10 and 0.766 at 20; water
#             that rises at 1 m/s has 0.34 m/s to the north. Roll alone is right. The beam angle is 25 degrees unless it
#             is given, 20 in most of these instruments.
# Matters:    discharges and stresses of a moored or towed ADCP that are too small, growing with the square of the
#             pitch.
# Documented: the docstring names the coordinate transformation for these instruments. No public thread found.
# Versions:   pytoast-core 0.1.0b3 (without the rest of its dependencies), numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    pytoast-core==0.1.0b3 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pytoast.utils.rotate_utils import coord_transform_4_beam_rdi


def measured(water, pitch, roll):
    """Velocities along the axes of an instrument that looks down, heading north, by the rotation of the maker."""
    p, r = np.radians(pitch), np.radians(roll)
    p = np.arctan(np.tan(p) * np.cos(r))
    turn = np.array([[np.cos(r), 0.0, np.sin(r)],
                     [np.sin(p) * np.sin(r), np.cos(p), -np.sin(p) * np.cos(r)],
                     [-np.cos(p) * np.sin(r), np.sin(p), np.cos(p) * np.cos(r)]])
    assert np.allclose(turn @ turn.T, np.eye(3))
    return turn.T @ np.array(water)


def turned(water, pitch, roll):
    """East, north and up in m/s, as pytoast turns them back."""
    parts = [np.array([part]) for part in [*measured(water, pitch, roll), 0.0]]
    found = coord_transform_4_beam_rdi(
        *parts, heading=0.0, pitch=pitch, roll=roll, orientation="down", coords_in="xyz", coords_out="enu")
    return [round(float(part[0]), 3) + 0.0 for part in found[:3]]


north = {pitch: turned([0.0, 1.0, 0.0], pitch, 0.0) for pitch in (5.0, 10.0, 20.0)}
rolled, rising = turned([0.0, 1.0, 0.0], 0.0, 10.0), turned([0.0, 0.0, 1.0], 10.0, 0.0)
print(f"pytoast-core {version('pytoast-core')}: east, north and up in m/s of water at 1 m/s to the north")
print("expected: [0, 1, 0] at each pitch; [0, 0, 1] for water that rises at 1 m/s")
print(f"seen: {north}; rolled by 10 degrees {rolled}; rising, pitched by 10 degrees {rising}")
assert rolled == [0.0, 1.0, 0.0]
assert [value[1] for value in north.values()] == [0.985, 0.94, 0.766], "the behaviour has changed"
assert abs(rising[1]) > 0.3, "the behaviour has changed"
PYTHON
