"""One run at a time in a folder: a lock that the operating system drops when its holder ends."""

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from vegglue.errors import StorageError
from vegglue.whole_files import NOT_FOLLOWED, lock


@contextmanager
def hold_lock(folder: Path) -> Iterator[None]:
    """Hold `folder/.lock` for the length of the block; the file names its holder (pid, host, time).

    The operating system drops the lock of a killed run. The file is emptied, not removed: removing a locked file would
    let two runs hold two files of one name. A link is not followed. Raises StorageError if a living process holds the
    lock, or the folder cannot be written.
    """
    path = folder / ".lock"
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | NOT_FOLLOWED, 0o644)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written ({error.strerror}); make {folder} writable.") from error
    try:
        try:
            lock(handle)
        except BlockingIOError as error:
            raise StorageError(f"{folder} is in use by {_holder(path)}; wait for it to end, or stop it.") from error
        except OSError as error:
            raise StorageError(f"{path}: cannot be locked ({error.strerror}); use a local folder.") from error
        since = datetime.now(UTC).isoformat(timespec="seconds")
        os.ftruncate(handle, 0)
        os.write(handle, json.dumps({"pid": os.getpid(), "host": socket.gethostname(), "since": since}).encode())
        yield
        os.ftruncate(handle, 0)
    finally:
        os.close(handle)


def _holder(path: Path) -> str:
    try:
        mark = json.loads(path.read_text(encoding="utf-8"))
        return f"process {mark['pid']} on {mark['host']} since {mark['since']}"
    except (OSError, ValueError, KeyError):
        return "another process"
