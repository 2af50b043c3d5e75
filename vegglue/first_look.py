"""Files of libraries that damage may harm are read by a process of its own first, within limits of time and memory.

On damaged files the HDF5 library and scipy's reader of MATLAB files may read in circles, ask for any memory or crash,
and nothing stops them from within. A digest is no help: who makes such a file can put the right one behind it. A
process takes a third of a second to begin, so that one reads all files that a command opens.
"""

import atexit
import os
import resource
import select
import subprocess
import sys
import time
from contextlib import suppress
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from threading import Lock

from vegglue.errors import StorageError

# How long the reading may take: a start, and bytes in a second. Chosen: slow network disks are twice as fast, and what
# is healthy is read at a hundred times this rate from a local one.
LONGEST_START, FEWEST_BYTES = 20.0, 5e6  # [s], [bytes/s]
MEMORY = 2 << 30  # [bytes] of addresses: libraries take half of one, and values are read by blocks
LONGEST_ANSWER = 2000  # [bytes]: pipes hand over up to 4096 at once, so that an answer is there whole or not at all
CHILD = "import sys; sys.path.append(sys.argv[1]); from vegglue.first_look import serve; serve()"
_Reader = subprocess.Popen[bytes]
_ASKING = Lock()


@lru_cache(maxsize=64)
def why_unreadable(path: Path, size: int, *state: int, by: str) -> str | None:
    """Why a process of its own does not come to the end of a file of this size [bytes], in words; None when it does.

    state: looked at once for each, however often the file is opened; by: what reads it, `module:function`, given the
    path as text, which says why it does not, or None. Errors: StorageError when no process can be begun.
    """
    longest = LONGEST_START + size / FEWEST_BYTES
    with _ASKING:
        try:
            reader = _living_reader()
        except OSError as error:
            why = error.strerror
            raise StorageError(f"{path}: no process can be begun to read it ({why}); close others.") from error
        try:
            why = _answer(reader, path, by, longest)
        except BaseException:  # Ctrl-C: the answer would be taken for that to the next question
            _dismiss(reader, os.getpid())
            raise
        if why is not None:  # a damaged file may have harmed whoever read it
            _dismiss(reader, os.getpid())
    return why


def _living_reader() -> _Reader:
    """The process that reads for this one: begun when first asked, and again when something has ended it."""
    reader = _reader(os.getpid())
    if reader.poll() is None:
        return reader
    _dismiss(reader, os.getpid())
    return _reader(os.getpid())


@lru_cache(maxsize=1)
def _reader(asking: int) -> _Reader:
    """asking: the process that it reads for; one that was forked has a reader of its own."""
    reader = subprocess.Popen(
        [sys.executable, "-P", "-c", CHILD, str(Path(__file__).parents[1])],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    atexit.register(_dismiss, reader, asking)
    return reader


def _dismiss(reader: _Reader, asking: int) -> None:
    """End a reader; the next question begins another. What a forked process inherits is not its own to end."""
    if os.getpid() != asking:
        return
    _reader.cache_clear()
    reader.kill()
    with reader:  # which closes its pipes and waits for its end
        pass


def _answer(reader: _Reader, path: Path, by: str, longest: float) -> str | None:
    """What the reader says of a file."""
    assert reader.stdin is not None
    assert reader.stdout is not None
    with suppress(BrokenPipeError):  # it has ended, and says nothing
        reader.stdin.write(f"{longest:.0f} {by} {os.fsencode(path).hex()}\n".encode())
    if not select.select([reader.stdout], [], [], longest)[0]:
        return f"it is not read to its end within {longest:.0f} s"
    answer = reader.stdout.readline().decode(errors="replace")
    return "its reader crashed" if not answer else answer.strip() or None


def serve() -> None:
    """Read one file after another, and say for each why that fails or nothing: what the process of its own does.

    Each line of the input is the longest time [s], what reads the file, and its path.
    """
    _limit(resource.RLIMIT_AS, MEMORY)
    _limit(resource.RLIMIT_CORE, 0)
    for line in sys.stdin:
        longest, by, path = line.split()
        # Whoever asked may have been killed meanwhile: nobody else ends a reading in circles.
        _limit(resource.RLIMIT_CPU, int(time.process_time() + 2.0 * float(longest)) + 2)  # later than whoever waits
        why = " ".join((_why_not(by, os.fsdecode(bytes.fromhex(path))) or "").split())
        os.write(sys.stdout.fileno(), why.encode(errors="replace")[:LONGEST_ANSWER] + b"\n")


def _limit(what: int, most: int) -> None:
    with suppress(ValueError, OSError):  # some systems know no such limit
        resource.setrlimit(what, (most, resource.getrlimit(what)[1]))


def _why_not(by: str, path: str) -> str | None:
    module, _, function = by.partition(":")
    try:
        return getattr(import_module(module), function)(path)
    except MemoryError:
        return "it asks for more memory than it can fill"
    except Exception as error:  # whatever the library raises
        return str(error) or type(error).__name__
