"""Results of every kind, and what may become of their files: other contents under the same names, or other bytes."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from diagnoses import a_diagnosis
from posteriors import a_posterior
from stored import ALL, HASH, WINDOW, a_header, write_chunks

from vegglue.errors import InputError, StorageError
from vegglue.flow.sensor import FlowFields
from vegglue.results.diagnosis import diagnosis_json
from vegglue.results.hdf5 import LENGTH, with_digest
from vegglue.results.result_files import (
    flow_that_fits,
    read_diagnosis,
    read_ensemble,
    read_fields,
    read_posterior,
    write_diagnosis,
    write_flow,
    write_posterior,
)

Change = Callable[[np.ndarray], Any]
THETA = {"n_b": 0.05}
# What may stand where a dataset was; None: nothing does.
OF_VALUES: dict[str, Change] = {
    "gone": lambda values: None,
    "one number": lambda values: np.array(1.0),
    "nothing": lambda values: values[:0] if values.ndim else np.zeros(0),
    "one less": lambda values: values[:-1] if values.ndim else values,
    "twice": lambda values: np.concatenate([values, values]) if values.ndim else values,
    "a dimension more": lambda values: values[..., None],
    "flat": np.ravel,
    "text": lambda values: np.full(values.shape, "x", object),
    "bytes": lambda values: np.full(values.shape, b"\xff\x00x", "S3"),
    "complex": lambda values: np.full(values.shape, 1j),
    "rows": lambda values: np.zeros(values.shape, [("a", float), ("b", int)]),
    "not a number": lambda values: np.full(values.shape, np.nan),
    "infinite": lambda values: np.full(values.shape, -np.inf),
    "giant": lambda values: np.full(values.shape, 1e300),
    "negative": lambda values: np.full(values.shape, -7),
}
# What may stand where an attribute was.
OF_WORDS: tuple[Any, ...] = (
    None, "x", "", "\n\u202e", "null", "[]", "{}", "[{}]", "[1e400, NaN]", "[" * 20_000, "3", np.zeros(3), np.nan,
    -np.inf, 10**18, -5, 1j, b"\xff",
)  # fmt: skip


@dataclass(frozen=True)
class Kept:
    """A kind of result: the name of its file, what writes a valid one, and what reads it to its end."""

    name: str
    write: Callable[[Path], Any]
    read: Callable[[Path], Any]


def _write_flow(path: Path) -> None:
    x, y, values = np.arange(3.0), np.arange(2.0), np.zeros((3, 2))
    write_flow(path, {"D0": FlowFields(x, y, values, values, values, values, values)}, THETA, "", HASH)


RESULTS = (
    Kept("ensemble.h5", lambda path: write_chunks(path, ALL, a_header()), lambda path: read_ensemble(path, HASH)),
    Kept(
        "fields.h5",
        lambda path: write_chunks(path.with_name("ensemble.h5"), ALL, a_header(window=WINDOW)),
        lambda path: read_fields(path, HASH),
    ),
    Kept(
        "posterior.h5",
        lambda path: write_posterior(path, a_posterior(True), "", HASH),
        lambda path: read_posterior(path, HASH),
    ),
    Kept(
        "diagnosis.h5",
        lambda path: write_diagnosis(path, a_diagnosis(), "", HASH),
        lambda path: diagnosis_json(read_diagnosis(path, HASH)),  # which looks at all of it
    ),
    Kept("flow.h5", _write_flow, lambda path: flow_that_fits(path, HASH, THETA)),
)


def sentence_of(kept: Kept, path: Path) -> str:
    """What is said of a file, nothing where it is read. Anything but the two errors is raised."""
    try:
        repr(kept.read(path))
    except (InputError, StorageError) as error:
        return str(error)
    return ""


def places_in(path: Path) -> list[tuple[str, str]]:
    """Group and name of every dataset, and ("", name) of every attribute of the file."""
    with h5py.File(path) as file:
        return [("", name) for name in file.attrs] + [(group, name) for group in file for name in file[group]]


def change_content(path: Path, place: tuple[str, str], values: Change, words: Any) -> None:
    """Put something else at a place of a file, whose digest is right again."""
    group, name = place
    with h5py.File(path, "r+") as file:
        if not group:
            del file.attrs[name]
            if words is not None:
                file.attrs[name] = words
        else:
            old = file[group][name]
            marks = {key: old.attrs[key] for key in ("dtype",) if key in old.attrs}
            _put(file[group], name, values(old[...]), marks)
    path.write_bytes(with_digest(path.read_bytes()))


def _put(group: h5py.Group, name: str, new: Any, marks: dict[str, Any]) -> None:
    del group[name]
    if new is None:
        return
    dtype = h5py.string_dtype() if new.dtype == object else None
    group.create_dataset(name, data=new, dtype=dtype).attrs.update(marks)


def without_digest(path: Path) -> bytes:
    """The bytes of a whole file, but for the line behind its end."""
    return path.read_bytes()[:-LENGTH]


def damaged(content: bytes, edits: list[tuple[float, str]]) -> bytes:
    """The bytes with some places spoilt: how far in each is, as a share, and what becomes of what stands there."""
    new = bytearray(content)
    for part, how in edits:
        place = int(part * len(new))
        if how == "cut":
            del new[place:]
        elif how == "bit" and new:
            new[place] ^= 1 << place % 8
        else:
            new[place : place + 64] = (b"\0" if how == "zeros" else b"\xff") * len(new[place : place + 64])
    return bytes(new)
