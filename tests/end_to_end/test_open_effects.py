"""The loop on data that another code made, with an effect of the library hidden in each."""

from collections.abc import Callable
from pathlib import Path

import pytest
from open_cases import WANTED, assert_found, extended, imported, looked_into, on_larger_cells

from vegglue.case.schema import Case

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "on_cells", "hidden", "true"),
    [
        ("open-c", on_larger_cells, "streamlining", -0.9),
        ("open-d", on_larger_cells, "discharge_error[high]", 0.09),
        ("open-e", imported, "mixing_length", 0.5),
    ],
    ids=["open-c", "open-d", "open-e"],
)
def test_what_is_hidden_is_found_and_added(
    name: str, on_cells: Callable[[str, Path], Case], hidden: str, true: float, campaigns: Path
) -> None:
    """And open-b, on which the tutorial runs: `test_documents`."""
    case = on_cells(name, campaigns)
    assert_found(looked_into(case), hidden, true)
    before, *_, after = extended(case).comparison.model_scores
    assert after.validation < min(before.validation, WANTED)
