"""Runs of a user's command: the files between both, one run, and many at once. docs/own_engine.md describes them.

    parameters.json   values and units of the parameters, and the flow of each experiment
    stations.csv      station, experiment, kind, section, x, y, depth, unit
    predictions.csv   station, prediction, left by the command

    runs/<name>/engine/<key>.json   predictions of a finished run, which is not run again
    runs/<name>/engine/<key>/       the folder of a run that is under way or has failed; of all with `keep: all`

The key is a hash of the command, of its files and of all that the run was given. This is the only file of the package
that starts a program which a config names.
"""

import hashlib
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event

import numpy as np
import pandas as pd
import psutil

from vegglue.arrays import Array
from vegglue.case.case_effects import value_of
from vegglue.case.channel_geometry import patches_present
from vegglue.case.config import values
from vegglue.case.resolved_config import digest_of, last_changes
from vegglue.case.schema import Case, CommandEngine
from vegglue.case.site_schema import Value
from vegglue.case.text_files import LARGEST_JSON, read_text, write_text
from vegglue.errors import InputError, shown_path
from vegglue.measurements.kinds import KINDS, STREAMWISE, WATER_LEVEL, kind_of
from vegglue.measurements.observations import LARGEST_READING
from vegglue.measurements.plausibility import is_mark
from vegglue.parallel import cores_allowed, has_backend
from vegglue.progress import Progress, Watch, silent
from vegglue.results.resume import hold_lock
from vegglue.whole_files import failed_writes_told
from vegglue.wording.remedies import MAKE_ROOM

PARAMETERS_FILE, STATIONS_FILE, PREDICTIONS_FILE = "parameters.json", "stations.csv", "predictions.csv"
COLUMNS_LEFT = ("station", "prediction")
LOG_FILE = "command.log"
# Most that predictions.csv may take [bytes]: the most stations of a case, with fifty signs each.
LARGEST_PREDICTIONS = 1_000_000
# Most that a command may print [bytes]. Chosen: more than any model prints, and no disk is full before it is noticed.
LONGEST_LOG = 1_000_000_000
# How often a running command is looked at [s]. Chosen: short against any run of a flow model, and hardly any work.
LOOK_EVERY = 0.05
# Signs of the last line of the log that a reason quotes: enough for a path; a reason of an ensemble has room for 240.
QUOTED = 160
# A mark of a missing value lies further than this from what was measured [SI]; a level or a discharge may be 99.9.
FAR_FROM_MEASURED = 5.0
# No river is faster [m/s], and no level further from the measured one [m]. Chosen; floods in gorges reach 10 m/s.
FASTEST_RIVER, FURTHEST_LEVEL = 20.0, 200.0
# Size of a measured value [SI], and standard errors of it, from which a prediction of exactly 0 is none: a dry cell, or
# a field that was never filled. Chosen: a probe reads less than 0.05 m/s at the edge of the water.
CLEARLY_NOT_ZERO, ERRORS_FROM_ZERO = 0.05, 3.0
OneTheta = Mapping[str, float]
Changes = Mapping[str, tuple[tuple[str, int, int], ...]]


class FailedRunError(ValueError):
    """A run of the command gave no predictions: why."""


def parameters_text(case: Case, theta: Mapping[str, float]) -> str:
    """parameters.json: theta in the units of the case, and discharge [m3/s], level [m] and plants of experiments."""
    values = {parameter: np.array([value]) for parameter, value in theta.items()}

    def number(value: Value) -> float:
        return float(value_of(value, values, 1)[0])

    parameters = {name: {"value": value, "unit": case.parameters[name].unit} for name, value in theta.items()}
    experiments = {
        name: {
            "discharge": {inflow: number(value) for inflow, value in one.discharge.items()},
            "level": number(one.level),
            "plants": [case.plants.patches[index].name for index in patches_present(case, name)],
        }
        for name, one in case.experiments.items()
    }
    return json.dumps({"case": case.name, "parameters": parameters, "experiments": experiments}, indent=1) + "\n"


def stations_text(station: pd.DataFrame) -> str:
    """stations.csv: places in the coordinates of the grid [m], depth as measured [m], empty if it was not."""
    columns = ["experiment", "kind", "section", "x", "y", "depth"]
    units = [kind_of(str(kind)).unit for kind in station["kind"]]
    table = station[columns].reset_index(drop=True).assign(unit=units)
    table.insert(0, "station", range(len(table)))
    return str(table.to_csv(index=False, lineterminator="\n"))


