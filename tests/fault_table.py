"""What can go wrong around a command, what the user then sees and what is kept: made to happen by the tests.

`python tests/fault_table.py` writes docs/faults.md from this table and from the kills that tests/kills.py has counted.
"""

import errno
import fcntl
import json
import os
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import h5py
import numpy as np

from vegglue.case.config import load_case
from vegglue.inference import solve_ensemble
from vegglue.measurements.observations import read_observations
from vegglue.progress import Progress

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "faults.md"
KILLS = ROOT / "data" / "faults" / "kills.json"
RUN = Path("runs/brook")
ENSEMBLE, PART = RUN / "ensemble.h5", RUN / "ensemble.h5.part"
NOTHING = ""
Trouble = Callable[[Path], AbstractContextManager[Any]]


@dataclass(frozen=True)
class Fault:
    """A fault, and the command it meets, in words; the exit code and the sentence (... for what differs each time).

    kept: what is kept, in words. trouble: makes it happen in the folder of a user for as long as it is entered. ready:
    whether an ensemble and a posterior are there already. solves: chunks of members, of four, that the command and the
    next try solve together.
    """

    what: str
    command: str
    code: int
    sees: str
    kept: str
    trouble: Trouble
    solves: int
    ready: bool = True


def failing(owner: Any, name: str, error: BaseException, after: int = 0) -> Trouble:
    """A function that fails, from some call on."""

    @contextmanager
    def trouble(folder: Path) -> Iterator[None]:
        real, calls = getattr(owner, name), []

        def fails(*arguments: Any, **more: Any) -> Any:
            calls.append(1)
            if len(calls) > after:
                raise error
            return real(*arguments, **more)

        with patch.object(owner, name, fails):
            yield

    return trouble


def done_to(name: Path | str, change: Callable[[Path], Any]) -> Trouble:
    """Something done once to a file of the user's folder."""

    @contextmanager
    def trouble(folder: Path) -> Iterator[None]:
        change(folder / name)
        yield

    return trouble


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def leading_out(path: Path) -> None:
    """The predictions in another file, the very same: whoever followed the link would not notice."""
    with h5py.File(path, "r+") as file, h5py.File(path.with_name("other.h5"), "w") as other:
        other["x"] = file["members/prediction"][...]
        del file["members/prediction"]
        file["members/prediction"] = h5py.ExternalLink("other.h5", "x")


def damaged_member(path: Path) -> None:
    """The prediction of one finished member of an unfinished run."""
    with h5py.File(path) as file:
        dataset = file["members/prediction"]
        first = int(np.flatnonzero(np.isfinite(dataset[:, 0]))[0])
        place = dataset.id.get_offset() + first * dataset.nbytes // len(dataset)
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(content)


def as_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def without_solved(path: Path) -> None:
    """A file where the folder of the run would be."""
    path.parent.mkdir(exist_ok=True)
    path.write_text("mine")


@contextmanager
def locked(path: Path) -> Iterator[None]:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


@contextmanager
def half_solved(folder: Path, change: Callable[[Path], Any] = lambda path: None) -> Iterator[None]:
    """Two of four chunks are there from a run that was stopped."""
    case = load_case(folder / "brook.yaml")

    def stop(progress: Progress) -> None:
        if progress.done >= case.simulate.members // 2:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        solve_ensemble.solve_ensemble(case, read_observations(case), folder / ENSEMBLE, 1, stop)
    change(folder / PART)
    yield


def replaced(old: str, new: str) -> Callable[[Path], Any]:
    return lambda path: path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


