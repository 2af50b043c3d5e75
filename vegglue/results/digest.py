"""A digest of all bytes of a result file, as a line behind its end: what has changed since is noticed when it is read.

The HDF5 library does not look behind the end of its file, so other readers of the format do not mind. A file without
the line, from an older version, is read too.
"""

import hashlib
import os
import stat
from functools import lru_cache
from pathlib import Path
from typing import IO

MARK = b"\nvegglue sha256 "
LENGTH = len(MARK) + 64 + 1
BLOCK = 1 << 20  # bytes read at once


def with_digest(content: bytes) -> bytes:
    """The content of a file, and the line behind it."""
    return content + _line(hashlib.sha256(content).hexdigest())


def append_digest(path: Path) -> None:
    """Put the line behind a file, in place of one that is there. Errors: OSError."""
    with path.open("r+b") as file:
        size = os.fstat(file.fileno()).st_size - (LENGTH if _stated(file) else 0)
        digest = _digest_of(file, size)
        file.seek(size)
        file.write(_line(digest))
        file.truncate()
        file.flush()
        os.fsync(file.fileno())


def state_of(path: Path) -> tuple[Path, int, int, int]:
    """What is another as soon as a file is: its place, size [bytes], inode and time. Errors: OSError."""
    now = path.stat()
    if not stat.S_ISREG(now.st_mode):  # opening a pipe would wait
        raise OSError("it is not a file")
    return path.resolve(), now.st_size, now.st_ino, now.st_mtime_ns


@lru_cache(maxsize=64)
def is_unchanged(path: Path, *state: int) -> bool | None:
    """Whether a file has the digest that stands behind it; None where none does. Errors: OSError.

    state: looked at once for each, however often the file is opened.
    """
    with path.open("rb") as file:
        stated = _stated(file)
        return None if stated is None else stated == _digest_of(file, os.fstat(file.fileno()).st_size - LENGTH)


def _line(digest: str) -> bytes:
    return MARK + digest.encode() + b"\n"


def _stated(file: IO[bytes]) -> str | None:
    size = os.fstat(file.fileno()).st_size
    if size < LENGTH:
        return None
    file.seek(size - LENGTH)
    line = file.read(LENGTH)
    return line[len(MARK) : -1].decode(errors="replace") if line.startswith(MARK) else None


def _digest_of(file: IO[bytes], size: int) -> str:
    """Of the first bytes of a file."""
    digest = hashlib.sha256()
    file.seek(0)
    while size > 0 and (block := file.read(min(BLOCK, size))):
        digest.update(block)
        size -= len(block)
    return digest.hexdigest()
