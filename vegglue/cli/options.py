"""What the commands share: the options that mean the same everywhere, the console, and how a long command is heard."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from vegglue.errors import InputError
from vegglue.progress import Progress, Say, Watch

# Into a file or a pipe, lines as long as they need to be.
# Names such as `discharge_error[high]` are no markup.
console = Console(highlight=False, soft_wrap=True, markup=False, width=None if sys.stdout.isatty() else 200)
Config = Annotated[Path, typer.Argument(help="The case, a YAML file.", show_default=False)]
Runs = Annotated[Path, typer.Option(help="Folder that holds one folder for each run.")]


def _some(jobs: int) -> int:
    if jobs == 0:
        raise InputError("--jobs: expected the number of processes, or -1 for one on every core, got 0.")
    return jobs


Jobs = Annotated[
    int, typer.Option(min=-1, callback=_some, help="Cores at once; -1 for all. Results do not depend on it.")
]
Members = Annotated[
    int | None,
    typer.Option(min=1, help="Size of the ensemble instead of the config's; powers of two use the Sobol' points best."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of words.")]
Trust = Annotated[bool, typer.Option("--trust", help="Run the effects of the config's own `effect_file`.")]


def say_on(quiet: bool = False) -> Say:
    """Prints what a verb says of its steps, or nothing where only its result is wanted."""

    def say(text: str) -> None:
        if not quiet:
            console.print(f"... {text}", style="dim")

    return say


def number_given(text: str) -> tuple[str, float]:
    """NAME=NUMBER as both."""
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(f"--shape: expected NAME=NUMBER, got {text!r}; e.g. --shape width=0.5.") from None


@contextmanager
def progress_bars() -> Iterator[Watch]:
    """A bar with the time left for each ensemble on a terminal, a line now and then elsewhere."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("members,"),
        TimeElapsedColumn(),
        TextColumn("spent,"),
        TimeRemainingColumn(elapsed_when_finished=False),
        TextColumn("left{task.fields[note]}"),
    )
    tasks: dict[str, TaskID] = {}
    with Bar(*columns, console=console, disable=not console.is_terminal) as bar:

        def watch(progress: Progress) -> None:
            if progress.name not in tasks:
                tasks[progress.name] = bar.add_task(progress.name, total=None, note="")
            failed = f", {progress.failed} failed" if progress.failed else ""
            bar.update(tasks[progress.name], completed=progress.solved, total=progress.members, note=failed)
            if not console.is_terminal:
                resumed = f" ({progress.resumed} from before)" if progress.resumed else ""
                print(f"{progress.name}: {progress.solved} of {progress.members} members{resumed}{failed}", flush=True)

        yield watch
