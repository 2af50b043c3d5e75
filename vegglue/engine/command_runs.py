"""Many runs of a command, several at once; what has run once is kept and not run again.

    runs/<name>/engine/<key>.json   predictions of a finished run
    runs/<name>/engine/<key>/       the folder of a run that is under way or has failed; of all with `keep: all`

The key is a hash of the command, of its files and of all that the run was given.
"""

import hashlib
import json
import os
import shutil
import sys
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from threading import Event

import numpy as np
import pandas as pd

from vegglue.arrays import Array
from vegglue.case.consistency import values
from vegglue.case.engine_schema import CommandEngine
from vegglue.case.resolved_config import digest_of, last_changes
from vegglue.case.schema import Case
from vegglue.case.text_files import LARGEST_JSON, read_text, write_text
from vegglue.engine.command_files import PARAMETERS_FILE, STATIONS_FILE, parameters_text, stations_text
from vegglue.engine.command_run import CommandEnd, run_command_once
from vegglue.errors import InputError, shown_path
from vegglue.parallel import cores_allowed, is_taken
from vegglue.progress import Progress, Watch, silent
from vegglue.results.lock import hold_lock
from vegglue.whole_files import MAKE_ROOM, failed_writes_told

OneTheta = Mapping[str, float]
Changes = Mapping[str, tuple[tuple[str, int, int], ...]]


@dataclass(frozen=True)
class CommandRuns:
    """A command that is ready to run: its words, a digest of it and of its files, when each of these was changed, and
    where its runs are kept.
    """

    settings: CommandEngine
    words: tuple[str, ...]
    digest: str
    changed: Changes
    folder: Path


def command_runs(case: Case, folder: Path) -> CommandRuns:
    """The command of a case, with its runs kept in `engine` below the folder of the case's results.

    Errors: InputError when its program is not there, when it is given no parameter, or on a cluster, whose machines
    need not have it.
    """
    settings = case.engine
    assert settings is not None
    if is_taken():
        raise InputError(
            f"--cluster: {case.name} runs the command of its `engine`, on this machine only; leave --cluster out, or "
            "let the command itself hand its work to the cluster."
        )
    if not own_parameters(case):
        raise InputError(
            f"{shown_path(case.source)}: `engine` expected a parameter that the command is given, got none: those of "
            "`effects` act in the built-in engine alone. Calibrate something that the command knows, or take `engine` "
            "out of the config."
        )
    words = settings.words(sys.executable)
    from_here = os.sep in words[0] and not os.path.isabs(words[0])  # but it is started in a folder of its own
    if from_here or shutil.which(words[0]) is None:
        raise InputError(
            f"{shown_path(case.source)}: `engine.command` expected a program that can be run, got {words[0]!r}; "
            "install it, give its full path, or name it in `engine.files` and make it executable."
        )
    changed = _changes(settings)  # first: what changes while it is read is noticed
    content = [settings.command, {name: digest_of(path) for name, path in settings.files.items()}]
    digest = hashlib.sha256(json.dumps(content).encode()).hexdigest()
    return CommandRuns(settings, words, digest, changed, folder.resolve() / "engine")


def _changes(settings: CommandEngine) -> Changes:
    return {name: last_changes(path) for name, path in settings.files.items()}


def _refuse_changed(runs: CommandRuns) -> None:
    """Errors: InputError when a file of the command is another than when its digest was made."""
    now = _changes(runs.settings)
    for name, path in runs.settings.files.items():
        if now[name] != runs.changed[name]:
            raise InputError(
                f"engine.files: expected `{name}` ({shown_path(path)}) to stay while vegglue runs, but it was changed; "
                "what ran before is kept with what it was then. Run the same command again."
            )


def own_parameters(case: Case) -> tuple[str, ...]:
    """Names of the parameters that a command is given: all but those that only stand in `effects`, which the built-in
    engine adds.
    """
    of_effects = {value for place, value, _ in values(case) if place[0] == "effects"}
    elsewhere = {value for place, value, _ in values(case) if place[0] != "effects"}
    return tuple(name for name in case.parameters if name in elsewhere or name not in of_effects)


