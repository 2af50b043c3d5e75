#!/bin/sh
# trdi_adcp_readers reads the first ensemble of a PD0 file and drops all others.
#
# Guess:      read_PD0_file returns the ensembles of the file, or says that there are more.
# Seen:       of a file with 30 ensembles the first one comes back, as one dictionary. Its time of 0.50 s is 50
#             microseconds, as the hundredths are handed over as such; a transducer turned by -45 degrees is turned by
#             610.36, as the angle is read without a sign. Lost velocities stay -32768 mm/s. No warning.
# Matters:    a moored record or a transect that is taken for a single profile.
# Documented: the description names PD0 files; no remark about one ensemble.
# Versions:   trdi_adcp_readers 25.6.4.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check trdi_adcp_readers==25.6.4
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import struct
from importlib.metadata import version
from pathlib import Path

from trdi_adcp_readers.readers import read_PD0_file


def ensemble(number):
    """One ensemble of PD0: header, fixed leader, variable leader and velocities in four cells, one of them lost."""
    cells, clock = 4, (24, 6, 3, 10, 0, number, 50)
    fixed = struct.pack(
        "<H8B3H4BH4Bhh2BHH4BH", 0, 10, 16, 0x41, 0x41, 0, 13, 4, cells, 1, 10, 25, 1, 64, 5, 0, 1500, 0, 1, 0,
        0x1F, -4500, 0, 0x7D, 0x3D, 35, 15, 1, 5, 50, 0, 5) + struct.pack("<8xHBBIB", 0, 255, 0, 12345, 20)
    leader = struct.pack(
        "<HH7BBHHHHhhhh3B3B8BIHIIB8B", 0x80, number, *clock, 0, 0, 1480, 2, 9000, 0, 0, 0, 1450,
        0, 1, 0, 0, 0, 0, *[0] * 8, 0, 0, 0, 0, 0, 20, *clock)
    velocity = struct.pack("<H16h", 0x100, *[300, 400, 0, 0] * 3, *[-32768] * 4)  # mm/s
    blocks = [fixed, leader, velocity]
    starts = [6 + 2 * len(blocks), 6 + 2 * len(blocks) + len(fixed), 6 + 2 * len(blocks) + len(fixed) + len(leader)]
    whole = struct.pack("<HHBB3H", 0x7F7F, starts[2] + len(velocity) + 2, 0, 3, *starts) + b"".join(blocks) + bytes(2)
    return whole + struct.pack("<H", sum(whole) & 0xFFFF)


Path("reach.000").write_bytes(b"".join(ensemble(number) for number in range(1, 31)))
data = read_PD0_file("reach.000")
number, time = data["variable_leader"]["ensemble_number"], data["timestamp"]
angle, last = data["fixed_leader"]["heading_alignment"] / 100.0, data["velocity"]["data"][-1]
print(f"trdi_adcp_readers {version('trdi_adcp_readers')}: a file with 30 ensembles, the first at 10:00:01.50")
print("expected: 30 ensembles, or an error; heading alignment -45 degrees; lost cells marked")
print(f"seen: {type(data).__name__} with ensemble {number} at {time.time()}, alignment {angle}, last cell {last}")
assert number == 1 and time.second == 1 and time.microsecond == 50, "the behaviour has changed"
assert angle == 610.36 and last == [-32768] * 4, "the behaviour has changed"
PYTHON
