"""What is stored of a member is what was solved, on another kind of processor too."""

import subprocess
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from reach import COARSE, ENVIRONMENT, command, write_reach

from vegglue.case.config import load_case
from vegglue.case.parameter_space import sobol_sample
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.flow.problem import Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.inference.solve_ensemble import chunk_size, solve_ensemble, solved_members
from vegglue.measurements.observations import Observations, read_observations
from vegglue.progress import silent
from vegglue.results.result_files import read_ensemble

FEW = 16  # members of the problems that tangents and strides are made with, at most


def test_stored_parameters_are_those_solved_bit_for_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of four chunks, every member's problem is built from the very numbers in the file."""
    case = load_case(write_reach(tmp_path, COARSE, ("members: 1024", "members: 300")))
    built: list[np.ndarray] = []

    def watched(*given: Any) -> Problem:
        built.append(np.column_stack(list(given[-1].values())))
        return build_problem(*given)

    monkeypatch.setattr("vegglue.inference.solve_ensemble.build_problem", watched)
    path = tmp_path / "ensemble.h5"
    solve_ensemble(case, read_observations(case), path, 1, lambda progress: None)
    stored = np.column_stack(list(read_ensemble(path).parameters.values()))
    solved = np.concatenate([theta for theta in built if len(theta) > FEW])
    assert sorted(row.tobytes() for row in solved) == sorted(row.tobytes() for row in stored)


def test_more_predictions_than_memory_is_laid_out_for_are_refused_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = load_case(write_reach(tmp_path, COARSE, ("members: 1024", "members: 1048576")))
    monkeypatch.setattr("vegglue.inference.solve_ensemble.MOST_PREDICTIONS", 2**20)
    with pytest.raises(InputError, match=r"1,048,576 members of .* stations have .* predictions; expected"):
        solve_ensemble(case, read_observations(case), tmp_path / "ensemble.h5", 1, watch=silent)
    assert not list(tmp_path.glob("*.h5*"))


@pytest.mark.parametrize(
    ("members", "experiments", "size"), [(64, 3, 32), (256, 1, 64), (256, 3, 128), (1024, 1, 256), (5000, 3, 256)]
)
def test_each_of_several_experiments_is_a_task_so_that_chunks_may_be_larger(
    members: int, experiments: int, size: int
) -> None:
    assert chunk_size(members, experiments) == size


RISEN = (
    ("  phi: {dist", "  rise: {distribution: normal, mean: 0, sd: 0.1, low: -0.3, high: 0.3, unit: m}\n  phi: {dist"),
    ("simulate:", "effects: {floor_level_error: {values: {rise: rise}}}\nsimulate:"),
)


@pytest.mark.parametrize("sparse", [0, 256])
def test_members_may_have_beds_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sparse: int) -> None:
    """It was a traceback: the beds of all were held against the levels of those that were done. From a member they all
    come from, and from coarser cells.
    """
    monkeypatch.setattr("vegglue.inference.solve_ensemble.SPARSE_MEMBERS", sparse)
    case = load_case(write_reach(tmp_path, COARSE, *RISEN, ("members: 1024", "members: 24")))
    observations, sample = read_observations(case), sobol_sample(case)
    found = solved_members(case, observations, sample, 1)
    assert np.ptp(sample.theta["rise"]) > 0.2
    for member in (3, 17):
        alone = solved_members(case, observations, sample.take(np.array([member])), 1)
        np.testing.assert_allclose(found[member], alone[0], atol=1e-4)


def two_experiments(folder: Path) -> tuple[Case, Observations]:
    """16 members of a reach, and its experiment twice, alike but for the level at the outlet."""
    case = load_case(write_reach(folder, COARSE))
    ((name, one),) = case.experiments.items()
    more = one.model_copy(update={"level": one.level + 0.05})
    case = case.model_copy(
        update={"experiments": {name: one, "more": more}, "simulate": case.simulate.model_copy(update={"members": 16})}
    )
    alone = read_observations(case)
    both = replace(alone, table=pd.concat([alone.table, alone.table.assign(experiment="more")], ignore_index=True))
    return case, both


def test_the_order_in_which_experiments_end_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each has its own predictions, whichever ends first."""
    case, both = two_experiments(tmp_path)
    sample = sobol_sample(case)
    in_order = solved_members(case, both, sample, 1)

    def backwards(work: Callable[..., Any], tasks: Iterable[Any], jobs: int) -> Iterator[Any]:
        assert jobs == 1
        return (work(*task) for task in reversed(list(tasks)))

    monkeypatch.setattr("vegglue.inference.solve_ensemble.as_finished", backwards)
    np.testing.assert_array_equal(solved_members(case, both, sample, 1), in_order)
    first, second = np.split(in_order, 2, axis=1)
    assert np.isfinite(in_order).all()
    assert np.abs(second - first).max() >= 0.01


def test_a_chunk_is_on_its_way_when_one_of_its_experiments_has_ended(tmp_path: Path) -> None:
    case, both = two_experiments(tmp_path)
    told: list[int | None] = []
    solve_ensemble(case, both, tmp_path / "ensemble.h5", 1, lambda progress: told.append(progress.done))
    assert told == [0, 4, 8, 12, 16]


# Without the vector units and the fused products of this machine's processor; compiled anew in half a minute of a core,
# and hardly optimised: no flag of the loops lets that round otherwise, predictions are the same to the last bit.
ANOTHER = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_OPT": "1", "OPENBLAS_CORETYPE": "Prescott"}
# Of predictions [m/s, m]. Measured on x86: 3e-11. The solver stops at a relative residual of 1e-8, and another order of
# rounding may stop it one step sooner or later.
FARTHEST = 1e-7
MEMBERS = 32


def simulate(folder: Path, runs: str, processor: dict[str, str]) -> None:
    """The members into a folder of runs. No limit of time: all loops may have to be compiled, on a machine at work."""
    arguments = command("simulate", "brook.yaml", "--members", MEMBERS, "--jobs", 1, "--runs", runs)
    subprocess.run(arguments, cwd=folder, env=ENVIRONMENT | processor, check=True, stdout=subprocess.DEVNULL)


@pytest.mark.slow
def test_another_kind_of_processor_predicts_the_same_to_within_a_bound(tmp_path: Path) -> None:
    write_reach(tmp_path, COARSE)
    simulate(tmp_path, "here", {})
    simulate(tmp_path, "there", ANOTHER | {"NUMBA_CACHE_DIR": str(tmp_path / "loops")})
    assert list((tmp_path / "loops").iterdir()), "loops were compiled anew"
    here, there = (read_ensemble(tmp_path / runs / "brook" / "ensemble.h5") for runs in ("here", "there"))
    np.testing.assert_array_equal(here.status, there.status)
    for one, other in ((here.prediction, there.prediction), (here.section_flow, there.section_flow)):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=FARTHEST)
