"""What can go wrong around a command, its exit code, and what is kept: made to happen by the tests.

`python tests/fault_table.py` writes docs/faults.md from this table and from the kills that tests/kills.py has counted.
"""

import errno
import json
import os
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any
from unittest.mock import patch

import h5py
import numpy as np

from vegglue.case.config import load_case
from vegglue.inference import solve_ensemble
from vegglue.measurements.observations import read_observations
from vegglue.progress import Progress
from vegglue.whole_files import lock

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "faults.md"
KILLS = ROOT / "data" / "faults" / "kills.json"
RUN = Path("runs/brook")
ENSEMBLE, PART = RUN / "ensemble.h5", RUN / "ensemble.h5.part"
NOTHING = ""
Trouble = Callable[[Path], AbstractContextManager[Any]]


@dataclass(frozen=True)
class Fault:
    """A fault, and the command it meets, in words; the exit code, and what the message names (nothing: no message).

    kept: what is kept, in words. trouble: makes it happen in the folder of a user for as long as it is entered. ready:
    whether an ensemble and a posterior are there already. solves: chunks of members, of four, that the command and the
    next try solve together.
    """

    what: str
    command: str
    code: int
    names: str
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
        lock(file.fileno())
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
SIMULATE = "vegglue simulate brook.yaml"
BEFORE, OLD, CHUNKS = "what was there before", "the older result", "every finished chunk"
HEADING = "| exit code | what is kept | after |\n|---:|---|---|"
FAULTS = (
    Fault("full disk, from the start", "simulate", 3, f"{PART}", BEFORE, failing(os, "fsync", FULL), 4, ready=False),
    Fault("full disk, half-way", "simulate", 3, f"{PART}", CHUNKS, failing(os, "fsync", FULL, after=6), 5, ready=False),
    Fault("full disk", "infer", 3, f"{RUN}/posterior.h5", OLD, failing(os, "fsync", FULL), 0),
    Fault("full disk", "report", 3, f"{RUN}/figures/", OLD, failing(os, "fsync", FULL), 0),
    Fault("full disk", "check", 3, f"{RUN}/channel.png", OLD, failing(os, "fsync", FULL), 0),
    Fault("read-only folder", "simulate", 3, f"{RUN}", BEFORE, failing(Path, "mkdir", READ_ONLY), 4, ready=False),
    Fault("a file in place of the run's folder", "check", 3, f"{RUN}", BEFORE, done_to(RUN, without_solved), 4,
          ready=False),
    Fault("a folder in place of the ensemble", "simulate", 3, f"{ENSEMBLE}", BEFORE, done_to(ENSEMBLE, as_folder), 4),
    Fault("a worker is killed, or out of memory", "simulate", 3, "--jobs", CHUNKS,
          failing(solve_ensemble, "solve_in_experiment", BrokenProcessPool(), after=2), 4, ready=False),
    Fault("no memory left", "simulate", 3, "--jobs", CHUNKS,
          failing(solve_ensemble, "solve_in_experiment", MemoryError(), after=2), 4, ready=False),
    Fault("two runs of one name", "simulate", 3, f"{RUN}", "what the first one does",
          lambda folder: locked(folder / RUN / ".lock"), 4, ready=False),
    Fault("the ensemble is cut short", "infer", 3, f"{ENSEMBLE}", OLD, done_to(ENSEMBLE, cut_short), 4),
    Fault("one bit of the ensemble flipped", "infer", 3, f"{ENSEMBLE}", OLD, done_to(ENSEMBLE, flipped), 4),
    Fault("one bit of the ensemble flipped", "simulate", 0, NOTHING, "nothing of it: all members are solved again",
          done_to(ENSEMBLE, flipped), 4),
    Fault("one bit of the posterior flipped", "report", 3, f"{RUN}/posterior.h5", OLD,
          done_to(RUN / "posterior.h5", flipped), 0),
    Fault("a foreign file that links to another", "infer", 3, f"{ENSEMBLE}", "every other file: no link is followed",
          done_to(ENSEMBLE, leading_out), 4),
    Fault("a stopped run", "simulate", 0, NOTHING, CHUNKS, half_solved, 2, ready=False),
    Fault("a stopped run with one bit of a member flipped", "simulate", 0, NOTHING, "every other chunk",
          lambda folder: half_solved(folder, damaged_member), 3, ready=False),
    Fault("a stopped run, its file cut short", "simulate", 0, NOTHING, "the broken file, as ensemble.h5.part.old",
          lambda folder: half_solved(folder, cut_short), 4, ready=False),
    Fault("a stopped run, its file links to another", "simulate", 0, NOTHING,
          "the foreign file, as ensemble.h5.part.old", lambda folder: half_solved(folder, leading_out), 4, ready=False),
    Fault("a stopped run", "infer", 2, SIMULATE, CHUNKS, half_solved, 2, ready=False),
    Fault("the clock jumps by twenty years", "simulate", 0, NOTHING, "everything: times of files do not count",
          done_to(ENSEMBLE, lambda path: os.utime(path, (2.5e9, 2.5e9))), 0),
    Fault("the config was changed", "infer", 2, SIMULATE, OLD,
          done_to("brook.yaml", replaced("high: 0.10", "high: 0.12")), 0),
    Fault("a data file was changed", "report", 2, SIMULATE, OLD, done_to("velocities.csv", replaced("0.436", "0.437")),
          0),
    Fault("fewer members than are there", "simulate --members 8", 2, "--members 256", OLD,
          lambda folder: nullcontext(), 0),
)  # fmt: skip


