#!/bin/sh
# adcpasciireader numbers the profiles of a WinRiver file one higher than their ensembles.
#
# Guess:      the two tables that are read from a "classic ASCII" file are joined by their column Ensemblecode.
# Seen:       ensemble 1 has the code 1, its profile the code 2. Joined, each profile has the depth, the position and
#             the time of the next ensemble; the first ensemble has no profile, the last profile no ensemble. Lost
#             velocities stay -32768 cm/s.
# Matters:    a transect whose velocities are shifted by one ensemble towards the far bank: cells below the bed at one
#             bank, missing ones at the other, and a discharge that uses foreign depths.
# Documented: no documentation of the columns; no public thread found.
# Versions:   adcpasciireader 1.1.3, numpy 2.3.1, matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    adcpasciireader==1.1.3 numpy==2.3.1 matplotlib==3.10.3
cd "$work"
MPLBACKEND=Agg timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

from adcpasciireader.adcpreader import original


def ensemble(number, depth):
    """Six lines of an ensemble, then two cells; the velocity of the first cell is 10 cm/s for each metre of depth."""
    lost = -32768
    return "\n".join((
        f"24 6 3 10 0 {number} 0 {number} 1 0.5 0.5 90.0 15.0",
        "0.0 50.0 0.0 0.0 0 0 0 0 " + " ".join([f"{depth:.2f}"] * 4),
        f"{number}.0 {number}.0 0.0 {number}.0 {number}.0",
        "30000.0 30000.0 0 0 0",
        "0.0 0.0 0.0 0.0 0.0 0.0 0.0 0.0 0.5 0.2",
        "2 cm BT dB 0.43 0.161",
        f"0.5 {10.0 * depth:.1f} 90.0 {10.0 * depth:.1f} 0.0 0.0 0.0 80 80 80 80 100 0.1",
        f"1.0 {lost} {lost} {lost} {lost} {lost} {lost} 80 80 80 80 0 0.0")) + "\n"


depths = {1: 2.0, 2: 4.0, 3: 6.0, 4: 3.0}  # m, by ensemble
header = "transect\nclassic ASCII\n20 50 30 2 1 5 1\n"
Path("transect_ASC.TXT").write_text(header + "".join(ensemble(*one) for one in depths.items()))
ensembles, profiles = original("transect_ASC.TXT").adcpasciireader()
depth = dict(zip(ensembles["Ensemblecode"], ensembles["DB1"], strict=True))
speed = {codes[0]: values[0] for codes, values in zip(profiles["Ensemblecode"], profiles["VM"], strict=True)}
seen = {code: (depth.get(code), speed.get(code)) for code in sorted({*depth, *speed})}
print(f"adcpasciireader {version('adcpasciireader')}: depth in m and velocity in cm/s by Ensemblecode")
print(f"expected: {({code: (one, 10.0 * one) for code, one in depths.items()})}")
print(f"seen: {seen}; second cell {profiles['VM'][0][1]}")
assert depth == depths
assert speed == {code + 1: 10.0 * one for code, one in depths.items()}, "the behaviour has changed"
PYTHON
