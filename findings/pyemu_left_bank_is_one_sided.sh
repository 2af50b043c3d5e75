#!/bin/sh
# An observation group "l_bank" is a constraint: velocities below the measured ones cost nothing.
#
# Guess:      names of groups are labels.
# Seen:       a name that begins with "l_" or "less" makes each observation of the group an upper limit, "g_" or
#             "greater" a lower one. Predictions of half the measured velocity have phi 0 in "l_bank", the full misfit
#             in "left_bank".
# Matters:    left bank, lower reach, gauge: "l_bank", "l_reach" and "g_weir" are natural names. Half of the residuals
#             leave the calibration without a word.
# Documented: in the manual of PEST++ (inequality observations) and in a property of pyEMU; nothing at the place where
#             a group gets its name.
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

import pandas as pd
import pyemu


def phi(group):
    """Misfit of predictions at 0.5 and at 1.5 times two measured velocities of 1 m/s in a group of this name."""
    control = pyemu.Pst.from_par_obs_names(["n"], ["u1", "u2"])
    control.observation_data[["obsval", "weight", "obgnme"]] = [[1.0, 1.0, group]] * 2
    predictions = pd.DataFrame([[0.5, 0.5], [1.5, 1.5]], columns=["u1", "u2"])
    return pyemu.ObservationEnsemble(control, predictions).phi_vector.tolist()


seen = {group: phi(group) for group in ("left_bank", "l_bank", "g_weir")}
print(f"pyemu {version('pyemu')}: phi of half and of one and a half times the measured velocities")
print("expected: 0.5 and 0.5 whatever the name of the group")
print(f"seen: {seen}")
assert seen["left_bank"] == [0.5, 0.5]
assert seen["l_bank"] == [0.0, 0.5] and seen["g_weir"] == [0.5, 0.0], "the behaviour has changed"
PYTHON
