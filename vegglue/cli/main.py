"""The entry point of the shell: its list of commands, exit codes, and what becomes of errors."""

import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Annotated, Any, cast

import typer

from vegglue.cli import commands
from vegglue.cli.terminal import FLAG
from vegglue.errors import InputError, StorageError
from vegglue.wording.commands import HELP, LAST_WORDS

UNREAD, MISTAKE, MACHINE, STOPPED = 1, 2, 3, 130  # exit codes


def ending_well(command: Callable[[], object]) -> None:
    """Run a command: errors a user can mend are one sentence and exit code 2, what the machine refuses (a full disk, a
    lock, no memory) 3, Ctrl-C or a plain kill 130.
    """
    for name in ("stdout", "stderr"):  # output that is closed goes nowhere
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:  # a terminal that knows fewer letters shows what it can
        reconfigure(errors="replace")
    # A plain kill, with which queues of clusters end a job at its time, is as Ctrl-C: what was started ends, too.
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        command()
    except InputError as error:
        _end(str(error), MISTAKE)
    except StorageError as error:
        _end(str(error), MACHINE)
    except OSError as error:
        where = LAST_WORDS["output"] if error.filename is None else error.filename
        _end(LAST_WORDS["file"].format(where, error.strerror or error), MACHINE)
    except MemoryError:
        _end(LAST_WORDS["memory"], MACHINE)
    except RuntimeError as error:
        if not str(error).startswith("Symlink loop"):  # of Python before 3.13; later it is an OSError
            raise
        _end(LAST_WORDS["link"].format(error), MISTAKE)
    except SystemExit as ended:
        if ended.code == STOPPED:  # typer has made this of Ctrl-C
            _end(LAST_WORDS["stopped"], STOPPED)
        _flush()
        raise
    _flush()


def _end(sentence: str, code: int) -> None:
    with suppress(OSError):
        print(sentence, file=sys.stderr, flush=True)
    with suppress(OSError):
        sys.stdout.flush()
    sys.exit(code)


def _flush() -> None:
    """Print what waits, now, while a full disk can still be reported."""
    try:
        sys.stdout.flush()
    except OSError as error:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python tries, and complains, again
        if isinstance(error, BrokenPipeError):  # `| head` has read enough: as click ends it where it prints at once
            sys.exit(UNREAD)
        _end(LAST_WORDS["file"].format(LAST_WORDS["output"], error.strerror), MACHINE)


app = typer.Typer(rich_markup_mode="rich", no_args_is_help=True, pretty_exceptions_enable=False)


def _print_version(asked: bool) -> None:
    if asked:
        commands.version_command()
        raise typer.Exit


@app.callback()
def about(
    version: Annotated[
        bool,
        typer.Option("--version", metavar=FLAG, callback=_print_version, is_eager=True, help=HELP["about.version"]),
    ] = False,
) -> None:
    """Calibrate a two-dimensional model of flow through plants, and find what it lacks.

    Begin with new or import, then check and run. Results are in runs/<name>/.
    """


# By group, in the order in which they are used.
COMMANDS = {
    "Begin": ("demo", "new", "plan", "import", "check", "run"),
    "The loop": ("diagnose", "discover", "extend", "compare", "next"),
    "Ensemble": ("simulate", "infer", "report", "overview"),
    "More": ("export", "effects", "twin", "reveal", "version"),
}
for _group, _names in COMMANDS.items():
    for _name in _names:
        app.command(name=_name, rich_help_panel=_group)(getattr(commands, f"{_name}_command"))


# What typer raises for a command line that it cannot read; its own copy of click's, or that of click.
UsageError = cast("type[typer.BadParameter]", typer.BadParameter.__bases__[0])


def run_app() -> None:
    """Run the command of the shell; a value that an option does not take is one sentence as any other mistake."""
    try:
        code = app(standalone_mode=False)
    except UsageError as error:
        problems: list[dict[str, Any]] = getattr(error.__cause__, "errors", list)()  # newer typer reads by pydantic
        if problems and error.param is not None:
            from vegglue.case.messages import expected_in_words

            choice, got = problems[0].get("ctx", {}).get("error", ""), problems[0]["input"]
            expected = "" if choice else expected_in_words(problems[0])
            option = error.param.opts[-1]
            raise InputError("option_value", option=option, expected=expected, choice=str(choice), got=got) from None
        error.show()
        code = error.exit_code
    sys.exit(code)


def main() -> None:
    """Entry point."""
    ending_well(run_app)


if __name__ == "__main__":
    main()
