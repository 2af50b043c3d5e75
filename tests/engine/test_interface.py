"""A point is searched from one nearby first, and from afar where that leads nowhere."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vegglue.arrays import Array
from vegglue.engine.interface import Point, Wanted, linearise_from

NEAR = Point(np.zeros(1), np.zeros(1), np.zeros((1, 1)), {})
FOUND = Point(np.ones(1), np.zeros(1), np.zeros((1, 1)), {})


@pytest.mark.parametrize(
    ("near", "leads", "tried"),
    [(NEAR, ("near", "afar"), ["near"]), (NEAR, ("afar",), ["near", "afar"]), (NEAR, (), ["near", "afar"]),
     (None, ("afar",), ["afar"]), (None, (), ["afar"])],
)  # fmt: skip
def test_a_point_is_searched_from_afar_once_and_only_where_it_has_to_be(
    near: Point | None, leads: tuple[str, ...], tried: list[str]
) -> None:
    starts: list[str] = []

    def searched(model: Any, z: Array, start: Point | None, wanted: Wanted) -> Point | None:
        starts.append("afar" if start is None else "near")
        return FOUND if starts[-1] in leads else None

    model: Any = SimpleNamespace(engine=SimpleNamespace(linearise=searched))
    assert linearise_from(model, np.ones(1), near) is (FOUND if leads else None)
    assert starts == tried
