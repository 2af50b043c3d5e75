"""This build and another one, by turns in one run: `make bench BESIDE=CHECKOUT`, or

    python tests/studies/beside.py CHECKOUT [--turns 3] [--only first run members ensemble infer] [--jobs -1]

For each work the shortest of all turns, by the clock and of the processor, and the ratio of this build to the other.
States figures, asserts none. `first` is what the first `diagnose` of a machine takes longer than the second.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).parents[2]
# The imported case: three experiments, a hidden effect.
OPEN_B = HERE / "data" / "open_cases" / "open-b"
WORDS = {
    "first": "first diagnose of open-b, beyond the second",
    "run": "run of open-b",
    "members": "5,000 members of configs/d3a.yaml",
    "ensemble": "256 members of open-b, 3 experiments",
    "infer": "infer of open-b to 1,000 effective draws",
}
Spent = tuple[float, float]


def main(checkout: Path, turns: int, works: list[str], jobs: int) -> None:
    builds = {"here": HERE, "beside": checkout.resolve()}
    with tempfile.TemporaryDirectory() as name:
        for build, source in builds.items():
            place = Path(name) / build
            place.mkdir()
            spent(source, place, place / "kept", "-m", "vegglue", "import", str(OPEN_B), "--to", "b.yaml", "--quiet")
            if set(works) - {"first"}:  # whose loops are then kept
                measured("run", source, place, "begin", jobs)
        for work in works:
            found: dict[str, list[Spent]] = {build: [] for build in builds}
            for turn in range(turns):
                order = list(builds) if turn % 2 else list(reversed(builds))
                for build in order:
                    found[build].append(measured(work, builds[build], Path(name) / build, f"{work}-{turn}", jobs))
            told(WORDS[work], found)


def told(words: str, found: dict[str, list[Spent]]) -> None:
    """The shortest of all turns: others use the machine too."""
    least = {build: [min(one) for one in zip(*turns, strict=True)] for build, turns in found.items()}
    for build, (wall, core) in least.items():
        every = ", ".join(f"{one[0]:.1f}" for one in found[build])
        print(f"{words}, {build}: {wall:.1f} s ({every}), {core:.1f} s of the processor")
    wall, core = (here / other for here, other in zip(least["here"], least["beside"], strict=True))
    print(f"  {wall:.2f} of the time, {core:.2f} of that of the processor", flush=True)


def measured(work: str, source: Path, place: Path, runs: str, jobs: int) -> Spent:
    """Seconds of one work by one build, and those of the processor."""
    kept, case = place / "kept", ["b.yaml", "--runs", runs, "--jobs", str(jobs), "--quiet"]
    if work == "first":
        fresh = place / f"fresh-{runs}"
        cold, warm = (
            spent(source, place, fresh, "-m", "vegglue", "diagnose", "b.yaml", "--runs", f"{runs}-{state}",
                  "--jobs", str(jobs), "--quiet")
            for state in ("cold", "warm")
        )  # fmt: skip
        return cold[0] - warm[0], cold[1] - warm[1]
    if work == "members":
        return spent(source, place, kept, "-m", "vegglue", "simulate", str(source / "configs" / "d3a.yaml"), *case[1:])
    if work == "ensemble":
        return spent(source, place, kept, "-m", "vegglue", "simulate", *case, "--members", "256")
    return spent(source, place, kept, "-m", "vegglue", work, *case)


def spent(source: Path, place: Path, kept: Path, *arguments: str) -> Spent:
    """Seconds until an interpreter with these arguments ends, and those of the processor, by a build."""
    own = {
        "PYTHONPATH": str(source), "NUMBA_CACHE_DIR": str(kept), "MPLBACKEND": "agg",
        "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1",
    }  # fmt: skip
    kept.mkdir(exist_ok=True)
    before, began = _processor(), time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=place, env=os.environ | own, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began, _processor() - before


def _processor() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--only", nargs="+", choices=list(WORDS), default=list(WORDS))
    parser.add_argument("--jobs", type=int, default=-1)
    given = parser.parse_args()
    main(given.checkout, given.turns, given.only, given.jobs)
