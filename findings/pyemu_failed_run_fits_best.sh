#!/bin/sh
# In a pyEMU ensemble a run that failed fits best: NaN in all predictions is a phi of 0.
#
# Guess:      the phi of a realisation without predictions is NaN, or the realisation is dropped.
# Seen:       missing residuals are left out of the sum. All predictions missing gives phi 0, the best of all; a run
#             that lost half of its stations beats one that kept them.
# Matters:    ensembles are sorted, filtered and weighted by phi. On a cluster with failed runs the failures survive.
# Documented: not in the documentation; no public thread found.
# Versions:   pyemu 1.7.0, numpy 2.3.1, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pyemu==1.7.0 numpy==2.3.1 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pandas as pd
import pyemu

control = pyemu.Pst.from_par_obs_names(["n"], ["u1", "u2", "u3"])
control.observation_data["obsval"] = [1.0, 2.0, 3.0]
control.observation_data["weight"] = 1.0
predictions = pd.DataFrame(
    [[1.2, 2.2, 3.2], [1.2, np.nan, np.nan], [np.nan] * 3],
    index=["complete", "one_station_left", "failed"], columns=["u1", "u2", "u3"],
)
phi = pyemu.ObservationEnsemble(control, predictions).phi_vector
print(f"pyemu {version('pyemu')}: three runs with the same misfit at each station that they predict")
print("expected: NaN for the two incomplete runs, or an error")
print(f"seen: {phi.round(3).to_dict()}; best run: {phi.idxmin()}")
assert abs(phi["complete"] - 0.12) < 1e-9
assert phi["failed"] == 0.0 and phi["one_station_left"] < phi["complete"], "the behaviour has changed"
PYTHON
