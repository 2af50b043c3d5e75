"""How a result file is read to its end, by the process that does so before the command (`sandboxed_reader`)."""

from collections.abc import Iterator

import h5py
import numpy as np

from vegglue.results.foreign_files import why_foreign

AT_ONCE = 1 << 26  # [bytes] of values read at once
READ_HDF5 = f"{__name__}:read_all_values"  # as `sandboxed_reader` names it


def read_all_values(path: str) -> None:
    """Read every value of a file, but of a foreign one, of which the command says so itself; errors of the library."""
    with h5py.File(path, "r", locking=False) as file:
        if why_foreign(file) is None:
            for _ in _all_values(file):
                pass


def _all_values(file: h5py.File) -> Iterator[object]:
    yield dict(file.attrs)
    for group in file.values():
        yield dict(group.attrs)
        for dataset in group.values():
            yield dict(dataset.attrs)
            for rows in _blocks(dataset):
                yield dataset[rows]


def _blocks(dataset: h5py.Dataset) -> Iterator[slice | tuple[()]]:
    """Rows, so many at once as are one block."""
    if not dataset.shape:
        yield ()
        return
    row = max(dataset.dtype.itemsize * int(np.prod(dataset.shape[1:], dtype=object)), 1)
    step = max(AT_ONCE // row, 1)
    for start in range(0, dataset.shape[0], step):
        yield slice(start, start + step)
