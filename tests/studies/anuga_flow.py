"""One steady flow in ANUGA, by a Python that has it: `python anuga_flow.py SITE.npz FLOW.npz`, begun by `peer.py`.

Two triangles a cell, Manning's n of the bed, plants by ANUGA's own drag (Baptist), no eddy viscosity. From still water
at the level of the outlet; it is steady once no velocity in water deeper than DEEP changes by STEADY in a minute.
"""

import sys
import time

import anuga
import numpy as np
from anuga.abstract_2d_finite_volumes.mesh_factory import rectangular

# [m], [m/s], [s] and [s].
DEEP, STEADY, LOOK_EVERY, LONGEST = 0.05, 1e-3, 60.0, 900.0

site = dict(np.load(sys.argv[1]))
x, y = site["x"], site["y"]
dx, dy, level = x[1] - x[0], y[1] - y[0], float(site["level"])


def at(values):
    """Values (nx, ny) of cells as a function of places, as `set_quantity` takes it."""

    def found(px, py):
        i, j = np.round((px - x[0]) / dx).astype(int), np.round((py - y[0]) / dy).astype(int)
        return values[np.clip(i, 0, x.size - 1), np.clip(j, 0, y.size - 1)]

    return found


def velocities(domain):
    """u, v [m/s] (2, n) and depth [m] (n,) of all triangles."""
    depth = domain.quantities["stage"].centroid_values - domain.quantities["elevation"].centroid_values
    momentum = [domain.quantities[name].centroid_values for name in ("xmomentum", "ymomentum")]
    return np.where(depth > DEEP, momentum / np.maximum(depth, DEEP), 0.0), depth


began = time.process_time()
points, triangles, sides = rectangular(x.size, y.size, x.size * dx, y.size * dy, origin=(x[0] - dx / 2, y[0] - dy / 2))
domain = anuga.Domain(points, triangles, sides)
domain.set_flow_algorithm("DE1")
domain.set_store(False)
domain.set_quantity("elevation", at(site["bed"]), location="centroids")
domain.set_quantity("stage", at(np.maximum(site["bed"], level)), location="centroids")
domain.set_quantity("friction", float(site["n"]), location="centroids")
domain.set_vegetation_drag(at(site["density"]), 1.0, float(site["canopy_height"]), Cd=1.0, bed_chezy=site["bare_chezy"])
wall = anuga.Reflective_boundary(domain)
outlet = anuga.Transmissive_n_momentum_zero_t_momentum_set_stage_boundary(domain, lambda t: level)
domain.set_boundary({"left": wall, "right": outlet, "top": wall, "bottom": wall})
wet = y[site["bed"][0] < level - DEEP]
anuga.Inlet_operator(domain, [[x[0], wet.min()], [x[0], wet.max()]], Q=float(site["discharge"]))
made, before, change, now = time.process_time() - began, np.inf, np.inf, 0.0
for now in domain.evolve(yieldstep=LOOK_EVERY, finaltime=LONGEST):
    found, depth = velocities(domain)
    change = float(np.abs(found - before).max())
    print(f"{now:.0f} s: {change:.1e} m/s, {time.process_time() - began:.0f} s of a core", file=sys.stderr, flush=True)
    before = found
    if change < STEADY:
        break
centres = domain.centroid_coordinates
np.savez(
    sys.argv[2], x=centres[:, 0], y=centres[:, 1], u=found[0], v=found[1], depth=depth, made=made,
    spent=time.process_time() - began, lasted=now, change=change, version=anuga.__version__, triangles=len(centres),
)  # fmt: skip
