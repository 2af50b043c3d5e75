"""How a killed run goes on: an ensemble grows in `ensemble.h5.part`, its fields in `fields.part`, chunk by chunk.

The datasets of the part file are laid out whole before the first member is solved: appending then changes no structure
and needs no more disk, so a run killed at any moment leaves a file that opens. The next run with the same config, seed,
version and cut into chunks solves only the chunks that are not marked as finished.

Fields wait as single-precision numbers in a plain file, every member at a place of its own, until all are there:
a compressed HDF5 file changes its structure with every append, and a kill in the middle could leave nothing of it.
"""

import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vegglue.arrays import Single
from vegglue.results.ensemble import ROWS, Header, unsolved
from vegglue.results.fields import QUANTITIES, FieldWindow, fields_group
from vegglue.storage.hdf5 import open_hdf5, read_group, storage_errors, write_whole
from vegglue.storage.lock import hold_lock

ENSEMBLE_FORMAT, FIELDS_FORMAT = "vegglue ensemble 1", "vegglue fields 1"


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


@dataclass(frozen=True)
class EnsembleWriter:
    """The one writer of an unfinished ensemble."""

    file: h5py.File
    path: Path
    set_aside: Path | None  # where an unfinished run of another config was moved to
    unfinished: UnfinishedFields | None  # fields, if any are kept

    @property
    def done(self) -> set[int]:
        """Chunks that need not be solved again."""
        return set(np.flatnonzero(self.file["progress/finished"][:]).tolist())

    def append(
        self, chunk: int, members: np.ndarray, rows: Mapping[str, np.ndarray], fields: np.ndarray | None = None
    ) -> None:
        """Write one chunk: rows[name] has one entry for each of `members` (indices into the ensemble), name in ROWS;
        so have fields (member, experiment, quantity, x, y) if the header has a window.

        Errors: StorageError when it cannot be written; chunks appended before stay readable.
        """
        members = np.asarray(members)
        order = np.argsort(members)
        group = self.file["members"]
        if self.unfinished is not None and fields is None:
            raise ValueError(f"chunk {chunk}: expected fields, got none")
        if set(rows) != set(ROWS):
            raise ValueError(f"chunk {chunk}: expected the rows {sorted(ROWS)}, got {sorted(rows)}")
        with storage_errors(self.path):
            for name, values in rows.items():
                if group[name].size:  # h5py cannot select members of nothing: a case without stations
                    group[name][members[order]] = _fitted(values, group[name])[order]
            if self.unfinished is not None and fields is not None:
                _write_fields(self.unfinished, members, fields)
            self._sync()  # rows and fields must be on disk before they are called finished
            self.file["progress/finished"][chunk] = 1
            self._sync()

    def _sync(self) -> None:
        self.file.flush()
        os.fsync(self.file.id.get_vfd_handle())