FULL, READ_ONLY = OSError(errno.ENOSPC, "No space left on device"), OSError(errno.EROFS, "Read-only file system")
MAKE_ROOM = "make room and run it again."
GO_ON = "what was written before is whole: make room, then run the same command again."
AGAIN = "remove it and run the step that makes it again."
BEFORE, OLD, CHUNKS = "what was there before", "the older result", "every finished chunk; the rest is solved next time"
HEADING = "| what happens | command | code | what the user sees | what is kept | chunks solved |"
FAULTS = (
    Fault("full disk, from the start", "simulate", 3, f"{PART}: the disk is full; {GO_ON}", BEFORE,
          failing(os, "fsync", FULL), 4, ready=False),
    Fault("full disk, half-way", "simulate", 3, f"{PART}: the disk is full; {GO_ON}", CHUNKS,
          failing(os, "fsync", FULL, after=6), 5, ready=False),
    Fault("full disk", "infer", 3, f"{RUN}/posterior.h5: the disk is full; {GO_ON}", OLD,
          failing(os, "fsync", FULL), 0),
    Fault("full disk", "report", 3, f"{RUN}/figures/...: the disk is full; {MAKE_ROOM}", OLD,
          failing(os, "fsync", FULL), 0),
    Fault("full disk", "check", 3, f"{RUN}/channel.png: the disk is full; {MAKE_ROOM}", OLD,
          failing(os, "fsync", FULL), 0),
    Fault("read-only folder", "simulate", 3,
          f"{RUN}: cannot be written (Read-only file system); make the folder runs writable, then run it again.",
          BEFORE, failing(Path, "mkdir", READ_ONLY), 4, ready=False),
    Fault("a file where the run's folder would be", "check", 3,
          f"{RUN}: cannot be written (File exists); expected a folder that can be made there; give another one by "
          "--runs.", BEFORE, done_to(RUN, without_solved), 4, ready=False),
    Fault("a folder where the ensemble would be", "simulate", 3,
          f"{ENSEMBLE}: expected a file or nothing, found a folder; move it away.", BEFORE,
          done_to(ENSEMBLE, as_folder), 4),
    Fault("a worker is killed, or runs out of memory", "simulate", 3,
          "A process that solved members was killed, most likely for want of memory; what was finished is kept: run "
          "the same command again, with fewer --jobs if this repeats.", CHUNKS,
          failing(solve_ensemble, "solve_in_experiment", BrokenProcessPool(), after=2), 4, ready=False),
    Fault("no memory left", "simulate", 3,
          "The memory is full; what was finished is kept: run it again with fewer --jobs, or a coarser grid.", CHUNKS,
          failing(solve_ensemble, "solve_in_experiment", MemoryError(), after=2), 4, ready=False),
    Fault("two runs of one name", "simulate", 3, f"{RUN} is in use by ...; wait for it to end, or stop it.",
          "what the first one does", lambda folder: locked(folder / RUN / ".lock"), 4, ready=False),
    Fault("the ensemble is cut short", "infer", 3, f"{ENSEMBLE}: cannot be opened (...); {AGAIN}", OLD,
          done_to(ENSEMBLE, cut_short), 4),
    Fault("one bit of the ensemble flipped", "infer", 3,
          f"{ENSEMBLE}: is broken, it has changed since it was written; {AGAIN}", OLD, done_to(ENSEMBLE, flipped), 4),
    Fault("one bit of the ensemble flipped", "simulate", 0, NOTHING, "nothing of it: all members are solved again",
          done_to(ENSEMBLE, flipped), 4),
    Fault("one bit of the posterior flipped", "report", 3,
          f"{RUN}/posterior.h5: is broken, it has changed since it was written; {AGAIN}", OLD,
          done_to(RUN / "posterior.h5", flipped), 0),
    Fault("a foreign file that leads to another one", "infer", 3,
          f"{ENSEMBLE}: members/prediction is a link, which vegglue never writes, and is not read; {AGAIN}",
          "every other file: no link is followed", done_to(ENSEMBLE, leading_out), 4),
    Fault("a stopped run", "simulate", 0, NOTHING, CHUNKS, half_solved, 2, ready=False),
    Fault("a stopped run, one bit of a member flipped", "simulate", 0, NOTHING,
          "every other chunk; that one is solved again", lambda folder: half_solved(folder, damaged_member),
          3, ready=False),
    Fault("a stopped run whose file is cut short", "simulate", 0, NOTHING,
          "the broken file, as ensemble.h5.part.old; all members are solved again",
          lambda folder: half_solved(folder, cut_short), 4, ready=False),
    Fault("a stopped run whose file leads to another one", "simulate", 0, NOTHING,
          "every other file; the foreign one as ensemble.h5.part.old", lambda folder: half_solved(folder, leading_out),
          4, ready=False),
    Fault("a stopped run", "infer", 2,
          f"{ENSEMBLE}: found only a part of the members; run `vegglue simulate brook.yaml` to solve the rest.",
          CHUNKS, half_solved, 2, ready=False),
    Fault("the clock jumps by twenty years", "simulate", 0, NOTHING, "everything: no time of a file is looked at",
          done_to(ENSEMBLE, lambda path: os.utime(path, (2.5e9, 2.5e9))), 0),
    Fault("the config was changed", "infer", 2, f"{ENSEMBLE}: expected config hash ..., found ...: the config, "
          "--members, a file it names or vegglue changed since this was made; run `vegglue simulate brook.yaml` again.",
          OLD,
          done_to("brook.yaml", replaced("high: 0.10", "high: 0.12")), 0),
    Fault("a data file was changed", "report", 2, f"{ENSEMBLE}: expected config hash ..., found ...: the config, "
          "--members, a file it names or vegglue changed since this was made; run `vegglue simulate brook.yaml` again.",
          OLD,
          done_to("velocities.csv", replaced("0.436", "0.437")), 0),
    Fault("fewer members than are there", "simulate --members 8", 2,
          f"{ENSEMBLE}: holds 256 members of this case, which 8 would replace; ask for --members 256, give another "
          "folder by --runs, or add --force.", OLD, lambda folder: nullcontext(), 0),
)  # fmt: skip


