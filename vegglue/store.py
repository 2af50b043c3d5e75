"""Results on disk: one HDF5 file each, readable by xarray and ArviZ without this package.

Every group holds its own dimensions as scales. An ensemble grows in `ensemble.h5.part`, whose datasets are laid out
whole before the first member is solved: appending then changes no structure and needs no more disk, so a run killed at
any moment leaves a file that opens.
"""

import errno
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd

from vegglue.errors import InputError, StorageError
from vegglue.lock import hold_lock

FORMAT = "vegglue ensemble 1"
REASON = h5py.string_dtype("utf-8", 240)  # of fixed length, so that its room is taken before the run starts
VALUE_UNIT = "m/s for velocity, m for level"

# What is stored of each member: dimensions, value before the member is solved, type, [unit].
ROWS: dict[str, tuple[tuple[str, ...], Any, Any, str]] = {
    "prediction": (("member", "station"), np.nan, np.float64, VALUE_UNIT),
    "status": (("member",), -1, np.int8, "-"),
    "reason": (("member",), b"", REASON, "-"),
    "iterations": (("member",), 0, np.int32, "-"),
    "mass_error": (("member",), np.nan, np.float64, "-"),
    "seconds": (("member",), np.nan, np.float64, "s"),
    "section_flow": (("member", "experiment", "section"), np.nan, np.float64, "m3/s"),
}


@dataclass(frozen=True)
class Variable:
    """One dataset of a group: names of its dimensions, values, [unit]."""

    dims: tuple[str, ...]
    values: Any
    unit: str = "-"


@dataclass(frozen=True)
class Header:
    """What is known of an ensemble before its first member is solved."""

    parameters: Mapping[str, np.ndarray]  # (member,) each
    units: Mapping[str, str]  # of the parameters
    station: pd.DataFrame  # all rows of observations.table
    experiments: tuple[str, ...]
    sections: tuple[tuple[str, float], ...]  # name, x [m]
    chunks: int  # how many fixed sets of members the run is cut into
    config: str  # resolved YAML
    config_hash: str
    seed: int
    version: str

    @property
    def members(self) -> int:
        return len(next(iter(self.parameters.values())))


@dataclass(frozen=True)
class Ensemble:
    """All members of a finished run, failed ones included."""

    parameters: dict[str, np.ndarray]  # (member,) each
    prediction: np.ndarray  # (member, station), NaN for failed members
    status: np.ndarray  # (member,) 0 solved by Newton, 1 solved by marching, 2 failed
    reason: np.ndarray  # (member,) '' or a sentence
    iterations: np.ndarray  # (member,)
    mass_error: np.ndarray  # (member,) largest |Q/Q_in - 1| over sections and experiments [-]
    seconds: np.ndarray  # (member,) [s]
    section_flow: np.ndarray  # (member, experiment, section) [m3/s]
    station: pd.DataFrame
    experiments: tuple[str, ...]
    sections: tuple[tuple[str, float], ...]  # name, x [m]
    config: str
    config_hash: str
    seed: int
    version: str


@dataclass(frozen=True)
class EnsembleWriter:
    """The one writer of an unfinished ensemble."""

    file: h5py.File
    path: Path
    set_aside: Path | None  # where an unfinished run of another config was moved to

    @property
    def done(self) -> set[int]:
        """Chunks that need not be solved again."""
        return set(np.flatnonzero(self.file["progress/finished"][:]).tolist())

    def append(self, chunk: int, members: np.ndarray, rows: Mapping[str, np.ndarray]) -> None:
        """Write one chunk: rows[name] has one entry for each of `members` (indices into the ensemble), name in ROWS.

        Errors: StorageError when it cannot be written; chunks appended before stay readable.
        """
        members = np.asarray(members)
        order = np.argsort(members)
        group = self.file["members"]
        if set(rows) != set(ROWS):
            raise ValueError(f"chunk {chunk}: expected the rows {sorted(ROWS)}, got {sorted(rows)}")
        with _told_as_storage_error(self.path):
            for name, values in rows.items():
                values = _clipped(values) if name == "reason" else np.asarray(values)
                group[name][members[order]] = values[order]
            self._sync()  # the rows must be on disk before they are called finished
            self.file["progress/finished"][chunk] = 1
            self._sync()

    def _sync(self) -> None:
        self.file.flush()
        os.fsync(self.file.id.get_vfd_handle())


