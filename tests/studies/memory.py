"""Memory of large ensembles, workers included: `python tests/studies/memory.py`, a part of `make bench`.

What the command and all processes that it began hold together: pages that they share are counted once (proportional
set size, /proc/PID/smaps_rollup, Linux only), looked at EVERY seconds while `vegglue simulate` runs.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # where `reach` lies

from reach import COARSE, ENVIRONMENT, command, write_reach

CONFIG = Path(__file__).parents[2] / "configs" / "d3a.yaml"
# Seconds between looks: a chunk of members takes a second and more.
EVERY = 0.5
MANY = 100_000
GIGABYTE = 1e9


def main() -> None:
    if not Path("/proc/self/smaps_rollup").exists():
        print("memory of workers: not measured, for it is read from Linux's /proc")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small = write_reach(folder, COARSE, ("members: 1024", f"members: {MANY}"))
        for words, config in (
            (f"{MANY:,} members of the brook", small),
            ("5,000 members of d3a, 1142 x 40 cells", CONFIG),
        ):
            told(words, command("simulate", config, "--quiet", "--runs", folder / "runs"))


def told(words: str, arguments: list[str]) -> None:
    """The largest sum over all processes, and how much of it the workers hold then."""
    began, most, of_workers, processes = time.perf_counter(), 0, 0, 0
    with subprocess.Popen(arguments, env=ENVIRONMENT, stdout=subprocess.DEVNULL) as running:
        while running.poll() is None:
            held = {pid: proportional(pid) for pid in tree(running.pid)}
            if sum(held.values()) > most:
                most, processes = sum(held.values()), len(held)
                of_workers = most - held[running.pid]
            time.sleep(EVERY)
    assert running.returncode == 0, f"{arguments} ended with {running.returncode}"
    print(
        f"{words}: at most {most / GIGABYTE:.2f} GB in {processes} processes, {of_workers / GIGABYTE:.2f} GB of it in "
        f"those that the command began; {time.perf_counter() - began:.0f} s",
        flush=True,
    )


def tree(pid: int) -> list[int]:
    """A process and all below it."""
    children = list[int]()
    for task in read(lambda: [str(one) for one in Path(f"/proc/{pid}/task").iterdir()]):
        children += map(int, read(partial(words_of, Path(task) / "children")))
    return [pid, *(one for child in children for one in tree(child))]


def words_of(path: Path) -> list[str]:
    return path.read_text().split()


def proportional(pid: int) -> int:
    """Proportional set size [bytes], 0 of a process that has ended."""
    words = read(partial(words_of, Path(f"/proc/{pid}/smaps_rollup")))
    return 1024 * sum(int(words[k + 1]) for k, word in enumerate(words) if word == "Pss:")


def read(what: Callable[[], list[str]]) -> list[str]:
    """What is read of a process, nothing when it has ended."""
    try:
        return what()
    except (FileNotFoundError, ProcessLookupError):
        return []


if __name__ == "__main__":
    main()
