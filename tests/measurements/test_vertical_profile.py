"""One vertical: averages against quadrature, fits against profiles that are known, errors against their own scatter."""

import numpy as np
import pytest
from scipy.integrate import quad

from vegglue.measurements.vertical_profile import (
    CanopyUnknown,
    Column,
    ProfileFit,
    average_weights,
    few_points_average,
    fit_canopy_height,
    fit_log_law,
    fit_two_layers,
    linear_average,
    linear_weights,
    sampling_error,
)

HEIGHT = np.arange(0.025, 1.2, 0.05)
DEPTH = 1.3
LOG_LAW = ProfileFit(0.0, 0.22, 0.05, np.eye(3), 1.0)
TWO_LAYERS = ProfileFit(0.12, 2.2, 0.8, np.eye(3), 1.0)


def column_of(truth: ProfileFit, noise: np.ndarray | float = 0.0, error: float = 0.01) -> Column:
    return Column(HEIGHT, truth.velocity(HEIGHT) + noise, np.full(HEIGHT.size, error), DEPTH)


@pytest.mark.parametrize("truth", [LOG_LAW, TWO_LAYERS, ProfileFit(0.3, 0.9, 1.5, np.eye(3), 1.0)])
def test_average_is_the_integral_of_the_profile(truth):
    integral, _ = quad(lambda z: float(truth.velocity(np.array([z]))[0]), 0.0, DEPTH, points=[min(truth.top, DEPTH)])
    assert truth.average(DEPTH)[0] == pytest.approx(integral / DEPTH, rel=1e-8)


def test_average_error_follows_the_gradient():
    step, truth = 1e-6, np.array([0.12, 2.2, 0.8])
    values = [ProfileFit(*(truth + step * unit), np.eye(3), 1.0).average(DEPTH)[0] for unit in np.eye(3)]
    gradient = (np.array(values) - TWO_LAYERS.average(DEPTH)[0]) / step
    assert TWO_LAYERS.average(DEPTH)[1] == pytest.approx(np.linalg.norm(gradient), rel=1e-4)


@pytest.mark.parametrize(("fit", "truth"), [(fit_log_law, LOG_LAW), (fit_two_layers, TWO_LAYERS)])
def test_fit_finds_the_profile_it_was_made_from(fit, truth):
    found = fit(column_of(truth))
    assert (found.within, found.slope, found.top) == pytest.approx((truth.within, truth.slope, truth.top), rel=0.03)
    assert found.average(DEPTH)[0] == pytest.approx(truth.average(DEPTH)[0], abs=5e-4)


@pytest.mark.parametrize(("fit", "truth"), [(fit_log_law, LOG_LAW), (fit_two_layers, TWO_LAYERS)])
def test_average_error_is_the_scatter_of_averages(fit, truth):
    generator = np.random.default_rng(3)
    found = [fit(column_of(truth, generator.normal(0.0, 0.01, HEIGHT.size))).average(DEPTH) for _ in range(300)]
    averages, errors = np.array(found).T
    assert averages.mean() == pytest.approx(truth.average(DEPTH)[0], abs=0.0006)
    assert averages.std() == pytest.approx(errors.mean(), rel=0.25)


def test_scatter_beyond_the_sampling_error_is_found_and_widens_the_average():
    noise = np.random.default_rng(4).normal(0.0, 0.04, HEIGHT.size)
    noisy, calm = fit_log_law(column_of(LOG_LAW, noise)), fit_log_law(column_of(LOG_LAW))
    assert noisy.scatter == pytest.approx(4.0, rel=0.35)
    assert calm.scatter == 1.0
    assert noisy.average(DEPTH)[1] > 2.0 * calm.average(DEPTH)[1]


@pytest.mark.parametrize("fit", [fit_log_law, fit_two_layers])
def test_no_profile_is_claimed_where_none_shows(fit):
    noise = np.random.default_rng(5).normal(0.0, 0.01, HEIGHT.size)
    assert fit(Column(HEIGHT, noise, np.full(HEIGHT.size, 0.01), DEPTH)) is None
    assert fit(Column(HEIGHT[:3], HEIGHT[:3], np.full(3, 0.01), DEPTH)) is None


@pytest.mark.parametrize("chezy", [31.0, 63.0])
@pytest.mark.parametrize(("shares", "within"), [((0.4,), 0.01), ((0.2, 0.8), 0.02), ((0.2, 0.4, 0.8), 0.02)])
def test_few_points_are_averaged_as_a_log_law(chezy, shares, within):
    """Points at 0.6, 0.2 and 0.8 of the depth from the surface, over beds from coarse to smooth."""
    truth = ProfileFit(0.0, 0.1, DEPTH * np.exp(-1.0 - 0.4 * chezy / np.sqrt(9.81)), np.eye(3), 1.0)
    height = DEPTH * np.array(shares)
    column = Column(height, truth.velocity(height), np.full(height.size, 1e-6), DEPTH)
    average, error = few_points_average(column, among_plants=False)
    assert average == pytest.approx(truth.average(DEPTH)[0], rel=within)
    assert abs(average - truth.average(DEPTH)[0]) < error < 0.08 * average
    assert linear_average(column)[0] < 0.97 * truth.average(DEPTH)[0], "what zero at the bed makes of it"


