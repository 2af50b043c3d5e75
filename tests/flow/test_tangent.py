"""Tangents against differences of solved states, adjoints against tangents; on a straight grid and in a bend."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from channels import centres, changed, make_problem, river, sloping

from vegglue.case.grid import Grid
from vegglue.flow.equations import residual
from vegglue.flow.jacobian import factors
from vegglue.flow.kernels import Bend
from vegglue.flow.newton import FROM_AFAR, newton
from vegglue.flow.problem import ALONG, LEVEL, InflowSegment
from vegglue.flow.sensor import read_sensors, reading_weights
from vegglue.flow.starts import backwater
from vegglue.flow.tangent import adjoints, jacobian_times, tangents

FROM_THE_ROOT = replace(FROM_AFAR, time_step=1e4)  # s, as a start at the root of a flow hardly changed allows

STEP = 1e-5
STRAIGHT, LEFT = river(), river(bend=Bend(np.full(60, 0.06), np.full(61, 0.06), -4.5, 0.375))


def with_manning(problem, factor):
    coefficient = problem.friction.coefficient.copy()
    coefficient[0] *= factor
    return changed(problem, coefficient=coefficient)


def with_phi(problem, factor):
    return replace(problem, plants=replace(problem.plants, phi=problem.plants.phi * factor))


def with_discharge(problem, factor):
    inflows = tuple(replace(one, discharge=one.discharge * factor) for one in problem.boundaries.inflows)
    return changed(problem, inflows=inflows)


def with_level(problem, factor):
    return changed(problem, outlet_level=problem.boundaries.outlet_level * factor)


CAUSES = (with_manning, with_phi, with_discharge, with_level)


@pytest.fixture(scope="module", params=[STRAIGHT, LEFT], ids=["straight", "bend"])
def solved(request):
    problem = request.param
    state = newton(problem, backwater(problem), 1e-10).state
    return problem, state, factors(problem, state)


def difference(problem, cause, of):
    return (of(cause(problem, 1.0 + STEP)) - of(cause(problem, 1.0 - STEP))) / (2.0 * STEP)


@pytest.mark.parametrize("cause", CAUSES)
def test_tangent_equals_difference_of_solved_states(solved, cause):
    """Relative to the largest answer in the water: 1e-4 asked for."""
    problem, state, shared = solved
    tangent = tangents(problem, state, shared, difference(problem, cause, lambda changed: residual(changed, state)))
    solved_again = difference(problem, cause, lambda changed: newton(changed, state, 1e-11, FROM_THE_ROOT).state)
    deep = (state[:, 0, :, 0] - problem.bed) > 0.3
    told, found = tangent[:, ALONG, :, 0][deep], solved_again[:, ALONG, :, 0][deep]
    error = np.abs(told - found).max() / np.abs(found).max()
    assert error < 1e-4


@pytest.mark.parametrize("nearby", [False, True])
def test_refinement_meets_the_equation(solved, nearby):
    """Also with factors of a state nearby: cells at the waterline are wet in one and dry in the other, where repetition
    alone runs away.
    """
    problem, state, shared = solved
    if nearby:
        shared = factors(problem, newton(with_level(problem, 0.95), state, 1e-8).state)
    causes = np.concatenate(
        [difference(problem, cause, lambda changed: residual(changed, state)) for cause in CAUSES], axis=3
    )
    left = causes + jacobian_times(problem, state, tangents(problem, state, shared, causes))
    most = 1e-4 if nearby else 1e-5
    assert (np.abs(left).max(axis=(0, 1, 2)) < most * np.abs(causes).max(axis=(0, 1, 2))).all()


def test_factors_know_how_a_depth_at_the_inflow_changes_the_shares_of_all_its_rows(solved):
    """J^-1 J e = e for the level of one deep cell there; shares put down to the rows near by were off by 0.1."""
    problem, state, shared = solved
    level = np.zeros_like(state)
    level[0, LEVEL, 12] = 1.0
    assert shared.solve(jacobian_times(problem, state, level)) == pytest.approx(level, abs=1e-3)


def test_weights_of_a_reading_give_the_reading(solved):
    problem, state, _ = solved
    nx, ny = problem.shape
    grid = Grid(centres(30.0, nx), centres(9.0, ny), problem.dx, problem.dy)
    station = pd.DataFrame({
        "kind": ["velocity", "level"] * 3, "x": [3.1, 14.0, 29.9, 0.1, 7.77, 14.6], "y": [4.6, 5.2, 4.4, 4.5, 0.1, 3.9],
    })  # fmt: skip
    read = read_sensors(problem, state, grid, station, ()).prediction[0]
    assert np.einsum("ikjn,ikj->n", reading_weights(problem, state, grid, station), state[..., 0]) == pytest.approx(
        read
    )


def test_adjoint_weighs_every_cause_as_the_tangent_does(solved):
    """l . dR = -g . dx for a mean velocity in the wake of the patch; the adjoint is of single precision."""
    problem, state, shared = solved
    weights = np.zeros_like(state)
    weights[40, ALONG, 8:16] = 0.125
    adjoint = adjoints(problem, state, shared, weights)
    for cause in CAUSES:
        rates = difference(problem, cause, lambda changed: residual(changed, state))
        told = float((weights * tangents(problem, state, shared, rates)).sum())
        assert -float((adjoint * rates).sum()) == pytest.approx(told, rel=5e-3)


def test_adjoints_know_how_an_inflow_through_a_side_is_shared():
    """Of water that enters beside it: levels of columns further off than blocks reach share, too."""
    inflows = (InflowSegment("south", 0, 10, np.array([1.5])),)
    problem = make_problem(sloping(20.0, 20, 6, 0.001), (1.0, 0.5), 1.5, 0.8, viscosity=np.array([0.02]))
    problem = changed(problem, inflows=inflows)
    state = newton(problem, backwater(problem), 1e-10, replace(FROM_AFAR, time_step=1e2)).state
    weights, rates = np.zeros((2, *state.shape))
    weights[4, ALONG, 1], rates[2, LEVEL, 0] = 1.0, 1.0
    shared = factors(problem, state)
    told = -float((adjoints(problem, state, shared, weights) * rates).sum())
    assert told == pytest.approx(tangents(problem, state, shared, rates)[4, ALONG, 1, 0], rel=2e-3)
