"""The loop on data that another code made, with an effect of the library hidden in each."""

from pathlib import Path

import pytest
from open_cases import WANTED, assert_found, extended, imported, looked_into, on_larger_cells

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "hidden", "true"),
    [("open-c", "streamlining", -0.9), ("open-d", "discharge_error[high]", 0.09), ("open-e", "mixing_length", 0.5)],
)
def test_what_is_hidden_is_found_and_added(name: str, hidden: str, true: float, campaigns: Path) -> None:
    """And open-b, on which the tutorial runs: `test_documents`."""
    case = (imported if name == "open-e" else on_larger_cells)(name, campaigns)
    assert_found(looked_into(case), hidden, true)
    before, *_, after = extended(case).comparison.model_scores
    assert after.validation < min(before.validation, WANTED)
