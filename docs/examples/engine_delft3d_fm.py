"""Delft3D FM (D-Flow FM, 2D) as the engine of a case. A template: it was never run, as the code is not installed here.

Called as `python engine_delft3d_fm.py TEMPLATE` in the folder of a member. TEMPLATE is the folder of your model, with
$n_b, $phi, ... for parameters and $discharge and $level for the flow wherever they stand in its text files:

    model.mdu     UnifFrictType = 1, UnifFrictCoef = $n_b, ObsFile = stations_obs.xyn
    *.bc          $discharge at the inflow, $level at the outlet
    *.ttd         plants as trachytopes, Baptist's formula with $phi

The mesh has to lie in the coordinates of the grid of the case, or shift x and y below. What keys and files are called
is from public models of others; compare them with the manual of your version.
"""

import csv
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path
from string import Template

import h5py

TEXT = (".mdu", ".bc", ".ext", ".ini", ".ttd", ".pol", ".xyz")
ENCODING = "latin-1"  # any, so that letters in comments stay as they are
READ = ("velocity", "velocity_across", "speed", "level")
STEADY = 1e-3  # largest change between the last two times that are written [m, m/s]

given = json.loads(Path("parameters.json").read_text(encoding="utf-8"))
with Path("stations.csv").open(newline="", encoding="utf-8") as file:
    stations = list(csv.DictReader(file))
if other := sorted({row["kind"] for row in stations} - set(READ)):
    sys.exit(f"this template reads {', '.join(READ)}; {', '.join(other)} has to be added to it")
parameters = {name: one["value"] for name, one in given["parameters"].items()}

predictions = {}
for experiment, flow in given["experiments"].items():
    folder = shutil.copytree(sys.argv[1], Path(experiment))
    values = parameters | {"discharge": sum(flow["discharge"].values()), "level": flow["level"]}
    for file in (file for file in folder.rglob("*") if file.suffix in TEXT):
        file.write_text(Template(file.read_text(ENCODING)).safe_substitute(values), ENCODING)
    here = [row for row in stations if row["experiment"] == experiment]
    places = [f"{row['x']} {row['y']} '{row['station']}'\n" for row in here]
    (folder / "stations_obs.xyn").write_text("".join(places), encoding="utf-8")

    subprocess.run(["dflowfm", "--autostartstop", "model.mdu"], cwd=folder, check=True)

    (history,) = folder.rglob("*_his.nc")
    with h5py.File(history) as file:
        names = [b"".join(name).decode().strip() for name in file["station_name"][...]]
        u, v, level = (file[name][-2:] for name in ("x_velocity", "y_velocity", "waterlevel"))
    if max(abs(series[1] - series[0]).max() for series in (u, v, level)) > STEADY:
        sys.exit(f"the flow of {experiment} is not steady when the run ends: let it run longer")
    for row in here:
        at = names.index(row["station"])
        read = {"velocity": u, "velocity_across": v, "level": level}
        speed = math.hypot(u[1, at], v[1, at])
        predictions[row["station"]] = speed if row["kind"] == "speed" else float(read[row["kind"]][1, at])

with Path("predictions.csv").open("w", newline="", encoding="utf-8") as file:
    csv.writer(file).writerows([("station", "prediction"), *predictions.items()])
