#!/bin/sh
# The number of a gauge in rashdf's observed stages is its place in the alphabet, in the results its place in the file.
#
# Guess:      refpt_id is one numbering of the reference points of a HEC-RAS plan: the observed stage and the modelled
#             stage with refpt_id 0 belong to one place.
# Seen:       in observed_timeseries_input the number is the place of the name in the alphabet; in
#             reference_points_timeseries_output and reference_points_stage it is the row of the table of points. With the
#             points Weir, Bridge and Mill, whose stages are reproduced exactly, the errors are +1, +1 and -2 m. No message.
# Matters:    a calibration of roughness to the levels of other gauges.
# Documented: no remark. The name, refpt_name, is right in both.
# Versions:   rashdf 0.12.0, xarray 2025.6.1, pandas 2.3.1, numpy 2.3.1, h5py 3.14.0, geopandas 1.1.1. The file has the
#             groups of a plan file that are read.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    rashdf==0.12.0 xarray==2025.6.1 pandas==2.3.1 numpy==2.3.1 h5py==3.14.0 geopandas==1.1.1
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import h5py
import numpy as np
from rashdf import RasPlanHdf

STAGES = {"Weir": 3.0, "Bridge": 2.0, "Mill": 1.0}  # m, in the order of the model; the model reproduces them
TIMES = ["01Jan2020 00:00:00", "01Jan2020 01:00:00"]
SERIES = "Results/Unsteady/Output/Output Blocks/Base Output/Unsteady Time Series"
with h5py.File("reach.p01.hdf", "w") as plan:
    plan[f"{SERIES}/Time Date Stamp (ms)"] = np.array([f"{time}:000" for time in TIMES], "S22")
    points = plan.create_group(f"{SERIES}/Reference Points")
    points["Name"] = np.array([f"{name}|Reach" for name in STAGES], "S32")
    points["Water Surface"] = np.array([list(STAGES.values())] * len(TIMES))
    points["Water Surface"].attrs["Units"] = np.bytes_("m")
    observed = plan.create_group("Event Conditions/Observed Data/Stage")
    observed["Attributes"] = np.array(list(STAGES), "S32")
    for name, stage in STAGES.items():
        observed[f"Ref Point: {name}"] = np.array([(time, stage) for time in TIMES], [("Date", "S18"), ("Value", "f4")])

with RasPlanHdf("reach.p01.hdf") as plan:
    modelled, measured = plan.reference_points_timeseries_output(), plan.observed_timeseries_input("Stage")
    stages = plan.reference_points_stage()
numbers = {str(name): number for number, name in enumerate(modelled["refpt_name"].values)}
seen = [float(modelled["Water Surface"].sel(refpt_id=k).mean() - measured.sel(refpt_id=k).mean()) for k in range(3)]
by_name = [float(stages[k].mean() - measured.sel(refpt_name=name).mean()) for name, k in numbers.items()]
print(f"rashdf {version('rashdf')}: modelled minus observed stage in m at refpt_id 0, 1, 2 ({', '.join(numbers)})")
print(f"expected: {by_name}, as by name")
print(f"seen: {seen}, with the observed points {[str(name) for name in measured['refpt_name'].values]}")
assert by_name == [0.0, 0.0, 0.0] and list(numbers) == list(STAGES)
assert seen == [1.0, 1.0, -2.0], "the behaviour has changed"
PYTHON
