"""What wide sites cost: `python tests/studies/wide.py FOLDER [--beside COMMAND] [--cells ..]`, a part of `make bench`.

A natural reach of `shared/cases` beside the checkout is imported on cells of several sizes and diagnosed with one job:
wall time, processor time, peak of memory and verdict, of this build and of another one, whose `vegglue` is COMMAND.
What FOLDER has is not computed again: a study that was stopped goes on.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

CASES = Path(__file__).parents[3] / "shared" / "cases"
REACH = "river-a"
# Cells [m]: as `import` makes them, and ever finer ones.
CELLS: dict[str, tuple[float, float] | None] = {
    "import": None, "180 x 75": (0.5, 0.2), "360 x 150": (0.25, 0.1), "720 x 300": (0.125, 0.05),
}  # fmt: skip
SMALL = ("import", "180 x 75")
HERE = str(Path(sys.executable).parent / "vegglue")
GIGABYTE = 1e9


def main(folder: Path, beside: str | None, sizes: tuple[str, ...] = tuple(CELLS)) -> None:
    if not (CASES / REACH).is_dir():
        print("wide sites: not measured, there is no folder `shared/cases` beside the repository")
        return
    for size in sizes:
        found = {
            build: measured(folder, build, command, size)
            for build, command in (("here", HERE), ("beside", beside))
            if command
        }
        for build, one in found.items():
            spent = f"{one['cpu']:.1f} s of a core, {one['wall']:.1f} s, {one['peak']:.2f} GB"
            print(f"{size}, {build}: {spent}, {one['said']}", flush=True)
        if len(found) == 2:
            here, other = found["here"], found["beside"]
            print(
                f"  {here['cpu'] / other['cpu']:.2f} of the time, {here['peak'] / other['peak']:.2f} of the memory",
                flush=True,
            )


def measured(folder: Path, build: str, command: str, size: str) -> dict[str, Any]:
    """One diagnosis, kept in a file; the peak is that of the process and of what it waited for."""
    path = folder / f"{size.replace(' ', '')}-{build}.json"
    if path.exists():
        kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return kept
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        place, cell = Path(name), CELLS[size]
        site = place / "site"
        shutil.copytree(CASES / REACH, site, ignore=shutil.ignore_patterns("answer*"))
        if cell is not None:
            described = site / "site.yaml"
            described.chmod(0o600)
            described.write_text(described.read_text() + f"  cell: [{cell[0]}, {cell[1]}]\n")
        own = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        subprocess.run([command, "import", "site", "--to", "c.yaml", "--quiet"], cwd=place, env=own, check=True)
        began = time.perf_counter()
        with (place / "out.json").open("w") as out:
            running = subprocess.Popen(
                [command, "diagnose", "c.yaml", "--json", "--jobs", "1"], cwd=place, env=own, stdout=out
            )
            _, status, used = os.wait4(running.pid, 0)
        running.returncode = os.waitstatus_to_exitcode(status)
        wall, found = time.perf_counter() - began, json.loads((place / "out.json").read_text() or "{}")
    one = {
        "wall": wall, "cpu": used.ru_utime + used.ru_stime, "peak": 1024 * used.ru_maxrss / GIGABYTE,
        "said": f"{found.get('verdict')} {found.get('set')}", "code": running.returncode, "diagnosis": found,
    }  # fmt: skip
    if running.returncode == 0:
        path.write_text(json.dumps(one), encoding="utf-8")
    return one


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--beside")
    arguments.add_argument("--cells", nargs="+", choices=list(CELLS), default=list(CELLS))
    given = arguments.parse_args()
    main(given.folder, given.beside, tuple(given.cells))
