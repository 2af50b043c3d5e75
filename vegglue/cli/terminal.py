"""What the commands share: options that mean the same everywhere, a config opened with warnings on its data, and how a
command prints: its progress in a moving line or in lines now and then; tables, results in words or as one JSON object.
"""

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import vegglue
from vegglue.errors import InputError, shell_line
from vegglue.plain_json import plain
from vegglue.progress import Progress, Watch, progress_lines, silent, with_pace
from vegglue.wording.commands import HELP
from vegglue.wording.sentences import phrase

if TYPE_CHECKING:
    from rich.console import Console

    from vegglue.workflow.case_run import CaseRun

# What stands for the value of an option that takes none: typer 0.29 would write `<bool>`, as if it took one.
FLAG = " "

Config = Annotated[Path, typer.Argument(metavar="CONFIG", help=HELP["config"], show_default=False)]
Runs = Annotated[Path, typer.Option(metavar="FOLDER", help=HELP["runs"])]
# Where results lie by default.
RUNS = Path("runs")


def _number_of_jobs(jobs: int) -> int:
    if jobs == 0:
        raise InputError("--jobs: expected the number of processes, or -1 for one on every core, got 0.")
    return jobs


Jobs = Annotated[int, typer.Option(min=-1, callback=_number_of_jobs, metavar="N", help=HELP["jobs"])]
MemoryLimit = Annotated[float | None, typer.Option(min=0.1, metavar="GB", help=HELP["memory"])]
Cluster = Annotated[str | None, typer.Option(metavar="ADDRESS", help=HELP["cluster"])]
Members = Annotated[int | None, typer.Option(min=1, metavar="N", help=HELP["members"])]
Json = Annotated[bool, typer.Option("--json", metavar=FLAG, help=HELP["json"])]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", metavar=FLAG, help=HELP["quiet"])]
Force = Annotated[bool, typer.Option("--force", metavar=FLAG, help=HELP["force"])]
Trust = Annotated[bool, typer.Option("--trust", metavar=FLAG, help=HELP["trust"])]


def number_given(text: str) -> tuple[str, float]:
    """NAME=NUMBER as both."""
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(f"--shape: expected NAME=NUMBER, got {text!r}; e.g. --shape width=0.5.") from None


def opened_run(config: Path, trust: bool) -> "CaseRun":
    """The run of a config, after warnings about its measurements. Raises InputError."""
    (run,) = opened_runs([config], trust)
    return run


def opened_runs(configs: Sequence[Path], trust: bool) -> "list[CaseRun]":
    """The same of several configs, each warning once, on standard error."""
    cases = [vegglue.load_case(config, trust) for config in configs]
    from vegglue.wording.sentences import sentence
    from vegglue.workflow.case_run import CaseRun
    from vegglue.workflow.check import critical_warnings

    first, *others = [CaseRun(case) for case in cases]
    several = [first, *(replace(one, beside=first) for one in others)]
    for warning in dict.fromkeys(sentence(one) for run in several for one in critical_warnings(run)):
        print(f"Doubtful: {warning}", file=sys.stderr, flush=True)
    return several


def print_doubts_of_ensemble(run: "CaseRun") -> None:
    """Warn that the members of a command, if they are kept, do not follow their parameters."""
    if run.case.engine is None or not (run.folder / "ensemble.h5").exists():
        return
    from vegglue.case.resolved_config import simulation_hash
    from vegglue.inference.command_ensemble import doubts_of_predictions
    from vegglue.results.result_files import read_ensemble, stored_hash
    from vegglue.wording.sentences import sentence
    from vegglue.workflow.case_run import as_solved

    path = run.folder / "ensemble.h5"
    if stored_hash(path) == simulation_hash(as_solved(run.case, run.folder)):
        for doubt in doubts_of_predictions(read_ensemble(path)):
            print(f"Doubtful: {sentence(doubt)}", file=sys.stderr, flush=True)


# Letters of a line in a file or a pipe, where nothing has to be left out.
WIDEST = 1000
# Spaces between two columns of a table.
COLUMN_GAP = 2


def command_line(verb: str, *arguments: object, runs: Path = RUNS, trust: bool = False) -> str:
    """A command that can be copied, with the options that the one before was given."""
    options = [*(["--runs", str(runs)] if runs != RUNS else []), *(["--trust"] if trust else [])]
    return shell_line(["vegglue", verb, *map(str, arguments), *options])


@cache
def console(errors: bool = False) -> "Console":
    """Standard output or error, for tables and what moves; into a file or a pipe, lines as long as they need to be."""
    from rich.console import Console

    width = None if (sys.stderr if errors else sys.stdout).isatty() else WIDEST
    # Names such as `discharge_error[high]` are no markup.
    return Console(stderr=errors, highlight=False, soft_wrap=True, markup=False, width=width)


def print_table(headings: Sequence[str], rows: Sequence[Sequence[str]], kept: Sequence[str]) -> None:
    """Print a table, its first column to the left; where the window is narrow without the columns that matter least.

    kept: the headings beside the first that matter most, which go last. A name is never cut off.
    """
    from rich.table import Table

    left_out, screen = left_out_of(headings, rows, kept, console().width), console()
    table = Table(box=None, pad_edge=False, header_style="bold")
    shown = [place for place, heading in enumerate(headings) if heading not in left_out]
    for place in shown:
        table.add_column(headings[place], justify="right" if place else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(row[place] for place in shown))
    screen.print(table)
    if left_out:
        screen.print(phrase("no_room_for", left_out))


def left_out_of(headings: Sequence[str], rows: Sequence[Sequence[str]], kept: Sequence[str], width: int) -> list[str]:
    """The headings that have no room in so many letters, in their order: the last of those not in `kept` goes first."""
    wide = {
        heading: max(map(len, [heading, *column])) + COLUMN_GAP
        for heading, column in zip(headings, zip(*rows, strict=True), strict=True)
    } if rows else {}  # fmt: skip
    others = [heading for heading in reversed(headings[1:]) if heading not in kept]
    going = [*others, *reversed(kept)]
    gone: list[str] = []
    while going and sum(wide.values()) - sum(wide[one] for one in gone) - COLUMN_GAP > width:
        gone.append(going.pop(0))
    return [heading for heading in headings if heading in gone]


def print_object(tree: Mapping[str, Any] | list[Any]) -> None:
    """Print keys and values as one JSON object on one line; numbers that are none as null."""
    spelt_out = "utf" not in (sys.stdout.encoding or "").lower()
    print(json.dumps(plain(tree), ensure_ascii=spelt_out, allow_nan=False))


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
