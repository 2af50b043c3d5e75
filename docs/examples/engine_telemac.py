"""TELEMAC-2D as the engine of a case. A template: it was never run, as the code is not installed here.

Called as `python engine_telemac.py TEMPLATE` in the folder of a member, with TELEMAC's environment (HOMETEL, PYTHONPATH
to its `scripts/python3`). TEMPLATE is the folder of your model, with $n_b, $phi, ... for parameters and $discharge and
$level for the flow wherever they stand in its text files:

    model.cas      PRESCRIBED FLOWRATES : 0.;$discharge      PRESCRIBED ELEVATIONS : $level;0.
                   FRICTION DATA : YES      FRICTION DATA FILE : friction.tbl      RESULTS FILE : r2d.slf
    friction.tbl   a law and its numbers for each zone: MANN $n_b on the bed, plants by VEGETATION FRICTION

Liquid boundaries have the order of your mesh. The mesh has to lie in the coordinates of the grid of the case, or shift
x and y below. What keys and files are called is from public models of others; compare them with the manual of your
version.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path
from shutil import copytree
from string import Template

import numpy as np
from data_manip.extraction.telemac_file import TelemacFile

TEXT = (".cas", ".tbl", ".liq", ".txt")
VARIABLES = {"velocity": "VELOCITY U", "velocity_across": "VELOCITY V", "level": "FREE SURFACE"}
ENCODING = "latin-1"  # any, so that letters in comments stay as they are
READ = (*VARIABLES, "speed")
STEADY = 1e-3  # largest change between the last two records [m, m/s]

given = json.loads(Path("parameters.json").read_text(encoding="utf-8"))
with Path("stations.csv").open(newline="", encoding="utf-8") as file:
    stations = list(csv.DictReader(file))
if other := sorted({row["kind"] for row in stations} - set(READ)):
    sys.exit(f"this template reads {', '.join(READ)}; {', '.join(other)} has to be added to it")
parameters = {name: one["value"] for name, one in given["parameters"].items()}

predictions = {}
for experiment, flow in given["experiments"].items():
    folder = copytree(sys.argv[1], Path(experiment))
    values = parameters | {"discharge": sum(flow["discharge"].values()), "level": flow["level"]}
    for file in (file for file in folder.rglob("*") if file.suffix in TEXT):
        file.write_text(Template(file.read_text(ENCODING)).safe_substitute(values), ENCODING)

    subprocess.run(["telemac2d.py", "model.cas", "--ncsize=1"], cwd=folder, check=True)

    here = [row for row in stations if row["experiment"] == experiment]
    points = [(float(row["x"]), float(row["y"])) for row in here]
    results = TelemacFile(str(folder / "r2d.slf"))
    last = results.ntimestep - 1
    now, before = (
        {kind: np.array(results.get_data_on_points(name, time, points)) for kind, name in VARIABLES.items()}
        for time in (last, last - 1)
    )
    results.close()
    if max(np.abs(now[kind] - before[kind]).max() for kind in VARIABLES) > STEADY:
        sys.exit(f"the flow of {experiment} is not steady when the run ends: let it run longer")
    now["speed"] = np.hypot(now["velocity"], now["velocity_across"])
    predictions |= {row["station"]: float(now[row["kind"]][at]) for at, row in enumerate(here)}

with Path("predictions.csv").open("w", newline="", encoding="utf-8") as file:
    csv.writer(file).writerows([("station", "prediction"), *predictions.items()])