def read_predictions(path: Path, stations: int) -> Array:
    """Predictions of predictions.csv, in any order.

    Parameters
    ----------
    path
        The file.
    stations
        How many there must be.

    Returns
    -------
    array
        (station,) [m/s, m or m3/s].

    Raises
    ------
    FailedRunError
        If the file is missing, cannot be read, or lacks a finite prediction of a station.
    """
    if not path.is_file():
        raise FailedRunError(f"the command ended well and left no {PREDICTIONS_FILE}")
    try:
        lines = read_text(path, LARGEST_PREDICTIONS).splitlines()
    except InputError as error:
        raise FailedRunError(f"{PREDICTIONS_FILE} cannot be read: {error}") from None
    heading = tuple(word.strip() for word in lines[0].split(",")) if lines else ()
    if heading != COLUMNS_LEFT:
        raise FailedRunError(
            f"{PREDICTIONS_FILE}, row 1: expected {','.join(COLUMNS_LEFT)}, got {','.join(heading)[:40]!r}"
        )
    found = np.full(stations, np.nan)
    for row, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        words, number, value = line.split(","), -1, math.nan
        with suppress(ValueError, IndexError):
            number, value = int(words[0]), float(words[1])
        at = f"{PREDICTIONS_FILE}, row {row}"
        if len(words) != len(COLUMNS_LEFT) or not math.isfinite(value):
            raise FailedRunError(f"{at}: expected a station and a finite number, got {line[:40]!r}")
        if abs(value) > LARGEST_READING:
            raise FailedRunError(f"{at}: expected a prediction of at most {LARGEST_READING:g}, got {value:g}")
        if not 0 <= number < stations:
            raise FailedRunError(f"{at}: expected a station from 0 to {stations - 1}, got {number}")
        if np.isfinite(found[number]):
            raise FailedRunError(f"{at}: station {number} stands there twice")
        found[number] = value
    missing = np.flatnonzero(np.isnan(found))
    if missing.size:
        more = f" and {missing.size - 1} more" if missing.size > 1 else ""
        raise FailedRunError(f"{PREDICTIONS_FILE}: no prediction of station {missing[0]}{more}")
    return found


def refuse_marks(prediction: Array, station: pd.DataFrame) -> None:
    """Refuse predictions that are what codes write for dry cells and failed runs.

    Parameters
    ----------
    prediction : (n,) [unit of each station]
    station : table of n stations

    Raises
    ------
    FailedRunError
        If one is a mark of a missing value, faster or higher than any river, exactly 0 where water was measured, or all
        are 0.
    """
    kinds, measured = station["kind"].to_numpy(str), station["value"].to_numpy(float)
    error, used = station["standard_error"].to_numpy(float), station["used"].to_numpy(bool)
    off = np.abs(prediction - measured)
    velocity = np.isin(kinds, [name for name, kind in KINDS.items() if kind.velocity])
    mark = np.array([is_mark(value) for value in prediction], bool) & ~(off <= FAR_FROM_MEASURED)
    fast = velocity & (np.abs(prediction) > FASTEST_RIVER)
    if 2 * fast.sum() > velocity.sum():  # another unit, which `check` reports
        fast[:] = False
    beyond = fast | (kinds == WATER_LEVEL) & (off > FURTHEST_LEVEL)
    # A flow may be straight: only what is measured along it, and levels and discharges, cannot be exactly 0.
    wet = np.abs(measured) > np.fmax(CLEARLY_NOT_ZERO, ERRORS_FROM_ZERO * error)
    zero = (prediction == 0.0) & used & wet & (~velocity | (kinds == STREAMWISE) | (kinds == "speed"))
    wrong = mark | beyond | zero
    if wrong.any():
        first = int(np.argmax(mark if mark.any() else beyond if beyond.any() else zero))
        x, y = station["x"].iloc[first], station["y"].iloc[first]
        raise FailedRunError(
            f"{PREDICTIONS_FILE}: station {first} (x = {x:g}, y = {y:g} m) has {prediction[first]:g}, a mark of a "
            f"missing value, of a dry cell or of a failed run: {measured[first]:.3g} was measured; "
            f"{int(wrong.sum())} of {prediction.size} stations"
        )
    if prediction.size > 1 and not prediction.any() and measured[used].any():
        raise FailedRunError(f"{PREDICTIONS_FILE}: all {prediction.size} predictions are 0, as of a failed run")


