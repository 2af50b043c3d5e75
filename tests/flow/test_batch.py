"""Members solved together: how they are cut into chunks, that others change none, and what a failure leaves."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from channels import family
from reach import COARSE, write_reach

from vegglue.case.config import load_case
from vegglue.case.gridded_site import Site, build_site
from vegglue.case.parameter_space import parameters_at, sample_at, sample_prior, sobol_points
from vegglue.case.schema import Case
from vegglue.flow.anderson import minimise
from vegglue.flow.batch import CLUSTER_SIZE, blend, put_rows, solve_members
from vegglue.flow.chord import ChordSolution, stream
from vegglue.flow.jacobian import eliminate
from vegglue.flow.parameter_metric import clusters, principal_axes, spline_weights
from vegglue.flow.problem import Problem
from vegglue.flow.status import FAILED, SOLVED_BY_NEWTON
from vegglue.flow.wet_band import widen
from vegglue.inference.glue import glue
from vegglue.inference.solve_ensemble import (
    LARGEST_CHUNK,
    solve_chunk,
    solve_ensemble,
    solved_members,
    starts_and_chunks,
)
from vegglue.measurements.observations import Observations, read_observations
from vegglue.results.result_files import read_ensemble

CHUNK = LARGEST_CHUNK
# The outlet level becomes a parameter; far below the bed, no steady state is found.
OUTLET = (
    ("level: 0.95", "level: outlet"),
    ("  phi: {dist", "  outlet: {distribution: uniform, low: -3, high: 1, unit: m}\n  phi: {dist"),
)
EMPTIED, FILLED = 0.02, 0.98  # points of the prior of the outlet level

Reach = tuple[Case, Site, Observations]


def reach_at(folder: Path, *changes: tuple[str, str]) -> Reach:
    case = load_case(write_reach(folder, COARSE, *changes))
    return case, build_site(case), read_observations(case)


def points_of(case: Case, members: int) -> np.ndarray:
    return sobol_points(len(case.parameters), members, case.simulate.seed)


@pytest.mark.parametrize("members", [1, 2, 15, 16, 17, 100, 1000, 5000])
@pytest.mark.parametrize("size", [CLUSTER_SIZE, CHUNK])
def test_clusters_hold_every_member_once_and_evenly(members: int, size: int) -> None:
    cut = clusters(np.random.default_rng(members).random((members, 3)), size)
    np.testing.assert_array_equal(np.sort(np.concatenate(cut)), np.arange(members))
    sizes = [cluster.size for cluster in cut]
    assert max(sizes) <= size
    assert len(cut) == -(-members // size)
    assert max(sizes) - min(sizes) <= max(2, 0.2 * size)


@pytest.mark.parametrize("sparse", [0, 256])
def test_members_at_an_end_of_a_prior_are_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sparse: int) -> None:
    """It was a traceback: no spline leads through members of which one parameter is the same."""
    monkeypatch.setattr("vegglue.inference.solve_ensemble.SPARSE_MEMBERS", sparse)
    case, _, observations = reach_at(tmp_path)
    points = points_of(case, 40)
    points[:, 0] = 1.0
    found = solved_members(case, observations, sample_at(case, points), 1)
    assert np.isfinite(found).all()


def test_splines_are_left_out_where_members_coincide() -> None:
    known = np.random.default_rng(2).random((20, 3))
    weights = spline_weights(known, known[:2] + 0.01, "cubic", 1)
    assert weights is not None
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert spline_weights(np.vstack([known, known[:1]]), known[:2], "cubic", 1) is None


def test_clusters_cope_with_members_at_one_place() -> None:
    cut = clusters(np.full((50, 3), 0.5), CLUSTER_SIZE)
    np.testing.assert_array_equal(np.sort(np.concatenate(cut)), np.arange(50))


def test_clusters_are_neighbours_and_follow_each_other() -> None:
    points = np.random.default_rng(5).random((128 * CLUSTER_SIZE, 3))
    cut = clusters(points, CLUSTER_SIZE)
    widths = np.array([np.ptp(points[cluster], axis=0) for cluster in cut])
    assert widths.max() <= 0.35, "128 clusters of a cube: about a fifth of the prior each way"
    centres = np.array([points[cluster].mean(axis=0) for cluster in cut])
    steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    assert np.median(steps) < 0.35, "at random it would be 0.66"


def test_members_lie_apart_as_their_flows_differ() -> None:
    """Along the direction that changes flows most the axis is longest; what changes nothing still has one."""
    change = np.random.default_rng(6).standard_normal((50, 3))
    both = 1.6 * change[:, 0] + 0.1 * change[:, 1]
    found = principal_axes([(both, 0.5 * both, np.zeros(50))], 3)
    lengths = np.sort(np.linalg.norm(found, axis=0))
    assert lengths[-1] == pytest.approx(1.0, abs=0.01)
    assert lengths[:2] == pytest.approx(0.1, abs=0.01)
    longest = found[:, np.linalg.norm(found, axis=0).argmax()]
    assert longest == pytest.approx(np.array([1.0, 0.5, 0.0]) / np.hypot(1.0, 0.5), abs=0.01)
    assert (principal_axes([], 3) == np.eye(3)).all()


@pytest.mark.parametrize("jobs", [1, 2])
def test_chunks_are_cut_before_the_jobs_are_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: int) -> None:
    """What is handed to the processes, and in which order, for any number of them."""
    case, site, observations = reach_at(tmp_path, ("members: 1024", f"members: {5 * CHUNK}"))
    handed: list[np.ndarray] = []

    def record(*given: Any) -> Iterator[Any]:
        _, _, _, sample, chunks, todo, _, _ = given
        handed.extend(sample.points[chunks[index]] for index in todo)
        return iter(())

    monkeypatch.setattr("vegglue.inference.solve_ensemble._solve_all", record)
    solve_ensemble(case, observations, tmp_path / "ensemble.h5", jobs, lambda progress: None)
    points = points_of(case, 5 * CHUNK)
    expected = [points[cluster] for cluster in starts_and_chunks(case, site, points)[1]]
    assert len(handed) == 5
    for ours, theirs in zip(handed, expected, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.slow
def test_company_does_not_change_a_member(tmp_path: Path) -> None:
    """Two clusters together against each member alone: below 1e-6 m/s and m, and as small as the tolerance asks for."""
    case, site, observations = reach_at(tmp_path)
    points = points_of(case, 2 * CLUSTER_SIZE)
    largest = {}
    for tolerance in (1e-7, 1e-9):
        numerics = case.numerics.model_copy(update={"tolerance": tolerance})
        asked = case.model_copy(update={"numerics": numerics})
        together = solve_chunk(asked, site, observations, sample_at(asked, points))
        alone = [solve_chunk(asked, site, observations, sample_at(asked, point[None])) for point in points]
        apart = np.concatenate([rows["prediction"] for rows in alone])
        largest[tolerance] = np.abs(together["prediction"] - apart).max()
        assert (together["status"] == SOLVED_BY_NEWTON).all()
    assert largest[1e-7] < 1e-6
    assert largest[1e-9] < 1e-8


def test_a_member_solved_from_far_away_is_the_same(tmp_path: Path) -> None:
    """The corner of the prior reached from its other end, and asked for alone."""
    case, site, observations = reach_at(tmp_path)
    ends = np.array([[0.02, 0.02], [0.98, 0.98]])
    both = solve_chunk(case, site, observations, sample_at(case, ends))["prediction"]
    each = [solve_chunk(case, site, observations, sample_at(case, end[None])) for end in ends]
    alone = np.concatenate([rows["prediction"] for rows in each])
    np.testing.assert_allclose(both, alone, atol=1e-5, rtol=0)
    assert np.abs(both[0] - both[1]).max() > 0.1


@pytest.mark.slow
def test_a_member_without_steady_state_fails_and_leaves_the_others_alone(tmp_path: Path) -> None:
    case, site, observations = reach_at(tmp_path, *OUTLET)
    column = list(case.parameters).index("outlet")
    points = points_of(case, 6)
    points[:, column] = FILLED
    points[2, column] = EMPTIED
    rows = solve_chunk(case, site, observations, sample_at(case, points))
    failed = np.arange(6) == 2
    np.testing.assert_array_equal(rows["status"] == FAILED, failed)
    np.testing.assert_array_equal(np.isnan(rows["prediction"]).all(axis=1), failed)
    assert rows["reason"][2].startswith("June")
    assert (rows["reason"][~failed] == "").all()
    assert rows["mass_error"][~failed].max() < 1e-5
    without = solve_chunk(case, site, observations, sample_at(case, points[~failed]))
    np.testing.assert_allclose(rows["prediction"][~failed], without["prediction"], atol=1e-5, rtol=0)


def test_a_case_states_how_long_to_march(tmp_path: Path) -> None:
    """Step and span reach the march, and a case that sets neither keeps its hash."""
    case, site, observations = reach_at(tmp_path, *OUTLET)
    assert not {"march_step", "march_span"} & case.numerics.model_dump(exclude_none=True).keys()
    short = case.numerics.model_copy(update={"march_step": 0.01, "march_span": 0.08})
    case = case.model_copy(update={"numerics": short})
    points = np.full((1, 3), 0.5)
    points[:, list(case.parameters).index("outlet")] = EMPTIED
    rows = solve_chunk(case, site, observations, sample_at(case, points))
    assert rows["status"][0] == FAILED
    assert "0.08 s" in rows["reason"][0]


@pytest.mark.slow
def test_a_failed_member_stays_in_the_ensemble_and_weighs_nothing(tmp_path: Path) -> None:
    shallower = ("low: -3, high: 1", "low: -0.7, high: 1")
    case, _, observations = reach_at(tmp_path, *OUTLET, shallower, ("members: 1024", "members: 8"))
    path = tmp_path / "ensemble.h5"
    heard = []
    solve_ensemble(case, observations, path, 1, heard.append)
    ensemble = read_ensemble(path)
    failed = ensemble.status == FAILED
    assert 0 < failed.sum() < 8
    assert heard[-1].failed == failed.sum()
    assert all(reason.startswith("June") for reason in ensemble.reason[failed])
    np.testing.assert_array_equal(ensemble.parameters["outlet"], sample_prior(case.parameters, 8, 7)["outlet"])
    posterior = glue(ensemble, case, observations)
    assert posterior.sample.failed == failed.sum()
    assert (posterior.sample.weights[failed] == 0).all()
    assert posterior.sample.weights.sum() == pytest.approx(1.0)
    np.testing.assert_array_equal(parameters_at(case, points_of(case, 8))["outlet"], ensemble.parameters["outlet"])


def test_no_solved_member_is_solved_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor the central member of the next cluster, which comes with this one, when stragglers become references."""
    done: set[int] = set()

    def watched(problem: Problem, queue: np.ndarray, *others: Any) -> None:
        *between, deliver = others
        assert not done.intersection(queue.tolist())

        def keep(members: np.ndarray, ended: ChordSolution) -> None:
            done.update(members[ended.converged].tolist())
            deliver(members, ended)

        stream(problem, queue, *between, keep)

    monkeypatch.setattr("vegglue.flow.batch.stream", watched)
    monkeypatch.setattr("vegglue.flow.batch.MOST_CHORD_STEPS", 5)
    points = np.random.default_rng(1).random((2 * CLUSTER_SIZE, 2))
    solved = solve_members(family(points), points, family, 1e-6)
    assert (solved.status == SOLVED_BY_NEWTON).all()
    assert len(done) < 2 * CLUSTER_SIZE - 2, "some were references besides the central members"


