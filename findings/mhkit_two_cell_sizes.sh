#!/bin/sh
# A transect with cells of two sizes has its shallow velocities at wrong depths, or is not read at all.
#
# Guess:      each velocity stands at the depth at which it was measured, whatever the size of the cells.
# Seen:       smaller cells are averaged in groups to the largest size, but the groups start at the first small cell
#             and get the depth of the first large one. Speeds that equal their depths in metres come back as
#             0.45 at 0.55 m. If the sizes have no whole ratio (10 and 25 cm) the reader stops with an IndexError.
# Matters:    RiverPro and StreamPro in automatic mode change their cells with the depth of the water: near the
#             banks every velocity moves down, by a third of a large cell here, with a bias of the mean flow.
# Documented: comments in the source describe the averaging; MHKiT-Python issues 207, 368 and 466 are about it.
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


def transect(name, cells, cell, first):
    """Six ensembles with cells of 10 cm, then six of other cells; each speed (m/s) equals its depth (m)."""
    def speeds(count, size, start):
        depths = 10.0 * (start + size * np.arange(count))
        return np.column_stack([depths, *3 * [0 * depths]])

    small = [ensemble(number, speeds(21, 10, 35)) for number in range(1, 7)]
    large = [ensemble(number, speeds(cells, cell, first), cell=cell, first=first) for number in range(7, 13)]
    return read(name, small + large)


data = transect("thirty.000", 7, 30, 55)
depth, small, large = data.range.values, data.vel.values[0, :, 0], data.vel.values[0, :, -1]
try:
    transect("twentyfive.000", 8, 25, 55)
    seen = "is read"
except IndexError as error:
    seen = f"IndexError: {error}"
print(f"mhkit {version('mhkit')}: depths {depth[:3].round(2)} m, speeds equal to depths were written")
print("expected: speeds equal to depths in all ensembles, and a file with cells of 10 and 25 cm is read")
print(f"seen: speeds of the large cells {large[:3].round(2)}, of the small ones {small[:3].round(2)} m/s")
print(f"seen: cells of 10 and 25 cm: {seen}")
assert np.allclose(large[:3], depth[:3], atol=2e-3)
assert np.allclose(depth[:3] - small[:3], 0.10, atol=2e-3), "the behaviour has changed"
assert seen.startswith("IndexError"), "the behaviour has changed"
PYTHON
