"""A Python that hides what only POSIX has, before anything is imported, by `PYTHONPATH=tests/_without_posix`.

Processes are spawned, and msvcrt has the one function that is used: a lock that one handle alone holds.
"""

import errno
import fcntl
import multiprocessing
import multiprocessing.popen_spawn_posix
import os
import subprocess  # noqa: F401
import sys
import types
from contextlib import suppress
from importlib.abc import MetaPathFinder

import joblib  # noqa: F401
import psutil  # noqa: F401

with suppress(ImportError):  # of dask
    import locket  # noqa: F401

HIDDEN = ("fcntl", "resource", "pwd", "grp", "termios")


class Hidden(MetaPathFinder):
    """Finds none of the hidden modules, so that importing one fails as on Windows."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        if name in HIDDEN:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


# Those above look for msvcrt, or have other code for this system than for Windows: they are imported first.
for name in HIDDEN:
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Hidden())


def locking(handle: int, mode: int, size: int) -> None:
    """Locks an open file until it is closed, or raises OSError as Windows does."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise OSError(errno.EACCES, "Permission denied") from None


windows = types.ModuleType("msvcrt")
windows.LK_NBLCK = 2  # type: ignore[attr-defined]
windows.locking = locking  # type: ignore[attr-defined]
sys.modules["msvcrt"] = windows
del os.killpg, os.fork
multiprocessing.set_start_method("spawn", force=True)
