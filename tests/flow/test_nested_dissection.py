"""Sparse factors against the block elimination: right-hand sides, adjoints, Newton's way and a whole flow."""

import numpy as np
import pytest
from channels import make_problem, river, sloping, solved, trapezoid

from vegglue.effects import bed_laws
from vegglue.flow import jacobian as of_jacobian
from vegglue.flow.jacobian import Factors, SharedFactors, SparseJacobian, factors, jacobian
from vegglue.flow.nested_dissection import dissection, sparse_factors
from vegglue.flow.problem import ACROSS, InflowSegment, Problem
from vegglue.flow.starts import backwater, between_cells, on_grid
from vegglue.flow.tangent import adjoints, tangents


@pytest.mark.parametrize(("nx", "ny"), [(1, 1), (3, 2), (7, 40), (60, 24), (25, 61)])
def test_every_cell_is_eliminated_once_and_the_last_part_leaves_none(nx: int, ny: int) -> None:
    parts = dissection(nx, ny)
    assert np.array_equal(np.sort(parts.own), np.arange(nx * ny))
    assert parts.around_start[-1] == parts.around_start[-2]


def test_no_entry_couples_two_parts_that_are_eliminated_side_by_side() -> None:
    """Cells beside a part belong to it, to one below it, or to its front."""
    nx, ny = 25, 31
    parts = dissection(nx, ny)
    below: dict[int, set[int]] = {}
    for node in range(parts.own_start.size - 1):
        inside = set(parts.own[parts.own_start[node] : parts.own_start[node + 1]].tolist())
        for child in parts.children[parts.child_start[node] : parts.child_start[node + 1]]:
            inside |= below[int(child)]
        below[node] = inside
        around = set(parts.around[parts.around_start[node] : parts.around_start[node + 1]].tolist())
        beside = {
            (cell // ny + di) * ny + cell % ny + dj
            for cell in inside
            for di in (-1, 0, 1)
            for dj in (-1, 0, 1)
            if 0 <= cell // ny + di < nx and 0 <= cell % ny + dj < ny
        }
        assert beside - inside == around


@pytest.mark.parametrize("members", [1, 3])
def test_factors_solve_the_compact_system_as_a_dense_solver_does(members: int) -> None:
    """M x = r and M' x = r in double precision, M with random entries and a strong diagonal."""
    nx, ny, chance = 9, 13, np.random.default_rng(2)
    values = 0.1 * chance.standard_normal((nx, ny, 3, 5, 3, 3)).astype(np.float32)
    values[..., [0, 4], :, :] = 0.0  # nothing beyond the cells beside, so that A and M are one
    values[:, :, 1, 2] += 4.0 * np.eye(3, dtype=np.float32)
    dense = np.zeros((nx, 3, ny, nx, 3, ny))
    for i, j, a, b in np.ndindex(nx, ny, 3, 5):
        if 0 <= i + a - 1 < nx and 0 <= j + b - 2 < ny:
            dense[i, :, j, i + a - 1, :, j + b - 2] = values[i, j, a, b]
        else:
            values[i, j, a, b] = 0.0
    matrix, found = dense.reshape(3 * nx * ny, -1), sparse_factors(values, np.zeros((nx, ny, 3), np.float32))
    right = chance.standard_normal((nx, 3 * ny, members)).astype(np.float32)
    for transposed in (False, True):
        wanted = np.linalg.solve(matrix.T if transposed else matrix, right.reshape(-1, members).astype(float))
        got = right.copy()
        found.solve(got, transposed)
        assert got.reshape(wanted.shape) == pytest.approx(wanted, abs=2e-6 * np.abs(wanted).max())


def test_cells_many_times_as_long_as_wide_are_factored_by_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cells of 50 m by 0.09 m over dry banks: single precision loses the level of parts beside the south wall."""
    bed, banks = trapezoid(1500.0, 4.5, (30, 96))
    cell = (50.0, 9.0 / 96)
    problem = make_problem(bed, cell, 4.0, -0.4, (bed_laws.MANNING, 0.03), friction_class=0 * banks, film=0.01)
    state = backwater(problem)
    sparse = jacobian(problem, state).inverse()
    monkeypatch.setattr(of_jacobian, "WIDE_FROM", 97)
    blocks = jacobian(problem, state).inverse()
    assert isinstance(sparse, SharedFactors)
    for transposed in (False, True):
        got, wanted = (np.ones((30, 3 * 96, 2), np.float32) for _ in range(2))
        sparse.solve(got, transposed)
        blocks.solve(wanted, transposed)
        assert np.abs(got - wanted).max() < 1e-2 * np.abs(wanted).max()


def test_no_inverse_gives_no_correction() -> None:
    nothing = SparseJacobian(
        np.zeros((4, 4, 3, 5, 3, 3), np.float32), np.zeros((4, 4, 3), np.float32),
        np.zeros((4, 12, 0), np.float32), np.zeros((4, 12, 0), np.float32),
    )  # fmt: skip
    right = np.ones((4, 12, 2), np.float32)
    nothing.inverse().solve(right)
    assert np.isnan(right).all()


def test_a_state_between_cells_keeps_what_is_linear() -> None:
    """Levels, u and v that are linear along and across stay so on cells of any other number."""

    def linear(nx: int, ny: int) -> np.ndarray:
        x, y = np.arange(nx)[:, None] / nx, np.arange(ny)[None] / ny
        state = np.stack([x + 2 * y + 0.5 / nx + 1.0 / ny, y + 0 * x, 3 * x + 3.0 / nx + 0 * y], axis=1)
        return state[..., None]

    for of in (between_cells, on_grid):
        found, wanted = of(linear(20, 15), (41, 32)), linear(41, 32)
        assert found[2:-2, :, 3:-3] == pytest.approx(wanted[2:-2, :, 3:-3], abs=1e-12)


def joined() -> Problem:
    """A flat rectangular channel, water from the west and through a side, both shared by depth over a rough bed."""
    sides = (InflowSegment("west", 0, 8, np.array([1.0])), InflowSegment("south", 20, 28, np.array([0.5])))
    bed = sloping(30.0, 60, 8, 0.0005) + 0.1 * np.sin(np.arange(60) / 1.6)[:, None]
    changes = {"inflows": sides, "viscosity": np.array([0.02])}
    return make_problem(bed, (0.5, 0.5), 1.0, 0.6, (bed_laws.MANNING, 0.03), **changes)


@pytest.fixture(params=[river, joined], ids=["river", "joined"])
def both(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> tuple[Problem, np.ndarray, Factors, Factors]:
    """A steady flow, and its factors by blocks and sparse."""
    problem = request.param()
    state = solved(problem)
    blocks = factors(problem, state)
    monkeypatch.setattr(of_jacobian, "WIDE_FROM", 1)
    sparse = factors(problem, state)
    assert isinstance(sparse.inverse, SharedFactors)
    return problem, state, blocks, sparse


def directions(state: np.ndarray) -> np.ndarray:
    found = np.random.default_rng(3).standard_normal((*state.shape[:3], 5))
    found[:, ACROSS, 0] = 0.0
    return found


def test_tangents_and_adjoints_are_those_of_blocks(both: tuple[Problem, np.ndarray, Factors, Factors]) -> None:
    problem, state, blocks, sparse = both
    causes = directions(state)
    ahead = [tangents(problem, state, one, causes, 1e-6) for one in (blocks, sparse)]
    back = [adjoints(problem, state, one, causes) for one in (blocks, sparse)]
    assert np.abs(ahead[1] - ahead[0]).max() < 1e-5 * np.abs(ahead[0]).max()
    assert np.abs(back[1] - back[0]).max() < 2e-3 * np.abs(back[0]).max()
    # l . dR = -g . dx
    g = directions(state)[..., :1]
    product = np.einsum("ikjn,ikjp->np", adjoints(problem, state, sparse, g), causes)
    wanted = -np.einsum("ikjn,ikjp->np", g, ahead[0])
    assert product == pytest.approx(wanted, abs=2e-3 * np.abs(wanted).max())


def test_newton_finds_the_same_flow(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = river()
    state = solved(problem)
    monkeypatch.setattr(of_jacobian, "WIDE_FROM", 1)
    assert solved(problem) == pytest.approx(state, abs=1e-9)
