"""The loop on data that another code made, with nothing hidden in them, or an instrument that is off."""

from pathlib import Path

import pytest
from open_cases import looked_into

pytestmark = pytest.mark.slow


def test_where_nothing_is_hidden_nothing_is_found(campaigns: Path) -> None:
    found = looked_into("open-a", campaigns)
    assert found.verdict.kind == "nothing-missing", found.verdict.sentence


@pytest.mark.parametrize(("name", "kind", "offset"), [("open-j", "probe", 0.05), ("open-k", "gauge", -0.015)])
def test_an_instrument_that_is_off_is_set_aside_alone(name: str, kind: str, offset: float, campaigns: Path) -> None:
    found = looked_into(name, campaigns)
    (faulty,) = found.instruments
    assert found.verdict.kind == "instrument", found.verdict.sentence
    assert (faulty.kind, found.steps, found.places) == (kind, (), ())
    assert faulty.interval95[0] <= offset <= faulty.interval95[1]
