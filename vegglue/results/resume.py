"""How a killed run goes on: an ensemble grows in `ensemble.h5.part`, its fields in `fields.part`, chunk by chunk.

The datasets of the part file are laid out whole before the first member is solved: appending then changes no structure
and needs no more disk, so a run killed at any moment leaves a file that opens. The next run with the same config, seed,
version and cut into chunks solves only the chunks that are not marked as finished, or whose digest is another.

Fields wait as single-precision numbers in a plain file, every member at a place of its own: a compressed HDF5 file
changes its structure with every append, and a kill in the middle could leave nothing of it.
"""

import json
import math
import os
import socket
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vegglue.arrays import Single
from vegglue.errors import StorageError
from vegglue.results.ensemble import QUANTITIES, ROWS, FieldWindow, Header, fields_group, unsolved
from vegglue.results.hdf5 import (
    UNREADABLE,
    append_digest,
    open_hdf5,
    read_values,
    refuse_in_use,
    write_to_grow,
    write_whole,
)
from vegglue.whole_files import NOT_FOLLOWED, failed_writes_told, lock
from vegglue.wording.remedies import REMOVE_PART, WRITTEN_STAYS


@contextmanager
def hold_lock(folder: Path) -> Iterator[None]:
    """Hold `folder/.lock` for the length of the block; the file names its holder (pid, host, time).

    The operating system drops the lock of a killed run. The file is emptied, not removed: removing a locked file would
    let two runs hold two files of one name. A link is not followed.

    Raises
    ------
    StorageError
        If a living process holds the lock, or the folder cannot be written.
    """
    path = folder / ".lock"
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | NOT_FOLLOWED, 0o644)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written ({error.strerror}); make {folder} writable.") from error
    try:
        try:
            lock(handle)
        except BlockingIOError as error:
            holder = "another process"
            with suppress(OSError, ValueError, KeyError):
                mark = json.loads(path.read_text(encoding="utf-8"))
                holder = f"process {mark['pid']} on {mark['host']} since {mark['since']}"
            raise StorageError(f"{folder} is in use by {holder}; wait for it to end, or stop it.") from error
        except OSError as error:
            raise StorageError(f"{path}: cannot be locked ({error.strerror}); use a local folder.") from error
        since = datetime.now(UTC).isoformat(timespec="seconds")
        os.ftruncate(handle, 0)
        os.write(handle, json.dumps({"pid": os.getpid(), "host": socket.gethostname(), "since": since}).encode())
        yield
        os.ftruncate(handle, 0)
    finally:
        os.close(handle)


FIELDS_PART = "fields.part"


@dataclass(frozen=True)
class UnfinishedFields:
    """Where the fields of a run wait: an array of `shape` (member, ...) in single precision, behind the run's mark."""

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
    """Take the room of all members, each NaN.

    Raises
    ------
    OSError
        If there is none; then nothing is left behind.
    """
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
    """Write values of some members onto the disk.

    Parameters
    ----------
    members : ndarray (n,)
        Their numbers.
    values : ndarray (n, experiment, quantity, x, y)
        [m, m/s]

    Raises
    ------
    OSError
        If they cannot be written.
    """
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


ENSEMBLE_FORMAT, FIELDS_FORMAT = "vegglue ensemble 1", "vegglue fields 1"
# What changes while a run is on its way, by group.
GROWING = {"members": tuple(ROWS), "progress": ("finished", "digest")}
KeptRows = Mapping[str, Mapping[str, np.ndarray]]


@dataclass(frozen=True)
class EnsembleWriter:
    """The one writer of an unfinished ensemble."""

    file: h5py.File
    path: Path
    moved_to: Path | None  # where an unfinished run of another config was moved to
    unfinished: UnfinishedFields | None  # fields, if any are kept

    @property
    def done(self) -> set[int]:
        """Chunks that need not be solved again."""
        return set(np.flatnonzero(self.file["progress/finished"][:]).tolist())

    def reopen_damaged(self, chunks: Sequence[np.ndarray]) -> None:
        """Count a finished chunk as not solved where what is stored of its members is not what was written.

        chunks: the members of each (indices into the ensemble).
        """
        stored = {name: self.file["members"][name][...] for name in ROWS}
        fields = None if self.unfinished is None else all_fields(self.unfinished)
        for chunk in self.done:
            members = np.sort(chunks[chunk])
            rows = [values[members] for values in stored.values() if values.size]
            found = _digest([*rows, *(() if fields is None else [fields[members]])])
            if found != self.file["progress/digest"][chunk]:
                self.file["progress/finished"][chunk] = 0
        self._sync()

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
        sorted_rows = dict[str, np.ndarray]()
        for name in (one for one in ROWS if group[one].size):
            values, dtype = rows[name], group[name].dtype
            if dtype.kind == "S":  # text, cut to its room without splitting a character
                cut = [str(text).encode()[: dtype.itemsize].decode(errors="ignore").encode() for text in values]
                values = np.array(cut, dtype)
            sorted_rows[name] = np.asarray(values, dtype)[order]
        sorted_fields = [] if fields is None else [fields.astype(np.float32)[order]]
        with failed_writes_told(self.path, WRITTEN_STAYS):
            for name, values in sorted_rows.items():  # h5py cannot select members of nothing: a case without stations
                group[name][members[order]] = values
            if self.unfinished is not None and fields is not None:
                write_fields(self.unfinished, members, fields)
            self.file["progress/digest"][chunk] = _digest([*sorted_rows.values(), *sorted_fields])
            self._sync()  # rows and fields must be on disk before they are called finished
            self.file["progress/finished"][chunk] = 1
            self._sync()

    def _sync(self) -> None:
        self.file.flush()
        os.fsync(self.file.id.get_vfd_handle())


