"""Weighted statistics against what is known in closed form or by repeating members."""

import math

import numpy as np
import pytest
import scipy.stats

from vegglue.inference.weighted_statistics import (
    correlation,
    effective_size,
    mixture_quantile,
    pareto_shape,
    systematic_draws,
    weighted_covariance,
    weighted_quantile,
)


def test_quantile_of_equal_weights_and_of_a_single_member() -> None:
    assert weighted_quantile(np.arange(5.0), np.ones(5), [0.1, 0.5, 0.9, 1.0]) == pytest.approx([0, 2, 4, 4])
    assert weighted_quantile(np.arange(5.0), np.array([0, 0, 0, 1, 0]), [0.025, 0.975]).tolist() == [3, 3]


def test_quantile_of_weights_is_that_of_repeated_members() -> None:
    random = np.random.default_rng(1)
    values, weights = random.normal(size=400), random.integers(0, 5, 400)
    repeated = np.repeat(values, weights)
    levels = np.array([0.1, 0.5, 0.9])
    got = weighted_quantile(values, weights.astype(float), levels)
    assert got == pytest.approx(np.quantile(repeated, levels), abs=0.02)


def test_quantile_keeps_columns_apart_and_marks_the_unknown() -> None:
    values = np.array([[1.0, np.nan, 5.0], [3.0, 1.0, np.nan]])
    got = weighted_quantile(values, np.array([1.0, 0.0]), [0.5])
    assert got[0, 0] == 1
    assert got[0, 2] == 5  # a NaN without weight plays no part
    assert math.isnan(got[0, 1])
    assert weighted_quantile(np.zeros((4, 2, 3)), np.ones(4), [0.5, 0.9]).shape == (2, 2, 3)


def test_mixture_of_one_member_is_its_normal() -> None:
    got = mixture_quantile(np.array([[1.0, 2.0]]), np.ones(1), np.array([0.5, np.nan]), [0.025, 0.5, 0.975])
    assert got[:, 0] == pytest.approx([1 - 0.5 * 1.959964, 1, 1 + 0.5 * 1.959964])
    assert np.isnan(got[:, 1]).all()


def test_mixture_of_normal_members_adds_the_variances() -> None:
    centres = np.random.default_rng(2).normal(3, 0.4, (20000, 1))
    got = mixture_quantile(centres, np.ones(20000), np.array([0.3]), [0.025, 0.975])
    assert got[:, 0] == pytest.approx([3 - 1.96 * 0.5, 3 + 1.96 * 0.5], abs=0.02)


def test_a_mixture_in_two_heaps_has_its_share_below_each_quantile() -> None:
    random = np.random.default_rng(4)
    centres = random.normal(size=(300, 6)) + 8.0 * (random.random((300, 6)) < 0.4)
    weights, levels = random.random(300) ** 2, [0.025, 0.25, 0.5, 0.75, 0.975]
    got = mixture_quantile(centres, weights, np.full(6, 0.5), levels)
    below = [weights @ scipy.stats.norm.cdf((row - centres) / 0.5) / weights.sum() for row in got]
    assert np.array(below) == pytest.approx(np.tile(np.reshape(levels, (-1, 1)), 6), abs=1e-12)


def test_covariance_of_weights_is_that_of_repeated_members() -> None:
    random = np.random.default_rng(3)
    values, weights = random.normal(size=(50, 3)), random.integers(0, 4, 50)
    expected = np.cov(np.repeat(values, weights, axis=0).T, bias=True)
    assert weighted_covariance(values, weights.astype(float)) == pytest.approx(expected)


def test_correlation_of_a_constant_is_unknown() -> None:
    got = correlation(np.array([[4.0, 3.0, 0.0], [3.0, 9.0, 0.0], [0.0, 0.0, 0.0]]))
    assert got[0, 1] == pytest.approx(0.5)
    assert math.isnan(got[0, 2])


def test_effective_size() -> None:
    assert effective_size(np.full(7, 0.3)) == pytest.approx(7)
    assert effective_size(np.array([0.0, 2.0, 0.0])) == 1
    assert effective_size(np.array([2.0, 1.0, 1.0])) == pytest.approx(16 / 6)


def test_draws_come_floor_or_ceil_of_their_share() -> None:
    weights = np.array([0.25, 0.0, 0.6, 0.15])
    draws = systematic_draws(weights, 10, np.random.default_rng(4))
    counts = np.bincount(draws, minlength=4)
    assert counts.sum() == 10
    assert counts[1] == 0
    assert np.all(np.abs(counts - 10 * weights) < 1)
    assert np.any(np.diff(draws) < 0)  # shuffled, so that chains are alike


def test_tail_shape_is_that_of_a_pareto_distribution() -> None:
    weights = np.random.default_rng(5).pareto(1 / 0.6, 100_000)
    assert pareto_shape(weights) == pytest.approx(0.6, abs=0.12)
    assert math.isnan(pareto_shape(np.ones(100)))
    assert math.isnan(pareto_shape(np.ones(1)))


@pytest.mark.slow  # arviz takes a second to import
def test_tail_shape_is_that_of_arviz() -> None:
    arviz = pytest.importorskip("arviz")
    if not hasattr(arviz, "psislw"):
        pytest.skip("ArviZ 1.0 has moved it")
    log_weights = 2 * np.random.default_rng(6).normal(size=5000)
    assert pareto_shape(np.exp(log_weights)) == pytest.approx(float(arviz.psislw(log_weights)[1]))
