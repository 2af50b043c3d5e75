"""Results of costly functions, kept in memory by what their arguments hold."""

import hashlib
import pickle
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Found = TypeVar("Found")


def memoised(most: int) -> Callable[[Callable[Arguments, Found]], Callable[Arguments, Found]]:
    """A decorator that keeps the `most` newest results, none of them None, of a function; arguments are compared by
    value, arrays too.
    """

    def of(compute: Callable[Arguments, Found]) -> Callable[Arguments, Found]:
        known = dict[bytes, Found]()

        @wraps(compute)
        def found(*args: Arguments.args, **named: Arguments.kwargs) -> Found:
            key = hashlib.sha256(pickle.dumps((args, named))).digest()
            if (result := known.get(key)) is None:
                result = compute(*args, **named)
                while len(known) >= most:
                    known.pop(next(iter(known)), None)
                known[key] = result
            return result

        return found

    return of
