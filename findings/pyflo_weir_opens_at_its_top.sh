#!/bin/sh
# A weir of pyflo carries nothing until the water is above the top of its opening, a section by points nothing at all.
#
# Guess:      Weir.flow of an opening 10 ft wide and 4 ft high is that of a weir, C L h^1.5, below its top, and that of an
#             orifice above; Irregular takes the points of a surveyed section as Trapezoid takes its slopes.
# Seen:       the weir has 0 ft3/s with 3 ft of water over its crest, where 166 are right, and 279 when the water is 0.1 ft
#             over its top. A trapezoid by its four points has area, perimeter and flow 0 at 5 ft, where 214 ft3/s are
#             right. No message.
# Matters:    an outlet structure or a bridge in a flood that is shut up to its soffit, and dry surveyed sections.
# Documented: Weir has no docstring; flow_area: "Area, in feet^2".
# Versions:   pyflo 0.3.3, scipy 1.16.0, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check pyflo==0.3.3 scipy==1.16.0 numpy==2.3.1
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

from pyflo.links import Reach, Weir
from pyflo.sections import Irregular, Rectangle, Trapezoid

WIDTH, HEIGHT, CREST, COEFFICIENT = 10.0, 4.0, 10.0, 3.2  # ft, ft, ft, ft^0.5/s
HEADS = (1.0, 3.0, 3.9, 4.1)  # ft over the crest; the level below is 5 ft under it
weir = Weir(invert=CREST, k_orif=0.6, k_weir=COEFFICIENT, section=Rectangle(WIDTH, HEIGHT))
right = [round(COEFFICIENT * WIDTH * head**1.5, 1) for head in HEADS[:3]]
seen = [round(weir.flow(CREST + head, CREST - 5.0), 1) for head in HEADS]
by_slopes = Reach(section=Trapezoid(1.0, 10.0, 1.0, n=0.035), slope=0.001)
by_points = Reach(section=Irregular([(0.0, 10.0), (10.0, 0.0), (20.0, 0.0), (30.0, 10.0)], n=0.035), slope=0.001)
flows = [round(one.normal_flow(5.0), 1) for one in (by_slopes, by_points)]
print(f"pyflo {version('pyflo')}: flow in ft3/s over a weir with an opening 4 ft high, at heads of {HEADS} ft")
print(f"expected: {right}, then that of an orifice; {flows[0]} in a trapezoid by its points")
print(f"seen: {seen}; {flows[1]} in a trapezoid by its points")
assert flows[0] == 214.4
assert seen[:3] == [0.0, 0.0, 0.0] and seen[3] > 270.0 and flows[1] == 0.0, "the behaviour has changed"
PYTHON
