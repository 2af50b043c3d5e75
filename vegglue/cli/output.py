"""How a command prints: lines, tables, or one JSON object; colour on a terminal only, none where NO_COLOR is set."""

import json
import math
import sys
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


@cache
def console(errors: bool = False) -> "Console":
    """Standard output or error, for tables and what moves; into a file or a pipe, lines as long as they need to be."""
    from rich.console import Console

    width = None if (sys.stderr if errors else sys.stdout).isatty() else 200
    # Names such as `discharge_error[high]` are no markup.
    return Console(stderr=errors, highlight=False, soft_wrap=True, markup=False, width=width)


def print_object(tree: Mapping[str, Any] | list[Any]) -> None:
    """Print keys and values as one JSON object on one line; numbers that are none as null."""
    spelt_out = "utf" not in (sys.stdout.encoding or "").lower()
    print(json.dumps(plain(tree), ensure_ascii=spelt_out, allow_nan=False))


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
