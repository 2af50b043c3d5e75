"""HEC-RAS 2D (6.x, its engine for Linux) as the engine of a case. A template: it was never run, as the code is not
installed here.

Called as `python engine_hecras.py TEMPLATE` in the folder of a member. TEMPLATE holds one folder for each experiment,
with the plan of its discharge and level as Windows has prepared it: model.p01.tmp.hdf, model.x01, model.b01. Output of
cell velocities has to be switched on in the plan. The geometry of the plan names the area below, in metres and in the
coordinates of the grid of the case.

The momentum equation takes Manning's n from the tables of faces, not from the centres of cells: below, that of all
faces is n_b; tell faces of banks and of plants apart by where they lie. There is no drag of plants of its own: give
them a higher n. What datasets are called is from public models of others; compare them with your files.
"""

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
from scipy.interpolate import LinearNDInterpolator

AREA = "Perimeter 1"
GEOMETRY = f"Geometry/2D Flow Areas/{AREA}"
RESULTS = f"Results/Unsteady/Output/Output Blocks/Base Output/Unsteady Time Series/2D Flow Areas/{AREA}"
VARIABLES = {
    "velocity": "Cell Velocity - Velocity X",
    "velocity_across": "Cell Velocity - Velocity Y",
    "level": "Water Surface",
}
MANNING = 3  # column of Manning's n in the tables of faces
READ = (*VARIABLES, "speed")
STEADY = 1e-3  # largest change between the last two times that are written [m, m/s]

given = json.loads(Path("parameters.json").read_text(encoding="utf-8"))
with Path("stations.csv").open(newline="", encoding="utf-8") as file:
    stations = list(csv.DictReader(file))
if other := sorted({row["kind"] for row in stations} - set(READ)):
    sys.exit(f"this template reads {', '.join(READ)}; {', '.join(other)} has to be added to it")

predictions = {}
for experiment in given["experiments"]:
    folder = shutil.copytree(Path(sys.argv[1]) / experiment, Path(experiment))
    plan = folder / "model.p01.tmp.hdf"
    with h5py.File(plan, "r+") as file:
        table = file[f"{GEOMETRY}/Faces Area Elevation Values"]
        table[:, MANNING] = given["parameters"]["n_b"]["value"]

    subprocess.run(["RasUnsteady", plan.name, "x01"], cwd=folder, check=True)

    with h5py.File(plan) as file:
        centres = file[f"{GEOMETRY}/Cells Center Coordinate"][...]
        last = {kind: file[f"{RESULTS}/{name}"][-2:] for kind, name in VARIABLES.items()}
    here = [row for row in stations if row["experiment"] == experiment]
    points = np.array([(float(row["x"]), float(row["y"])) for row in here])
    before, now = (
        {kind: LinearNDInterpolator(centres, series[time])(points) for kind, series in last.items()} for time in (0, 1)
    )
    if max(np.abs(now[kind] - before[kind]).max() for kind in VARIABLES) > STEADY:
        sys.exit(f"the flow of {experiment} is not steady when the run ends: let it run longer")
    now["speed"] = np.hypot(now["velocity"], now["velocity_across"])
    predictions |= {row["station"]: float(now[row["kind"]][at]) for at, row in enumerate(here)}

with Path("predictions.csv").open("w", newline="", encoding="utf-8") as file:
    csv.writer(file).writerows([("station", "prediction"), *predictions.items()])
