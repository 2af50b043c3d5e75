"""Shear over the smaller of two depths, `numerics.shear_depth: smaller`: what it is, and that tangents know it."""

from dataclasses import replace

import numpy as np
import pytest
from channels import make_problem, river
from pydantic import ValidationError

from vegglue.effect import weighted_across
from vegglue.flow import ALONG, faces, residual
from vegglue.jacobian import factors
from vegglue.schema import Numerics
from vegglue.start import backwater
from vegglue.steady import newton
from vegglue.tangent import tangents

FILM = 1e-6


def corner_depths(smaller):
    """Depths [m] between rows whose beds rise by 0.25 m each, 1 m below the water and less, to land."""
    bed = np.repeat(0.25 * np.arange(7.0)[None], 4, axis=0)
    problem = make_problem(bed, (1.0, 1.0), 0.0, 1.0, film=FILM, smaller_shear_depth=smaller)
    state = np.zeros((4, 3, 7, 1))
    state[:, 0] = 1.0
    return faces(problem, state).corner[2, 1:-1, 0]


def test_shear_acts_over_the_depth_between_or_the_smaller_one():
    assert corner_depths(False) == pytest.approx([0.875, 0.625, 0.375, 0.125, 0.0, 0.0], abs=FILM)
    assert corner_depths(True) == pytest.approx([0.75, 0.5, 0.25, 0.0, 0.0, 0.0], abs=FILM)


def test_land_has_no_say_in_a_gradient():
    """u = 1 + y^2 in four rows of water beside land at rest; central inside, one-sided beside the land."""
    y = np.arange(6.0)
    u = np.where(y < 4.0, 1.0 + y**2, 0.0)[None, :, None]
    weight = np.where(y[:-1] < 3.0, 0.7, 1e-12)[None, :, None]
    assert weighted_across(u, weight, 0.5)[0, :4, 0] == pytest.approx([2.0, 4.0, 8.0, 10.0])


def test_a_misspelt_choice_is_refused():
    with pytest.raises(ValidationError, match="'point' or 'smaller'"):
        Numerics(shear_depth="smallest")


def test_tangent_equals_difference_of_solved_states():
    """Of the discharge, relative to the largest answer in the water; as `test_tangent` has it for the depth between."""

    def with_discharge(factor):
        problem = river(smaller_shear_depth=True)
        inflows = tuple(replace(one, discharge=one.discharge * factor) for one in problem.inflows)
        return replace(problem, inflows=inflows)

    problem, step = with_discharge(1.0), 1e-4
    state = newton(problem, backwater(problem), 1e-10).state
    assert np.abs(state - newton(river(), backwater(river()), 1e-10).state).max() > 1e-3
    more, less = with_discharge(1.0 + step), with_discharge(1.0 - step)
    cause = (residual(more, state) - residual(less, state)) / (2.0 * step)
    tangent = tangents(problem, state, factors(problem, state), cause)[:, ALONG, :, 0]
    found = newton(more, state, 1e-11, time_step=1e4).state - newton(less, state, 1e-11, time_step=1e4).state
    deep = (state[:, 0, :, 0] - problem.bed) > 0.3
    found = (found / (2.0 * step))[:, ALONG, :, 0]
    assert np.abs(tangent - found)[deep].max() < 1e-4 * np.abs(found[deep]).max()
