#!/bin/sh
# Setting a mesh into meshkernel and getting it back renumbers its faces.
#
# Guess:      "set" followed by "get", with no operation between them, is the identity.
# Seen:       the faces come back in another order, sorted by the nodes and edges from which they are found again.
#             Nothing in the result maps the old numbers to the new ones. Nodes keep their order.
# Matters:    depth, bed level and velocity of a result file stand in arrays by face number. Put beside the mesh that
#             comes back they are values of other places: a plausible flow field with shuffled cells.
# Documented: no remark found in the documentation; MeshKernelPy issue 247 is about face_nodes that "set" ignores.
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

# Four quadrangles in a row, numbered against the current: face 0 is the one at x = 3 to 4.
columns = 5
x, y = np.meshgrid(np.arange(columns, dtype=float), [0.0, 1.0])
along = [[row * columns + i, row * columns + i + 1] for row in (0, 1) for i in range(columns - 1)]
across = [[i, i + columns] for i in range(columns)]
faces = [[i, i + 1, i + 1 + columns, i + columns] for i in reversed(range(columns - 1))]
kernel = MeshKernel()
kernel.mesh2d_set(Mesh2d(
    node_x=x.ravel(), node_y=y.ravel(), edge_nodes=np.array(along + across, np.int32).ravel(),
    face_nodes=np.array(faces, np.int32).ravel(), nodes_per_face=np.full(4, 4, np.int32),
))
back = kernel.mesh2d_get()
before = x.ravel()[np.array(faces)].mean(axis=1)
after = back.node_x[back.face_nodes.reshape(-1, 4)].mean(axis=1)
print(f"meshkernel {version('meshkernel')}: centres of the faces before {before}")
print("expected: the same centres in the same order")
print(f"seen: centres after {after}")
assert np.allclose(back.node_x, x.ravel()) and np.allclose(np.sort(after), np.sort(before))
assert not np.allclose(after, before), "the behaviour has changed"
PYTHON
