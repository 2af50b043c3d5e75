"""The entry point of the shell: its list of commands, and what becomes of errors."""

import sys
from collections.abc import Callable

import typer

from vegglue.cli.effect_commands import effects_command
from vegglue.cli.ensemble_commands import check_command, infer_command, report_command, run_command, simulate_command
from vegglue.cli.loop_commands import (
    compare_command,
    diagnose_command,
    extend_command,
    import_command,
    next_command,
)
from vegglue.cli.options import console
from vegglue.cli.twin_commands import reveal_command, twin_command
from vegglue.errors import InputError, StorageError
from vegglue.parallel import one_thread
from vegglue.version import VERSION

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)


@app.callback()
def about() -> None:
    """Calibrate a model of flow through plants against measured velocities, and see where it fails.

    check, then run, or its steps: simulate, infer, diagnose, extend, compare, next, report. Every command takes the
    same CONFIG and works in runs/<name>.
    """


def version_command() -> None:
    """Print the version."""
    console.print(VERSION)


COMMANDS: dict[str, Callable[..., None]] = {
    "version": version_command,
    "check": check_command,
    "simulate": simulate_command,
    "infer": infer_command,
    "report": report_command,
    "run": run_command,
    "import": import_command,
    "diagnose": diagnose_command,
    "extend": extend_command,
    "compare": compare_command,
    "next": next_command,
    "twin": twin_command,
    "reveal": reveal_command,
    "effects": effects_command,
}
for _name, _command in COMMANDS.items():
    app.command(name=_name)(_command)


def main() -> None:
    """Entry point: errors a user can mend are one sentence and exit code 2, a full disk or a lock 3, Ctrl-C 130."""
    try:
        with one_thread():
            app()
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    except StorageError as error:
        print(error, file=sys.stderr)
        sys.exit(3)
    except SystemExit as ended:
        if ended.code == 130:  # typer has made this of Ctrl-C
            print("Stopped; what was solved is kept, run the same command again to go on.", file=sys.stderr)
        raise


if __name__ == "__main__":
    main()
