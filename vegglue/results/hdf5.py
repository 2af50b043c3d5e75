"""HDF5 files that xarray and ArviZ read without this package: groups written and read, each file whole or not at all.

Every group holds its own dimensions as scales. What is stored of which result stands in `result_files`, how an ensemble
grows in `resume`. A digest of all bytes stands as a line behind the end of a file, where the HDF5 library does not
look: what changed since is noticed when it is read.
"""

import hashlib
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

import h5py
import numpy as np

from vegglue.errors import InputError, StorageError
from vegglue.results.hdf5_reading import READ_HDF5, ForeignFileError, refuse_foreign
from vegglue.results.layout import Group
from vegglue.sandboxed_reader import why_unreadable
from vegglue.whole_files import lock, write_file
from vegglue.wording.remedies import REMAKE, WRITTEN_STAYS

MARK = b"\nvegglue sha256 "
LENGTH = len(MARK) + 64 + 1
BLOCK = 1 << 20  # bytes read at once


def with_digest(content: bytes) -> bytes:
    """The content of a file, and the line behind it."""
    return content + _line(hashlib.sha256(content).hexdigest())


def append_digest(path: Path) -> None:
    """Put the line behind a file, in place of one that is there.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    with path.open("r+b") as file:
        size = os.fstat(file.fileno()).st_size - (LENGTH if _stated(file) else 0)
        digest = _digest_of(file, size)
        file.seek(size)
        file.write(_line(digest))
        file.truncate()
        file.flush()
        os.fsync(file.fileno())


def state_of(path: Path) -> tuple[Path, int, int, int]:
    """What is another as soon as a file is: its place, size [bytes], inode and time. Errors: OSError."""
    now = path.stat()
    if not stat.S_ISREG(now.st_mode):  # opening a pipe would wait
        raise OSError("it is not a file")
    return path.resolve(), now.st_size, now.st_ino, now.st_mtime_ns


@lru_cache(maxsize=64)
def is_unchanged(path: Path, *state: int) -> bool | None:
    """Whether a file has the digest that stands behind it; None where none does.

    Parameters
    ----------
    state : int
        Looked at once for each, however often the file is opened.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with path.open("rb") as file:
        stated = _stated(file)
        return None if stated is None else stated == _digest_of(file, os.fstat(file.fileno()).st_size - LENGTH)


def _line(digest: str) -> bytes:
    return MARK + digest.encode() + b"\n"


def _stated(file: IO[bytes]) -> str | None:
    size = os.fstat(file.fileno()).st_size
    if size < LENGTH:
        return None
    file.seek(size - LENGTH)
    line = file.read(LENGTH)
    return line[len(MARK) : -1].decode(errors="replace") if line.startswith(MARK) else None


def _digest_of(file: IO[bytes], size: int) -> str:
    """Of the first bytes of a file."""
    digest = hashlib.sha256()
    file.seek(0)
    while size > 0 and (block := file.read(min(BLOCK, size))):
        digest.update(block)
        size -= len(block)
    return digest.hexdigest()


# What reading a damaged file may raise, of Python or of the HDF5 library.
UNREADABLE = (OSError, RuntimeError, ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError)


def write_whole(path: Path, groups: Mapping[str, Group], attributes: Mapping[str, Any]) -> None:
    """Write a file that appears under its name only when it is whole.

    Raises
    ------
    StorageError
        If it cannot be written; a file of that name from before stays as it was.
    """
    write_file(path, with_digest(_image(groups, attributes)), WRITTEN_STAYS)


def write_to_grow(path: Path, groups: Mapping[str, Group], attributes: Mapping[str, Any]) -> None:
    """As write_whole, for a file that will change: without a digest. Errors: StorageError."""
    write_file(path, _image(groups, attributes), WRITTEN_STAYS)


def _image(groups: Mapping[str, Group], attributes: Mapping[str, Any]) -> bytes:
    """A file in memory: on a full disk the HDF5 library crashes instead of raising.

    Coordinates are dimension scales of a group's own, one attached to every dimension of every variable.
    """
    with h5py.File("image", "w", driver="core", backing_store=False) as file:
        file.attrs.update(attributes)
        for name, content in groups.items():
            group = file.create_group(name, track_order=True)
            clash = sorted(set(content.coordinates) & set(content.variables))
            if clash:
                raise InputError(f"parameters: {clash} are names of dimensions of the group {name}; rename them.")
            for dim, values in content.coordinates.items():
                scale = _dataset(group, dim, values)
                scale.make_scale(dim)
                if dim in content.units:
                    scale.attrs["units"] = content.units[dim]
            for key, variable in content.variables.items():
                dataset = _dataset(group, key, variable.values, variable.compressed)
                dataset.attrs["units"] = variable.unit
                for axis, dim in enumerate(variable.dims):
                    dataset.dims[axis].attach_scale(group[dim])
        file.flush()
        return bytes(file.id.get_file_image())


