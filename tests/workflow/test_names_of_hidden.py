"""What is hidden goes by the name that a diagnosis has for it."""

from pathlib import Path

import pytest
from built_models import model_of
from reach import COARSE, write_reach

from vegglue.case.config import load_case
from vegglue.measurements.observations import read_observations
from vegglue.workflow.hidden_effect import candidate_of


@pytest.mark.parametrize(
    ("hidden", "name"),
    [
        ("discharge_error", "discharge_error[June]"),
        ("discharge_error[June]", "discharge_error[June]"),
        ("patch_density", "patch_density[p1]"),
        ("station_shift", "station_shift"),
        ("viscosity", "viscosity"),
    ],
)
def test_of_one_experiment_and_one_patch(tmp_path: Path, hidden: str, name: str) -> None:
    """`discharge_error[June]` was found, and `reveal` said that the hidden `discharge_error` was missed."""
    case = load_case(write_reach(tmp_path, COARSE))
    assert candidate_of(model_of(case, read_observations(case)), hidden).name == name
