"""How a command ends: its exit code, and one sentence where something went wrong; and what it prints to."""

import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress

from vegglue.errors import InputError, StorageError

MISTAKE, MACHINE, STOPPED = 2, 3, 130  # exit codes
KEPT_ANYWAY = "what was finished is kept"


def ending_well(command: Callable[[], object]) -> None:
    """Run a command: errors a user can mend are one sentence and exit code 2, what the machine refuses (a full disk, a
    lock, no memory) 3, Ctrl-C or a plain kill 130.
    """
    _make_printable()
    _heed_kill()
    try:
        command()
    except InputError as error:
        _end(str(error), MISTAKE)
    except StorageError as error:
        _end(str(error), MACHINE)
    except OSError as error:
        where = "The output, or a file," if error.filename is None else error.filename
        _end(f"{where} cannot be used ({error.strerror or error}); {KEPT_ANYWAY}: mend that, run it again.", MACHINE)
    except MemoryError:
        _end(f"The memory is full; {KEPT_ANYWAY}: run it again with fewer --jobs, or a coarser grid.", MACHINE)
    except RuntimeError as error:
        if not str(error).startswith("Symlink loop"):  # of Python before 3.13; later it is an OSError
            raise
        _end(f"A link leads back to itself ({error}); give another path.", MISTAKE)
    except SystemExit as ended:
        if ended.code == STOPPED:  # typer has made this of Ctrl-C
            _end("Stopped; solved members and finished steps are kept: run the same command again.", STOPPED)
        _flush()
        raise
    _flush()


def _end(sentence: str, code: int) -> None:
    with suppress(OSError):
        print(sentence, file=sys.stderr, flush=True)
    with suppress(OSError):
        sys.stdout.flush()
    sys.exit(code)


def _make_printable() -> None:
    """Output that is closed goes nowhere, and a terminal that knows fewer letters shows what it can."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors="replace")


def _heed_kill() -> None:
    """A plain kill, with which queues of clusters end a job at its time, is as Ctrl-C: what was started ends, too."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def _flush() -> None:
    """Print what waits, now, while a full disk can still be told."""
    try:
        sys.stdout.flush()
    except OSError as error:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python tries, and complains, again
        _end(f"The output cannot be used ({error.strerror}); {KEPT_ANYWAY}: mend that, run it again.", MACHINE)