@contextmanager
def ensemble_writer(path: Path, header: Header) -> Iterator[EnsembleWriter]:
    """Open `path`.part for appending, resuming what an earlier run of the same header left; rename it to `path` when
    the block ends with every chunk appended. Fields wait in `fields.part` beside it and become `fields.h5` just before.

    A part file of another config, seed, version or cut into chunks, or a broken one, is moved to `path`.part.old, never
    mixed in.
    Errors: StorageError when another run holds the folder or the disk is full.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part, unfinished = part_file(path), _unfinished_fields(path.parent, header)
    with hold_lock(path.parent):
        resumable = (unfinished is None or _is_reserved(unfinished)) and _resumable(part, header)
        set_aside = _set_aside(part) if part.exists() and not resumable else None
        if not part.exists():
            _lay_out(part, unfinished, header)
        with open_hdf5(part, "r+") as file:
            writer = EnsembleWriter(file, part, set_aside, unfinished)
            yield writer
            complete = len(writer.done) == header.chunks
        if complete:
            _finish(path, unfinished, header)


def _attributes(header: Header) -> dict[str, Any]:
    own = {name: getattr(header, name) for name in ("config", "config_hash", "seed", "version", "cut")}
    return own | {"format": ENSEMBLE_FORMAT}


def part_file(path: Path) -> Path:
    """The file that a result grows in."""
    return path.with_name(path.name + ".part")


def _lay_out(part: Path, unfinished: UnfinishedFields | None, header: Header) -> None:
    """All room a run will need, the fields first: a part of an ensemble without its fields cannot be."""
    if unfinished is not None:
        with storage_errors(unfinished.path):
            _reserve(unfinished)
    write_whole(part, unsolved(header), _attributes(header))


def _finish(path: Path, unfinished: UnfinishedFields | None, header: Header) -> None:
    """Fields before the ensemble, which stands for both: a run killed in between only has this to do again."""
    if unfinished is None:
        os.replace(part_file(path), path)
        return
    group = fields_group(unfinished.window, header.experiments, _all_fields(unfinished))
    own = {"format": FIELDS_FORMAT, "range": unfinished.window.range}
    write_whole(path.with_name("fields.h5"), {"fields": group}, _attributes(header) | own)
    os.replace(part_file(path), path)
    unfinished.path.unlink()


def _resumable(part: Path, header: Header) -> bool:
    """Whether the part file holds members of exactly this run."""
    try:
        with h5py.File(part, "r") as file:
            same = all(file.attrs[name] == value for name, value in _attributes(header).items())
            parameters = read_group(file["parameters"])
            return (
                same
                and len(file["progress/finished"]) == header.chunks
                and all(np.array_equal(parameters[name], values) for name, values in header.parameters.items())
            )
    except (OSError, KeyError):
        return False


def _set_aside(part: Path) -> Path:
    return part.replace(part.with_name(part.name + ".old"))


def _fitted(values: Any, dataset: h5py.Dataset) -> np.ndarray:
    """Values as the dataset holds them; text cut to its room without splitting a character."""
    if dataset.dtype.kind != "S":
        return np.asarray(values, dataset.dtype)
    room = dataset.dtype.itemsize
    return np.array([str(text).encode()[:room].decode(errors="ignore").encode() for text in values], dataset.dtype)


def _unfinished_fields(folder: Path, header: Header) -> UnfinishedFields | None:
    """What a run with this header writes its fields to, (member, experiment, quantity, x, y); None if it keeps none."""
    if (window := header.window) is None:
        return None
    shape = (header.members, len(header.experiments), len(QUANTITIES), window.x.size, window.y.size)
    return UnfinishedFields(folder / "fields.part", f"vegglue fields of {header.config_hash}\n".encode(), shape, window)


def _reserve(unfinished: UnfinishedFields) -> None:
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


def _is_reserved(unfinished: UnfinishedFields) -> bool:
    """Whether the file is there, of this run and of full size."""
    try:
        with unfinished.path.open("rb") as file:
            mine = file.read(len(unfinished.mark)) == unfinished.mark
            size = os.fstat(file.fileno()).st_size
    except OSError:
        return False
    return mine and size == len(unfinished.mark) + unfinished.shape[0] * unfinished.member_bytes


def _write_fields(unfinished: UnfinishedFields, members: np.ndarray, values: Single) -> None:
    """Write values (len(members), ...) of some members, onto the disk. Errors: OSError."""
    if values.shape != (len(members), *unfinished.shape[1:]):
        raise ValueError(f"expected fields of shape {(len(members), *unfinished.shape[1:])}, got {values.shape}")
    with unfinished.path.open("r+b") as file:
        for member, own in zip(members, values, strict=True):
            file.seek(len(unfinished.mark) + int(member) * unfinished.member_bytes)
            file.write(own.astype(np.float32).tobytes())
        file.flush()
        os.fsync(file.fileno())


def _all_fields(unfinished: UnfinishedFields) -> Single:
    """The whole array, read as it is used."""
    return np.memmap(unfinished.path, np.float32, "r", offset=len(unfinished.mark), shape=unfinished.shape)
