"""The loop on data that another code made, with an effect of the library hidden in each."""

from pathlib import Path

import pytest
from open_cases import WANTED, extended, looked_into

EDDIES = {"viscosity", "elder", "smagorinsky", "mixing_length", "coherent_structures", "edge_mixing"}
pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "hidden", "true"),
    [
        ("open-b", "secondary_current", 0.010),
        ("open-c", "streamlining", -0.9),
        ("open-d", "discharge_error[high]", 0.09),
        ("open-e", "mixing_length", 0.5),
    ],
)
def test_what_is_hidden_is_found_and_added(name: str, hidden: str, true: float, campaigns: Path) -> None:
    found = looked_into(name, campaigns)
    assert found.verdict.kind in ("identified", "one-of"), found.verdict.sentence
    assert len(found.steps) == 1, found.verdict.sentence
    assert hidden in found.set, found.verdict.sentence
    assert len(found.set) == 1 or set(found.set) <= EDDIES, found.verdict.sentence
    low, high = found.suspect(hidden).amplitude.interval95
    assert low <= true <= high
    before, after = extended(name, campaigns).comparison.rungs
    assert after.validation < min(before.validation, WANTED)