@contextmanager
def ensemble_writer(path: Path, header: Header) -> Iterator[EnsembleWriter]:
    """Open `path`.part for appending, resuming what an earlier run of the same header left.

    It is renamed to `path` when the block ends with every chunk appended. Fields wait in `fields.part` beside it and
    become `fields.h5` just before. A part file of another config, seed, version or cut into chunks, or a broken one, is
    moved to `path`.part.old, never mixed in.

    Raises
    ------
    StorageError
        If another run holds the folder, its files cannot be written or the disk is full.
    """
    with failed_writes_told(path, WRITTEN_STAYS):
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise StorageError(f"{path}: expected a file or nothing, found a folder; move it away.")
        if path.exists():
            refuse_in_use(path)
    part, unfinished = part_file(path), unfinished_fields(path.parent, header)
    with hold_lock(path.parent):
        kept = _kept_rows(part, header) if unfinished is None or is_reserved(unfinished) else None
        moved_to = None
        if kept is None and (part.exists() or part.is_symlink()):
            with failed_writes_told(part, REMOVE_PART.format(part)):
                moved_to = part.replace(part.with_name(part.name + ".old"))
        # All room a run needs, the fields first: a part of an ensemble without its fields cannot be.
        if unfinished is not None and kept is None:
            with failed_writes_told(unfinished.path, WRITTEN_STAYS):
                reserve(unfinished)
        # What an earlier run has kept is laid out anew as well: nothing is ever written into a file as it was found.
        groups = unsolved(header)
        for name, rows in (kept or {}).items():
            own = dict(groups[name].variables)
            for key, values in rows.items():
                own[key] = replace(own[key], values=np.asarray(values, own[key].values.dtype))
            groups[name] = replace(groups[name], variables=own)
        write_to_grow(part, groups, _attributes(header))
        with open_hdf5(part, "r+") as file:
            writer = EnsembleWriter(file, part, moved_to, unfinished)
            yield writer
            complete = len(writer.done) == header.chunks
            # Locks of some network disks do not reach other machines.
            mine = os.fstat(file.id.get_vfd_handle())
            there = part.stat() if part.exists() else None
            if there is None or (there.st_dev, there.st_ino) != (mine.st_dev, mine.st_ino):
                raise StorageError(
                    f"{part}: was replaced by another run, on a machine that the lock of this one does not reach; wait "
                    "for that run to end, then give the same command again."
                )
        if complete:
            with failed_writes_told(path, WRITTEN_STAYS):
                # Fields before the ensemble, which stands for both: a run killed in between only has this to do again.
                if unfinished is not None:
                    group = fields_group(unfinished.window, header.experiments, all_fields(unfinished))
                    own_words = {"format": FIELDS_FORMAT, "range": unfinished.window.range}
                    write_whole(path.with_name("fields.h5"), {"fields": group}, _attributes(header) | own_words)
                append_digest(part)
                os.replace(part, path)
                if unfinished is not None:
                    unfinished.path.unlink()


def remove_left_over_fields(path: Path) -> None:
    """Take away `fields.part` of a run that was killed after its ensemble at `path` was whole.

    Raises
    ------
    StorageError
        If it cannot be removed.
    """
    left = path.with_name(FIELDS_PART)
    if left.exists() and not part_file(path).exists():
        with hold_lock(path.parent), failed_writes_told(left, WRITTEN_STAYS):
            left.unlink(missing_ok=True)


def _attributes(header: Header) -> dict[str, Any]:
    own = {name: getattr(header, name) for name in ("config", "config_hash", "seed", "version", "cut")}
    return own | {"format": ENSEMBLE_FORMAT}


def part_file(path: Path) -> Path:
    """The file that a result grows in."""
    return path.with_name(path.name + ".part")


def begun_or_finished(path: Path) -> bool:
    """Whether a result is there, or a part of one that was stopped."""
    return path.exists() or part_file(path).exists()


def _kept_rows(part: Path, header: Header) -> KeptRows | None:
    """What is stored of members and progress by a run of exactly this header; None where there is no such file."""
    if part.is_symlink():
        return None
    growing, groups = {key for keys in GROWING.values() for key in keys}, unsolved(header)
    try:
        with open_hdf5(part, "r") as file:
            if any(file.attrs[name] != value for name, value in _attributes(header).items()):
                return None
            kept = {name: {key: file[name][key][...] for key in keys} for name, keys in GROWING.items()}
            for name, rows in kept.items():
                own = {key: groups[name].variables[key].values for key in rows}
                if any(values.shape != own[key].shape for key, values in rows.items()):
                    return None
                if not all(np.can_cast(values.dtype, own[key].dtype, "same_kind") for key, values in rows.items()):
                    return None
            for name, group in groups.items():  # whether it holds the values that do not change
                laid_out = {**group.coordinates, **{key: one.values for key, one in group.variables.items()}}
                for key in laid_out.keys() - growing:
                    found, values = read_values(file[name][key]), np.asarray(laid_out[key])
                    text = values.dtype.kind in "OUS"
                    if not ((found == values).all() if text else np.array_equal(found, values, equal_nan=True)):
                        return None
            return kept
    except UNREADABLE:
        return None


def _digest(arrays: Sequence[np.ndarray]) -> int:
    """CRC-32 of the members of a chunk, in their order."""
    found = 0
    for values in arrays:
        found = zlib.crc32(np.ascontiguousarray(values).tobytes(), found)
    return found