def rows() -> str:
    """The table of the page."""
    lines = [HEADING, "|---|---|---:|---|---|---:|"]
    for one in FAULTS:
        lines.append(
            f"| {one.what} | `{one.command}` | {one.code} | {one.sees or 'nothing of it'} | {one.kept} | {one.solves} |"
        )
    return "\n".join(lines)


def kills() -> str:
    """What came of the kills, by command."""
    table = json.loads(KILLS.read_text(encoding="utf-8"))
    total, in_time = (sum(one[key] for one in table.values()) for key in ("kills", "in_time"))
    lines = [
        f"{total} kills, {in_time} of them before the command had ended. Every time the same command then finished,",
        "and every file of the user's folder had the bits of an undisturbed run, but for the seconds members took.",
        "", "| command | kills | before its end |", "|---|---:|---:|",
    ]  # fmt: skip
    return "\n".join([*lines, *(f"| `{name}` | {one['kills']} | {one['in_time']} |" for name, one in table.items())])


def page() -> str:
    """The whole page."""
    return TEXT.format(rows=rows(), kills=kills())


TEXT = """# When something goes wrong

This page is made by the tests: `tests/end_to_end/test_fault_table.py` makes each of these faults happen, reads what is
said, and then gives the same command once more, undisturbed. `python tests/fault_table.py` writes the page.

## Faults and what comes of them

Codes are those of [the commands](commands.md#what-is-kept-and-how-a-command-ends). Wherever a command can go on
afterwards, its numbers have the bits of a run that nothing disturbed. The ensemble has four chunks of members: the last
column counts those that the command and the next `simulate` solve together.

{rows}

A worker that hangs cannot be told from one that is slow: the command waits. Stop it by Ctrl-C: nothing
finished is lost.

## Kills

`make faults` kills every command with signal 9 at random moments of its time; `make test` has a share of it.

{kills}

## How it is done

- A file appears under its name only when it is whole and on the disk. It grows beside that place with `.new` at its
  end.
- Whole results end with a line that holds the SHA-256 of all bytes before it. Other readers of HDF5 do not see it. A
  result of an older version, or that another program opened to write, has none.
- Every result, and every part file of a stopped run, is read by a process of its own first: the HDF5 library reads some
  damaged files in circles, and anyone can put the right digest behind one.
- What is read is held against the shapes and types it was stored with, before anyone computes with it.
- One ensemble at a time is written in a folder: a lock of the operating system says who, and a second `simulate` or
  `run` that needs it is refused. A diagnosis, a posterior or a page is put in place whole when it is done: of two at
  once both end well, and the later one stays. Some network disks are mounted with locks that do not reach other
  machines; of two runs the first then stops with a sentence, and the second is whole.
- Members are kept chunk by chunk in `ensemble.h5.part`, each chunk with a checksum. The next run lays the file out
  anew, and takes over the chunks whose checksum is right.
- Results hold no links and no data in other files. A file that has any is refused, and a soft or hard link in the
  folder of a run is replaced, not followed. So a run folder may be taken from others.
- `import`, `extend` and `twin` write among your files. Their configs end with checksums of what was written: what you
  edited or made yourself is replaced with `--force` only.

## Following a run

The growing file may be read at any time, also by other programs and with HDF5's locks on. `progress/finished` says
which chunks are there; the rows of the others are NaN. Open it, read, and close it again:

```python
import h5py

with h5py.File("runs/brook/ensemble.h5.part") as file:
    members = file["members"]
    solved = members["status"][:] >= 0
    print(solved.sum(), "of", solved.size, "members", members["prediction"][:][solved].mean(axis=0))
```
"""


def main() -> None:
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
