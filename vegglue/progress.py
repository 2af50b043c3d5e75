"""How a long command reports its progress: what it does, and how much of that is done if it is counted."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

from vegglue.wording.numbers import duration_in_short

# Seconds between two lines about one phase in a file or a pipe, at least: a log of an hour stays readable.
BETWEEN_LINES = 10.0
# Share [-] that is done, or seconds gone, before the time left is printed: an inference begins with few draws a minute.
LEFT_SHOWN_FROM, LEFT_SHOWN_AFTER = 0.02, 60.0


@dataclass(frozen=True)
class Progress:
    """What a long command does now.

    Attributes
    ----------
    phase
        In words.
    done, total, unit
        How many are done, of how many, None where nothing is counted, and what these are.
    failed, resumed
        Those of the done that failed, and those that an earlier run had done.
    """

    phase: str
    done: int = 0
    total: int | None = None
    unit: str = ""
    failed: int = 0
    resumed: int = 0

    def __str__(self) -> str:
        """As one line: 'solving brook: 128 of 256 members (64 from before), 1 failed'."""
        if self.total is None:
            return self.phase
        resumed = f" ({self.resumed:,} from before)" if self.resumed else ""
        failed = f", {self.failed:,} failed" if self.failed else ""
        return f"{self.phase}: {self.done:,} of {self.total:,} {self.unit}".rstrip() + resumed + failed


Watch = Callable[[Progress], None]


def silent(*_: object) -> None:
    """Shows nothing: the default of `watch` and `show`."""


def counted(watch: Watch, phase: str, total: int, unit: str = "") -> Callable[[int], None]:
    """Reports a phase each time one more of `total` is done, and at once that none is."""
    watch(Progress(phase, 0, total, unit))
    return lambda done: watch(Progress(phase, done, total, unit))


def now_and_then(write: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> Watch:
    """Prints a line when a phase begins, and within it at most one in BETWEEN_LINES seconds."""
    timed, written_at, lock = with_pace(clock), -BETWEEN_LINES, Lock()

    def watch(progress: Progress) -> None:
        nonlocal written_at
        with lock:  # phases of one command may run side by side
            new, pace = timed(progress)
            if new or clock() - written_at >= BETWEEN_LINES:
                write(f"... {progress}{pace}")
                written_at = clock()

    return watch


def with_pace(clock: Callable[[], float] = time.monotonic) -> Callable[[Progress], tuple[bool, str]]:
    """Gives for each progress whether its phase is new, and its rate and the time left in words."""
    phase, began, first = "", 0.0, 0

    def timed(progress: Progress) -> tuple[bool, str]:
        nonlocal phase, began, first
        if new := progress.phase != phase:
            phase, began, first = progress.phase, clock(), progress.done
        return new, pace_in_words(progress, progress.done - first, clock() - began)

    return timed


def pace_in_words(progress: Progress, done: int, seconds: float) -> str:
    """', 53 a second, 12 s left' after so many were done in so many seconds; nothing if that is unknown."""
    if progress.total is None or done <= 0 or seconds <= 0.0:
        return ""
    rate, waiting = done / seconds, progress.total - progress.done
    told = waiting > 0 and (done >= LEFT_SHOWN_FROM * (done + waiting) or seconds >= LEFT_SHOWN_AFTER)
    # In the shortest span of time in which at least one is done.
    spans = ((1.0, "a second"), (60.0, "a minute"), (3600.0, "an hour"))
    span, words = next((one for one in spans if rate * one[0] >= 1.0), spans[-1])
    count = rate * span
    pace = f", {count:,.0f} {words}" if count >= 10.0 else f", {count:.1f} {words}"
    return f"{pace}, {duration_in_short(waiting / rate)} left" if told else pace


def progress_lines() -> Watch:
    """What a verb is given as `watch` to print plain lines now and then, in a notebook or a script.

    Returns
    -------
    callable
        Of a `Progress`: prints a line when a phase begins, and within it at most one in 10 s.
    """
    return now_and_then(lambda line: print(line, flush=True))
