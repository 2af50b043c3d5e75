"""What the commands share: the console, and the options that mean the same everywhere."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from vegglue.errors import InputError

# Into a file or a pipe, lines as long as they need to be.
# Names such as `discharge_error[high]` are no markup.
console = Console(highlight=False, soft_wrap=True, markup=False, width=None if sys.stdout.isatty() else 200)
Config = Annotated[Path, typer.Argument(help="The case, a YAML file.", show_default=False)]
Runs = Annotated[Path, typer.Option(help="Folder that holds one folder for each run.")]
Jobs = Annotated[int, typer.Option(min=-1, help="Cores at once; -1 for all. Results do not depend on it.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of words.")]
Trust = Annotated[bool, typer.Option("--trust", help="Run the effects of the config's own `effect_file`.")]


def say_on(quiet: bool = False) -> Callable[[str], None]:
    def say(text: str) -> None:
        if not quiet:
            console.print(f"... {text}", style="dim")

    return say


def number_given(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(f"--shape: expected NAME=NUMBER, got {text!r}; e.g. --shape width=0.5.") from None
