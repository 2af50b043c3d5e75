#!/bin/sh
# A cell that all four beams lost is still water in adcpreader, or water at 1.8 m/s if the boat heels.
#
# Guess:      a velocity that is marked as lost in a PD0 file (-32768) is masked or NaN, and what is computed from it as
#             well.
# Seen:       it is -32.768 m/s for each beam. Along the instrument's axes the beams cancel: 0.0 m/s in x and y, as
#             valid as the cells above, and -34.9 m/s upwards; to the east it is 0.0 m/s if the boat is level and 1.8
#             m/s at 3 degrees of roll. If the lost beams are masked first (ValueLimit), the masks cancel as well: x and
#             y are 0.0 m/s and not masked.
# Matters:    all cells below the bed are lost by all beams. A transect has water at rest there, or a plausible velocity
#             across; the mean of a vertical, and a discharge, take it in.
# Documented: no remark on lost velocities was found. The maker's format describes -32768.
# Versions:   adcpreader 0.2.1, numpy 2.3.1, scipy 1.16.0, gsw 3.6.20, netCDF4 1.7.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    adcpreader==0.2.1 numpy==2.3.1 scipy==1.16.0 gsw==3.6.20 netCDF4==1.7.2 cftime==1.6.4.post1 certifi==2025.6.15
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import struct
from importlib.metadata import version
from pathlib import Path

import numpy as np
from adcpreader.rdi_qc import ValueLimit
from adcpreader.rdi_reader import PD0
from adcpreader.rdi_transforms import TransformBEAM_XYZ, TransformXYZ_ENU


def ensemble(roll):
    """One ensemble of PD0 in beam coordinates, beams at 20 degrees: four cells, the last one lost by all beams."""
    cells, clock = 4, (24, 6, 3, 10, 0, 1, 50)
    fixed = struct.pack(
        "<H8B3H4BH4Bhh2BHH4BH", 0, 10, 16, 0x4A, 0x41, 0, 13, 4, cells, 1, 10, 25, 1, 64, 5, 0, 1500, 0, 1, 0,
        0x07, 0, 0, 0x7D, 0x3D, 35, 15, 1, 5, 50, 0, 5) + struct.pack("<8xHBBIB", 0, 255, 0, 12345, 20)
    leader = struct.pack(
        "<HH7BBHHHHhhhh3B3B8BIHIIB8B", 0x80, 1, *clock, 0, 0, 1480, 2, 0, 0, round(100 * roll), 0, 1450,
        0, 1, 0, 0, 0, 0, *[0] * 8, 0, 0, 0, 0, 0, 20, *clock)
    velocity = struct.pack("<H16h", 0x100, *[200, -200, -100, 100] * 3, *[-32768] * 4)  # mm/s
    blocks = [fixed, leader, velocity]
    starts = [6 + 2 * len(blocks), 6 + 2 * len(blocks) + len(fixed), 6 + 2 * len(blocks) + len(fixed) + len(leader)]
    whole = struct.pack("<HHBB3H", 0x7F7F, starts[2] + len(velocity) + 2, 0, 3, *starts) + b"".join(blocks) + bytes(2)
    return whole + struct.pack("<H", sum(whole) & 0xFFFF)


def last_two(*steps, roll=0.0):
    """The first two velocities of the third cell and of the lost one, with "masked" for what is masked."""
    Path("one.000").write_bytes(ensemble(roll))
    found = next(iter(PD0().ensemble_generator("one.000")))
    for step in steps:
        if isinstance(step, ValueLimit):
            step.check_ensemble(found)
        else:
            step.transform_velocities_in_ensemble(found)
    parts = [found["velocity"][f"Velocity{i}"] for i in (1, 2)]
    return [["masked" if np.ma.is_masked(part[cell]) else round(float(part[cell]), 2) + 0.0 for part in parts]
            for cell in (2, 3)]


limit = ValueLimit()
for beam in range(1, 5):
    limit.mask_parameter("velocity", f"Velocity{beam}", "||>", 5.0)
axes, masked = last_two(TransformBEAM_XYZ()), last_two(limit, TransformBEAM_XYZ())
level = last_two(TransformBEAM_XYZ(), TransformXYZ_ENU())
heeled = last_two(TransformBEAM_XYZ(), TransformXYZ_ENU(), roll=3.0)
print(f"adcpreader {version('adcpreader')}: two velocities in m/s of a sound cell and of one that all beams lost")
print("expected: the second pair masked or NaN")
print(f"seen: along the axes {axes}, with lost beams masked {masked}, east and north {level}, rolled by 3 degrees {heeled}")
assert axes[0] == masked[0] and axes[0][0] > 0.5
assert axes[1] == masked[1] == level[1] == [0.0, 0.0], "the behaviour has changed"
assert abs(heeled[1][0]) > 1.5, "the behaviour has changed"
PYTHON
