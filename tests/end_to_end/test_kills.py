"""A share of what `make faults` does: commands killed at random moments, which then finish with the same bits."""

import os
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from kills import COMMANDS, Step, disturbed, load_all, same, steps
from reach import COARSE, begin, vegglue, write_reach

KILLS = 14
# Quick ones of each kind: configs among files of a user, a picture, an ensemble that grows, a result of two files, many
# files in a folder, a folder.
SOME = [
    command
    for command in COMMANDS
    if command[0] in ("import", "check", "twin", "simulate", "infer", "export", "new") and command[-1] != "2"
]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> list[Step]:
    folder = tmp_path_factory.mktemp("kills")
    load_all(folder / "loaded", SOME)
    return steps(folder / "work", folder, SOME)


@pytest.mark.slow
def test_a_killed_command_finishes_with_the_same_bits(undisturbed: list[Step], tmp_path: Path) -> None:
    work = undisturbed[0].before.parent / "work"
    shares = np.random.default_rng(7).uniform(0.0, 1.0, KILLS)
    in_time = [disturbed(undisturbed[number % len(SOME)], work, share) for number, share in enumerate(shares)]
    assert any(in_time)  # how many come before the end is a matter of the machine's other work


def workers_of(process: int) -> list[int]:
    """Processes that solve members for another one, as the system lists them."""
    found = subprocess.run(
        ["ps", "-ww", "-o", "pid=,args=", "--ppid", str(process)], capture_output=True, text=True, check=True
    )
    return [int(line.split()[0]) for line in found.stdout.splitlines() if "LokyProcess" in line]


def finished_chunks(part: Path) -> int:
    try:
        with h5py.File(part, locking=False) as file:
            return int(file["progress/finished"][:].sum())
    except (OSError, KeyError):
        return 0


@pytest.mark.slow
def test_a_killed_worker_loses_no_finished_member(tmp_path: Path) -> None:
    """Of a command on two processes: one sentence, and then the bits of one that nothing disturbed, on one process."""
    for name in ("disturbed", "undisturbed"):
        (tmp_path / name).mkdir()
        write_reach(tmp_path / name, COARSE)
    here = tmp_path / "disturbed"
    begun = begin(here, "simulate", "brook.yaml", "--jobs", "2")
    until = time.monotonic() + 120.0
    while not finished_chunks(here / "runs/brook/ensemble.h5.part") and time.monotonic() < until:
        time.sleep(0.02)
    workers = workers_of(begun.pid)
    try:
        os.kill(workers[0], signal.SIGKILL)
    finally:
        _, said = begun.communicate(timeout=120.0)
    assert begun.returncode == 3, said
    assert said.splitlines() == [
        "A process that solved members was killed, most likely for want of memory; what was finished is kept: run the "
        "same command again, with fewer --jobs if this repeats."
    ]
    kept = finished_chunks(here / "runs/brook/ensemble.h5.part")
    assert kept >= 1
    vegglue(here, "simulate", "brook.yaml", "--jobs", "2")
    vegglue(tmp_path / "undisturbed", "simulate", "brook.yaml", "--jobs", "1")
    assert same(here / "runs/brook/ensemble.h5", tmp_path / "undisturbed/runs/brook/ensemble.h5")
