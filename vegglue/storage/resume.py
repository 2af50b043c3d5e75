"""Fields of an unfinished run: single-precision numbers in a plain file, every member at a place of its own.

A compressed HDF5 file changes its structure with every append, and a kill in the middle could leave nothing of it. Here
all room is taken before the first member is solved, and writing a member touches no other.
"""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vegglue.arrays import Single
from vegglue.results.ensemble import Header
from vegglue.results.fields import QUANTITIES, FieldWindow


@dataclass(frozen=True)
class Unfinished:
    """Where the fields of a run wait: an array of `shape` (member, ...) behind a mark that says which run it is."""

    path: Path
    mark: bytes
    shape: tuple[int, ...]
    window: FieldWindow

    @property
    def member_bytes(self) -> int:
        return 4 * math.prod(self.shape[1:])


def unfinished_fields(folder: Path, header: Header) -> Unfinished | None:
    """What a run with this header writes its fields to, (member, experiment, quantity, x, y); None if it keeps none."""
    if (window := header.window) is None:
        return None
    shape = (header.members, len(header.experiments), len(QUANTITIES), window.x.size, window.y.size)
    return Unfinished(folder / "fields.part", f"vegglue fields of {header.config_hash}\n".encode(), shape, window)


def reserve(unfinished: Unfinished) -> None:
    """Take the room of all members, each NaN. Errors: OSError when there is none, and then nothing is left behind."""
    nothing = np.full(unfinished.shape[1:], np.nan, np.float32).tobytes()
    try:
        with unfinished.path.open("wb") as file:
            file.write(unfinished.mark)
            for _ in range(unfinished.shape[0]):
                file.write(nothing)
            file.flush()
            os.fsync(file.fileno())
    except OSError:
        unfinished.path.unlink(missing_ok=True)
        raise


def is_reserved(unfinished: Unfinished) -> bool:
    """Whether the file is there, of this run and of full size."""
    try:
        with unfinished.path.open("rb") as file:
            mine = file.read(len(unfinished.mark)) == unfinished.mark
            size = os.fstat(file.fileno()).st_size
    except OSError:
        return False
    return mine and size == len(unfinished.mark) + unfinished.shape[0] * unfinished.member_bytes


def put(unfinished: Unfinished, members: np.ndarray, values: Single) -> None:
    """Write values (len(members), ...) of some members, onto the disk. Errors: OSError."""
    if values.shape != (len(members), *unfinished.shape[1:]):
        raise ValueError(f"expected fields of shape {(len(members), *unfinished.shape[1:])}, got {values.shape}")
    with unfinished.path.open("r+b") as file:
        for member, own in zip(members, values, strict=True):
            file.seek(len(unfinished.mark) + int(member) * unfinished.member_bytes)
            file.write(own.astype(np.float32).tobytes())
        file.flush()
        os.fsync(file.fileno())


def stored_array(unfinished: Unfinished) -> Single:
    """The whole array, read as it is used."""
    return np.memmap(unfinished.path, np.float32, "r", offset=len(unfinished.mark), shape=unfinished.shape)
