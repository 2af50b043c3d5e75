"""Whether what was read of a file has the shapes and types that its values are stored with.

A file that was damaged or made by others may hold anything under the right names: it is refused here, before anyone
computes with it.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from vegglue.measurements.kinds import KINDS
from vegglue.measurements.observations import STATION_TYPES, station_table
from vegglue.results.layout import Stored

ReadGroup = Mapping[str, np.ndarray]
IN_WORDS, WHOLE_NUMBERS, YES_OR_NO = object, np.int64, bool  # types of what is no floating-point number
# Kinds of numpy's types that hold values of a type.
_KINDS = {"O": "O", "S": "O", "f": "fiu", "i": "iu", "b": "b"}


def fitting(group: ReadGroup, stored: Mapping[str, Stored], sizes: Mapping[str, int] | None = None) -> ReadGroup:
    """The group, where each variable is there with its type and the size of each of its dimensions.

    sizes: of dimensions that are known already. Errors: KeyError for a missing one, ValueError for one that does not
    fit.
    """
    known = dict(sizes or {})
    for name, one in stored.items():
        values = group[name]
        if values.ndim != len(one.dims) or not _has_type(values, one.type):
            raise ValueError(f"{name} is no array of {len(one.dims)} dimensions and its type")
        for dim, size in zip(one.dims, values.shape, strict=True):
            if known.setdefault(dim, size) != size:
                raise ValueError(f"{name} has {size} values along {dim}, not {known[dim]}")
    for dim, size in known.items():
        if dim in group and group[dim].shape != (size,):
            raise ValueError(f"{dim} has not {size} entries")
    return group


def _has_type(values: np.ndarray, wanted: Any) -> bool:
    if not values.size:  # an empty column has no type of its own
        return True
    if values.dtype.kind not in _KINDS[np.dtype(wanted).kind]:
        return False
    return values.dtype.kind != "O" or all(isinstance(one, str) for one in values.flat)


_STATED: dict[type, tuple[tuple[type, ...], str]] = {
    str: ((str,), "text"),
    bool: ((bool, np.bool_), "yes or no"),
}


def stated_as(kind: type, stated: Mapping[str, Any], name: str) -> Any:
    """A number, word, or yes or no that a file states. Errors: KeyError without it, ValueError where it is no such."""
    value = stated[name]
    types, words = _STATED.get(kind, ((int, float, np.integer, np.floating), "number"))
    if not isinstance(value, types):
        raise ValueError(f"{name} is no {words}")
    return kind(value)


def names_of(group: ReadGroup, dim: str) -> tuple[str, ...]:
    """The names along a dimension. Errors: KeyError; ValueError where these are no names, or two are the same."""
    names = tuple(fitting(group, {dim: Stored((dim,), type=IN_WORDS)})[dim])
    if len(set(names)) < len(names):
        raise ValueError(f"two of {dim} have the same name")
    return names


def stations_from(group: ReadGroup) -> pd.DataFrame:
    """The table of stations of a group, without what else stands there. Errors: KeyError, ValueError."""
    types = {name: IN_WORDS if kind is str else kind for name, kind in STATION_TYPES.items()}
    found = fitting(group, {name: Stored(("station",), type=kind) for name, kind in types.items()})
    table = station_table(pd.DataFrame({name: found[name] for name in STATION_TYPES}))
    unknown = set(table["kind"]) - set(KINDS)
    if unknown:
        raise ValueError(f"{sorted(unknown)[0]!r} is no kind of observation")
    return table
