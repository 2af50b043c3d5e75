"""kill -9 at random moments of every command: the same command then finishes, with the bits of an undisturbed one.

`python tests/kills.py 208` kills so many times and keeps the outcome in data/faults/kills.json, for docs/faults.md.
"""

import argparse
import json
import math
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from reach import COARSE, write_reach

# Of the wall clock, or of who ran it: another one each time.
OF_THE_CLOCK = ("seconds",)
WITH_ERRORS = ("experiment: June}", "experiment: June, standard_error: 0.02}")
# So many members that there are four chunks of them, and a kill may come between.
CHANGES = (COARSE, ("members: 1024", "members: 256"), WITH_ERRORS)
TWO = ("--jobs", "2")
# In this order, each on what those before have left; what each writes among the user's files is part of the outcome.
Commands = Sequence[tuple[str, ...]]
COMMANDS: Commands = (
    ("import", "site"),
    ("check", "brook.yaml"),
    ("twin", "brook.yaml", "--to", "riddle", "--hide", "nothing"),
    ("simulate", "brook.yaml", "--jobs", "1"),
    ("infer", "brook.yaml", "--jobs", "1"),
    ("report", "brook.yaml"),
    ("overview", "brook.yaml"),
    ("diagnose", "brook.yaml", "--jobs", "1"),
    ("effects", "streamlining", "--config", "brook.yaml"),
    ("extend", "brook.yaml", "--add", "streamlining"),
    ("extend", "brook.yaml", "--auto", "--jobs", "1"),
    ("compare", "brook.yaml", "brook+streamlining.yaml", "--jobs", "1"),
    ("next", "brook.yaml", "--jobs", "1"),
    ("export", "brook.yaml"),
    ("new", "mill"),
    ("run", "brook.yaml", "--jobs", "1"),
    ("simulate", "brook.yaml", "--members", "512", *TWO),
)
# Kills of the slowest command.
FEWEST = 4
OUTCOME = Path(__file__).parents[1] / "data" / "faults" / "kills.json"


@dataclass(frozen=True)
class Step:
    """A command, the folder before and after it when nothing disturbs it, and how long it took [s]."""

    command: tuple[str, ...]
    before: Path
    after: Path
    seconds: float

    @property
    def name(self) -> str:
        jobs = f" {' '.join(TWO)}" if self.command[-2:] == TWO else ""
        return " ".join([self.command[0], *(word for word in self.command if word in ("--add", "--auto"))]) + jobs


def prepared(folder: Path) -> None:
    """The files of a user: the brook, and a folder to import."""
    write_reach(folder, *CHANGES)
    site = folder / "site"
    site.mkdir()
    channel = {"length_m": 30, "bottom_width_m": 6, "bank_slope_v_per_h": 0.5, "bed_slope": 0.001}
    told = {"channel": channel, "experiments": {"June": {"discharge_m3_s": 2.0, "downstream_level_m": 0.8}}}
    (site / "site.json").write_text(json.dumps(told), encoding="utf-8")
    shutil.copy(folder / "velocities.csv", site / "velocities.csv")


