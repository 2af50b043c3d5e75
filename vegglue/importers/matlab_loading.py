"""MATLAB files of version 5, loaded by the process of `sandboxed_reader` before the command loads them, and their
structures read.
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat

from vegglue.arrays import Array
from vegglue.errors import InputError, shown_path
from vegglue.importers.library_files import read_by_library, refuse_larger_matlab
from vegglue.sandboxed_reader import why_unreadable

READ_MATLAB = f"{__name__}:read_all_variables"  # as `sandboxed_reader` names it
KIND = "a MATLAB file of version 5"


def loaded_matlab(path: Path) -> dict[str, Any]:
    """The variables of a file, structures as objects. Errors: those of refuse_unreadable_matlab."""
    refuse_unreadable_matlab(path, KIND)
    with read_by_library(path, KIND):
        found: dict[str, Any] = loadmat(path, struct_as_record=False, squeeze_me=True)
    return found


def refuse_unreadable_matlab(path: Path, kind: str) -> None:
    """Errors: InputError for a file that is too large, or that a process of its own does not read to its end; kind:
    what it should be, in words. StorageError when no process can be begun.
    """
    with read_by_library(path, kind):
        refuse_larger_matlab(path)
        state = path.stat()
    why = why_unreadable(path.absolute(), state.st_size, state.st_mtime_ns, by=READ_MATLAB)
    if why is not None:
        raise InputError(f"{shown_path(path)} cannot be read as {kind}: {why}; save it anew.")


def read_all_variables(path: str) -> None:
    """Load a file and drop what comes. Its errors are left to whoever loads it next: they harm nobody."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            loadmat(path, struct_as_record=False, squeeze_me=True)
        except MemoryError:
            raise
        except Exception:  # on damaged files it raises anything
            return


@contextmanager
def reading_structures(path: Path, kind: str, advice: str) -> Iterator[None]:
    """Within, structures of a file are read: whatever they lack is told in one sentence, as an InputError.

    kind: what was expected; advice: how to come by it, both in words.
    """
    try:
        yield
    except InputError:
        raise
    except (AttributeError, IndexError, ValueError, TypeError) as error:
        raise InputError(f"{shown_path(path)}: expected {kind}, got others ({error}); {advice}.") from None


def numbers_of_variable(values: Any) -> Array:
    """A variable as numbers, a single one as an array of one."""
    return np.atleast_1d(np.asarray(values, dtype=np.float64))
