"""One cross-section: both rules against sections whose discharge is known."""

import numpy as np
import pytest

from vegglue.measurements.section_discharge import (
    CrossSection,
    combine,
    conveyance_weights,
    grid_weights,
    neighbour_error,
)
from vegglue.measurements.vertical_profile import Column

Y = np.arange(-3.99, 4.0, 0.02)
TRAPEZOID = CrossSection(Y, 0.6667 * np.maximum(np.abs(Y) - 1.5, 0.0), 1.2)
RECTANGLE = CrossSection(Y, np.where(np.abs(Y) < 2.0, 0.0, 5.0), 1.0)


def columns_at(section, position, velocity):
    """Verticals of 50 points each, with velocity(y, height above the bed)."""
    depth = np.interp(position, section.y, section.depth)
    heights = [h * (np.arange(50) + 0.5) / 50 for h in depth]
    return [Column(z, velocity(y, z), np.full(50, 0.01), h) for y, z, h in zip(position, heights, depth, strict=True)]


def discharge(weights, columns):
    return sum(float(weight @ column.velocity) for weight, column in zip(weights, columns, strict=True))


def test_paper_rule_sums_a_linear_profile_exactly():
    position = np.linspace(-1.99, 1.99, 9)
    columns = columns_at(RECTANGLE, position, lambda y, z: 2.0 * z)
    # u = 2 z up to the highest point at 0.99 m, constant above; zero within one cell of the walls
    assert discharge(grid_weights(RECTANGLE, position, columns, 0.01), columns) == pytest.approx(4.0, rel=0.01)


def test_paper_rule_goes_to_zero_between_the_outermost_vertical_and_the_bank():
    position = np.array([-1.0, 1.0])
    columns = columns_at(RECTANGLE, position, lambda y, z: np.ones_like(z))
    # full velocity over 2 m, straight down to zero over 1 m on either side, and to zero below the lowest point
    assert discharge(grid_weights(RECTANGLE, position, columns, 0.002), columns) == pytest.approx(3.0 * 0.995, rel=0.01)


def test_paper_rule_on_dense_verticals_is_the_integral_over_a_trapezoid():
    position = np.arange(-3.2, 3.21, 0.1)
    columns = columns_at(TRAPEZOID, position, lambda y, z: (1.0 - (y / 4.0) ** 2) * np.sqrt(z))
    exact = TRAPEZOID.width * np.sum((1.0 - (Y / 4.0) ** 2) * TRAPEZOID.depth**1.5 / 1.5)
    assert discharge(grid_weights(TRAPEZOID, position, columns, 0.02), columns) == pytest.approx(exact, rel=0.01)


def test_conveyance_rule_is_exact_for_a_constant_froude_number_whatever_the_verticals():
    position = np.array([-2.6, -0.3, 1.9])
    depth = np.interp(position, Y, TRAPEZOID.depth)
    weights = conveyance_weights(TRAPEZOID, position, depth)
    exact = TRAPEZOID.width * np.sum(0.2 * TRAPEZOID.depth**1.5)
    assert weights @ (0.2 * np.sqrt(depth)) == pytest.approx(exact, rel=1e-9)


def test_neighbour_error_is_the_noise_on_a_smooth_profile():
    position = np.cumsum(np.random.default_rng(1).uniform(0.2, 0.6, 400))
    smooth = 0.1 + 0.3 * position - 0.002 * position**2 + 1e-5 * position**3
    assert neighbour_error(position, smooth) == pytest.approx(0.0, abs=1e-9)
    noise = np.random.default_rng(2).normal(0.0, 0.03, position.size)
    assert neighbour_error(position, smooth + noise) == pytest.approx(0.03, rel=0.15)


def test_neighbour_error_of_few_verticals_takes_the_straight_line():
    position, straight = np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 3.0])
    assert neighbour_error(position, straight) == pytest.approx(0.0, abs=1e-12)
    lifted = straight + np.array([0.0, 0.1, 0.0])
    assert neighbour_error(position, lifted) == pytest.approx(0.1 / np.sqrt(1.0 + (2 / 3) ** 2 + (1 / 3) ** 2))
    assert np.isnan(neighbour_error(position[:2], straight[:2]))


def test_discharge_error_takes_the_larger_of_sampling_and_spacing():
    assert combine(2.0, 0.03, 0.01, 0.04).standard_error == pytest.approx(0.05)
    assert combine(2.0, 0.01, 0.03, 0.04).standard_error == pytest.approx(0.05)
    assert combine(2.0, 0.03, float("nan"), 0.04).standard_error == pytest.approx(0.05)
