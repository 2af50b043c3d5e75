"""Validators of the types that results are made of."""

from functools import cache
from typing import Any

from pydantic import TypeAdapter


@cache
def type_adapter(kind: Any) -> TypeAdapter[Any]:
    """The validator of a type, made once: each takes a millisecond, and a diagnosis that is read has some eighty."""
    return TypeAdapter(kind)
