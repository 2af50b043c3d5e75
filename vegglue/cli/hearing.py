"""How a long command is heard: one line that moves on a terminal, a line now and then in a file or a pipe."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock
from typing import TYPE_CHECKING

from vegglue.cli.output import console
from vegglue.progress import Progress, Watch, silent
from vegglue.wording.numbers import duration_in_short

if TYPE_CHECKING:
    from rich.console import Console

# Seconds between two lines about one phase in a file or a pipe, at least: a log of an hour stays readable.
BETWEEN_LINES = 10.0
# Share [-] that is done, or seconds gone, before the time left is told: an inference begins with few draws a minute.
LEFT_TOLD_FROM, LEFT_TOLD_AFTER = 0.02, 60.0
# Terminals that cannot take a line back.
PLAIN_TERMINALS = ("dumb", "unknown")


@contextmanager
def heard(quiet: bool, as_object: bool) -> Iterator[Watch]:
    """Whoever watches a verb and tells the user. Nothing is told if quiet.

    Where standard output is kept for an object, a terminal is told on standard error, and nobody else.
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


def now_and_then(say: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> Watch:
    """Says a line when a phase begins, and within it at most one in BETWEEN_LINES seconds."""
    timed, said_at, lock = with_pace(clock), -BETWEEN_LINES, Lock()

    def watch(progress: Progress) -> None:
        nonlocal said_at
        with lock:  # phases of one command may run side by side
            new, pace = timed(progress)
            if new or clock() - said_at >= BETWEEN_LINES:
                say(f"... {progress}{pace}")
                said_at = clock()

    return watch


def with_pace(clock: Callable[[], float] = time.monotonic) -> Callable[[Progress], tuple[bool, str]]:
    """Tells of each progress whether its phase is new, and its rate and the time left in words."""
    phase, began, first = "", 0.0, 0

    def timed(progress: Progress) -> tuple[bool, str]:
        nonlocal phase, began, first
        if new := progress.phase != phase:
            phase, began, first = progress.phase, clock(), progress.done
        return new, pace_in_words(progress, progress.done - first, clock() - began)

    return timed


def pace_in_words(progress: Progress, done: int, seconds: float) -> str:
    """', 53 a second, 12 s left' after so many were done in so many seconds; nothing where that tells nothing."""
    if progress.total is None or done <= 0 or seconds <= 0.0:
        return ""
    rate, waiting = done / seconds, progress.total - progress.done
    told = waiting > 0 and (done >= LEFT_TOLD_FROM * (done + waiting) or seconds >= LEFT_TOLD_AFTER)
    return f", {_rate(rate)}, {duration_in_short(waiting / rate)} left" if told else f", {_rate(rate)}"


def _rate(each_second: float) -> str:
    """In the shortest span of time in which at least one is done."""
    spans = ((1.0, "a second"), (60.0, "a minute"), (3600.0, "an hour"))
    seconds, words = next((span for span in spans if each_second * span[0] >= 1.0), spans[-1])
    count = each_second * seconds
    return f"{count:,.0f} {words}" if count >= 10.0 else f"{count:.1f} {words}"
