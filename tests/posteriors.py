"""What tests of posteriors share: one that differs in a few numbers, and whether two are the same."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pandas as pd


def changed(value: Any, **changes: object) -> Any:
    """The value with other fields, wherever in it fields of these names lie."""
    own = {field.name: getattr(value, field.name) for field in fields(value)}
    inner = {name: changed(each, **changes) for name, each in own.items() if is_dataclass(each)}
    return replace(value, **inner, **{name: new for name, new in changes.items() if name in own})


def assert_same(one: Any, other: Any) -> None:
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert list(one) == list(other)
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, pd.DataFrame):
        pd.testing.assert_frame_equal(one, other, check_dtype=False)
    elif is_dataclass(one):
        for field in fields(one):
            assert_same(getattr(one, field.name), getattr(other, field.name))
    else:
        np.testing.assert_array_equal(one, other)
