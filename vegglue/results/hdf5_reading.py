"""What a result file may hold, and how it is read to its end by a process before the command (`sandboxed_reader`).

Nothing in a file of others leads out of it, or claims more room than it can fill: vegglue writes groups, and datasets
in them, whose numbers lie in the file itself. External and soft links, virtual datasets, raw storage in other files and
filters that load code would let a received file read, or fill, any other file of its reader. This file imports little,
as each command starts it anew.
"""

import h5py
import numpy as np
from h5py import h5d, h5z

# Filters that vegglue writes; others are loaded as code from wherever a plugin path leads.
FILTERS = {h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32}
# Bytes that one stored byte can stand for at most: the bound of the deflate format, rounded up.
LARGEST_RATIO = 1100


class ForeignFileError(Exception):
    """A file has what vegglue never writes."""


def refuse_foreign(file: h5py.File) -> None:
    """Raise ForeignFileError for what of an open file cannot be of vegglue. Nothing is read, no link followed."""
    room = LARGEST_RATIO * max(file.id.get_filesize(), 1)  # for all together: one dataset may have many names
    for name in file:
        if not _is_hard(file, name):
            raise ForeignFileError(f"{name} is a link")
        group = file[name]
        if isinstance(group, h5py.Dataset):
            raise ForeignFileError(f"{name} is not in a group")
        if not isinstance(group, h5py.Group):
            raise ForeignFileError(f"{name} is neither group nor dataset")
        for key in group:
            if not _is_hard(group, key):
                raise ForeignFileError(f"{name}/{key} is a link")
            dataset = group[key]
            if not isinstance(dataset, h5py.Dataset):
                raise ForeignFileError(f"{name}/{key} is no dataset")
            made = dataset.id.get_create_plist()
            if made.get_layout() == h5d.VIRTUAL:
                raise ForeignFileError(f"{name}/{key} is put together from other files")
            if made.get_external_count():
                raise ForeignFileError(f"{name}/{key} lies in other files")
            if {made.get_filter(number)[0] for number in range(made.get_nfilters())} - FILTERS:
                raise ForeignFileError(f"{name}/{key} is packed in a way that vegglue does not use")
            room -= int(np.prod(dataset.shape or (), dtype=object)) * dataset.dtype.itemsize
            if room < 0:
                raise ForeignFileError(f"{name}/{key} claims more numbers than the file can hold")


def _is_hard(group: h5py.Group, name: str) -> bool:
    return isinstance(group.get(name, getlink=True), h5py.HardLink)


AT_ONCE = 1 << 26  # [bytes] of values read at once
READ_HDF5 = f"{__name__}:read_all_values"  # as `sandboxed_reader` names it


def read_all_values(path: str) -> None:
    """Read every value of a file, except of a foreign one, which the command itself refuses. Raises errors of h5py."""
    with h5py.File(path, "r", locking=False) as file:
        try:
            refuse_foreign(file)
        except ForeignFileError:
            return
        dict(file.attrs)
        for group in file.values():
            dict(group.attrs)
            for dataset in group.values():
                dict(dataset.attrs)
                if not dataset.shape:
                    dataset[()]
                    continue
                row = max(dataset.dtype.itemsize * int(np.prod(dataset.shape[1:], dtype=object)), 1)
                step = max(AT_ONCE // row, 1)
                for start in range(0, dataset.shape[0], step):  # so many rows as are one block
                    dataset[start : start + step]
