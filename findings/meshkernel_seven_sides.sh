#!/bin/sh
# Cells of more than six sides vanish on the way through meshkernel.
#
# Guess:      a polygonal mesh that is set into MeshKernel comes back whole, or with an error message.
# Seen:       a cell of seven or eight sides is missing from the mesh that comes back, without a message, although its
#             nodes and edges stay. A cell of six sides stays.
# Matters:    HEC-RAS makes cells of up to eight sides along breaklines and banks. A mesh that goes through meshkernel
#             (or through Ugrid2d.meshkernel of xugrid) has holes there, and face data one entry too many.
# Documented: the limit of six nodes a face is in the source of the C++ library; MeshKernelPy issue 247 is about cells
#             that are lost or kept by "set". No remark in the documentation of the Python package.
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


def through_meshkernel(sides):
    """Sizes of the faces that come back from a cell of so many sides with a quadrangle beside it."""
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    ring = [[node, (node + 1) % sides] for node in range(sides)]
    quadrangle = [[0, sides], [sides, sides + 1], [sides + 1, 1]]
    kernel = MeshKernel()
    kernel.mesh2d_set(Mesh2d(
        node_x=np.append(np.cos(angles), [3.0, 3.0]),
        node_y=np.append(np.sin(angles), [-1.0, 1.0]),
        edge_nodes=np.array(ring + quadrangle, np.int32).ravel(),
        face_nodes=np.append(np.arange(sides), [0, sides, sides + 1, 1]).astype(np.int32),
        nodes_per_face=np.array([sides, 4], np.int32),
    ))
    return kernel.mesh2d_get().nodes_per_face.tolist()


seen = {sides: through_meshkernel(sides) for sides in (5, 6, 7, 8)}
print(f"meshkernel {version('meshkernel')}: two faces each go in, one of 5, 6, 7 or 8 sides and a quadrangle")
print("expected: both come back")
print(f"seen: sides of the faces that come back {seen}")
assert sorted(seen[5]) == [4, 5] and sorted(seen[6]) == [4, 6]
assert seen[7] == [4] and seen[8] == [4], "the behaviour has changed"
PYTHON
