"""How a frozen value is laid out in a file, and whether what was read of a file fits.

Dimensions and unit stand in the annotation of each field. A file that was damaged or made by others may hold anything
under the right names: it is refused here, before anything is computed with it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
import pandas as pd

from vegglue.measurements.kinds import KINDS
from vegglue.measurements.observations import STATION_TYPES, station_table


@dataclass(frozen=True)
class Stored:
    """Annotation of a field that is stored.

    Attributes
    ----------
    dims : tuple of str
        Names of its dimensions; of a dict the first is that of its keys.
    fill : object
        What stands where nothing is known.
    type : type
        Of its values.
    """

    dims: tuple[str, ...]
    unit: str = "-"
    fill: Any = np.nan
    type: Any = np.float64


@dataclass(frozen=True)
class Variable:
    """One dataset of a file.

    Attributes
    ----------
    dims : tuple of str
        Names of its dimensions.
    compressed : tuple of int or None
        Shape of the blocks in which it is compressed, if any.
    """

    dims: tuple[str, ...]
    values: Any
    unit: str = "-"
    compressed: tuple[int, ...] | None = None


@dataclass(frozen=True)
class Group:
    """What belongs together in a file.

    Attributes
    ----------
    coordinates : mapping of array
        By dimension.
    variables : mapping of Variable
        On these.
    units : mapping of str
        Of the coordinates.
    """

    coordinates: Mapping[str, Any]
    variables: Mapping[str, Variable]
    units: Mapping[str, str] = field(default_factory=dict)


def stored_fields(kind: type) -> dict[str, Stored]:
    """Fields of a dataclass that are annotated as stored, in order."""
    hints = get_type_hints(kind, include_extras=True).items()
    return {name: get_args(hint)[1] for name, hint in hints if get_origin(hint) is Annotated}


def table_group(table: pd.DataFrame, dim: str, units: Mapping[str, str]) -> Group:
    """A table as a group: one variable per column, its rows counted by `dim`."""
    columns = {
        str(name): Variable((dim,), column.to_numpy(), units.get(str(name), "-")) for name, column in table.items()
    }
    return Group({dim: np.arange(len(table))}, columns)


ReadGroup = Mapping[str, np.ndarray]
IN_WORDS, WHOLE_NUMBERS, YES_OR_NO = object, np.int64, bool  # types of what is no floating-point number
# Kinds of numpy's types that hold values of a type.
_KINDS = {"O": "O", "S": "O", "f": "fiu", "i": "iu", "b": "b"}


def fitting(group: ReadGroup, stored: Mapping[str, Stored], sizes: Mapping[str, int] | None = None) -> ReadGroup:
    """A group, once each of its variables is there with its type and the size of each of its dimensions.

    Parameters
    ----------
    stored : mapping of Stored
        The variables.
    sizes : mapping of int, optional
        Of dimensions that are known already.

    Returns
    -------
    mapping of ndarray
        The group.

    Raises
    ------
    KeyError
        If one is missing.
    ValueError
        If one does not fit.
    """
    known = dict(sizes or {})
    for name, one in stored.items():
        values = group[name]
        fits = values.dtype.kind in _KINDS[np.dtype(one.type).kind] and (
            values.dtype.kind != "O" or all(isinstance(text, str) for text in values.flat)
        )
        if values.ndim != len(one.dims) or not (fits or not values.size):  # an empty column has no type of its own
            raise ValueError(f"{name} is no array of {len(one.dims)} dimensions and its type")
        for dim, size in zip(one.dims, values.shape, strict=True):
            if known.setdefault(dim, size) != size:
                raise ValueError(f"{name} has {size} values along {dim}, not {known[dim]}")
    for dim, size in known.items():
        if dim in group and group[dim].shape != (size,):
            raise ValueError(f"{dim} has not {size} entries")
    return group


_STATED: dict[type, tuple[tuple[type, ...], str]] = {str: ((str,), "text"), bool: ((bool, np.bool_), "yes or no")}


def stated_as(kind: type, stated: Mapping[str, Any], name: str) -> Any:
    """A number, word, or yes or no that a file states.

    Raises
    ------
    KeyError
        Without it.
    ValueError
        If it is no such.
    """
    value = stated[name]
    types, words = _STATED.get(kind, ((int, float, np.integer, np.floating), "number"))
    if not isinstance(value, types):
        raise ValueError(f"{name} is no {words}")
    return kind(value)


def names_of(group: ReadGroup, dim: str) -> tuple[str, ...]:
    """The names along a dimension.

    Raises
    ------
    KeyError
        Without the dimension.
    ValueError
        If these are no names, or two are the same.
    """
    names = tuple(fitting(group, {dim: Stored((dim,), type=IN_WORDS)})[dim])
    if len(set(names)) < len(names):
        raise ValueError(f"two of {dim} have the same name")
    return names


def stations_from(group: ReadGroup) -> pd.DataFrame:
    """The table of stations of a group, without what else stands there.

    Raises
    ------
    KeyError, ValueError
        Without one of its columns; if one holds something else, or names an unknown kind.
    """
    types = {name: IN_WORDS if kind is str else kind for name, kind in STATION_TYPES.items()}
    found = fitting(group, {name: Stored(("station",), type=kind) for name, kind in types.items()})
    table = station_table(pd.DataFrame({name: found[name] for name in STATION_TYPES}))
    unknown = set(table["kind"]) - set(KINDS)
    if unknown:
        raise ValueError(f"{sorted(unknown)[0]!r} is no kind of observation")
    return table