@contextmanager
def open_hdf5(path: Path, mode: str) -> Iterator[h5py.File]:
    """An open file for the length of the block: "r" for one that is whole, "r+" for one that grows.

    Without locks of the HDF5 library: whole files are never changed in place, and a growing one is guarded by the lock
    of its folder and may be looked at.

    Raises
    ------
    StorageError
        If it cannot be opened, has changed since it was written, or holds what leads out of it.
    """
    try:
        if mode == "r":
            state = state_of(path)
            if is_unchanged(*state) is False:
                refuse_in_use(path)
                raise StorageError(f"{path}: is broken, it has changed since it was written; {REMAKE}.")
            if (why := why_unreadable(*state, by=READ_HDF5)) is not None:
                refuse_in_use(path)
                raise StorageError(f"{path}: cannot be opened ({why}); {REMAKE}.")
        try:
            file = h5py.File(path, mode, locking=False)
        except OSError as error:
            if "locking flag" not in str(error):
                raise
            file = h5py.File(path, mode)  # this very process has it open, with locks
    except StorageError:
        raise
    except UNREADABLE as error:
        raise StorageError(f"{path}: cannot be opened ({error}); {REMAKE}.") from error
    with file:
        try:
            refuse_foreign(file)
        except ForeignFileError as error:
            raise StorageError(f"{path}: {error}, which vegglue never writes, and is not read; {REMAKE}.") from None
        except UNREADABLE as error:
            raise StorageError(f"{path}: is broken ({error}); {REMAKE}.") from error
        yield file


def refuse_in_use(path: Path) -> None:
    """Refuse a file that another program has open to change it, which locks it.

    Raises
    ------
    StorageError
        If it is in use.
    OSError
        If there is no such file.
    """
    with path.open("rb") as file:
        try:
            lock(file.fileno(), shared=True)
        except BlockingIOError as error:
            raise StorageError(f"{path} is in use by another program; close it there.") from error
        except OSError:
            pass  # a file system without locks


def stored_attribute(path: Path, attribute: str) -> str | None:
    """An attribute of a file, None when there is no readable file or it has none of that name."""
    try:
        with open_hdf5(path, "r") as file:
            return str(file.attrs[attribute])
    except UNREADABLE:
        return None


def read_groups(file: h5py.File) -> dict[str, dict[str, np.ndarray]]:
    """All groups of a file by name; see read_group."""
    return {name: read_group(group) for name, group in file.items() if isinstance(group, h5py.Group)}


def read_group(group: h5py.Group) -> dict[str, np.ndarray]:
    """All datasets of a group by name, strings as str and booleans as bool."""
    return {name: read_values(dataset) for name, dataset in group.items() if isinstance(dataset, h5py.Dataset)}


def _dataset(group: h5py.Group, name: str, values: Any, compressed: tuple[int, ...] | None = None) -> h5py.Dataset:
    values = np.asarray(values)
    if compressed is not None:
        return group.create_dataset(name, data=values, chunks=compressed, compression="gzip", shuffle=True)
    if values.dtype.kind == "S":
        return group.create_dataset(name, data=values.astype(h5py.string_dtype("utf-8", values.dtype.itemsize)))
    if values.dtype.kind in "OUT":
        return group.create_dataset(name, data=values.astype(object), dtype=h5py.string_dtype())
    dataset = group.create_dataset(name, data=values.astype(np.int8) if values.dtype == bool else values)
    if values.dtype == bool:
        dataset.attrs["dtype"] = "bool"  # xarray's mark: netCDF knows no booleans
    return dataset


def read_values(dataset: h5py.Dataset) -> np.ndarray:
    """All values of a dataset, strings as str and booleans as bool."""
    if h5py.check_string_dtype(dataset.dtype):
        return dataset.asstr()[...].astype(object)
    return dataset[...].astype(bool) if dataset.attrs.get("dtype") == "bool" else dataset[...]
