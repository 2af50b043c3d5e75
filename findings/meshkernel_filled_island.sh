#!/bin/sh
# An island with three to six banks becomes a water cell.
#
# Guess:      the faces of a mesh that is given by nodes and edges are its cells; a hole stays a hole.
# Seen:       each closed ring of three to six edges becomes a face. A triangular island in a ring of three
#             quadrangles adds a fourth cell, which is the island itself. With a ring of seven edges it stays a hole.
# Matters:    bridge piers and small islands are meshed like this. A network file of D-Flow FM needs nodes and edges
#             only, so that a pier becomes a cell through which water flows, and wetted area and storage are too large.
# Documented: faces "are found" by the library, by its documentation, without a remark on holes; faces given besides
#             nodes and edges keep the hole. No public thread found.
# Versions:   meshkernel 8.3.0, numpy 2.3.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check meshkernel==8.3.0 numpy==2.3.1
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from meshkernel import Mesh2d, MeshKernel


def cells(corners):
    """Number of cells of a ring of quadrangles around an island of so many corners, given by nodes and edges."""
    angles = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False) + 0.1
    ring = [[i, (i + 1) % corners] for i in range(corners)]
    outer = [[a + corners, b + corners] for a, b in ring]
    spokes = [[i, i + corners] for i in range(corners)]
    kernel = MeshKernel()
    kernel.mesh2d_set(Mesh2d(
        node_x=np.append(np.cos(angles), 3.0 * np.cos(angles)),
        node_y=np.append(np.sin(angles), 3.0 * np.sin(angles)),
        edge_nodes=np.array(ring + outer + spokes, np.int32).ravel(),
    ))
    return len(kernel.mesh2d_get().nodes_per_face)


seen = {corners: cells(corners) for corners in (3, 4, 6, 7)}
print(f"meshkernel {version('meshkernel')}: islands of 3, 4, 6 and 7 corners, each in a ring of as many quadrangles")
print("expected: 3, 4, 6 and 7 cells")
print(f"seen: {seen}")
assert seen[7] == 7
assert (seen[3], seen[4], seen[6]) == (4, 5, 7), "the behaviour has changed"
PYTHON
