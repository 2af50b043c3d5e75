"""Scripts of make targets find their modules, begun as the Makefile begins them."""

import subprocess
import sys
from pathlib import Path

import pytest

STUDIES = Path(__file__).parent
NAMES = (
    "bench", "beside", "blind", "blind_lengths", "confluence", "drawn_sites", "fuzz", "growth", "laws", "law_alarms",
    "natural", "peer", "scale", "sensitivity", "surrogate", "loop", "startup", "wide",
)  # fmt: skip
# One process reads all, as imports take seconds; the last name on standard output is the one that failed.
READ = """
import runpy, sys
folder, *names = sys.argv[1:]
for name in names:
    print(name, flush=True)
    path, sys.path[:] = sys.path[1:], [folder, *sys.path[1:]]
    runpy.run_path(f"{folder}/{name}.py")
    sys.path[:] = ["", *path]
"""


@pytest.mark.slow
def test_scripts_are_read_by_themselves() -> None:
    done = subprocess.run(
        [sys.executable, "-c", READ, str(STUDIES), *NAMES], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{done.stdout.split()[-1]}: {done.stderr}"
