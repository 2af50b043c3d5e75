"""What is stored of a member is what was solved."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reach import COARSE, write_reach

from vegglue.case.config import load_case
from vegglue.ensemble.solve_ensemble import solve_ensemble
from vegglue.errors import InputError
from vegglue.flow.problem import Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.measurements.observations import read_observations
from vegglue.storage.result_files import read_ensemble

FEW = 16  # members of the problems that tangents and strides are made with, at most


def test_stored_parameters_are_those_solved_bit_for_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of four chunks, every member's problem is built from the very numbers in the file."""
    case = load_case(write_reach(tmp_path, COARSE, ("members: 1024", "members: 300")))
    built: list[np.ndarray] = []

    def watched(*given: Any) -> Problem:
        built.append(np.column_stack(list(given[-1].values())))
        return build_problem(*given)

    monkeypatch.setattr("vegglue.ensemble.solve_ensemble.build_problem", watched)
    path = tmp_path / "ensemble.h5"
    solve_ensemble(case, read_observations(case), path, 1, lambda progress: None)
    stored = np.column_stack(list(read_ensemble(path).parameters.values()))
    solved = np.concatenate([theta for theta in built if len(theta) > FEW])
    assert sorted(row.tobytes() for row in solved) == sorted(row.tobytes() for row in stored)


def test_more_predictions_than_memory_is_laid_out_for_are_refused_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = load_case(write_reach(tmp_path, COARSE, ("members: 1024", "members: 1048576")))
    monkeypatch.setattr("vegglue.ensemble.solve_ensemble.MOST_PREDICTIONS", 2**20)
    with pytest.raises(InputError, match=r"1,048,576 members of .* stations have .* predictions; expected"):
        solve_ensemble(case, read_observations(case), tmp_path / "ensemble.h5", 1)
    assert not list(tmp_path.glob("*.h5*"))