def test_starts_are_weighted_sums_of_solved_states_in_the_rows_of_a_band() -> None:
    random = np.random.default_rng(7)
    states, weights = random.random((9, 5, 3, 8)), random.random((4, 3))
    some = np.array([7, 0, 3])
    expected = np.einsum("bn,nxej->xejb", weights, states[some][..., 2:6])
    assert blend(states, some, weights, 2, 6) == pytest.approx(expected, rel=1e-12)


def test_states_found_in_a_band_are_put_into_all_rows_of_those_that_are_good() -> None:
    states, found = np.full((6, 5, 3, 9), 7.0), np.random.default_rng(8).random((5, 3, 4, 3))
    put_rows(states, np.array([4, 0, 5]), np.array([True, False, True]), found, 2, 6)
    wide = widen(found, 9, (2, 6))
    np.testing.assert_array_equal(states[[4, 5]], np.moveaxis(wide, -1, 0)[[0, 2]])
    assert (states[:4] == 7.0).all()


def test_a_singular_jacobian_fails_its_own_member_only(tmp_path: Path) -> None:
    """On a bed of slope 0.05 water runs faster than its waves, the march runs away, and a block has no inverse."""
    low = (OUTLET[0], (OUTLET[1][0], OUTLET[1][1].replace("-3", "-0.94")))
    steep, briefly = ("bed_slope: 0.001", "bed_slope: 0.05"), ("simulate:", "numerics: {march_span: 20}\nsimulate:")
    case, site, observations = reach_at(tmp_path, *low, steep, briefly)
    sample = sample_at(case, np.array([[0.5, EMPTIED, 0.5], [0.5, FILLED, 0.5]]))
    rows = solve_chunk(case, site, observations, sample)
    assert rows["status"].tolist() == [FAILED, SOLVED_BY_NEWTON]
    assert rows["reason"][0]
    assert np.isnan(rows["prediction"][0]).all()
    assert np.isfinite(rows["prediction"][1]).all()


def test_a_matrix_without_an_inverse_leads_nowhere() -> None:
    columns, far = np.zeros((3, 3, 6, 6), np.float32), np.zeros((3, 6), np.float32)
    eliminate(columns, far)
    assert np.isnan(columns).all()


def test_a_slot_without_finite_numbers_is_mixed_on_its_own() -> None:
    gram, right = np.ones((1, 1, 3)), np.array([[1.0, np.nan, 1.0]])
    gram[..., 2] = np.inf
    assert minimise(gram, right).tolist() == [[pytest.approx(1.0), 0.0, 0.0]]
