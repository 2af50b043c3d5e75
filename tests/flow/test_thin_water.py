"""Rows of thin water as chord steps need them: roots stay roots, deep water stays as it is."""

import numpy as np
from channels import river, solved

from vegglue.flow import thin_water
from vegglue.flow.equations import faces, residual
from vegglue.flow.problem import ACROSS, ALONG
from vegglue.flow.thin_water import eased, slope_of_friction


def test_easing_moves_no_root_and_leaves_deep_water():
    """Eased rows vanish with the residual, and only with it; they are the residual's where water is not thin."""
    problem = river()
    state = solved(problem)
    slope = slope_of_friction(problem, state)
    outlet = problem.boundaries.outlet
    assert np.abs(eased(problem, state, slope, outlet)).max() < 1e-8
    moved = state + 1e-3 * np.random.default_rng(5).standard_normal(state.shape)
    moved[:, ACROSS, 0] = 0.0
    plain, other = residual(problem, moved), eased(problem, moved, slope, outlet)
    deep = np.minimum(faces(problem, moved).cell[:-1], faces(problem, moved).cell[1:]) > thin_water.THIN * problem.film
    assert (plain[:-1, ALONG] == other[:-1, ALONG])[deep].all()
    changed = plain != other
    assert changed[:, ALONG].any()
    assert not changed[:, ACROSS].any(), "what flows across is held by what comes in, not by friction"
    assert (np.sign(plain) == np.sign(other))[changed].all()


def test_easing_is_exact_where_friction_is_all():
    """In a film the root of k |U| u = -g dz/dx in one step, from ten times its speed."""
    problem = river()
    state = solved(problem)
    everywhere = faces(problem, state).cell < 0.2 * problem.film
    slope = slope_of_friction(problem, state)
    faster = state.copy()
    faster[:, ALONG] = np.where(everywhere, 10.0 * state[:, ALONG] + 1e-3, state[:, ALONG])
    step = eased(problem, faster, slope, problem.boundaries.outlet)[:, ALONG] / np.maximum(slope[:, ALONG], 1e-12)
    for columns in (slice(0, -1), slice(-1, None)):  # at the outlet as elsewhere
        film = everywhere[columns]
        assert film.any()
        error = np.abs(faster - state)[columns, ALONG][film] - step[columns][film]
        assert np.median(np.abs(error)) < 0.1 * np.median(np.abs(state[columns, ALONG][film]))
