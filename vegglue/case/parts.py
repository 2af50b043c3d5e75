"""What the parts of a case are made of: numbers, ranges, polygons, and values that may be parameters."""

import math
import re
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field


def _number_or_name(value: Any) -> Any:
    if isinstance(value, str) and re.fullmatch(r"[A-Za-z_]\w*", value):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError("a number or the name of an entry of `parameters`")
    return float(value)


def rising(interval: tuple[float, float]) -> tuple[float, float]:
    """The interval as it is. Errors: ValueError, of which the schema makes a sentence, if its ends are not in order."""
    if not interval[0] < interval[1]:
        raise ValueError("two numbers, the lower one first")
    return interval


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
Interval = Annotated[tuple[Number, Number], AfterValidator(rising)]
Polygon = Annotated[tuple[tuple[Number, Number], ...], Field(min_length=3)]
Value = Annotated[Number | str, BeforeValidator(_number_or_name)]


class Part(BaseModel):
    """What all parts of a case share: they are values, and know all their keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


def exactly(part: Part, chosen: str, wanted: Mapping[str, tuple[str, ...]], allowed: tuple[str, ...] = ()) -> None:
    """Check that a part has the keys of its kind and none of another. Errors: ValueError naming the key.

    chosen: the kind; wanted: the keys of each kind; allowed: keys that any kind may have.
    """
    others = {key for keys in wanted.values() for key in keys} - set(wanted[chosen]) - set(allowed)
    for key in wanted[chosen]:
        if getattr(part, key) is None:
            raise ValueError(f"the key `{key}`, which {chosen} needs")
    for key in sorted(others):
        if getattr(part, key) is not None:
            raise ValueError(f"no key `{key}` together with {chosen}")
