"""What the commands share: options that mean the same everywhere, and a config opened with warnings on its data."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import vegglue
from vegglue.errors import InputError
from vegglue.wording.commands import HELP

if TYPE_CHECKING:
    from vegglue.workflow.case_run import CaseRun

# What stands for the value of an option that takes none: typer 0.29 would write `<bool>`, as if it took one.
FLAG = " "

Config = Annotated[Path, typer.Argument(help=HELP["config"], show_default=False)]
Runs = Annotated[Path, typer.Option(help=HELP["runs"])]
# Where results lie by default.
RUNS = Path("runs")


def _some(jobs: int) -> int:
    if jobs == 0:
        raise InputError("--jobs: expected the number of processes, or -1 for one on every core, got 0.")
    return jobs


Jobs = Annotated[int, typer.Option(min=-1, callback=_some, help=HELP["jobs"])]
MemoryLimit = Annotated[float | None, typer.Option(min=0.1, metavar="GB", help=HELP["memory"])]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help=HELP["cluster"],
    ),
]
Members = Annotated[
    int | None,
    typer.Option(min=1, help=HELP["members"]),
]
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
