"""How the C library keeps memory that was freed."""

import ctypes
import os
from functools import cache

# glibc's names of what may be set, see mallopt(3), and bytes: arrays of a batch, tens of MB each, stay with the process
# when they are freed, 256 MB of them at most where they lie last.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
_KEPT, _LARGEST = 1 << 28, 1 << 30


@cache
def reuse_freed_memory() -> None:
    """Large arrays take the place of those freed before, once and for the whole process; only with glibc.

    By itself it gives each back to the system, which clears its pages anew: a sixth of the time of a batch (DECISIONS).
    """
    if os.name != "posix":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_MMAP_THRESHOLD, _LARGEST)
        mallopt(_TRIM_THRESHOLD, _KEPT)
