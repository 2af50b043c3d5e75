"""Members solved on ever finer cells: the same flows as from neighbours, and failures told."""

from functools import partial

import numpy as np
import pytest
from reach import COARSE, write_reach

from vegglue.case.config import load_case
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.parameter_space import parameters_at, sobol_points
from vegglue.case.schema import Case
from vegglue.engine.model import ever_coarser
from vegglue.flow import nested_grids
from vegglue.flow.batch import solve_members
from vegglue.flow.march import USUAL_FALL_BACK
from vegglue.flow.nested_grids import GridProblem, solve_nested
from vegglue.flow.parameter_metric import metric_of_flows
from vegglue.flow.problem import ACROSS, ALONG, LEVEL, Problem
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.starts import lifted_flows, on_grid
from vegglue.flow.status import SOLVED_BY_NEWTON

TOLERANCE = 1e-7


def problem_at(case: Case, site: Site, points: np.ndarray) -> Problem:
    return build_problem(case, site, next(iter(case.experiments)), parameters_at(case, points))


@pytest.fixture(scope="module")
def grids_and_points(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[GridProblem], np.ndarray]:
    case = load_case(write_reach(tmp_path_factory.mktemp("reach"), COARSE))
    points = sobol_points(len(case.parameters), 24, 3)
    problems = [partial(problem_at, *place) for place in ever_coarser(case, build_site(case))]
    grids = [GridProblem(of(points), of) for of in problems]
    assert len(grids) > 1
    return grids, points


def test_the_same_flows_as_from_neighbours(grids_and_points: tuple[list[GridProblem], np.ndarray]) -> None:
    grids, points = grids_and_points
    nested = solve_nested(grids, points, TOLERANCE, USUAL_FALL_BACK)
    beside = solve_members(grids[-1].problem, points, grids[-1].problem_of, TOLERANCE)
    assert (nested.status == SOLVED_BY_NEWTON).all()
    assert np.abs(nested.state - beside.state).max() < 20 * TOLERANCE


def test_members_without_a_flow_on_coarser_cells_are_solved(
    grids_and_points: tuple[list[GridProblem], np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    grids, points = grids_and_points
    whole = solve_nested(grids, points, TOLERANCE, USUAL_FALL_BACK)
    solve = nested_grids.solve_members

    def without_two(*arguments: object, **others: object) -> object:
        solved = solve(*arguments, **others)
        solved.state[..., [3, 5]] = np.nan
        return solved

    monkeypatch.setattr(nested_grids, "solve_members", without_two)
    fewer = solve_nested(grids, points, TOLERANCE, USUAL_FALL_BACK)
    assert (fewer.status == SOLVED_BY_NEWTON).all()
    assert np.abs(fewer.state - whole.state).max() < 20 * TOLERANCE


def test_members_that_stalled_go_on_with_the_next_reference(
    grids_and_points: tuple[list[GridProblem], np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Few steps for each reference: members go on where they stalled, to the same flow in fewer steps."""
    grids, points = grids_and_points
    whole = solve_nested(grids, points, TOLERANCE, USUAL_FALL_BACK)
    monkeypatch.setattr(nested_grids, "MOST_NESTED_STEPS", 4)
    briefly = solve_nested(grids, points, TOLERANCE, USUAL_FALL_BACK)
    assert (briefly.status == SOLVED_BY_NEWTON).all()
    assert np.abs(briefly.state - whole.state).max() < 20 * TOLERANCE
    monkeypatch.setattr(nested_grids, "CLOSE", 0.0)  # none begins where it stalled
    afresh = solve_nested(grids, points, TOLERANCE, USUAL_FALL_BACK)
    assert briefly.iterations.max() > 4
    assert briefly.iterations.sum() < afresh.iterations.sum()


def test_a_lifted_flow_is_nearer_where_friction_is_another(
    grids_and_points: tuple[list[GridProblem], np.ndarray],
) -> None:
    """Beside banks finer cells are shallower or deeper than those around them; only u changes."""
    (*_, coarse, fine), points = grids_and_points
    before = solve_members(coarse.problem, points, coarse.problem_of, TOLERANCE).state
    after = solve_members(fine.problem, points, fine.problem_of, TOLERANCE).state
    plain, lifted = on_grid(before, fine.problem.shape), lifted_flows(coarse.problem, before, fine.problem)
    off = [np.sqrt(((state - after)[:, ALONG] ** 2).mean(axis=(0, 1))) for state in (plain, lifted)]
    assert (off[1] < 0.8 * off[0]).mean() > 0.9
    np.testing.assert_array_equal(lifted[:, [LEVEL, ACROSS]], plain[:, [LEVEL, ACROSS]])


def test_a_metric_of_flows_is_longest_along_what_changes_them_most() -> None:
    points = np.random.default_rng(1).random((30, 2))
    states = np.zeros((4, 3, 5, 30)) + 1.0 + 3.0 * points[:, 0] + 0.1 * points[:, 1]
    states[..., 7] = np.nan
    spread = np.ptp(metric_of_flows(points, states).coordinates, axis=0)
    assert spread.max() > 2 * spread.min()
    np.testing.assert_array_equal(metric_of_flows(points, np.full_like(states, np.nan)).axes, np.eye(2))
