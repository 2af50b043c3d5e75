"""Files of libraries that damage may harm are read by a process of its own first, within limits of time and memory.

On damaged files the HDF5 library and scipy's reader of MATLAB files may loop, ask for any memory or crash, and nothing
stops them from within. A digest is no help: it can be forged with the file. Such a process takes a third of a second to
start, so that one reads all files that a command opens. Where processes can be forked each file has a copy of it, made
once the libraries are there, for some milliseconds: what a damaged file harms ends with its copy.
"""

import atexit
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from threading import Lock

from vegglue.errors import StorageError

# Longest time of a reading: a start, and a rate. Chosen: slow network disks are twice as fast, and a healthy file is
# read at a hundred times this rate from a local one.
LONGEST_START, FEWEST_BYTES = 20.0, 5e6  # [s], [bytes/s]
MEMORY = 2 << 30  # [bytes] of addresses: libraries take half of one, and values are read by blocks
CRASHED = "its reader crashed"
LONGEST_ANSWER = 2000  # [bytes]: pipes hand over up to 4096 at once, so that an answer is whole or not there
FORKS = hasattr(os, "fork")
CHILD = "import sys; sys.path.append(sys.argv[1]); from vegglue.sandboxed_reader import serve; serve()"
_Reader = subprocess.Popen[bytes]
_ASKING = Lock()


@lru_cache(maxsize=64)
def why_unreadable(path: Path, size: int, *state: int, by: str) -> str | None:
    """Read a file in the other process, once for each `state`, and return why that fails, or None.

    Parameters
    ----------
    size : int
        Size of the file [bytes].
    state : int
        Changes when the file changes, as its time does.
    by : str
        The reader, `module:function`; given the path as text, it returns why it fails, or None.

    Raises
    ------
    StorageError
        If no process can be started.
    """
    longest = LONGEST_START + size / FEWEST_BYTES
    with _ASKING:
        try:
            reader = _reader(os.getpid())
            if reader.poll() is not None:
                _dismiss(reader, os.getpid())
                reader = _reader(os.getpid())
        except OSError as error:
            why = error.strerror
            raise StorageError(f"{path}: no process can be started to read it ({why}); close others.") from error
        try:
            why = _answer(reader, path, by, longest)
        except BaseException:  # Ctrl-C: the answer would be taken for that to the next question
            _dismiss(reader, os.getpid())
            raise
        if why is not None and not FORKS:  # a damaged file may have harmed its reader
            _dismiss(reader, os.getpid())
    return why


@lru_cache(maxsize=1)
def _reader(asking: int) -> _Reader:
    """The process that reads for the process `asking`; a forked process gets one of its own."""
    reader = subprocess.Popen(
        [sys.executable, "-P", "-c", CHILD, str(Path(__file__).parents[1])],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"}, process_group=0 if FORKS else None,
    )  # fmt: skip
    atexit.register(_dismiss, reader, asking)
    return reader


def _dismiss(reader: _Reader, asking: int) -> None:
    """End a reader; the next question starts another. A forked process leaves that of its parent alone."""
    if os.getpid() != asking:
        return
    _reader.cache_clear()
    _kill(reader)
    with reader:  # closes its pipes and waits for its end
        pass


def _kill(reader: _Reader) -> None:
    """End a reader and its copy at once."""
    if not FORKS:
        reader.kill()
    elif reader.poll() is None:  # else its number may be another's
        os.killpg(reader.pid, signal.SIGKILL)


def _answer(reader: _Reader, path: Path, by: str, longest: float) -> str | None:
    assert reader.stdin is not None
    assert reader.stdout is not None
    with suppress(BrokenPipeError, OSError):  # it has ended, and answers nothing
        reader.stdin.write(f"{longest:.0f} {by} {os.fsencode(path).hex()}\n".encode())
    pool = ThreadPoolExecutor(1)  # pipes of Windows can be waited for by a thread only
    try:
        answer = pool.submit(reader.stdout.readline).result(longest).decode(errors="replace")
    except TimeoutError:
        _kill(reader)  # ends the thread's reading, too
        return f"it is not read to its end within {longest:.0f} s"
    finally:
        pool.shutdown(wait=False)
    return CRASHED if not answer else answer.strip() or None


def serve() -> None:
    """Read one file after another in the process of its own, and answer each with a line: why that fails, or nothing.

    Each line of the input is the longest time [s], the reader, and the path.
    """
    _limit("RLIMIT_AS", MEMORY)
    _limit("RLIMIT_CORE", 0)
    for line in sys.stdin:
        longest, by, path = line.split()
        if FORKS:
            import_module(by.partition(":")[0])
            if copy := os.fork():
                _, ended = os.waitpid(copy, 0)
                if ended:
                    os.write(sys.stdout.fileno(), CRASHED.encode() + b"\n")
                continue
        # The other process may have been killed meanwhile: nothing else ends a reading that loops.
        _limit("RLIMIT_CPU", int(time.process_time() + 2.0 * float(longest)) + 2)
        module, _, function = by.partition(":")
        try:
            why = getattr(import_module(module), function)(os.fsdecode(bytes.fromhex(path))) or ""
        except MemoryError:
            why = "it needs more memory than it can fill"
        except Exception as error:  # whatever the library raises
            why = str(error) or type(error).__name__
        os.write(sys.stdout.fileno(), " ".join(why.split()).encode(errors="replace")[:LONGEST_ANSWER] + b"\n")
        if FORKS:
            os._exit(0)


def _limit(what: str, most: int) -> None:
    """Set a limit of this process, on systems that have it."""
    with suppress(ImportError, AttributeError, ValueError, OSError):
        import resource

        number = getattr(resource, what)
        resource.setrlimit(number, (most, resource.getrlimit(number)[1]))
