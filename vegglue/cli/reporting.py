"""How a command reports: its progress in a moving line or in lines now and then, and its result in the end."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from vegglue.cli.output import console, print_object
from vegglue.progress import Progress, Watch, silent
from vegglue.wording.numbers import duration_in_short

if TYPE_CHECKING:
    from rich.console import Console

    from vegglue.case.schema import Case

# Seconds between two lines about one phase in a file or a pipe, at least: a log of an hour stays readable.
BETWEEN_LINES = 10.0
# Share [-] that is done, or seconds gone, before the time left is printed: an inference begins with few draws a minute.
LEFT_SHOWN_FROM, LEFT_SHOWN_AFTER = 0.02, 60.0
# Terminals that cannot take a line back.
PLAIN_TERMINALS = ("dumb", "unknown")


@contextmanager
def progress_reporter(quiet: bool, as_object: bool) -> Iterator[Watch]:
    """What receives the progress of a verb and prints it; nothing if quiet.

    If standard output is kept for an object, progress goes to standard error, and to a terminal only.
    """
    screen = sys.stderr if as_object else sys.stdout
    moving = screen.isatty() and os.environ.get("TERM") not in PLAIN_TERMINALS
    if quiet or (as_object and not moving):
        yield silent
    elif moving:
        with moving_line(console(errors=as_object)) as watch:
            yield watch
    else:
        yield now_and_then(lambda line: print(line, flush=True))


@contextmanager
def moving_line(screen: "Console") -> Iterator[Watch]:
    """One line at the foot of a terminal, gone in the end: phase, bar, done of all, rate, time left, failures."""
    from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    words = (TextColumn(f"{{task.{part}}}", markup=False) for part in ("description", "fields[count]"))
    columns = (SpinnerColumn(), next(words), BarColumn(bar_width=16), next(words), TimeElapsedColumn())
    with Bar(*columns, console=screen, transient=True) as bar:
        task, timed = bar.add_task("", total=None, count="", visible=False), with_pace()

        def watch(progress: Progress) -> None:
            new, pace = timed(progress)
            if new:
                bar.reset(task, total=progress.total)
            bar.update(
                task,
                description=progress.phase,
                completed=progress.done,
                total=progress.total,
                visible=True,
                count=str(progress).removeprefix(progress.phase).removeprefix(": ") + pace,
            )

        yield watch


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


def print_result(case: "Case", runs: Path, result: Any, as_object: bool, details: bool = False, more: str = "") -> None:
    """Print a result of a verb, kept in runs/<name>/, as an object or in words."""
    if as_object:
        from vegglue.cli.objects import object_of

        print_object(object_of(case, runs, result))
    else:
        from vegglue.cli.printed import show

        show(case, runs, result, details, more)
