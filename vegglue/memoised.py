"""Results of costly functions, kept in memory by what their arguments hold."""

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np

Arguments = ParamSpec("Arguments")
Found = TypeVar("Found")


def memoised(most: int) -> Callable[[Callable[Arguments, Found]], Callable[Arguments, Found]]:
    """A decorator that keeps the newest results of a function by the values of all arguments.

    Parameters
    ----------
    most : int
        Results that are kept, none of which may be None.

    Returns
    -------
    callable
        Of the function. A key is made of the numbers of arrays, the fields of values, and the text of all else.
    """

    def of(compute: Callable[Arguments, Found]) -> Callable[Arguments, Found]:
        known = dict[bytes, Found]()

        @wraps(compute)
        def found(*args: Arguments.args, **named: Arguments.kwargs) -> Found:
            key = hashlib.sha256(b"\0".join(_bytes_of((args, sorted(named.items()))))).digest()
            if (result := known.get(key)) is None:
                result = compute(*args, **named)
                while len(known) >= most:
                    known.pop(next(iter(known)), None)
                known[key] = result
            return result

        return found

    return of


def _bytes_of(value: Any) -> Iterator[bytes]:
    """What tells a value from others: the numbers of arrays, the parts of what has parts, else how it is shown."""
    if isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape}".encode()
        yield value.tobytes()
    elif is_dataclass(value):
        for field in fields(value):
            yield from _bytes_of(getattr(value, field.name))
    elif isinstance(value, tuple | list):
        yield f"{len(value)}".encode()
        for part in value:
            yield from _bytes_of(part)
    else:
        yield repr(value).encode()
