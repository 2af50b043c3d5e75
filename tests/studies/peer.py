"""ANUGA beside this package: `python tests/studies/peer.py CASE.yaml PYTHON`, PYTHON being one that has ANUGA.

One steady flow of the first experiment in the middle of the prior, of both codes; of this package also a member of an
ensemble. Seconds of one core. `wide.py` measures the diagnosis of the same reach.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from bench import timed

sys.path.insert(0, str(Path(__file__).parents[1]))  # where `built_models` lies

from built_models import model_of

from vegglue.case.config import load_case
from vegglue.engine.interface import linearise
from vegglue.engine.newton import centre_flow, problem_at
from vegglue.flow.equations import residual
from vegglue.flow.starts import backwater
from vegglue.measurements.observations import read_observations
from vegglue.parallel import at_most
from vegglue.version import VERSION

ANUGA = Path(__file__).with_name("anuga_flow.py")
# Where the speeds of both flows are compared, water is this deep [m].
DEEP = 0.2


def main(config: Path, python: str) -> None:
    case = load_case(config)
    model = model_of(case, read_observations(case))
    name, middle = next(iter(case.experiments)), np.zeros(len(model.names))
    problem, grid = problem_at(model, name, middle[None]), model.site.grid
    plants = problem.plants
    density = np.zeros(problem.shape)  # C_D m D = phi / h_d with C_D = 1 and D = 1 m
    density[plants.column, plants.row] = plants.share * plants.phi[:, 0] / plants.canopy_height[:, 0]
    residual(problem, backwater(problem))  # compiled, if it is not yet
    with at_most(1):
        linearise(model, middle)
        began = time.process_time()
        point = linearise(model, middle)
        spent = time.process_time() - began
    assert point is not None
    shape = " x ".join(map(str, problem.shape))
    experiments = len(case.experiments)
    print(f"vegglue {VERSION}, {shape} cells: a flow from nothing with slopes {spent / experiments:.1f} s of a core")
    _, member = timed(case)
    print(f"  a member of an ensemble, all {experiments} experiments: {member:.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        site, flow = Path(folder) / "site.npz", Path(folder) / "flow.npz"
        np.savez(
            site, x=grid.x, y=grid.y, bed=problem.bed, density=density, n=problem.friction.coefficient[0, 0],
            canopy_height=plants.canopy_height[0, 0], bare_chezy=plants.bare_chezy[0, 0],
            level=problem.boundaries.outlet_level[0],
            discharge=sum(one.discharge[0] for one in problem.boundaries.inflows),
        )  # fmt: skip
        own = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": ""}
        subprocess.run([python, str(ANUGA), str(site), str(flow)], env=own, cwd=folder, check=True)
        found = dict(np.load(flow))
    print(
        f"ANUGA {found['version']}, {found['triangles']:,} triangles: {found['spent']:.0f} s of a core, of them "
        f"{found['made']:.0f} for the mesh, for {found['lasted'] / 60:.0f} min of flow, whose velocities then change "
        f"by {found['change']:.1e} m/s a minute"
    )
    ours = centre_flow(model, point, name)
    i, j = (
        np.floor((found[axis] - centres[0]) / step + 0.5).astype(int)
        for axis, centres, step in (("x", grid.x, grid.dx), ("y", grid.y, grid.dy))
    )
    deep = (found["depth"] > DEEP) & (ours.depth[i, j] > DEEP)
    apart = (found["u"] - ours.u[i, j])[deep]
    print(
        f"  u in water deeper than {DEEP} m: mean {ours.u[i, j][deep].mean():.3f} m/s here, "
        f"{found['u'][deep].mean():.3f} there, RMS of the difference {np.sqrt((apart**2).mean()):.3f}"
    )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("config", type=Path)
    arguments.add_argument("python")
    given = arguments.parse_args()
    main(given.config, given.python)
