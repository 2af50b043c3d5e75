"""The loop on data that another code made, with something in each that is in no list and stands at one place."""

from pathlib import Path

import pytest
from open_cases import assert_better, extended, looked_into, on_larger_cells

pytestmark = pytest.mark.slow


def test_something_unlisted_is_none_of_these_and_has_a_place(campaigns: Path) -> None:
    found = looked_into(on_larger_cells("open-f", campaigns))
    location = found.verdict.anomaly
    assert found.verdict.kind == "none-of-these", found.verdict.sentence
    assert location is not None
    assert ((location.x - 33.0) ** 2 + (location.y + 0.6) ** 2) ** 0.5 < 1.5


@pytest.mark.parametrize(("name", "term", "x", "y"), [("open-i", "bed", 47.0, -0.5), ("open-f", "drag", 33.0, -0.6)])
def test_a_place_is_of_the_right_term(name: str, term: str, x: float, y: float, campaigns: Path) -> None:
    found = looked_into(on_larger_cells(name, campaigns))
    (place,) = found.places
    assert found.verdict.kind == "none-of-these", found.verdict.sentence
    assert ((place.x - x) ** 2 + (place.y - y) ** 2) ** 0.5 < 1.5
    assert place.term == term
    assert all(odds > 10.0 for name, odds in place.odds.items() if name in ("drag", "bed", "inflow", "viscosity"))


def test_a_place_is_added(campaigns: Path) -> None:
    assert_better(extended(on_larger_cells("open-i", campaigns)), 1)
