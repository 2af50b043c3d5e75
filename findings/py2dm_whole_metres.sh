#!/bin/sh
# py2dm writes northings in whole metres: half of the cells of half a metre get the area 0.
#
# Guess:      a mesh that is written and read back has its nodes where they were, or within a millimetre.
# Seen:       each coordinate is written with seven digits. An easting of 683421.37 m comes back as 683421.4 m, a northing
#             of 5248123.25 m as 5248123.0 m. Half of the triangles with sides of 0.5 m have the area 0,
#             the others twice their own. No message.
# Matters:    SRH-2D, BASEMENT and Hydro_AS read their mesh from such a file in the coordinates of the map. Groynes, piers
#             and flumes on a map lose their cells; flume coordinates near 0 look right.
# Documented: no remark on digits in the docstrings of the writer. With flush_nodes(decimals=10) before closing the nodes
#             stay where they were.
# Versions:   py2dm 0.2.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check py2dm==0.2.2
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import py2dm

EAST, NORTH, SIDE, ROWS = 683421.37, 5248123.25, 0.5, 12  # m, on a map
places = [(EAST + SIDE * column, NORTH + SIDE * row, 412.34) for row in range(ROWS + 1) for column in range(2)]


def area(corners):
    (x1, y1, _), (x2, y2, _), (x3, y3, _) = corners
    return abs((x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)) / 2


def read_back(**how):
    with py2dm.Writer("reach.2dm") as mesh:
        for number, place in enumerate(places, start=1):
            mesh.node(number, *place)
        for row in range(ROWS):
            first = 2 * row + 1
            mesh.element("E3T", 2 * row + 1, first, first + 1, first + 2)
            mesh.element("E3T", 2 * row + 2, first + 1, first + 3, first + 2)
        if how:
            mesh.flush_nodes(**how)
    with py2dm.Reader("reach.2dm") as mesh:
        nodes = {node.id: node.pos for node in mesh.nodes}
        areas = [area([nodes[number] for number in cell.nodes]) for cell in mesh.elements]
    return nodes[1], [round(one, 3) for one in areas]


first, areas = read_back()
exact, whole = read_back(decimals=10)
print(f"py2dm {version('py2dm')}: {len(areas)} cells of {SIDE**2 / 2} m2, the first node at {places[0]}")
print(f"expected: {exact}, areas {sorted(set(whole))}")
print(f"seen: {first}, areas {sorted(set(areas))}; {areas.count(0.0)} cells without area")
assert exact == places[0] and set(whole) == {0.125}
assert first == (683421.4, 5248123.0, 412.34) and areas.count(0.0) > 0, "the behaviour has changed"
PYTHON
