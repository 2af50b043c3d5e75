"""Results kept in memory by the values of arguments."""

from dataclasses import dataclass

import numpy as np

from vegglue.arrays import Array
from vegglue.memoised import memoised


@dataclass(frozen=True)
class Field:
    """Something that holds an array."""

    values: Array


def test_equal_arguments_are_computed_once_and_the_oldest_is_forgotten() -> None:
    asked = list[float]()

    @memoised(2)
    def total(field: Field) -> float:
        asked.append(float(field.values.sum()))
        return asked[-1]

    fields = [Field(np.full(3, value)) for value in (1.0, 2.0, 3.0)]
    assert [total(fields[0]), total(Field(np.ones(3)))] == [3.0, 3.0]
    assert asked == [3.0]
    assert [total(one) for one in fields] == [3.0, 6.0, 9.0]
    assert asked == [3.0, 6.0, 9.0]
    assert total(fields[0]) == 3.0
    assert asked == [3.0, 6.0, 9.0, 3.0]
