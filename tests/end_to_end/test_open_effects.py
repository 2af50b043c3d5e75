"""The loop on data that another code made, with an effect of the library hidden in each."""

from pathlib import Path

import pytest
from open_cases import WANTED, assert_found, extended, looked_into, on_larger_cells

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "wider", "hidden", "true"),
    [
        ("open-c", 2.0, "streamlining", -0.9),
        ("open-d", 2.0, "discharge_error[high]", 0.09),
        ("open-e", 1.0, "mixing_length", 0.5),
    ],
    ids=["open-c", "open-d", "open-e"],
)
def test_what_is_hidden_is_found_and_added(name: str, wider: float, hidden: str, true: float, campaigns: Path) -> None:
    """And open-b, on which the tutorial runs: `test_documents`."""
    case = on_larger_cells(name, campaigns, wider)
    assert_found(looked_into(case), hidden, true)
    before, *_, after = extended(case).comparison.model_scores
    assert after.validation < min(before.validation, WANTED)