@contextmanager
def ensemble_writer(path: Path, header: Header) -> Iterator[EnsembleWriter]:
    """Open `path`.part for appending, resuming what an earlier run of the same header left; rename it to `path` when
    the block ends with every chunk appended.

    A part file of another config, seed or version, or a broken one, is moved to `path`.part.old, never mixed in.
    Errors: StorageError when another run holds the folder or the disk is full.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = _part(path)
    with hold_lock(path.parent):
        set_aside = _set_aside(part) if part.exists() and not _resumable(part, header) else None
        if not part.exists():
            _lay_out(part, header)
        with _opened(part, "r+") as file:
            writer = EnsembleWriter(file, part, set_aside)
            yield writer
            complete = len(writer.done) == header.chunks
        if complete:
            os.replace(part, path)


def read_ensemble(path: Path, expected_hash: str | None = None) -> Ensemble:
    """Read a finished ensemble.

    Errors: InputError when there is none, or it was made from another config than the one with `expected_hash`;
    StorageError when the file is broken.
    """
    if not path.exists():
        found = "an unfinished run, which will be resumed" if _part(path).exists() else "no file"
        raise InputError(f"{path}: expected the members of this config, found {found}; run `vegglue simulate CONFIG`.")
    with _opened(path, "r") as file:
        found = file.attrs.get("config_hash", "none")
        if expected_hash is not None and found != expected_hash:
            raise InputError(
                f"{path}: expected config hash {expected_hash[:12]}, found {found[:12]}: the config or a data file "
                "changed since the members were solved; run `vegglue simulate CONFIG` again."
            )
        try:
            return _ensemble(file)
        except (KeyError, OSError) as error:
            what = f"{path}: not a whole ensemble file ({error}); remove it and run `vegglue simulate CONFIG`."
            raise StorageError(what) from error


def stored_hash(path: Path) -> str | None:
    """Config hash a result file was made from, or None when there is no readable file."""
    try:
        with h5py.File(path, "r") as file:
            return str(file.attrs["config_hash"])
    except (OSError, KeyError):
        return None


def _ensemble(file: h5py.File) -> Ensemble:
    rows, parameters, station = (read_group(file[name]) for name in ("members", "parameters", "stations"))
    del parameters["member"], station["station"]
    return Ensemble(
        parameters=parameters,
        **{name: rows[name] for name in ROWS},
        station=pd.DataFrame(station),
        experiments=tuple(rows["experiment"]),
        sections=tuple(zip(rows["section"].tolist(), rows["section_x"].tolist(), strict=True)),
        config=str(file.attrs["config"]),
        config_hash=str(file.attrs["config_hash"]),
        seed=int(file.attrs["seed"]),
        version=str(file.attrs["version"]),
    )


def _lay_out(part: Path, header: Header) -> None:
    """Create the part file whole, filled with 'not solved yet'."""
    coordinates = {
        "member": np.arange(header.members),
        "station": np.arange(len(header.station)),
        "experiment": np.array(header.experiments, object),
        "section": np.array([name for name, _ in header.sections], object),
    }
    rows = {
        name: Variable(dims, np.full([len(coordinates[dim]) for dim in dims], fill, kind), unit)
        for name, (dims, fill, kind, unit) in ROWS.items()
    }
    rows["section_x"] = Variable(("section",), np.array([x for _, x in header.sections], float), "m")
    parameters = {name: Variable(("member",), values, header.units[name]) for name, values in header.parameters.items()}
    finished = {"finished": Variable(("chunk",), np.zeros(header.chunks, np.int8))}
    with written_whole(part, _attributes(header)) as file:
        write_group(file, "members", coordinates, rows)
        write_group(file, "parameters", {"member": coordinates["member"]}, parameters)
        write_group(file, "stations", {"station": coordinates["station"]}, table_variables(header.station))
        write_group(file, "progress", {"chunk": np.arange(header.chunks)}, finished)


def _attributes(header: Header) -> dict[str, Any]:
    return {name: getattr(header, name) for name in ("config", "config_hash", "seed", "version")} | {"format": FORMAT}


def _part(path: Path) -> Path:
    return path.with_name(path.name + ".part")


def _resumable(part: Path, header: Header) -> bool:
    """Whether the part file holds members of exactly this run."""
    try:
        with h5py.File(part, "r") as file:
            same = all(file.attrs[name] == value for name, value in _attributes(header).items())
            parameters = read_group(file["parameters"])
            return same and len(file["progress/finished"]) == header.chunks and all(
                np.array_equal(parameters[name], values) for name, values in header.parameters.items()
            )
    except (OSError, KeyError):
        return False


def _set_aside(part: Path) -> Path:
    return part.replace(part.with_name(part.name + ".old"))


def _clipped(reasons: np.ndarray) -> np.ndarray:
    """UTF-8, cut to the room a row has without splitting a character."""
    cut = [str(reason).encode()[: REASON.itemsize].decode(errors="ignore") for reason in reasons]
    return np.array([reason.encode() for reason in cut], REASON)


def table_variables(table: pd.DataFrame) -> dict[str, Variable]:
    """Columns of the station table as variables; lengths in [m]."""
    units = dict.fromkeys(("x", "y", "depth"), "m") | dict.fromkeys(("value", "standard_error"), VALUE_UNIT)
    return {
        str(name): Variable(("station",), column.to_numpy(), units.get(str(name), "-")) for name, column in table.items()
    }


def write_group(
    file: h5py.File, name: str, coordinates: Mapping[str, Any], variables: Mapping[str, Variable]
) -> h5py.Group:
    """Write one self-contained group: coordinates as dimension scales, attached to every dimension of every variable.

    Errors: InputError when a variable has the name of a dimension, which xarray could not read.
    """
    group = file.create_group(name, track_order=True)
    clash = sorted(set(coordinates) & set(variables))
    if clash:
        raise InputError(f"{file.filename}, group {name}: {clash} are names of dimensions; rename the parameter.")
    for dim, values in coordinates.items():
        _dataset(group, dim, values).make_scale(dim)
    for key, variable in variables.items():
        dataset = _dataset(group, key, variable.values)
        dataset.attrs["units"] = variable.unit
        for axis, dim in enumerate(variable.dims):
            dataset.dims[axis].attach_scale(group[dim])
    return group


def _dataset(group: h5py.Group, name: str, values: Any) -> h5py.Dataset:
    values = np.asarray(values)
    if values.dtype.kind in "OUT":
        return group.create_dataset(name, data=values.astype(object), dtype=h5py.string_dtype())
    dataset = group.create_dataset(name, data=values.astype(np.int8) if values.dtype == bool else values)
    if values.dtype == bool:
        dataset.attrs["dtype"] = "bool"  # xarray's mark: netCDF knows no booleans
    return dataset


def read_group(group: h5py.Group) -> dict[str, np.ndarray]:
    """All datasets of a group by name, strings as str and booleans as bool."""
    return {name: _values(dataset) for name, dataset in group.items() if isinstance(dataset, h5py.Dataset)}


def _values(dataset: h5py.Dataset) -> np.ndarray:
    if h5py.check_string_dtype(dataset.dtype):
        return dataset.asstr()[...].astype(object)
    return dataset[...].astype(bool) if dataset.attrs.get("dtype") == "bool" else dataset[...]


@contextmanager
def written_whole(path: Path, attributes: Mapping[str, Any]) -> Iterator[h5py.File]:
    """A new file that appears under its name only when it is whole.

    Errors: StorageError when it cannot be written; a file of that name from before stays as it was.
    """
    new = path.with_name(path.name + ".new")
    try:
        with _told_as_storage_error(path):
            with h5py.File(new, "w") as file:
                file.attrs.update(attributes)
                yield file
            os.replace(new, path)
    finally:
        new.unlink(missing_ok=True)


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
