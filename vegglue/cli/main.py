"""The entry point of the shell: its list of commands, and what becomes of errors."""

from collections.abc import Callable
from typing import Annotated

import typer

from vegglue.cli.effect_commands import effects_command
from vegglue.cli.endings import ending_well
from vegglue.cli.ensemble_commands import check_command, infer_command, report_command, run_command, simulate_command
from vegglue.cli.loop_commands import (
    compare_command,
    diagnose_command,
    discover_command,
    extend_command,
    import_command,
    next_command,
    overview_command,
)
from vegglue.cli.map_commands import export_command, new_command
from vegglue.cli.options import FLAG
from vegglue.cli.twin_commands import reveal_command, twin_command
from vegglue.version import VERSION

app = typer.Typer(rich_markup_mode="rich", no_args_is_help=True, pretty_exceptions_enable=False)


def version_command() -> None:
    """Print the version."""
    print(VERSION)


def _print_version(asked: bool) -> None:
    if asked:
        version_command()
        raise typer.Exit


@app.callback()
def about(
    version: Annotated[
        bool,
        typer.Option("--version", metavar=FLAG, callback=_print_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Calibrate a model of flow through plants against measured velocities, and see where it fails.

    Begin with check, then run, or take its steps one by one; all work in runs/<name>.
    """


# By group, in the order in which they are used.
COMMANDS: dict[str, dict[str, Callable[..., None]]] = {
    "Begin": {"new": new_command, "import": import_command, "check": check_command, "run": run_command},
    "The loop": {
        "diagnose": diagnose_command,
        "discover": discover_command,
        "extend": extend_command,
        "compare": compare_command,
        "next": next_command,
    },
    "Ensemble": {
        "simulate": simulate_command,
        "infer": infer_command,
        "report": report_command,
        "overview": overview_command,
    },
    "More": {
        "export": export_command,
        "effects": effects_command,
        "twin": twin_command,
        "reveal": reveal_command,
        "version": version_command,
    },
}
for _group, _commands in COMMANDS.items():
    for _name, _command in _commands.items():
        app.command(name=_name, rich_help_panel=_group)(_command)


def main() -> None:
    """Entry point."""
    ending_well(app)


if __name__ == "__main__":
    main()
