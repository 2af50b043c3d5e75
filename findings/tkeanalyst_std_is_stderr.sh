#!/bin/sh
# The column "u std" of TKEanalyst holds the standard error, and "TKE norm." of a probe that looks down a shear stress.
#
# Guess:      in the tables of statistics a column holds what its head says.
# Seen:       the heads are in the order average, std, stderr and the numbers in the order average, stderr, std. Of a record
#             of 2,000 samples with a fluctuation of 0.05 m/s the table gives u std 0.0011 and u stderr 0.049 m/s. With
#             the direction "down" eight more columns are exchanged: "TKE2" is the normalised velocity, "u norm." is
#             TKE2, "TKE norm." is a standard error of the stress, and so is the plot of it.
# Matters:    turbulence intensities behind plants and wood that are too small by the root of the number of samples, and
#             standard errors as large as the turbulence.
# Documented: otherwise, by the heads. No public thread found.
# Versions:   TKEanalyst 1.0.3, numpy 2.3.1, pandas 2.3.3, matplotlib 3.10.3, openpyxl 3.1.5.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    TKEanalyst==1.0.3 numpy==2.3.1 pandas==2.3.3 matplotlib==3.10.3 openpyxl==3.1.5
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import contextlib
import io
import os
from importlib.metadata import version

import numpy as np
import pandas as pd
from TKEanalyst import process_adv_files

SAMPLES, RATE, BULK = 2000, 25.0, 0.3  # -, Hz, m/s
random = np.random.default_rng(1)
velocities = random.normal([BULK, 0.0, 0.0, 0.0], [0.05, 0.04, 0.03, 0.03], (SAMPLES, 4))
blank, number = np.zeros(SAMPLES), np.arange(SAMPLES)
record = np.column_stack([blank, number / RATE, number, blank, velocities, np.full((SAMPLES, 12), 20.0)])
settings = {
    "Input folder directory": "record",
    "Data file ending": ".vna",
    "Flow velocity": BULK,
    "Water depth": 0.2,
    "ADV sampling frequency": RATE,
    "Turbulence object length dimension": 0.1,
    "Spike detection method": "velocity",
    "Despike lambda a": 1.0,
    "Despike k": 9.0,
}
os.mkdir("record")
np.savetxt("record/8_16.5_6_T1.vna", record, fmt="%.6f")


def table(direction):
    """The row of the only place, as written for a probe of this direction."""
    given = pd.DataFrame({"VALUE": settings | {"ADV direction": direction}}).rename_axis("PARAMETER")
    given.to_excel("input.xlsx")
    with contextlib.redirect_stdout(io.StringIO()):
        process_adv_files("input.xlsx")
    return pd.read_excel("record/stats-despiked.xlsx", index_col=0).iloc[0]


spread = velocities[:, :3].std(axis=0)
energy = 0.5 * float((spread**2).sum())
side, down = table("longitudinal"), table("down")
expected = {"u std": spread[0], "u stderr": spread[0] / SAMPLES**0.5, "TKE norm.": energy / BULK**2}
heads = ["u std (m/s)", "u stderr (m/s)", "TKE norm. (-)"]
print(f"TKEanalyst {version('TKEanalyst')}: {SAMPLES} samples at {RATE:g} Hz")
print("expected:", {name: round(float(one), 5) for name, one in expected.items()})
print("seen, longitudinal:", side[heads].round(5).to_dict())
print("seen, down:", down[[*heads, "TKE2 (m^2/s^2)", "u norm. (-)"]].round(5).to_dict())
assert np.isclose(side["TKE norm. (-)"], expected["TKE norm."], rtol=1e-3)
for one in (side, down):
    assert np.isclose(one["u std (m/s)"], expected["u stderr"], rtol=1e-3), "the behaviour has changed"
    assert np.isclose(one["u stderr (m/s)"], expected["u std"], rtol=1e-3), "the behaviour has changed"
assert np.isclose(down["TKE2 (m^2/s^2)"], velocities[:, 0].mean() / BULK, rtol=1e-3), "the behaviour has changed"
assert down["TKE norm. (-)"] < 0.01 * expected["TKE norm."], "the behaviour has changed"
PYTHON