@dataclass(frozen=True)
class CommandEnd:
    """How a run ended.

    Attributes
    ----------
    prediction
        (station,) [unit of each], None if it failed.
    reason
        Why it failed, else empty.
    seconds
        That it took.
    """

    prediction: Array | None
    reason: str
    seconds: float


def run_command_once(
    words: tuple[str, ...], folder: Path, given: Mapping[str, str], stations: int, timeout: float, stop: Event
) -> CommandEnd:
    """Start a command in an empty folder, wait for it, and read what it leaves.

    Parameters
    ----------
    words
        Program and arguments.
    folder
        Where it runs; what an earlier run has left there is removed.
    given
        Text of each file that it is given, by name.
    stations
        How many predictions are expected.
    timeout
        Time after which it is stopped [s].
    stop
        Is set to end the run early.

    Raises
    ------
    StorageError
        If the folder cannot be written.
    """
    with failed_writes_told(folder, MAKE_ROOM):
        if folder.exists():  # a killed run that still writes there then writes beside, until it ends by itself
            aside = Path(tempfile.mkdtemp(prefix="left-", dir=folder.parent))
            folder.rename(aside / folder.name)
            shutil.rmtree(aside, ignore_errors=True)
        folder.mkdir(parents=True)
        for name, text in given.items():
            (folder / name).write_text(text, encoding="utf-8")
    began = time.monotonic()
    try:
        _run_to_its_end(words, folder, timeout, stop)
        return CommandEnd(read_predictions(folder / PREDICTIONS_FILE, stations), "", time.monotonic() - began)
    except FailedRunError as error:
        return CommandEnd(None, str(error), time.monotonic() - began)


def _run_to_its_end(words: tuple[str, ...], folder: Path, timeout: float, stop: Event) -> None:
    """Start the command and wait; raise FailedRunError unless it ends well."""
    path, code = folder / LOG_FILE, None
    with path.open("wb") as log:
        try:
            process = subprocess.Popen(
                words,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # so that all it has started can be ended with it
            )
        except OSError as error:
            raise FailedRunError(f"the command cannot be started: {error.strerror} ({words[0]})") from None
        try:
            until = time.monotonic() + timeout
            while code is None and not stop.is_set() and os.fstat(log.fileno()).st_size <= LONGEST_LOG:
                left = until - time.monotonic()
                if left <= 0.0:
                    break
                with suppress(subprocess.TimeoutExpired):
                    code = process.wait(min(LOOK_EVERY, left))
        finally:  # also what it has started and left behind
            if not hasattr(os, "killpg"):  # Windows
                with suppress(psutil.Error):
                    for one in psutil.Process(process.pid).children(recursive=True):
                        one.kill()
                process.kill()
            else:
                with suppress(ProcessLookupError, PermissionError):
                    os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    if stop.is_set():
        raise FailedRunError("the command was stopped")
    if code is None and path.stat().st_size > LONGEST_LOG:
        path.unlink()
        raise FailedRunError(f"the command printed more than {LONGEST_LOG / 1e9:g} GB and was stopped")
    if code is None:
        raise FailedRunError(f"the command did not end within {timeout:g} s and was stopped")
    if not code:
        return
    with path.open("rb") as file:
        file.seek(0, os.SEEK_END)
        file.seek(max(file.tell() - 4096, 0))
        lines = [line.strip() for line in file.read().decode(errors="replace").splitlines()]
    last = next((line for line in reversed(lines) if line), "")
    output = f"its last line: {last[:QUOTED]}" if last else f"no output; see {LOG_FILE}"
    raise FailedRunError(f"the command ended with {f'exit code {code}' if code > 0 else f'signal {-code}'}, {output}")


@dataclass(frozen=True)
class CommandRuns:
    """A command that is ready to run.

    Parameters
    ----------
    settings, words
        `engine` of the case, and program and arguments.
    digest, changed
        Of the command and its files, and when each of these was changed.
    folder
        Where its runs are kept.
    """

    settings: CommandEngine
    words: tuple[str, ...]
    digest: str
    changed: Changes
    folder: Path


def command_runs(case: Case, folder: Path) -> CommandRuns:
    """The command of a case, with its runs kept in `engine` below the folder of the case's results.

    Raises
    ------
    InputError
        If its program does not exist, if it is given no parameter, or on a cluster, whose machines may not have it.
    """
    settings = case.engine
    assert settings is not None
    if has_backend():
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
    from_here = ("/" in words[0] or os.sep in words[0]) and not os.path.isabs(
        words[0]
    )  # but it is started in a folder of its own
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


