#!/bin/sh
# The second file that adcpreader turns has the beam angle of the first: 46 % too fast if the instrument is another one.
#
# Guess:      each transform takes beam angle, shape and direction of looking from the file that it turns, as two
#             objects that were made for two files do.
# Seen:       the configuration is kept in one dictionary of the class. After a file of an instrument with beams at 20
#             degrees, the same velocities of one at 30 degrees are 1.46 times as large as they are in a session of
#             their own: 0.58 instead of 0.40 m/s. The direction of looking is kept as well, so that after an instrument
#             that looks down one that looks up has its east reversed. No message.
# Matters:    two instruments compared in one script or notebook; the order of the files decides about the velocities.
# Documented: the examples turn one file each; no remark was found.
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

from adcpreader.rdi_reader import PD0
from adcpreader.rdi_transforms import Transform, TransformBEAM_XYZ, TransformXYZ_ENU


def ensemble(angle, up):
    """One ensemble of PD0 in beam coordinates: one cell, beam angle code 1 (20 degrees) or 2 (30), looking up or down."""
    clock = (24, 6, 3, 10, 0, 1, 50)
    fixed = struct.pack(
        "<H8B3H4BH4Bhh2BHH4BH", 0, 10, 16, 0xCA if up else 0x4A, 0x40 + angle, 0, 13, 4, 1, 1, 10, 25, 1, 64, 5, 0, 1500, 0, 1,
        0, 0x07, 0, 0, 0x7D, 0x3D, 35, 15, 1, 5, 50, 0, 5) + struct.pack("<8xHBBIB", 0, 255, 0, 12345, 20)
    leader = struct.pack(
        "<HH7BBHHHHhhhh3B3B8BIHIIB8B", 0x80, 1, *clock, 0, 0, 1480, 2, 0, 0, 0, 0, 1450,
        0, 1, 0, 0, 0, 0, *[0] * 8, 0, 0, 0, 0, 0, 20, *clock)
    velocity = struct.pack("<H4h", 0x100, 200, -200, 0, 0)  # mm/s
    blocks = [fixed, leader, velocity]
    starts = [6 + 2 * len(blocks), 6 + 2 * len(blocks) + len(fixed), 6 + 2 * len(blocks) + len(fixed) + len(leader)]
    whole = struct.pack("<HHBB3H", 0x7F7F, starts[2] + len(velocity) + 2, 0, 3, *starts) + b"".join(blocks) + bytes(2)
    return whole + struct.pack("<H", sum(whole) & 0xFFFF)


def east(angle, up=False):
    """Velocity to the east in m/s, with transforms of its own for this file."""
    name = Path(f"{angle}{up}.000")
    name.write_bytes(ensemble(angle, up))
    found = next(iter(PD0().ensemble_generator(str(name))))
    for step in (TransformBEAM_XYZ(), TransformXYZ_ENU()):
        step.transform_velocities_in_ensemble(found)
    return round(float(found["velocity"]["Velocity1"][0]), 3)


first, after = east(1), (east(2), east(2, up=True))
Transform.CACHE.clear()
alone = [east(2)]
Transform.CACHE.clear()
alone.append(east(2, up=True))
print(f"adcpreader {version('adcpreader')}: east in m/s of beams at 30 degrees, after a file with beams at 20 degrees ({first})")
print(f"expected: {alone[0]} if it looks down, {alone[1]} if it looks up, as in a session of its own")
print(f"seen: {after[0]} and {after[1]}")
assert alone == [0.4, -0.4]
assert after == (first, first) and first == 0.585, "the behaviour has changed"
PYTHON
