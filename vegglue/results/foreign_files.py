"""HDF5 files that come from others: nothing in them leads out of the file, or claims more room than it can fill.

vegglue writes groups, and datasets in them, whose numbers lie in the file itself. External and soft links, virtual
datasets, raw storage in other files and filters that load code are never its own: they would let a file that was
received read, or fill, any other file of whoever opens it.
"""

import h5py
import numpy as np
from h5py import h5d, h5z

# Filters that vegglue writes; others are loaded as code from wherever a plugin path leads.
FILTERS = {h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32}
# Bytes that one stored byte can stand for at most: the bound of the deflate format, rounded up.
LARGEST_RATIO = 1100


def why_foreign(file: h5py.File) -> str | None:
    """What of an open file cannot be of vegglue, in words; None when all may be. Nothing is read, no link followed."""
    room = LARGEST_RATIO * max(file.id.get_filesize(), 1)  # for all together: one dataset may have many names
    for name in file:
        if not _is_hard(file, name):
            return f"{name} is a link"
        group = file[name]
        if isinstance(group, h5py.Dataset):
            return f"{name} is not in a group"
        if not isinstance(group, h5py.Group):
            return f"{name} is neither group nor dataset"
        for key in group:
            if not _is_hard(group, key):
                return f"{name}/{key} is a link"
            dataset = group[key]
            found = _why_not(dataset)
            if found:
                return f"{name}/{key} {found}"
            room -= int(np.prod(dataset.shape or (), dtype=object)) * dataset.dtype.itemsize
            if room < 0:
                return f"{name}/{key} claims more numbers than the file can hold"
    return None


def _is_hard(group: h5py.Group, name: str) -> bool:
    return isinstance(group.get(name, getlink=True), h5py.HardLink)


def _why_not(dataset: h5py.Dataset | h5py.Group) -> str | None:
    if not isinstance(dataset, h5py.Dataset):
        return "is no dataset"
    made = dataset.id.get_create_plist()
    if made.get_layout() == h5d.VIRTUAL:
        return "is put together from other files"
    if made.get_external_count():
        return "lies in other files"
    if {made.get_filter(number)[0] for number in range(made.get_nfilters())} - FILTERS:
        return "is packed in a way that vegglue does not use"
    return None
