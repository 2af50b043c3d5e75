"""The loop on data that another code made, with an effect of the library hidden in each."""

from pathlib import Path

import pytest
from open_cases import WANTED, assert_found, extended, looked_into

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "hidden", "true", "wanted"),
    [
        ("open-c", "streamlining", -0.9, WANTED),
        ("open-d", "discharge_error[high]", 0.09, WANTED),
        # 0.0116 m/s on these cells, 0.0062 on those of an import, on which `test_open_pair` adds a mixing length.
        ("open-e", "mixing_length", 0.5, 0.0125),
    ],
)
def test_what_is_hidden_is_found_and_added(name: str, hidden: str, true: float, wanted: float, campaigns: Path) -> None:
    """And open-b, on which the tutorial runs: `test_documents`."""
    assert_found(looked_into(name, campaigns), hidden, true)
    before, *_, after = extended(name, campaigns).comparison.model_scores
    assert after.validation < min(before.validation, wanted)
