#!/bin/sh
# py2dm reads a mesh without its roughness zones if one header line is missing, and writes it without them.
#
# Guess:      the number behind the nodes of a cell is its material, the zone of its roughness, as in each description of
#             the format; a file in which all cells have one is read with it.
# Seen:       without the line NUM_MATERIALS_PER_ELEM all cells have no material: (), not zone 4 and zone 7. No message.
#             A copy made from what was read has no zones either. Reader(path, materials=1) reads both.
# Matters:    the line is new in SMS 11; older meshes have none. The copy has one roughness everywhere, and plants,
#             floodplain and channel cannot be told apart.
# Documented: the docstring of materials_per_element says that the number is 0 if it is not given.
# Versions:   py2dm 0.2.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check py2dm==0.2.2
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import py2dm

MESH = """MESH2D
{header}E3T 1 1 2 3 4
E4Q 2 2 4 5 3 7
ND 1 0.0 0.0 1.0
ND 2 1.0 0.0 1.1
ND 3 0.0 1.0 1.2
ND 4 2.0 0.0 1.3
ND 5 2.0 1.0 1.4
"""


def zones(path, **how):
    with py2dm.Reader(path, **how) as mesh:
        return [cell.materials for cell in mesh.elements]


Path("with_line.2dm").write_text(MESH.format(header="NUM_MATERIALS_PER_ELEM 1\n"))
Path("without.2dm").write_text(MESH.format(header=""))
with py2dm.Reader("without.2dm") as mesh, py2dm.Writer("copy.2dm") as copy:
    for node in mesh.nodes:
        copy.node(node)
    for cell in mesh.elements:
        copy.element(cell)
seen = {
    "with the line": zones("with_line.2dm"),
    "without": zones("without.2dm"),
    "without, materials=1": zones("without.2dm", materials=1),
    "copy, materials=1": zones("copy.2dm", materials=1),
}
print(f"py2dm {version('py2dm')}: materials of two cells in zones 4 and 7")
print("expected: [(4,), (7,)] in all four")
print(f"seen: {seen}")
assert seen["with the line"] == seen["without, materials=1"] == [(4,), (7,)]
assert seen["without"] == [(), ()] and seen["copy, materials=1"] != [(4,), (7,)], "the behaviour has changed"
PYTHON
