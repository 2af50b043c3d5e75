"""How a command reports: its progress in a moving line or in lines now and then, and its result in the end."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vegglue.cli.terminal import console, print_object
from vegglue.progress import Progress, Watch, progress_lines, silent, with_pace

if TYPE_CHECKING:
    from rich.console import Console

    from vegglue.case.schema import Case

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
        yield progress_lines()


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


def print_result(case: "Case", runs: Path, result: Any, as_object: bool, details: bool = False, more: str = "") -> None:
    """Print a result of a verb, kept in runs/<name>/, as an object or in words."""
    if as_object:
        from vegglue.cli.objects import object_of

        print_object(object_of(case, runs, result))
    else:
        from vegglue.cli.printed import show

        show(case, runs, result, details, more)