def ended_runs(
    runs: CommandRuns, case: Case, station: pd.DataFrame, thetas: Sequence[OneTheta]
) -> Generator[tuple[int, CommandEnd], None, None]:
    """The position of each theta and how its run ended, in the order in which they end; those kept come first.

    What is closed early, or stopped by Ctrl-C, stops the runs under way. Errors: StorageError.
    """
    stations = stations_text(station)
    given = [{PARAMETERS_FILE: parameters_text(case, theta), STATIONS_FILE: stations} for theta in thetas]
    keys = [hashlib.sha256("\n".join([runs.digest, *one.values()]).encode()).hexdigest()[:32] for one in given]
    first: dict[str, int] = {}
    for position, key in enumerate(keys):
        kept = _kept(runs, key, len(station))
        if kept is not None:
            yield position, kept
        elif key in first:  # two of the same wait for one run
            continue
        else:
            first[key] = position
    with closing(_new_runs(runs, {key: given[at] for key, at in first.items()}, len(station))) as ends:
        for key, end in ends:
            yield from ((position, end) for position, same in enumerate(keys) if same == key)


def _new_runs(
    runs: CommandRuns, given: Mapping[str, Mapping[str, str]], stations: int
) -> Generator[tuple[str, CommandEnd], None, None]:
    """The key of each run and how it ended; given: its files by key. Of two vegglue in one folder one is refused."""
    if not given:
        return
    with failed_writes_told(runs.folder, MAKE_ROOM):
        runs.folder.mkdir(parents=True, exist_ok=True)
    stop = Event()
    with hold_lock(runs.folder):
        pool = ThreadPoolExecutor(cores_allowed())
        try:
            waiting = {pool.submit(_run, runs, key, files, stations, stop): key for key, files in given.items()}
            while waiting:
                ended, _ = wait(waiting, return_when=FIRST_COMPLETED)
                for one in ended:
                    yield waiting.pop(one), one.result()
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)


def command_predictions(
    runs: CommandRuns,
    case: Case,
    station: pd.DataFrame,
    thetas: Sequence[OneTheta],
    watch: Watch = silent,
    why: str = "",
) -> tuple[Array, list[str]]:
    """Predictions (m, station), NaN where a run failed, and the reason of each, '' where it did not; why: what the runs
    are for, in the words of a progress line.
    """
    found, reasons, failed = np.full((len(thetas), len(station)), np.nan), [""] * len(thetas), 0
    watch(Progress(why, 0, len(thetas), "runs"))
    with closing(ended_runs(runs, case, station, thetas)) as ends:
        for done, (position, end) in enumerate(ends, 1):
            reasons[position] = end.reason
            if end.prediction is None:
                failed += 1
            else:
                found[position] = end.prediction
            watch(Progress(why, done, len(thetas), "runs", failed))
    return found, reasons


def _kept(runs: CommandRuns, key: str, stations: int) -> CommandEnd | None:
    """What is kept of a finished run; None where nothing is, or nothing sound."""
    try:
        found = json.loads(read_text(runs.folder / f"{key}.json", LARGEST_JSON))
        prediction, seconds = np.array(found["prediction"], dtype=float), float(found["seconds"])
    except (InputError, ValueError, KeyError, TypeError, RecursionError):
        return None
    sound = prediction.shape == (stations,) and bool(np.isfinite(prediction).all())
    return CommandEnd(prediction, "", seconds) if sound else None


def _run(runs: CommandRuns, key: str, given: Mapping[str, str], stations: int, stop: Event) -> CommandEnd:
    if stop.is_set():
        return CommandEnd(None, "the command was not started", 0.0)
    folder, settings = runs.folder / key, runs.settings
    end = run_command_once(runs.words, folder, given, stations, settings.timeout, stop)
    if end.prediction is None:
        return end
    _refuse_changed(runs)
    text = json.dumps({"prediction": end.prediction.tolist(), "seconds": round(end.seconds, 3)})
    write_text(runs.folder / f"{key}.json", text, MAKE_ROOM)
    if settings.keep == "failed":
        shutil.rmtree(folder, ignore_errors=True)
    return end
