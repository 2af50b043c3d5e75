"""One run of a command: started in a folder of its own, watched, stopped when it takes too long, and its files read.

The only place of the package that starts a program which a config names.
"""

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event

from vegglue.arrays import Array
from vegglue.engine.command_files import PREDICTIONS_FILE, BadPredictionsError, read_predictions
from vegglue.whole_files import MAKE_ROOM, failed_writes_told

LOG_FILE = "command.log"
# Most that a command may say [bytes]. Chosen: more than any model prints, and no disk is full before it is noticed.
LONGEST_LOG = 1_000_000_000
# How often a running command is looked at [s]. Chosen: short against any run of a flow model, and hardly any work.
LOOK_EVERY = 0.05
# Signs of the last line of the log that a reason quotes: enough for a path; a reason of an ensemble has room for 240.
QUOTED = 160


@dataclass(frozen=True)
class CommandEnd:
    """How a run ended: its predictions (station,), or None and the reason; seconds: how long it took."""

    prediction: Array | None
    reason: str
    seconds: float


def run_command_once(
    words: tuple[str, ...], folder: Path, given: Mapping[str, str], stations: int, timeout: float, stop: Event
) -> CommandEnd:
    """Start a command in an empty folder with the files it is given, wait for it, and read what it leaves.

    given: text of each file by its name; timeout [s]; stop: is set when nobody waits any more, which ends the run.
    Errors: StorageError when the folder cannot be written.
    """
    with failed_writes_told(folder, MAKE_ROOM):
        if folder.exists():
            _clear_away(folder)
        folder.mkdir(parents=True)
        for name, text in given.items():
            (folder / name).write_text(text, encoding="utf-8")
    began = time.monotonic()
    reason = _outcome(words, folder, timeout, stop)
    if not reason:
        try:
            return CommandEnd(read_predictions(folder / PREDICTIONS_FILE, stations), "", time.monotonic() - began)
        except BadPredictionsError as error:
            reason = str(error)
    return CommandEnd(None, reason, time.monotonic() - began)


def _clear_away(folder: Path) -> None:
    """Remove what a killed run has left. One that still writes there then writes beside, until it ends by itself."""
    aside = Path(tempfile.mkdtemp(prefix="left-", dir=folder.parent))
    folder.rename(aside / folder.name)
    shutil.rmtree(aside, ignore_errors=True)


def _outcome(words: tuple[str, ...], folder: Path, timeout: float, stop: Event) -> str:
    """Why a command did not end well, '' when it did."""
    with (folder / LOG_FILE).open("wb") as log:
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
            return f"the command cannot be started: {error.strerror} ({words[0]})"
        try:
            code = _waited_for(process, time.monotonic() + timeout, stop, log.fileno())
        finally:
            _end_all(process)
    if stop.is_set():
        return "the command was stopped"
    if code is None and (folder / LOG_FILE).stat().st_size > LONGEST_LOG:
        (folder / LOG_FILE).unlink()
        return f"the command printed more than {LONGEST_LOG / 1e9:g} GB and was stopped"
    if code is None:
        return f"the command did not end within {timeout:g} s and was stopped"
    if code:
        how = f"exit code {code}" if code > 0 else f"signal {-code}"
        return f"the command ended with {how}{_last_said(folder / LOG_FILE)}"
    return ""


def _waited_for(process: "subprocess.Popen[bytes]", until: float, stop: Event, log: int) -> int | None:
    """The exit code; None when it was not there in time, or its log grew too long."""
    while not stop.is_set() and os.fstat(log).st_size <= LONGEST_LOG:
        left = until - time.monotonic()
        if left <= 0.0:
            return None
        with suppress(subprocess.TimeoutExpired):
            return process.wait(min(LOOK_EVERY, left))
    return None


def _end_all(process: "subprocess.Popen[bytes]") -> None:
    """End the command, if it still runs, and whatever it has started and left behind."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _last_said(log: Path) -> str:
    """The last line of the output of a command, for a reason; '' when it said nothing."""
    with log.open("rb") as file:
        file.seek(0, os.SEEK_END)
        file.seek(max(file.tell() - 4096, 0))
        lines = [line.strip() for line in file.read().decode(errors="replace").splitlines()]
    said = next((line for line in reversed(lines) if line), "")
    return f", and said: {said[:QUOTED]}" if said else f", and said nothing; see {LOG_FILE}"
