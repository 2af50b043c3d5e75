"""What the commands share: the options that mean the same everywhere."""

from pathlib import Path
from typing import Annotated

import typer

from vegglue.errors import InputError

# What stands for the value of an option that takes none: typer 0.29 would write `<bool>`, as if it took one.
FLAG = " "

Config = Annotated[Path, typer.Argument(help="The case, a YAML file.", show_default=False)]
Runs = Annotated[Path, typer.Option(help="Folder that holds one folder for each run.")]
# Where results lie unless told.
RUNS = Path("runs")


def _some(jobs: int) -> int:
    if jobs == 0:
        raise InputError("--jobs: expected the number of processes, or -1 for one on every core, got 0.")
    return jobs


Jobs = Annotated[
    int, typer.Option(min=-1, callback=_some, help="Cores at once; -1 for all. Results do not depend on it.")
]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Dask scheduler whose workers compute, tcp://HOST:PORT; or local:N, for N processes here.",
    ),
]
Members = Annotated[
    int | None,
    typer.Option(min=1, help="Size of the ensemble instead of the config's; powers of two use the Sobol' points best."),
]
Json = Annotated[bool, typer.Option("--json", metavar=FLAG, help="Print one JSON object instead of words.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", metavar=FLAG, help="Print results only, not how far the command is.")
]
Force = Annotated[
    bool, typer.Option("--force", metavar=FLAG, help="Replace also what you made or edited, or a larger ensemble.")
]
Trust = Annotated[
    bool, typer.Option("--trust", metavar=FLAG, help="Run the config's `effect_file` and the command of its `engine`.")
]


def number_given(text: str) -> tuple[str, float]:
    """NAME=NUMBER as both."""
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(f"--shape: expected NAME=NUMBER, got {text!r}; e.g. --shape width=0.5.") from None
