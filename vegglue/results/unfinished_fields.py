"""Fields of an ensemble on its way: single-precision numbers in a plain file, every member at a place of its own.

They wait there until all are solved: a compressed HDF5 file changes its structure with every append, and a kill in the
middle could leave nothing of it.
"""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.arrays import Single
from vegglue.results.ensemble import Header
from vegglue.results.fields import QUANTITIES, FieldWindow

FIELDS_PART = "fields.part"


@dataclass(frozen=True)
class UnfinishedFields:
    """Where the fields of a run wait: an array of `shape` (member, ...) in single precision, behind a mark
    that says which run it is.
    """

    path: Path
    mark: bytes
    shape: tuple[int, ...]
    window: FieldWindow

    @property
    def member_bytes(self) -> int:
        return 4 * math.prod(self.shape[1:])


def unfinished_fields(folder: Path, header: Header) -> UnfinishedFields | None:
    """What a run with this header writes its fields to, (member, experiment, quantity, x, y); None if it keeps none."""
    if (window := header.window) is None:
        return None
    shape = (header.members, len(header.experiments), len(QUANTITIES), window.x.size, window.y.size)
    return UnfinishedFields(folder / FIELDS_PART, f"vegglue fields of {header.config_hash}\n".encode(), shape, window)


def reserve(unfinished: UnfinishedFields) -> None:
    """Take the room of all members, each NaN. Errors: OSError when there is none, and then nothing is left behind."""
    nothing = np.full(unfinished.shape[1:], np.nan, np.float32).tobytes()
    try:
        unfinished.path.unlink(missing_ok=True)  # a link there is not followed
        with unfinished.path.open("xb") as file:
            file.write(unfinished.mark)
            for _ in range(unfinished.shape[0]):
                file.write(nothing)
            file.flush()
            os.fsync(file.fileno())
    except OSError:
        unfinished.path.unlink(missing_ok=True)
        raise


def is_reserved(unfinished: UnfinishedFields) -> bool:
    """Whether the file is there, of this run and of full size."""
    if unfinished.path.is_symlink():
        return False
    try:
        with unfinished.path.open("rb") as file:
            mine = file.read(len(unfinished.mark)) == unfinished.mark
            size = os.fstat(file.fileno()).st_size
    except OSError:
        return False
    return mine and size == len(unfinished.mark) + unfinished.shape[0] * unfinished.member_bytes


def write_fields(unfinished: UnfinishedFields, members: np.ndarray, values: Single) -> None:
    """Write values (len(members), ...) of some members, onto the disk. Errors: OSError."""
    if values.shape != (len(members), *unfinished.shape[1:]):
        raise ValueError(f"expected fields of shape {(len(members), *unfinished.shape[1:])}, got {values.shape}")
    with unfinished.path.open("r+b") as file:
        for member, own in zip(members, values, strict=True):
            file.seek(len(unfinished.mark) + int(member) * unfinished.member_bytes)
            file.write(own.astype(np.float32).tobytes())
        file.flush()
        os.fsync(file.fileno())


def all_fields(unfinished: UnfinishedFields) -> Single:
    """The whole array, read as it is used."""
    return np.memmap(unfinished.path, np.float32, "r", offset=len(unfinished.mark), shape=unfinished.shape)
