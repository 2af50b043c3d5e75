"""What it costs to use other machines, and what many members need: `python tests/studies/scale.py [--many N]`.

Two workers on this machine beside two processes of it; bytes that travel for each member; and, with --many, the peak of
memory and the time of N members of a small case, while another process reads the growing file.
"""

import argparse
import pickle
import resource
import subprocess
import sys
import tempfile
import time
from contextvars import copy_context
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # where `reach` lies

import numpy as np
from reach import COARSE, write_reach

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.case.parameter_space import sobol_sample
from vegglue.cluster import on_cluster
from vegglue.flow.status import FAILED, members_with
from vegglue.inference.solve_ensemble import solve_chunk, solve_ensemble, starts_and_chunks
from vegglue.measurements.observations import read_observations
from vegglue.results.result_files import read_ensemble

# Members that are timed on the brook: seconds of work. And on cells of half the size.
TIMED, FINE = 32768, ("cell: [1.0, 0.5]", "cell: [0.25, 0.1875]")
# Each is timed so often, in turns, and the shortest time counts: others use the machine too.
TURNS = 3
SOLVED = 16
MEGABYTE = 1e6
# Looks at the growing file until it is gone: how often it could be read, and how many chunks were finished then.
READER = """
import sys, time
from pathlib import Path
import h5py
path, looks, refused, most = Path(sys.argv[1]), 0, 0, 0
while not path.exists():
    time.sleep(0.05)
while path.exists():
    try:
        with h5py.File(path, "r", locking=False) as file:
            finished = file["progress/finished"][:]
            looks, most = looks + 1, max(most, int(finished.sum()))
    except OSError:
        refused += 1
    time.sleep(0.5)
print(f"a reader beside it looked {looks + refused} times, was refused {refused} times, "
      f"and last saw {most} of {finished.size} chunks")
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--many", type=int, help="members of the small case in one file, with one process")
    given = parser.parse_args()
    if given.many is None:
        spread()
    else:
        many(given.many)


def brook(folder: Path, cell: tuple[str, str], members: int):  # type: ignore[no-untyped-def]
    """The case of docs/own_case.md on other cells."""
    return load_case(write_reach(folder, cell, ("members: 1024", f"members: {members}")))


def spread() -> None:
    """Two workers against two processes, and what travels."""
    with tempfile.TemporaryDirectory() as folder:
        cases = [brook(Path(folder), COARSE, TIMED), brook(Path(folder), FINE, TIMED // 8)]
        for case in cases:
            travels(case)
            beside(case, Path(folder))


def beside(case, folder: Path) -> None:  # type: ignore[no-untyped-def]
    """Members a second of two processes here, and of two workers."""
    here, there, without = [], [], copy_context()
    with on_cluster("local:2"):
        for turn in range(1 + TURNS):
            pair = without.run(timed, case, folder), timed(case, folder)
            if turn:  # the first teaches everyone the loops
                here.append(pair[0])
                there.append(pair[1])
    print(
        f"  {case.simulate.members / min(here):,.0f} members a second with two processes, "
        f"{case.simulate.members / min(there):,.0f} with two workers: {100 * min(here) / min(there):.0f} %"
    )


def timed(case, folder: Path) -> float:  # type: ignore[no-untyped-def]
    """Seconds from the first member to the last."""
    told, path = list[float](), folder / "ensemble.h5"
    solve_ensemble(case, read_observations(case), path, 2, lambda _: told.append(time.perf_counter()))
    path.unlink()
    return told[-1] - told[0]


def travels(case) -> None:  # type: ignore[no-untyped-def]
    """Bytes that a worker needs once, and that each member sends and brings back; what a member costs."""
    site, observations, sample = build_site(case), read_observations(case), sobol_sample(case)
    start_from, chunks = starts_and_chunks(case, site, sample.points)
    few = sample.take(chunks[0][:SOLVED])
    solve_chunk(case, site, observations, few, start_from)
    began = time.process_time()
    rows = solve_chunk(case, site, observations, few, start_from)
    cost = (time.process_time() - began) / SOLVED
    once = len(pickle.dumps(partial(solve_chunk, case, site, observations, start_from=start_from)))
    there, back = len(pickle.dumps(few)) / SOLVED, len(pickle.dumps(rows)) / SOLVED
    nx, ny = site.bed.shape
    print(
        f"{case.name}, {nx} x {ny} cells, {case.simulate.members:,} members: {1000 * cost:.1f} ms a member; once to "
        f"each worker {once / MEGABYTE:.1f} MB; for each member {there:.0f} bytes there and {back:.0f} back"
    )


def many(members: int) -> None:
    """Peak of memory and time of one process, and a reader of the growing file beside it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        case, path = brook(folder, COARSE, members), folder / "ensemble.h5"
        told = list[int]()
        with subprocess.Popen(
            [sys.executable, "-c", READER, f"{path}.part"], stdout=subprocess.PIPE, text=True
        ) as reader:
            began, worked = time.perf_counter(), time.process_time()
            solve_ensemble(case, read_observations(case), path, 1, lambda one: told.append(one.done))
            seconds, worked = time.perf_counter() - began, time.process_time() - worked
            said, _ = reader.communicate()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # Linux counts kilobytes
        found = read_ensemble(path)
        print(
            f"{members:,} members: {seconds:.0f} s, of them {worked:.0f} s of one core; at most {peak:.0f} MB; a file "
            f"of {path.stat().st_size / MEGABYTE:.0f} MB; {members_with(found.status, FAILED)} failed; {said.strip()}; "
            f"largest mass error {np.nanmax(found.mass_error):.0e}"
        )


if __name__ == "__main__":
    main()