def begun(folder: Path, command: tuple[str, ...], heard: Path) -> int:
    """A command on its way in a process of its own, forked with all that is loaded; what it says goes to a file."""
    child = os.fork()
    if child:
        return child
    os.setsid()
    os.chdir(folder)
    said = os.open(heard, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(said, 1)
    os.dup2(said, 2)
    code = 1
    try:
        from vegglue.cli.main import main

        sys.argv = ["vegglue", *command]
        main()
        code = 0
    except SystemExit as ended:
        code = int(ended.code or 0)
    finally:
        os._exit(code)


def load_all(folder: Path, commands: Commands = COMMANDS) -> None:
    """Run commands in this process, so that those forked from it have libraries and compiled loops at hand."""
    from vegglue.cli.main import main

    folder.mkdir()
    prepared(folder)
    here = Path.cwd()
    os.chdir(folder)
    for command in commands:
        if command[-2:] == TWO:  # processes of this one would be no use to those forked from it
            continue
        sys.argv = ["vegglue", *command]
        with suppress(SystemExit):
            main()
    os.chdir(here)


def finish(folder: Path, command: tuple[str, ...], heard: Path) -> None:
    _, status = os.waitpid(begun(folder, command, heard), 0)
    assert status == 0, f"{' '.join(command)}: {heard.read_text(errors='replace')}"


def steps(work: Path, store: Path, commands: Commands = COMMANDS) -> list[Step]:
    """Every command once, undisturbed, each in the same folder `work`, for the same paths; states kept in `store`."""
    work.mkdir()
    prepared(work)
    found = []
    for number, command in enumerate(commands):
        before, after = store / f"{number}-before", store / f"{number}-after"
        shutil.copytree(work, before)
        began = time.monotonic()
        finish(work, command, store / "heard.txt")
        found.append(Step(command, before, after, time.monotonic() - began))
        print(f"{found[-1].seconds:6.1f} s  {' '.join(command)}", flush=True)
        shutil.copytree(work, after)
    return found


def disturbed(step: Step, work: Path, share: float) -> bool:
    """Kill a command after a share of its time, then let it finish; whether the kill came before its end."""
    shutil.rmtree(work)
    shutil.copytree(step.before, work)
    heard = step.before.parent / "heard.txt"
    child = begun(work, step.command, heard)
    time.sleep(share * step.seconds)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    if step.command[0] != "new" or unlike(work, step.after):  # which refuses a folder that is there, as it should
        finish(work, step.command, heard)
    differences = unlike(work, step.after)
    assert not differences, f"{' '.join(step.command)}, killed after {share:.2f} of its time: {differences}"
    return os.WIFSIGNALED(status)


def unlike(folder: Path, other: Path) -> list[str]:
    """Files that only one of two folders has, or whose content differs, but for the wall clock."""
    names = [{path.relative_to(each).as_posix() for path in files(each)} for each in (folder, other)]
    found = sorted(names[0] ^ names[1])
    return found + [name for name in sorted(names[0] & names[1]) if not same(folder / name, other / name)]


def files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file() and path.name != ".lock"]


def same(path: Path, other: Path) -> bool:
    if path.suffix != ".h5":
        return path.read_bytes() == other.read_bytes()
    with h5py.File(path) as one, h5py.File(other) as two:
        return contents(one) == contents(two)


def contents(file: h5py.File) -> dict[str, Any]:
    found: dict[str, Any] = {name: str(value) for name, value in file.attrs.items()}

    def add(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and name.split("/")[-1] not in (*OF_THE_CLOCK, "digest"):
            values = item[...]
            plain = values.tolist() if values.dtype == object else values.tobytes()
            found[name] = (str(values.dtype), values.shape, plain)

    file.visititems(add)
    return found


def shared_out(kills: int, undisturbed: Sequence[Step]) -> list[int]:
    """So many kills or more, most for the quick commands, and for each of them some."""
    weights = [1.0 / (0.5 + step.seconds) for step in undisturbed]
    return [max(FEWEST, math.ceil(kills * weight / sum(weights))) for weight in weights]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kills", type=int, nargs="?", default=208)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[], help="as the table names them; the others keep theirs")
    asked = parser.parse_args()
    random, table = np.random.default_rng(asked.seed), {}
    if asked.only:
        table = json.loads(OUTCOME.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as name:
        work = Path(name) / "work"
        load_all(Path(name) / "loaded")
        undisturbed = steps(work, Path(name))
        tried = [step for step in undisturbed if not asked.only or step.name in asked.only]
        for step, kills in zip(tried, shared_out(asked.kills, tried), strict=True):
            in_time = sum(disturbed(step, work, float(share)) for share in random.uniform(0.0, 1.0, kills))
            table[step.name] = {"kills": kills, "in_time": in_time}
            print(f"{step.name}: {in_time} of {kills} in time", flush=True)
    OUTCOME.parent.mkdir(parents=True, exist_ok=True)
    OUTCOME.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
