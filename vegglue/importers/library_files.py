"""Files that a library reads: workbooks, GeoTIFFs, shapefiles, MATLAB files. Whatever one of them makes of a damaged
file, and however many numbers a small file unpacks to, the user reads one sentence.
"""

import logging
import struct
import traceback
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vegglue.case.size_limits import LARGEST_DATA
from vegglue.errors import InputError, shown_path

COMPRESSED, AT_ONCE_UNPACKED = 15, 1 << 20  # type of an element of a MATLAB file; [bytes]
LONGEST_COMPLAINT = 200  # letters of what a library says; some quote the file


@contextmanager
def read_by_library(path: Path, kind: str, logger: str = "", advice: str = "save it anew") -> Iterator[None]:
    """Within, a library reads a file: its warnings and its log are not shown, its errors are told as one.

    kind: what the file should be, in words; advice: how its sentence ends. Errors: InputError when it is larger than a
    file of data may be, or the library fails in whatever way.
    """
    log = logging.getLogger(logger) if logger else None
    before = None if log is None else log.disabled
    try:
        refuse_larger(path, path.stat().st_size)
        if log is not None:
            log.disabled = True
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with _frames_cleared():
                yield
    except (InputError, MemoryError):
        raise
    except Exception as error:  # on damaged files libraries raise anything
        lines = str(error).splitlines() or [type(error).__name__]
        complaint = lines[0][:LONGEST_COMPLAINT]
        raise InputError(f"{shown_path(path)} cannot be read as {kind}: {complaint}; {advice}.") from None
    finally:
        if log is not None and before is not None:
            log.disabled = before


@contextmanager
def _frames_cleared() -> Iterator[None]:
    """What a library that fails leaves open is closed at once, while nobody hears its warnings."""
    try:
        yield
    except Exception as error:
        traceback.clear_frames(error.__traceback__)
        raise


def refuse_larger_matlab(path: Path) -> None:
    """Errors: InputError when the variables of a MATLAB file of version 5 unpack to more than a file of data may be.

    Format: MAT-File Format (MathWorks): a header of 128 bytes that ends in the order of bytes, then elements, each with
    its type and its size; those of type 15 are packed by deflate.
    """
    with path.open("rb") as file:
        order = "<" if file.read(128)[126:] == b"IM" else ">"
        total = 0
        while len(head := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", head)
            rest = file.read(size)
            total += len(rest)
            unpacker = zlib.decompressobj()
            while kind == COMPRESSED and rest and not unpacker.eof:
                total += len(unpacker.decompress(rest, AT_ONCE_UNPACKED))
                rest = unpacker.unconsumed_tail
                refuse_larger(path, total)


def refuse_larger(path: Path, size: int) -> None:
    """Errors: InputError when what a file holds, packed or unpacked, is more than a file of data may be [bytes]."""
    if size > LARGEST_DATA:
        raise InputError(f"{shown_path(path)}: expected at most {LARGEST_DATA:,} bytes, got {size:,}; make it smaller.")
