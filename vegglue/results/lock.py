"""One run at a time in a folder: a lock that the operating system drops when its holder dies."""

import fcntl
import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from vegglue.errors import StorageError


@contextmanager
def hold_lock(folder: Path) -> Iterator[None]:
    """Hold `folder/.lock` for the length of the block; the file says who holds it (pid, host, time).

    The lock itself is `flock`, so what a killed run left behind is taken over without asking. The file is emptied, not
    removed: removing a locked file would let two runs hold two files of one name. A link is not followed: what it names
    is another's.

    Errors: StorageError when a living process holds it, or the folder cannot be written.
    """
    path = folder / ".lock"
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written ({error.strerror}); make {folder} writable.") from error
    try:
        _take(handle, path)
        yield
        os.ftruncate(handle, 0)
    finally:
        os.close(handle)


def _take(handle: int, path: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise StorageError(f"{path.parent} is in use by {_holder(path)}; wait for it to end, or stop it.") from error
    except OSError as error:
        raise StorageError(f"{path}: this file system cannot lock ({error.strerror}); use a local folder.") from error
    mark = {"pid": os.getpid(), "host": socket.gethostname(), "since": datetime.now(UTC).isoformat(timespec="seconds")}
    os.ftruncate(handle, 0)
    os.write(handle, json.dumps(mark).encode())


def _holder(path: Path) -> str:
    try:
        mark = json.loads(path.read_text())
        return f"process {mark['pid']} on {mark['host']} since {mark['since']}"
    except (OSError, ValueError, KeyError):
        return "another process"
