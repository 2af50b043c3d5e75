"""Results on disk: one HDF5 file each, readable by xarray and ArviZ without this package.

Every group holds its own dimensions as scales. An ensemble grows in `ensemble.h5.part`, whose datasets are laid out
whole before the first member is solved: appending then changes no structure and needs no more disk, so a run killed at
any moment leaves a file that opens.
"""

import errno
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from vegglue.errors import InputError, StorageError
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.diagnosis_file import diagnosis_attributes, diagnosis_from, diagnosis_groups
from vegglue.results.ensemble import ROWS, Ensemble, Header, ensemble_from, unsolved
from vegglue.results.fields import Fields, fields_from, fields_group
from vegglue.results.layout import Group
from vegglue.results.posterior import Posterior
from vegglue.results.posterior_file import posterior_attributes, posterior_from, posterior_groups
from vegglue.storage.lock import hold_lock
from vegglue.storage.resume import Unfinished, is_reserved, put, reserve, stored_array, unfinished_fields

ENSEMBLE_FORMAT, FIELDS_FORMAT, POSTERIOR_FORMAT = "vegglue ensemble 1", "vegglue fields 1", "vegglue posterior 1"
DIAGNOSIS_FORMAT = "vegglue diagnosis 2"
Result = TypeVar("Result")


@dataclass(frozen=True)
class EnsembleWriter:
    """The one writer of an unfinished ensemble."""

    file: h5py.File
    path: Path
    set_aside: Path | None  # where an unfinished run of another config was moved to
    unfinished: Unfinished | None  # fields, if any are kept

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
        with _told_as_storage_error(self.path):
            for name, values in rows.items():
                if group[name].size:  # h5py cannot select members of nothing: a case without stations
                    group[name][members[order]] = _fitted(values, group[name])[order]
            if self.unfinished is not None and fields is not None:
                put(self.unfinished, members, fields)
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
    part, unfinished = _part(path), unfinished_fields(path.parent, header)
    with hold_lock(path.parent):
        resumable = (unfinished is None or is_reserved(unfinished)) and _resumable(part, header)
        set_aside = _set_aside(part) if part.exists() and not resumable else None
        if not part.exists():
            _lay_out(part, unfinished, header)
        with _opened(part, "r+") as file:
            writer = EnsembleWriter(file, part, set_aside, unfinished)
            yield writer
            complete = len(writer.done) == header.chunks
        if complete:
            _finish(path, unfinished, header)


def read_ensemble(path: Path, expected_hash: str | None = None) -> Ensemble:
    """Read a finished ensemble.

    Errors: InputError when there is none, or it was made from another config than the one with `expected_hash`;
    StorageError when the file is broken.
    """
    if not path.exists() and _part(path).exists():
        raise InputError(f"{path}: found only a part of the members; run `vegglue simulate CONFIG` to solve the rest.")
    return _read(path, expected_hash, "simulate", ensemble_from)


def read_fields(path: Path, expected_hash: str | None = None) -> Fields:
    """Read the fields of a finished ensemble, whole; errors as those of read_ensemble."""
    if not path.exists():
        remedy = "say in `simulate.fields` where they are to be kept and run `vegglue simulate CONFIG`"
        raise InputError(f"{path}: expected fields of the members, found no file; {remedy}.")
    return _read(path, expected_hash, "simulate", fields_from)


def write_posterior(path: Path, posterior: Posterior, config: str, config_hash: str) -> None:
    """Write a posterior with the resolved config it was inferred under, replacing an older file only when it is whole.

    Errors: StorageError when it cannot be written.
    """
    own = {"config": config, "config_hash": config_hash, "format": POSTERIOR_FORMAT}
    _write_whole(path, posterior_groups(posterior), posterior_attributes(posterior) | own)


def read_posterior(path: Path, expected_hash: str | None = None) -> Posterior:
    """Read a posterior; errors as those of read_ensemble, for `vegglue infer CONFIG`."""
    return _read(path, expected_hash, "infer", posterior_from)


def write_diagnosis(path: Path, diagnosis: Diagnosis, config: str, config_hash: str) -> None:
    """Write a diagnosis with the resolved config it was made under; errors as those of write_posterior."""
    own = {"config": config, "config_hash": config_hash, "format": DIAGNOSIS_FORMAT}
    _write_whole(path, diagnosis_groups(diagnosis), diagnosis_attributes(diagnosis) | own)


def read_diagnosis(path: Path, expected_hash: str | None = None) -> Diagnosis:
    """Read a diagnosis; errors as those of read_ensemble, for `vegglue diagnose CONFIG`."""
    return _read(path, expected_hash, "diagnose", diagnosis_from)


def diagnosis_that_fits(path: Path, config_hash: str) -> Diagnosis | None:
    """The diagnosis of exactly this config, None when there is none or only one of another state or another format."""
    fits = stored_hash(path) == config_hash and _stored_attribute(path, "format") == DIAGNOSIS_FORMAT
    return read_diagnosis(path) if fits else None


def stored_hash(path: Path) -> str | None:
    """Config hash a result file was made from, or None when there is no readable file."""
    return _stored_attribute(path, "config_hash")


