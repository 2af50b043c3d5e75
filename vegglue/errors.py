"""Errors a user can mend: one sentence each, shown without a traceback."""


class InputError(ValueError):
    """Something handed in is wrong: says where, what was expected, what came, and what to do."""


class StorageError(OSError):
    """A result could not be written or read: says which file, why, and what is still safe."""
