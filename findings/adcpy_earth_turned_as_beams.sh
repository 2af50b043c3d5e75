#!/bin/sh
# adcpy turns the velocities of every PD0 file from beams to earth, also those that are in earth coordinates already.
#
# Guess:      a PD0 file that was recorded in earth coordinates keeps its velocities on the way to the final file, whose
#             "transformation" is EARTH, as the raw file names its coordinates; a beam without a velocity leaves a gap.
# Seen:       0.3 m/s east and 0.4 m/s north become 0.15 m/s west and 0.19 m/s upwards; the same water recorded in beam
#             coordinates is right. A lost beam, -32768 in the file, is taken for -32.768 m/s: 48 m/s south, not masked.
#             The last two of 30 ensembles are not written. No message.
# Matters:    currents of a moored ADCP that are turned and too small, and averages that one lost beam decides.
# Documented: "transforms the data into Earth coordinates", for "any 4 beam Janus" profiler; -1 is the end of the file.
# Versions:   adcpy 0.1.1, numpy 1.26.4, netCDF4 1.7.2, pandas 2.2.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    adcpy==0.1.1 numpy==1.26.4 netCDF4==1.7.2 pandas==2.2.3
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import struct
from contextlib import redirect_stdout
from importlib.metadata import version
from math import radians, sin
from pathlib import Path

from adcpy.EPICstuff.ADCPcdf2ncEPIC import doEPIC_ADCPfile
from adcpy.TRDIstuff.TRDIpd0tonetcdf import convert_pd0_to_netcdf
from netCDF4 import Dataset

ENSEMBLES, CELLS, LOST = 30, 4, -32768
COORDINATES = {"BEAM": 0x00, "EARTH": 0x18}
slanted = sin(radians(20.0))
WATER = {  # mm/s: east, north, up, error; or along the beams of 20 degrees, level and heading north
    "EARTH": (300, 400, 0, 0),
    "BEAM": (round(300 * slanted), round(-300 * slanted), round(-400 * slanted), round(400 * slanted)),
}


def ensemble(number, frame):
    """One ensemble of PD0 of an ADCP that looks down; the fourth beam has lost the last cell."""
    clock = (24, 6, 3, 10, number, 0, 0)
    fixed = struct.pack(
        "<H8B3H4BH4Bhh2BHH4BH", 0, 10, 16, 0x49, 0x41, 0, 13, 4, CELLS, 1, 10, 25, 1, 64, 5, 0, 1500, 0, 1, 0,
        COORDINATES[frame], 0, 0, 0x7D, 0x3D, 35, 15, 1, 5, 50, 0, 5) + struct.pack("<8xHBBIB", 0, 255, 0, 12345, 20)
    leader = struct.pack(
        "<HH7BBHHHHhhhh3B3B8BIHIIB8B", 0x80, number, *clock, 0, 0, 1480, 2, 0, 0, 0, 0, 1450,
        0, 1, 0, 0, 0, 0, *[0] * 8, 0, 0, 0, 0, 0, 20, *clock)
    velocity = struct.pack("<H16h", 0x100, *WATER[frame] * (CELLS - 1), *WATER[frame][:3], LOST)
    quality = [struct.pack("<H16B", kind, *[100] * 16) for kind in (0x200, 0x300, 0x400)]
    blocks = [fixed, leader, velocity, *quality]
    starts = [6 + 2 * len(blocks)]
    for block in blocks:
        starts.append(starts[-1] + len(block))
    whole = struct.pack(f"<HHBB{len(blocks)}H", 0x7F7F, starts[-1] + 2, 0, len(blocks), *starts[:-1])
    whole += b"".join(blocks) + bytes(2)
    return whole + struct.pack("<H", sum(whole) & 0xFFFF)


def converted(frame):
    """Number of ensembles, and east, north and up in cm/s of the first and of the last cell."""
    Path("site.000").write_bytes(b"".join(ensemble(number, frame) for number in range(1, ENSEMBLES + 1)))
    Path("site.txt").write_text("MOORING;1\nWATER_DEPTH;5\nlatitude;50\nlongitude;8\nmagnetic_variation;0\n")
    settings = {
        "good_ensembles": [0, -1], "orientation": "DOWN", "transducer_offset_from_bottom": 4.0, "transformation": "EARTH",
        "timetype": "CF", "time_type_out": "CF"}
    with redirect_stdout(open("log", "w")):
        convert_pd0_to_netcdf("site.000", "raw.cdf", [0, -1], "1", "CF", "60")
        doEPIC_ADCPfile("raw.cdf", "site.nc", "site.txt", settings)
    with Dataset("raw.cdf") as raw, Dataset("site.nc") as site:
        assert raw.TRDI_Coord_Transform == frame and site.transform == "EARTH"
        cells = [[round(float(site[name][0, cell, 0, 0])) for name in ("u_1205", "v_1206", "w_1204")] for cell in (0, -1)]
        return len(site["time"]), *cells


seen = {frame: converted(frame) for frame in COORDINATES}
print(f"adcpy {version('adcpy')}: ensembles; east, north and up in cm/s in a good cell, and in one with a lost beam")
print(f"expected: ({ENSEMBLES}, [30, 40, 0], masked) from both")
print(f"seen: {seen}")
assert seen["BEAM"][1] == [30, 40, 0]
count, good, lost = seen["EARTH"]
assert (count, good) == (28, [-15, 0, 19]) and lost[1] < -4000, "the behaviour has changed"
PYTHON
