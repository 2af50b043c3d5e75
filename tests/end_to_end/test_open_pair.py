"""The loop on data that another code made, with two effects of the library hidden at once."""

from pathlib import Path

import pytest
from open_cases import assert_better, extended, on_larger_cells


@pytest.mark.slow
def test_two_effects_are_added(campaigns: Path) -> None:
    assert_better(extended(on_larger_cells("open-l", campaigns)), 2)
