#!/bin/sh
# A mean heading of a boat that sails north is 180 degrees.
#
# Guess:      VelBinner.bin_average treats directions as directions. Headings of 358 and 2 degrees average to 0.
# Seen:       it takes the arithmetic mean of every variable, so the mean heading is 180 degrees. The velocities of
#             the same call are right if they were turned to earth axes before, and no warning is printed.
# Matters:    ensembles of a transect that runs close to north are commonly averaged to reduce noise. Any later use
#             of the heading (GPS offset of the antenna, loop correction, placing the boat) turns by half a circle.
# Documented: the docstring says that each variable is averaged; no remark about angles, no public thread found.
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


def ensemble(number, heading):
    """One ensemble of PD0: header, fixed leader, variable leader, velocities and three blocks of quality."""
    cells, clock = 8, (20, 6, 3, 10, *divmod(number, 60), 0)
    fixed = struct.pack(
        "<H8B3H4BH4Bhh2BHH4BH", 0, 10, 16, 0x41, 0x41, 0, 13, 4, cells, 1, 10, 25, 1, 64, 5, 0, 1500, 0, 1, 0,
        0x1F, 0, 0, 0x7D, 0x3D, 35, 15, 1, 5, 50, 0, 5) + struct.pack("<8xHBBIB", 0, 255, 0, 12345, 20)
    leader = struct.pack(
        "<HH7BBHHHHhhhh3B3B8BIHIIB8B", 0x80, number, *clock, 0, 0, 1480, 2, round(100 * heading), 0, 0, 0, 1450,
        0, 1, 0, 0, 0, 0, *[0] * 8, 0, 0, 0, 0, 0, 20, *clock)
    velocity = np.tile(np.array([300, 400, 0, 0], "<i2"), (cells, 1))  # east 0.3 m/s, north 0.4 m/s
    blocks = [fixed, leader, struct.pack("<H", 0x100) + velocity.tobytes()]
    blocks += [struct.pack("<H", name) + bytes([value]) * velocity.size
               for name, value in ((0x200, 120), (0x300, 90), (0x400, 100))]
    starts = np.cumsum([6 + 2 * len(blocks), *map(len, blocks)]).tolist()
    whole = struct.pack("<HHBB", 0x7F7F, starts[-1] + 2, 0, len(blocks))
    whole += struct.pack(f"<{len(blocks)}H", *starts[:-1]) + b"".join(blocks) + bytes(2)
    return whole + struct.pack("<H", sum(whole) & 0xFFFF)


with open("north.000", "wb") as file:
    file.write(b"".join(ensemble(number, (358.0, 2.0)[number % 2]) for number in range(1, 42)))
data = dolfyn.read("north.000")
averaged = dolfyn.VelBinner(n_bin=10, fs=data.fs, n_fft=10).bin_average(data)
heading, velocity = averaged.heading.values, averaged.vel.values[:2, 0, 0]
print(f"mhkit {version('mhkit')}: headings read {data.heading.values[:4]} degrees")
print("expected: a mean heading of 0 (or 360) degrees")
print(f"seen: {heading} degrees; the velocity of the same call is {velocity} m/s (true: 0.3, 0.4)")
assert np.allclose(sorted(set(data.heading.values.round(2).tolist())), [2.0, 358.0])
assert np.allclose(velocity, [0.3, 0.4], atol=1e-3)
assert np.allclose(heading, 180.0), "the behaviour has changed"
PYTHON
