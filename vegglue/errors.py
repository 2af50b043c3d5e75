"""Errors a user can mend: one sentence each, shown without a traceback."""

import os
from pathlib import Path


class InputError(ValueError):
    """Something handed in is wrong: says where, what was expected, what came, and what to do."""


class StorageError(OSError):
    """A result could not be written or read: says which file, why, and what is still safe."""


def shown_path(path: Path) -> str:
    """The path as sentences name it: relative to where the user stands."""
    return os.path.relpath(path)
