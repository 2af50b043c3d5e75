#!/bin/sh
# A lost beam costs the whole velocity, although the file allows solutions by three beams.
#
# Guess:      beam velocities turn into a velocity by three beams if the fourth is lost. The bit for it is set in the
#             file, the reader shows it as use_3beam "yes", and the maker's own program does it.
# Seen:       rotate2 multiplies by the matrix for four beams: one NaN in four makes east, north and up NaN.
# Matters:    near a bank or over plants one beam is often blocked. Those are the places at which a model of a
#             vegetated channel needs data; they vanish from a transect recorded in beam coordinates.
# Documented: the attribute is listed in the documentation without a remark; no public thread found.
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


BEAM = 0x07  # coordinates of the beams; tilts, solutions by three beams and mapping of cells switched on
whole = np.tile([300.0, -300.0, 100.0, -100.0], (8, 1))
lost = whole.copy()
lost[:, 3] = -32768
data = read("beams.000", [ensemble(number, lost if number % 2 else whole, coordinates=BEAM) for number in range(1, 12)])
beams = int(np.isfinite(data.vel.values[:, 0, 0]).sum())
dolfyn.rotate2(data, "earth")
east, finite = data.vel.values[0], np.isfinite(data.vel.values[:3]).all(axis=0)
print(f"mhkit {version('mhkit')}: use_3beam {data.use_3beam!r}, {beams} of 4 beams sound in the first ensemble")
print("expected: a velocity in each ensemble, with an error velocity missing in each second one")
print(f"seen: ensembles with a velocity {finite.all(axis=0).tolist()}")
assert data.use_3beam == "yes" and beams == 3
assert np.isfinite(east[:, 1::2]).all()
assert not finite[:, ::2].any(), "the behaviour has changed"
PYTHON
