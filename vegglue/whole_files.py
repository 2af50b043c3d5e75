"""Files that appear under their name only when they are whole, and never follow a link out of their folder."""

import errno
import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from vegglue.errors import StorageError

# How often, and after how many seconds each, a file that another process is writing is tried again. Chosen: a result of
# some hundred MB is written within this.
ATTEMPTS, BETWEEN = 200, 0.05
MAKE_ROOM = "make room and run it again"
NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.EROFS)


@contextmanager
def whole_file(path: Path) -> Iterator[IO[bytes]]:
    """A file to write, which takes the place of `path` when the block ends well; folders above it are made.

    It grows in `path`.new, which is locked: of two commands that write one result, one waits. What a killed command
    left there is taken over. A link of either name is replaced, not followed: the folder of a run may come from others.
    Errors: OSError when it cannot be written, and then what was there before stays.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(path.name + ".new")
    with _held(new) as file:
        try:
            yield file
            file.flush()
            os.fsync(file.fileno())
            os.replace(new, path)
        except BaseException:
            with suppress(OSError):
                new.unlink()
            raise


def folder_within(folder: Path, name: str) -> Path:
    """The place of a folder in another; a link there is taken away, not followed. Errors: StorageError."""
    within = folder / name
    if within.is_symlink():
        with failed_writes_told(within, MAKE_ROOM):
            within.unlink()
    return within


def write_file(path: Path, content: bytes, advice: str) -> None:
    """Write a file whole or not at all. Errors: StorageError, which ends with the advice."""
    with failed_writes_told(path, advice), whole_file(path) as file:
        file.write(content)


@contextmanager
def failed_writes_told(path: Path, advice: str) -> Iterator[None]:
    """Turn a failed write into one sentence that ends with the advice; h5py tells some of them as RuntimeError."""
    try:
        yield
    except StorageError:
        raise
    except (OSError, RuntimeError) as error:
        number, why = getattr(error, "errno", None), getattr(error, "strerror", None) or str(error)
        if number == errno.ENOSPC or "No space left" in str(error):
            raise StorageError(f"{path}: the disk is full; {advice}.") from error
        if number in NOT_ALLOWED:
            advice = f"make the folder {path.parent} writable, then run it again"
        raise StorageError(f"{path}: cannot be written ({why}); {advice}.") from error


def _held(path: Path) -> IO[bytes]:
    """An empty file of this name that nobody else writes."""
    for _ in range(ATTEMPTS):
        file = _opened(path)
        if file is None:
            continue
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            time.sleep(BETWEEN)
            continue
        except OSError:
            pass  # a file system without locks: as good as it gets
        if _is_named(file, path):
            file.truncate(0)
            return file
        file.close()  # another process has renamed it meanwhile, or it is a second name of some file
    raise StorageError(f"{path}: another process is writing this; wait for it to end, or stop it.")


def _opened(path: Path) -> IO[bytes] | None:
    """The file as it is, made if need be; None where a link was taken away first. No pipe makes it wait."""
    try:
        return os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666), "wb")
    except OSError as error:
        if error.errno != errno.ELOOP:
            raise
        path.unlink(missing_ok=True)
        return None


def _is_named(file: IO[bytes], path: Path) -> bool:
    """Whether the open file is what lies there, under no other name; a second name is taken away."""
    mine = os.fstat(file.fileno())
    with suppress(FileNotFoundError):
        there = os.stat(path, follow_symlinks=False)
        if (there.st_dev, there.st_ino) != (mine.st_dev, mine.st_ino):
            return False
        if mine.st_nlink == 1:
            return True
        path.unlink()
    return False