def rows() -> str:
    """The table of the page: faults by their outcome."""
    after: dict[tuple[int, str], dict[str, str]] = {}
    for one in FAULTS:
        faults = after.setdefault((one.code, one.kept), {})
        faults[one.what] = ", ".join([*filter(None, [faults.get(one.what)]), f"`{one.command}`"])
    lines = []
    for (code, kept), faults in sorted(after.items(), key=lambda one: one[0][0]):
        listed = "; ".join(f"{what} ({commands})" for what, commands in faults.items())
        lines.append(f"| {code} | {kept} | {listed} |")
    return "\n".join([HEADING, *lines])


def kills() -> str:
    """The outcome of the kills."""
    table = json.loads(KILLS.read_text(encoding="utf-8"))
    total, in_time = (sum(one[key] for one in table.values()) for key in ("kills", "in_time"))
    text = (
        "`make faults` kills every command with signal 9 at random moments. "
        f"{total} kills of {len(table)} commands (`data/faults/kills.json`), {in_time} of them before the command had "
        "ended. Every time the same command then finished, and every file had the bits of an undisturbed run, except "
        "for the seconds that members took."
    )
    return fill(text, 120, break_on_hyphens=False)


def page() -> str:
    """The whole page."""
    return TEXT.format(rows=rows(), kills=kills())


TEXT = """# Full disks, kills and damaged files

The tests cause each of these faults, and then run the same command again, undisturbed
(`tests/end_to_end/test_fault_table.py`).

## Faults and their outcome

With an [exit code](commands.md#what-is-kept-and-how-a-command-ends) other than 0, one sentence on standard error gives
the file, the fault, and the command that repairs it. Results that are continued have the bits of an undisturbed run.
Members are kept in chunks.

{rows}

If a worker hangs the command waits, as for a slow one: stop it with Ctrl-C; finished work is kept.

## Kills

{kills}

## Mechanisms

- A file appears under its name only when it is complete and on the disk.
- Results end with the SHA-256 of all bytes before it. A separate process reads every result first, because the HDF5
  library never finishes reading some damaged files.
- Members are kept chunk by chunk in `ensemble.h5.part`; the next run reuses the chunks whose checksum is right.
- A lock of the operating system allows one process at a time to write an ensemble. If locks of a network disk do not
  reach other machines, the first of two runs stops. Of two processes that write another result, the later one wins.
- A file with links or with data in other files is refused; a link in the folder of a run is replaced, not followed.

## Damaged files from others

Beside [the rules of tables](own_files.md#how-tables-are-read), `import` leaves out codes of gauging offices (Ice, Eqp,
-999999), and raw ensembles of a boat with a wrong checksum or size, cut short, or without bottom track or ranges. It
refuses velocities relative to the boat (reference NONE), a jump of the boat, missing-value codes in the site file,
stems and corners, damaged MATLAB files, files of another kind by how they begin, and files that unpack to more than
100 MB.

## Following a run

The growing file may be read at any time; rows that are not finished are NaN. Open it, read, and close it again:

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