def _stored_attribute(path: Path, attribute: str) -> str | None:
    try:
        with h5py.File(path, "r") as file:
            return str(file.attrs[attribute])
    except (OSError, KeyError):
        return None


def _read(path: Path, expected_hash: str | None, step: str, understand: Callable[..., Result]) -> Result:
    remedy = f"run `vegglue {step} CONFIG`"
    if not path.exists():
        raise InputError(f"{path}: expected the result of an earlier step, found no file; {remedy}.")
    with _opened(path, "r") as file:
        found = str(file.attrs.get("config_hash", "none"))
        if expected_hash is not None and found != expected_hash:
            raise InputError(
                f"{path}: expected config hash {expected_hash[:12]}, found {found[:12]}: the config, a data file "
                f"or vegglue changed since this was made; {remedy} again."
            )
        try:
            return understand(_read_groups(file), dict(file.attrs))
        except (KeyError, OSError, TypeError, ValueError) as error:
            raise StorageError(f"{path}: is broken or of another version ({error}); remove it and {remedy}.") from error


def _attributes(header: Header) -> dict[str, Any]:
    own = {name: getattr(header, name) for name in ("config", "config_hash", "seed", "version", "cut")}
    return own | {"format": ENSEMBLE_FORMAT}


def _part(path: Path) -> Path:
    return path.with_name(path.name + ".part")


def _lay_out(part: Path, unfinished: Unfinished | None, header: Header) -> None:
    """All room a run will need, the fields first: a part of an ensemble without its fields cannot be."""
    if unfinished is not None:
        with _told_as_storage_error(unfinished.path):
            reserve(unfinished)
    _write_whole(part, unsolved(header), _attributes(header))


def _finish(path: Path, unfinished: Unfinished | None, header: Header) -> None:
    """Fields before the ensemble, which stands for both: a run killed in between only has this to do again."""
    if unfinished is None:
        os.replace(_part(path), path)
        return
    group = fields_group(unfinished.window, header.experiments, stored_array(unfinished))
    own = {"format": FIELDS_FORMAT, "range": unfinished.window.range}
    _write_whole(path.with_name("fields.h5"), {"fields": group}, _attributes(header) | own)
    os.replace(_part(path), path)
    unfinished.path.unlink()


def _resumable(part: Path, header: Header) -> bool:
    """Whether the part file holds members of exactly this run."""
    try:
        with h5py.File(part, "r") as file:
            same = all(file.attrs[name] == value for name, value in _attributes(header).items())
            parameters = _read_group(file["parameters"])
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


def _write_group(file: h5py.File, name: str, content: Group) -> None:
    """Coordinates as dimension scales of the group's own, one attached to every dimension of every variable."""
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


def _read_group(group: h5py.Group) -> dict[str, np.ndarray]:
    """All datasets of a group by name, strings as str and booleans as bool."""
    return {name: _values(dataset) for name, dataset in group.items() if isinstance(dataset, h5py.Dataset)}


def _read_groups(file: h5py.File) -> dict[str, dict[str, np.ndarray]]:
    return {name: _read_group(group) for name, group in file.items() if isinstance(group, h5py.Group)}


def _values(dataset: h5py.Dataset) -> np.ndarray:
    if h5py.check_string_dtype(dataset.dtype):
        return dataset.asstr()[...].astype(object)
    return dataset[...].astype(bool) if dataset.attrs.get("dtype") == "bool" else dataset[...]


def _write_whole(path: Path, groups: Mapping[str, Group], attributes: Mapping[str, Any]) -> None:
    """Write a file that appears under its name only when it is whole.

    Errors: StorageError when it cannot be written; a file of that name from before stays as it was.
    """
    new = path.with_name(path.name + ".new")
    image = _image(groups, attributes)  # in memory: on a full disk the HDF5 library crashes instead of raising
    try:
        with _told_as_storage_error(path):
            with new.open("wb") as file:
                file.write(image)
                file.flush()
                os.fsync(file.fileno())
            os.replace(new, path)
    finally:
        with suppress(OSError):
            new.unlink(missing_ok=True)


def _image(groups: Mapping[str, Group], attributes: Mapping[str, Any]) -> bytes:
    with h5py.File("image", "w", driver="core", backing_store=False) as file:
        file.attrs.update(attributes)
        for name, content in groups.items():
            _write_group(file, name, content)
        file.flush()
        return bytes(file.id.get_file_image())


@contextmanager
def _opened(path: Path, mode: str) -> Iterator[h5py.File]:
    try:
        file = h5py.File(path, mode)
    except OSError as error:
        what = f"{path}: cannot be opened ({error}); remove it and run the step that makes it again."
        raise StorageError(what) from error
    with file:
        yield file


@contextmanager
def _told_as_storage_error(path: Path) -> Iterator[None]:
    """Turn a failed write into one sentence; h5py tells some of them as RuntimeError."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        full = getattr(error, "errno", None) == errno.ENOSPC or "No space left" in str(error)
        what = "the disk is full" if full else f"cannot be written ({error})"
        advice = "what was written before is whole: make room, then run the same command again"
        raise StorageError(f"{path}: {what}; {advice}.") from error
