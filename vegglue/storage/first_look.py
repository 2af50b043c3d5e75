"""A result file that states no digest is read by a process of its own first, within limits of time and memory.

On damaged files the HDF5 library may read in circles, ask for any memory or crash, and nothing stops it from within. A
file whose digest is right has been whole once; one without was cut, is of another program, or is still growing.
"""

import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import h5py
import numpy as np

from vegglue.errors import StorageError
from vegglue.storage.foreign_files import why_foreign

# How long the reading may take: a start, and bytes in a second. Chosen: slow network disks are twice as fast, and what
# is healthy is read at a hundred times this rate from a local one.
LONGEST_START, FEWEST_BYTES = 20.0, 5e6  # [s], [bytes/s]
MEMORY = 2 << 30  # [bytes] of addresses: libraries take half of one, and values are read by blocks
AT_ONCE = 1 << 26  # [bytes] of values read at once
CHILD = "import sys; sys.path.append(sys.argv[1]); from vegglue.storage.first_look import look; look(sys.argv[2])"


@lru_cache(maxsize=64)
def why_unreadable(path: Path, size: int, *state: int) -> str | None:
    """Why a process of its own does not come to the end of a file of this size [bytes], in words; None when it does.

    state: looked at once for each, however often the file is opened. Errors: StorageError when no process can be begun.
    """
    longest = LONGEST_START + size / FEWEST_BYTES
    command = [sys.executable, "-P", "-c", CHILD, str(Path(__file__).parents[2]), str(path)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", timeout=longest, check=False,
            stdin=subprocess.DEVNULL, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"it is not read to its end within {longest:.0f} s"
    except OSError as error:
        raise StorageError(f"{path}: no process can be begun to read it ({error.strerror}); close others.") from error
    if done.returncode == 0:
        return None
    return (done.stdout.splitlines() or ["its reader crashed"])[-1]


def look(path: str) -> None:
    """Read all of a file, or print why that fails and end with code 1: what the process of its own does."""
    for limit, most in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CORE, 0)):
        with suppress(ValueError, OSError):  # some systems know no such limit
            resource.setrlimit(limit, (most, most))
    why = _why_not_to_its_end(path)
    if why is not None:
        print(why.encode(errors="replace").decode())
        sys.exit(1)


def _why_not_to_its_end(path: str) -> str | None:
    try:
        with h5py.File(path, "r", locking=False) as file:
            if why_foreign(file) is None:  # else the command says so itself
                for _ in _all_values(file):
                    pass
    except MemoryError:
        return "it asks for more memory than it can fill"
    except Exception as error:  # whatever the library raises
        return str(error) or type(error).__name__
    return None


def _all_values(file: h5py.File) -> Iterator[object]:
    yield dict(file.attrs)
    for group in file.values():
        yield dict(group.attrs)
        for dataset in group.values():
            yield dict(dataset.attrs)
            for rows in _blocks(dataset):
                yield dataset[rows]


def _blocks(dataset: h5py.Dataset) -> Iterator[slice | tuple[()]]:
    """Rows, so many at once as are one block."""
    if not dataset.shape:
        yield ()
        return
    row = max(dataset.dtype.itemsize * int(np.prod(dataset.shape[1:], dtype=object)), 1)
    step = max(AT_ONCE // row, 1)
    for start in range(0, dataset.shape[0], step):
        yield slice(start, start + step)