def test_few_points_among_plants_stand_for_what_is_below_them():
    column = Column(np.array([0.4, 0.8]), np.array([0.2, 0.2]), np.full(2, 0.01), 1.0)
    average, error = few_points_average(column, among_plants=True)
    assert average == pytest.approx(0.2)
    assert error == pytest.approx(np.hypot(linear_average(column)[1], 0.04 / np.sqrt(3.0)))


def test_linear_rule_is_zero_at_the_bed_and_constant_above_the_highest_point():
    weights = linear_weights(np.array([0.2, 0.6]), np.array([0.0, 0.1, 0.4, 0.6, 1.0]))
    assert weights @ np.array([2.0, 4.0]) == pytest.approx([0.0, 1.0, 3.0, 4.0, 4.0])


def test_linear_average_is_the_area_under_the_linear_rule():
    height, velocity = np.array([0.1, 0.4, 0.9]), np.array([0.2, 0.5, 0.4])
    exact = (0.1 * 0.1 + 0.3 * 0.35 + 0.5 * 0.45 + 0.3 * 0.4) / 1.2
    assert average_weights(height, 1.2) @ velocity == pytest.approx(exact)
    average, error = linear_average(Column(height, velocity, np.array([0.01, 0.02, 0.03]), 1.2), scatter=2.0)
    assert average == pytest.approx(exact)
    assert error == pytest.approx(2.0 * np.sqrt((0.2 * 0.01) ** 2 + (0.4 * 0.02) ** 2 + (0.55 * 0.03) ** 2) / 1.2)


def test_profile_beats_the_linear_rule_where_top_and_bottom_are_not_sampled():
    part = slice(3, 17)
    column = Column(HEIGHT[part], LOG_LAW.velocity(HEIGHT[part]), np.full(14, 0.01), DEPTH)
    truth = LOG_LAW.average(DEPTH)[0]
    assert abs(linear_average(column)[0] - truth) > 0.01
    assert abs(fit_log_law(column).average(DEPTH)[0] - truth) < 0.001


def test_sampling_error_is_the_scatter_of_means_of_a_correlated_record():
    step, time_scale, duration, generator = 0.1, 0.8, 100.0, np.random.default_rng(6)
    memory = np.exp(-step / time_scale)  # exponential correlation: its integral is the time scale
    record = np.empty((400, int(duration / step)))
    record[:, 0] = generator.normal(size=400)
    for index in range(1, record.shape[1]):
        record[:, index] = memory * record[:, index - 1] + np.sqrt(1 - memory**2) * generator.normal(size=400)
    error = sampling_error(np.array([1.0]), np.array([duration]), time_scale)[0]
    assert record.mean(axis=1).std() == pytest.approx(error, rel=0.1)


def test_sampling_error_never_exceeds_the_deviation():
    assert sampling_error(np.array([0.07]), np.array([1.0]), 30.0) == pytest.approx([0.07])


def test_canopy_height_is_shared_by_the_verticals_and_its_error_is_honest():
    generator, found = np.random.default_rng(7), []
    for _ in range(60):
        columns = [column_of(TWO_LAYERS, generator.normal(0.0, 0.03, HEIGHT.size), 0.03) for _ in range(3)]
        found.append(fit_canopy_height(columns))
    values = np.array([canopy.value for canopy in found])
    errors = np.array([canopy.standard_error for canopy in found])
    assert values.mean() == pytest.approx(0.8, abs=0.004)
    assert values.std() == pytest.approx(errors.mean(), rel=0.4)


def test_canopy_height_is_unknown_for_emergent_plants():
    noise = np.random.default_rng(8).normal(0.0, 0.01, HEIGHT.size)
    canopy = fit_canopy_height([Column(HEIGHT, 0.2 + noise, np.full(HEIGHT.size, 0.01), DEPTH)])
    assert np.isnan(canopy.value)
    assert canopy.unknown is CanopyUnknown.NO_TOP
    assert fit_canopy_height([]).unknown is CanopyUnknown.FEW_POINTS


def test_canopy_height_is_unknown_where_verticals_share_no_height():
    low, high = (
        Column(heights, np.full(5, 0.2), np.full(5, 0.01), DEPTH)
        for heights in (np.linspace(0.05, 0.2, 5), np.linspace(0.65, 0.8, 5))
    )
    canopy = fit_canopy_height([low, high])
    assert np.isnan(canopy.value)
    assert canopy.unknown is CanopyUnknown.NO_SHARED_HEIGHT
