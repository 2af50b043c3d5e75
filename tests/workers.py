"""A Dask scheduler and workers in processes of their own on this machine, on ports the system chooses."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from reach import ENVIRONMENT, ROOT

HERE = ENVIRONMENT | {
    "PYTHONPATH": os.pathsep.join([str(ROOT), ENVIRONMENT.get("PYTHONPATH", "")]),
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "10s",
}
LONGEST_START = 60.0
WORKER = "from distributed.cli.dask_worker import main; main()"
SCHEDULER = "from distributed.cli.dask_scheduler import main; main()"


@dataclass(frozen=True)
class Workers:
    """A scheduler, and those of its workers that were not ended."""

    address: str
    folder: Path
    processes: list["subprocess.Popen[bytes]"]  # the scheduler first

    def begin(self, before: str = "") -> None:
        """One more worker, of one thread; before: Python that it runs first. It may take seconds until it serves."""
        of_its_own = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        local = ("--local-directory", self.folder / "scratch")
        self.processes.append(_begun(self.folder, before + WORKER, self.address, *of_its_own, *local))

    def kill(self) -> None:
        """Ends the oldest worker as the system would, without a word."""
        _end(self.processes.pop(1))

    def kill_scheduler(self) -> None:
        _end(self.processes.pop(0))


@contextmanager
def workers_in(folder: Path, count: int) -> Iterator[Workers]:
    """A scheduler with workers, all ended on the way out."""
    at = folder / "scheduler.json"
    options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", at)
    begun = [_begun(folder, SCHEDULER, *options)]
    try:
        workers = Workers(_address(at), folder, begun)
        for _ in range(count):
            workers.begin()
        if count:
            _wait_for(workers.address, count)
        yield workers
    finally:
        for process in begun:
            _end(process)


def _wait_for(address: str, count: int) -> None:
    """Until so many serve: what a test asks of all would be asked of none before."""
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(count, timeout=LONGEST_START)


def _end(process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    process.wait()


def _begun(folder: Path, program: str, *arguments: object) -> "subprocess.Popen[bytes]":
    with (folder / "workers.log").open("ab") as log:
        command = [sys.executable, "-c", program, *map(str, arguments)]
        return subprocess.Popen(command, cwd=folder, env=HERE, stdout=log, stderr=log)


def _address(file: Path) -> str:
    began = time.monotonic()
    while time.monotonic() - began < LONGEST_START:
        try:
            return str(json.loads(file.read_text(encoding="utf-8"))["address"])
        except (OSError, ValueError):  # not there yet, or half written
            time.sleep(0.05)
    raise TimeoutError(f"no scheduler after {LONGEST_START:g} s; see {file.with_name('workers.log')}")
