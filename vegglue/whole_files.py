"""Files that appear under their name only when they are whole, and never follow a link out of their folder."""

import errno
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from vegglue.errors import StorageError
from vegglue.wording.remedies import MAKE_ROOM, MAKE_WRITABLE

# How often, and after how many seconds each, a file that another process is writing is tried again. Chosen: a result of
# some hundred MB is written within this.
ATTEMPTS, BETWEEN = 200, 0.05
NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.EROFS)
# Flags of POSIX; Windows opens neither links nor pipes by accident.
NOT_FOLLOWED = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
LOCKED_BYTE = 1 << 40  # [bytes] from the beginning: beyond what is written, as Windows writes no locked byte


def lock(handle: int, shared: bool = False) -> None:
    """Lock an open file until it is closed or its process ends.

    Parameters
    ----------
    handle : int
        Its descriptor.
    shared : bool
        Whether others may hold such a lock, too.

    Raises
    ------
    BlockingIOError
        If another process holds the lock.
    OSError
        If the file system has none.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        os.lseek(handle, LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except OSError as error:
            raise BlockingIOError(*error.args) from None
        finally:
            os.lseek(handle, 0, os.SEEK_SET)
        return
    fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)


@contextmanager
def whole_file(path: Path) -> Iterator[IO[bytes]]:
    """Open a file that takes the place of `path` when the block ends without an error; folders above it are made.

    It grows in `path`.new, which is locked: of two commands that write one result, one waits. A file that a killed
    command left there is taken over. A link of either name is replaced, not followed: the folder of a run may come from
    others.

    Raises
    ------
    OSError
        If the file cannot be written; what was there before then stays.
    StorageError
        If another process is writing it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(path.name + ".new")
    file = _locked_file(new)
    try:
        with file:
            yield file
            file.flush()
            os.fsync(file.fileno())
            if os.name != "nt":
                os.replace(new, path)
        if os.name == "nt":  # Windows renames closed files only
            os.replace(new, path)
    except BaseException:
        file.close()
        with suppress(OSError):
            new.unlink()
        raise


def folder_within(folder: Path, name: str) -> Path:
    """The place of a folder in another; a link there is taken away, not followed.

    Raises
    ------
    StorageError
        If the link cannot be removed.
    """
    within = folder / name
    if within.is_symlink():
        with failed_writes_told(within, MAKE_ROOM):
            within.unlink()
    return within


def write_file(path: Path, content: bytes, advice: str) -> None:
    """Write a file whole or not at all.

    Parameters
    ----------
    advice : str
        End of the sentence if it fails.

    Raises
    ------
    StorageError
    """
    with failed_writes_told(path, advice), whole_file(path) as file:
        file.write(content)


@contextmanager
def failed_writes_told(path: Path, advice: str) -> Iterator[None]:
    """Turn a failed write into one sentence that ends with the advice; h5py raises some of them as RuntimeError."""
    try:
        yield
    except StorageError:
        raise
    except (OSError, RuntimeError) as error:
        number, why = getattr(error, "errno", None), getattr(error, "strerror", None) or str(error)
        if number == errno.ENOSPC or "No space left" in str(error):
            raise StorageError(f"{path}: the disk is full; {advice}.") from error
        if number in NOT_ALLOWED:
            advice = MAKE_WRITABLE.format(path.parent)
        raise StorageError(f"{path}: cannot be written ({why}); {advice}.") from error


def _locked_file(path: Path) -> IO[bytes]:
    """Open an empty file of this name that no other process writes. Raises StorageError after ATTEMPTS."""
    for _ in range(ATTEMPTS):
        try:
            file = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | NOT_FOLLOWED, 0o666), "wb")
        except OSError as error:
            if error.errno != errno.ELOOP:
                raise
            path.unlink(missing_ok=True)  # a link
            continue
        try:
            lock(file.fileno())
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


def _is_named(file: IO[bytes], path: Path) -> bool:
    """Whether the open file lies at `path` and has no other name; a second name is removed."""
    mine = os.fstat(file.fileno())
    with suppress(FileNotFoundError):
        there = os.stat(path, follow_symlinks=False)
        if (there.st_dev, there.st_ino) != (mine.st_dev, mine.st_ino):
            return False
        if mine.st_nlink == 1:
            return True
        path.unlink()
    return False
