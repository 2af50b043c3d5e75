#!/bin/sh
# One ensemble with a wrong check sum makes a whole PD0 file unreadable.
#
# Guess:      the reader skips the ensemble whose check sum is wrong, as its source announces, and reads the others.
# Seen:       after the skip it takes the bytes that follow as the next header and stops with a TypeError: of twelve
#             ensembles none comes back. The same file with the right check sum is read.
# Matters:    one bit lost on the radio link between boat and shore costs the transect.
# Documented: the logged warning names the check sum. MHKiT-Python issue 390 describes another fault of the same
#             branch, a reader that goes round the same ensembles.
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
import logging
import struct
from importlib.metadata import version

import numpy as np

logging.disable(logging.CRITICAL)
import mhkit.dolfyn as dolfyn


def ensemble(number, velocity, cell=10, first=35, coordinates=0x1F, spoilt=False):
    """One ensemble of PD0 by its published layout: header, two leaders, velocities, three blocks of quality."""
    clock = (20, 6, 3, 10, *divmod(number, 60), 0)
    fixed = struct.pack(
        "<H8B3H4BH4Bhh2BHH4BH", 0, 10, 16, 0x41, 0x41, 0, 13, 4, len(velocity), 1, cell, 25, 1, 64, 5, 0, 1500,
        0, 1, 0, coordinates, 0, 0, 0x7D, 0x3D, first, 15, 1, 5, 50, 0, 5)
    fixed += struct.pack("<8xHBBIB", 0, 255, 0, 12345, 20)
    leader = struct.pack(
        "<HH7BBHHHHhhhh3B3B8BIHIIB8B", 0x80, number, *clock, 0, 0, 1480, 2, 0, 0, 0, 0, 1450,
        0, 1, 0, 0, 0, 0, *[0] * 8, 0, 0, 0, 0, 0, 20, *clock)
    rows = np.asarray(velocity).round().astype("<i2")  # mm/s, four a cell
    blocks = [fixed, leader, struct.pack("<H", 0x100) + rows.tobytes()]
    blocks += [struct.pack("<H", name) + bytes([value]) * rows.size
               for name, value in ((0x200, 120), (0x300, 90), (0x400, 100))]
    starts = np.cumsum([6 + 2 * len(blocks), *map(len, blocks)]).tolist()
    whole = struct.pack("<HHBB", 0x7F7F, starts[-1] + 2, 0, len(blocks))
    whole += struct.pack(f"<{len(blocks)}H", *starts[:-1]) + b"".join(blocks) + bytes(2)
    return whole + struct.pack("<H", (sum(whole) ^ (0x5555 if spoilt else 0)) & 0xFFFF)


def read(name, ensembles):
    """What mhkit makes of a file of these ensembles."""
    with open(name, "wb") as file:
        file.write(b"".join(ensembles))
    return dolfyn.read(name)


profile = np.tile([300, 400, 0, 0], (12, 1))
sound = read("sound.000", [ensemble(number, profile) for number in range(1, 13)])
try:
    data = read("spoilt.000", [ensemble(number, profile, spoilt=number == 5) for number in range(1, 13)])
    seen = f"{data.sizes['time']} ensembles"
except TypeError as error:
    seen = f"TypeError: {error}"
print(f"mhkit {version('mhkit')}: {sound.sizes['time']} ensembles are read from the sound file")
print("expected: one ensemble fewer from the file in which ensemble 5 has a wrong check sum")
print(f"seen: {seen}")
assert sound.sizes["time"] >= 11
assert seen.startswith("TypeError"), "the behaviour has changed"
PYTHON
