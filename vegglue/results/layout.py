"""How a frozen value is laid out in a file: dimensions and unit stand in the annotation of each field."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Stored:
    """Annotation of a field that is stored: names of its dimensions, [unit], and what stands where nothing is known.

    For a dict the first dimension is that of its keys.
    """

    dims: tuple[str, ...]
    unit: str = "-"
    fill: Any = np.nan
    type: Any = np.float64


@dataclass(frozen=True)
class Variable:
    """One dataset: names of its dimensions, values, [unit], and the shape of the blocks it is compressed in, if any."""

    dims: tuple[str, ...]
    values: Any
    unit: str = "-"
    compressed: tuple[int, ...] | None = None


@dataclass(frozen=True)
class Group:
    """What belongs together in a file: coordinates by dimension, variables on them, and [units] of coordinates."""

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
