"""The built-in solver as if it were another code: one member, from parameters.json to predictions.csv.

It stands for a script that starts your own model. Called as `python solver_as_command.py brook.yaml` in the folder of a
member; the config it gets names no `engine`.
"""

import csv
import json
import sys
from pathlib import Path

import numpy as np

import vegglue
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import sample_of
from vegglue.inference.solve_ensemble import solve_chunk
from vegglue.measurements.observations import read_observations

case = vegglue.load_case(sys.argv[1])
given = json.loads(Path("parameters.json").read_text(encoding="utf-8"))["parameters"]
theta = {name: np.array([one["value"]]) for name, one in given.items()}

solved = solve_chunk(case, build_site(case), read_observations(case), sample_of(case, theta))
if solved["reason"][0]:
    sys.exit(str(solved["reason"][0]))  # the last line that is said becomes the reason of the failure

with Path("stations.csv").open(newline="", encoding="utf-8") as file:
    stations = [int(row["station"]) for row in csv.DictReader(file)]  # the rows of the case's own measurements
with Path("predictions.csv").open("w", newline="", encoding="utf-8") as file:
    table = csv.writer(file)
    table.writerow(["station", "prediction"])
    table.writerows((station, repr(float(solved["prediction"][0, station]))) for station in stations)
