#!/bin/sh
# SWMM ignores the roughness of a conduit with a surveyed section: depths are the same for n = 0.02 and 0.06.
#
# Guess:      the roughness of [CONDUITS] is that of the conduit, whatever its section; a calibration changes it there.
# Seen:       with a section of type IRREGULAR the roughness of the line NC of [TRANSECTS] is used alone: the depth is
#             0.80 m for n = 0.02, 0.03 and 0.06. The same rectangle as RECT_OPEN has 0.61, 0.80 and 1.27 m. No warning
#             in the report, which lists the roughness of the transect without saying so.
# Matters:    natural reaches have surveyed sections: their sensitivity to roughness is 0, and a sampler returns its
#             prior.
# Documented: the manual describes n of the conduit and n of the transect, each in its place.
# Versions:   pyswmm 2.2.0 with swmm-toolkit 0.17.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check pyswmm==2.2.0 swmm-toolkit==0.17.0
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

from pyswmm import Nodes, Simulation

MODEL = """[OPTIONS]
FLOW_UNITS CMS
FLOW_ROUTING DYNWAVE
START_DATE 01/01/2024
REPORT_START_DATE 01/01/2024
END_DATE 01/01/2024
END_TIME 03:00:00
ROUTING_STEP 1
[JUNCTIONS]
A 10.0 3 0 0 0
B 9.9 3 0 0 0
[OUTFALLS]
O 9.8 NORMAL
[CONDUITS]
AB A B 100 {n} 0 0 0 0
BO B O 100 {n} 0 0 0 0
[XSECTIONS]
AB {section} 0 0 1
BO {section} 0 0 1
[TRANSECTS]
NC 0.03 0.03 0.03
X1 T 4 0 5 0 0 0 0 0
GR 3 0 0 0 0 5 3 5
[INFLOWS]
A FLOW "" FLOW 1 1 3.0
"""


def depth(section, n):
    """After three hours with 3 m3/s, upstream."""
    Path("reach.inp").write_text(MODEL.format(section=section, n=n))
    with Simulation("reach.inp") as simulation:
        for _ in simulation:
            pass
        return round(Nodes(simulation)["A"].depth, 2)


sections = {"IRREGULAR": "IRREGULAR T 0", "RECT_OPEN": "RECT_OPEN 3 5"}
seen = {name: [depth(section, n) for n in (0.02, 0.03, 0.06)] for name, section in sections.items()}
print(f"pyswmm {version('pyswmm')}: depth in m of a channel 5 m wide for a roughness of 0.02, 0.03 and 0.06")
print(f"expected: {seen['RECT_OPEN']} for both ways to describe the section")
print(f"seen: {seen}")
assert seen["RECT_OPEN"] == [0.61, 0.8, 1.27]
assert seen["IRREGULAR"] == [0.8, 0.8, 0.8], "the behaviour has changed"
PYTHON
