#!/bin/sh
# With NSE or KGE, ras-commander fits a roughness that is as far from the surveyed levels as its bounds allow.
#
# Guess:      RasCalibrate.optimize with metric="nse" finds the roughness that reproduces the surveyed water levels of a
#             steady HEC-RAS run, as with metric="rmse"; or it refuses one number per place.
# Seen:       a place with one measured number, the only kind that a steady profile may have, is scored by the absolute
#             error, whatever the metric; and with NSE and KGE the largest score is the best. Levels of a roughness of
#             0.035 lead to 0.060, the upper bound, with success True and a score of 0.52, which is an error in metres;
#             with RMSE to 0.035. No message.
# Matters:    a calibrated roughness at a bound that looks like a fair fit.
# Documented: no remark; NSE is the default metric of a CalibrationPoint.
# Versions:   ras-commander 0.110.1, pandas 2.3.1, numpy 2.2.6, scipy 1.16.0, h5py 3.14.0, shapely 2.1.1, requests 2.32.4.
#             In the place of HEC-RAS stands Manning's equation, which writes the results of a steady plan.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    ras-commander==0.110.1 pandas==2.3.1 numpy==2.2.6 scipy==1.16.0 h5py==3.14.0 shapely==2.1.1 requests==2.32.4
cd "$work"
TMPDIR="$work" HOME="$work" timeout 200 "$work/venv/bin/python" -W ignore - 2> log <<'PYTHON' || { cat log; exit 1; }
import importlib
import logging
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
from ras_commander import RasCalibrate

logging.disable()
calibrate = importlib.import_module("ras_commander.RasCalibrate")
TRUE, BOUNDS = 0.035, (0.02, 0.06)  # s/m^(1/3)
BED = {"10": 0.0, "20": 0.1}  # m, by the river station
PLAN = Path("reach.p01")
OUTPUT = "Results/Steady/Output"
PROFILES = f"{OUTPUT}/Output Blocks/Base Output/Steady Profiles"


def levels(roughness):
    """Levels in m of 30 m3/s at normal depth in a channel 20 m wide that falls by 1 in 1000."""
    depth = (roughness * 30.0 / (20.0 * 0.001**0.5)) ** 0.6
    return [bed + depth for bed in BED.values()]


def set_roughness(plan, parameters, ras):
    PLAN.write_text(str(float(parameters["n"])))


def run(number, **options):
    """Results of the plan, as HEC-RAS writes them."""
    kinds = [("River", "S16"), ("Reach", "S16"), ("Station", "S8")]
    places = np.array([("River", "Reach", station) for station in BED], kinds)
    with h5py.File("reach.p01.hdf", "w") as results:
        results[f"{PROFILES}/Profile Names"] = np.array([b"Flood"])
        results[f"{PROFILES}/Cross Sections/Water Surface"] = np.array([levels(float(PLAN.read_text()))])
        results[f"{OUTPUT}/Geometry Info/Cross Section Attributes"] = places
    return SimpleNamespace(results_df_row={"HDF_Results_Path": "reach.p01.hdf"})


PLAN.write_text("0.04")
calibrate.RasCmdr = SimpleNamespace(compute_plan=run)
calibrate.RasPlan = SimpleNamespace(get_plan_path=lambda number, ras_object: PLAN)
project = SimpleNamespace(check_initialized=lambda: None)
points = [
    {"name": f"mark {station}", "variable": "wse", "extraction_method": "steady_profile", "observed": level, "river": "River",
     "reach": "Reach", "station": station}
    for station, level in zip(BED, levels(TRUE))
]
seen = {}
for metric in ("rmse", "mae", "nse", "kge"):
    answer = RasCalibrate.optimize("01", {"n": BOUNDS}, set_roughness, points, metric=metric, ras_object=project)
    seen[metric] = (answer["success"], round(answer["best_parameters"]["n"], 4), round(answer["best_objective"], 2))
print(f"ras-commander {version('ras-commander')}: success, roughness and score from exact levels of n = {TRUE}")
print(f"expected: ({True}, {TRUE}, 0 or 1), or an error")
print(f"seen: {seen}")
assert seen["rmse"] == seen["mae"] == (True, TRUE, 0.0)
assert seen["nse"] == seen["kge"] == (True, BOUNDS[1], 0.52), "the behaviour has changed"
PYTHON
