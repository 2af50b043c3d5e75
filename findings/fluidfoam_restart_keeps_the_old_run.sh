#!/bin/sh
# The forces and probes that fluidfoam merges over a restart are those of the abandoned run, as far as it went.
#
# Guess:      with time_name="mergeTime" the records of an OpenFOAM case that was restarted at an earlier time are joined
#             at the restart: from there on the folder of the second run counts.
# Seen:       rows of the second run at times that the first one had reached are dropped, and the first run goes on to its
#             end. A run to 8 s, continued from 5 s with another drag of the plants, has the old force from 6 to 8 s and
#             the new one from 9 s. readforce and readprobes alike. No message.
# Matters:    mean forces on plants and velocities at probes in which the trial with the wrong coefficient stays.
# Documented: the docstrings say that mergeTime is supported.
# Versions:   fluidfoam 0.3.1, numpy 2.3.1, scipy 1.16.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    fluidfoam==0.3.1 numpy==2.3.1 scipy==1.16.0
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import fluidfoam

RUNS = {0: (range(1, 9), 1.0), 5: (range(6, 11), 2.0)}  # s of the start: s of the rows, N (and m/s at the probe)
for start, (times, value) in RUNS.items():
    for kind in ("forces", "probes"):
        Path(f"flume/postProcessing/{kind}/{start}").mkdir(parents=True)
    rows = [f"{time} (({value} 0 0) (0 0 0))" for time in times]
    Path(f"flume/postProcessing/forces/{start}/forces.dat").write_text("\n".join(["# Time forces", *rows, ""]))
    rows = [f"{time} ({value} 0 0)" for time in times]
    Path(f"flume/postProcessing/probes/{start}/U").write_text("\n".join(["# Probe 0 (1 0.2 0.1)", "# Time", *rows, ""]))

forces = fluidfoam.readforce("flume", time_name="mergeTime")
_, times, velocities = fluidfoam.readprobes("flume", time_name="mergeTime", name="U", verbose=False)
second = {float(time): value for time, value in fluidfoam.readforce("flume", time_name="5")[:, :2]}
seen = {float(time): float(value) for time, value in forces[:, :2]}
expected = {time: second.get(time, value) for time, value in seen.items()}
print(f"fluidfoam {version('fluidfoam')}: force in N by the time in s, restarted at 5 s")
print(f"expected: {({time: float(value) for time, value in expected.items()})}, mean {sum(expected.values()) / 10}")
print(f"seen: {seen}, mean {sum(seen.values()) / 10}")
assert dict(zip(times.tolist(), velocities[:, 0, 0].tolist())) == seen
assert seen == {float(time): 1.0 if time < 9 else 2.0 for time in range(1, 11)}, "the behaviour has changed"
PYTHON
