"""Values in what JSON knows, printed or kept."""

import math
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """The value in what JSON knows: arrays as lists, paths as text, infinite and undefined numbers as null."""
    if hasattr(value, "tolist"):  # of numpy, which need not be imported for this
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, int | str | None) else str(value)
