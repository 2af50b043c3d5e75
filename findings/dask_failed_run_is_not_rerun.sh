#!/bin/sh
# A failed run that is submitted to Dask again does not run again, and five equal runs are one.
#
# Guess:      each call of submit starts a run. If a run failed for a passing reason, the same call repeats it.
# Seen:       the key of a task is made of the function and its arguments. As long as the first future is held, the same
#             call returns the old error without a run; map over five equal parameter sets runs once and returns
#             five copies. With pure=False there are five runs; retries=2 at the first submission repeats a failure.
# Matters:    a loop of one's own that submits failed members again ends with the same failures. Replicates that are to
#             show the noise of an engine have a scatter of exactly 0.
# Documented: the parameter "pure" in the reference of Client.submit and Client.map, whose default is true.
# Versions:   distributed and dask 2026.8.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    distributed==2026.8.0 dask==2026.8.0
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import logging
import os
import tempfile
from importlib.metadata import version

from distributed import Client, LocalCluster

logging.disable(logging.CRITICAL)


def engine(roughness, folder, fails_first=False):
    """A run of a model: leaves a file in a folder and returns how many runs there were before."""
    before = len(os.listdir(folder))
    with open(os.path.join(folder, f"run{before}"), "w"):
        pass
    if fails_first and before == 0:
        raise OSError("licence server busy")
    return before


if __name__ == "__main__":
    folders = [tempfile.mkdtemp(dir=".") for _ in range(4)]
    local = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
    with LocalCluster(**local) as cluster, Client(cluster) as client:
        first = client.submit(engine, 0.03, folders[0], fails_first=True)
        error = str(first.exception())
        second = str(client.submit(engine, 0.03, folders[0], fails_first=True).exception())
        again = client.gather(client.submit(engine, 0.03, folders[1], fails_first=True, retries=2))
        equal = client.gather(client.map(engine, [0.03] * 5, [folders[2]] * 5))
        impure = client.gather(client.map(engine, [0.03] * 5, [folders[3]] * 5, pure=False))
    runs = [len(os.listdir(folder)) for folder in folders]
    print(f"distributed {version('distributed')}: a run that fails once is submitted twice; five equal runs are mapped")
    print("expected: two runs, the second of which succeeds; five runs")
    print(f"seen: {runs[0]} run, errors {error!r} and {second!r}; {runs[2]} run for {equal}")
    print(f"seen: with retries {runs[1]} runs, with pure=False {runs[3]} runs for {impure}")
    assert again == 1 and runs[1] == 2 and sorted(impure) == [0, 1, 2, 3, 4]
    assert runs[0] == 1 and second == error, "the behaviour has changed"
    assert runs[2] == 1 and equal == [0] * 5, "the behaviour has changed"
PYTHON