def own_parameters(case: Case) -> tuple[str, ...]:
    """Names of the parameters that a command gets: all but those of `effects`, which the built-in engine adds."""
    of_effects = {value for place, value, _ in values(case) if place[0] == "effects"}
    elsewhere = {value for place, value, _ in values(case) if place[0] != "effects"}
    return tuple(name for name in case.parameters if name in elsewhere or name not in of_effects)


def ended_runs(
    runs: CommandRuns, case: Case, station: pd.DataFrame, thetas: Sequence[OneTheta]
) -> Generator[tuple[int, CommandEnd], None, None]:
    """The position of each theta and how its run ended, in the order in which they end; those kept come first.

    Closing it early, or Ctrl-C, stops the runs under way.

    Raises
    ------
    InputError
        If a file of the command changes while it runs.
    StorageError
        If the folder cannot be written, or another process runs the command there.
    """
    stations = stations_text(station)
    given = [{PARAMETERS_FILE: parameters_text(case, theta), STATIONS_FILE: stations} for theta in thetas]
    keys = [hashlib.sha256("\n".join([runs.digest, *one.values()]).encode()).hexdigest()[:32] for one in given]
    first: dict[str, int] = {}
    kept: dict[int, CommandEnd] = {}
    for position, key in enumerate(keys):
        with suppress(InputError, ValueError, KeyError, TypeError, RecursionError):  # nothing kept, or damaged
            found = json.loads(read_text(runs.folder / f"{key}.json", LARGEST_JSON))
            prediction, seconds = np.array(found["prediction"], dtype=float), float(found["seconds"])
            if prediction.shape == (len(station),) and np.isfinite(prediction).all():
                refuse_marks(prediction, station)
                kept[position] = CommandEnd(prediction, "", seconds)
        if position not in kept:
            first.setdefault(key, position)  # two of the same wait for one run
    yield from kept.items()
    with closing(_new_runs(runs, {key: given[at] for key, at in first.items()}, station)) as ends:
        for key, end in ends:
            yield from ((position, end) for position, same in enumerate(keys) if same == key)


def _new_runs(
    runs: CommandRuns, given: Mapping[str, Mapping[str, str]], station: pd.DataFrame
) -> Generator[tuple[str, CommandEnd], None, None]:
    """The key of each run and how it ended; given: its files by key. Of two vegglue in one folder one is refused."""
    if not given:
        return
    settings, stop = runs.settings, Event()

    def run(key: str, files: Mapping[str, str]) -> CommandEnd:
        if stop.is_set():
            return CommandEnd(None, "not started", 0.0)
        end = run_command_once(runs.words, runs.folder / key, files, len(station), settings.timeout, stop)
        if end.prediction is None:
            return end
        try:
            refuse_marks(end.prediction, station)
        except FailedRunError as error:
            return CommandEnd(None, str(error), end.seconds)
        now = _changes(settings)
        for name, path in settings.files.items():
            if now[name] != runs.changed[name]:
                raise InputError(
                    f"engine.files: expected `{name}` ({shown_path(path)}) to stay while vegglue runs, but it was "
                    "changed; what ran before is kept with what it was then. Run the same command again."
                )
        text = json.dumps({"prediction": end.prediction.tolist(), "seconds": round(end.seconds, 3)})
        write_text(runs.folder / f"{key}.json", text, MAKE_ROOM)
        if settings.keep == "failed":
            shutil.rmtree(runs.folder / key, ignore_errors=True)
        return end

    with failed_writes_told(runs.folder, MAKE_ROOM):
        runs.folder.mkdir(parents=True, exist_ok=True)
    with hold_lock(runs.folder):
        pool = ThreadPoolExecutor(cores_allowed())
        try:
            waiting = {pool.submit(run, key, files): key for key, files in given.items()}
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
    """f_c at many places: runs of the command, side by side, unless they are kept.

    Parameters
    ----------
    runs, case, station, thetas
        As `ended_runs`; m thetas.
    watch, why
        Called with the progress, and the phase of it: what the runs are for.

    Returns
    -------
    (m, station)
        [unit of each station], NaN if a run failed.
    list of m str
        The reason of each, empty if it did not.

    Raises
    ------
    InputError, StorageError
        As `ended_runs`.
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
