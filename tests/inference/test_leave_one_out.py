"""Leave-one-out scores by new weights against posteriors that were really calculated without what is left out."""

import numpy as np
import pytest
import scipy.stats

from vegglue.calibration.fit import chance_of_misfit, freedom_of_misfit
from vegglue.inference.weighted_statistics import (
    leave_one_out,
    leave_out,
    log_likelihoods,
    pareto_smoothed,
    share_inside,
)

STATIONS, DRAWS = 30, 6000


@pytest.fixture(scope="module")
def linear() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Design, measured values, covariance of correlated errors, and draws of the posterior."""
    random = np.random.default_rng(1)
    design = random.normal(size=(STATIONS, 2))
    apart = np.abs(np.subtract.outer(np.arange(STATIONS), np.arange(STATIONS)))
    covariance = 0.6**apart
    measured = design @ [0.5, -1.0] + np.linalg.cholesky(covariance) @ random.normal(size=STATIONS)
    mean, spread = posterior(design, measured, covariance, np.arange(STATIONS))
    draws = mean + random.normal(size=(DRAWS, 2)) @ np.linalg.cholesky(spread).T
    return design, measured, covariance, draws


def posterior(
    design: np.ndarray, measured: np.ndarray, covariance: np.ndarray, kept: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    inverse = np.linalg.inv(covariance[np.ix_(kept, kept)])
    spread = np.linalg.inv(design[kept].T @ inverse @ design[kept] + np.eye(2))
    return spread @ design[kept].T @ inverse @ measured[kept], spread


def exact(
    design: np.ndarray, measured: np.ndarray, covariance: np.ndarray, out: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of what is left out, given all others."""
    kept = np.setdiff1d(np.arange(STATIONS), out)
    mean, spread = posterior(design, measured, covariance, kept)
    gain = covariance[np.ix_(out, kept)] @ np.linalg.inv(covariance[np.ix_(kept, kept)])
    slope = design[out] - gain @ design[kept]
    centre = design[out] @ mean + gain @ (measured[kept] - design[kept] @ mean)
    return centre, covariance[np.ix_(out, out)] - gain @ covariance[np.ix_(kept, out)] + slope @ spread @ slope.T


def test_each_station_left_out(linear: tuple[np.ndarray, ...]) -> None:
    design, measured, covariance, draws = linear
    found = leave_one_out(measured - draws @ design.T, np.linalg.inv(covariance), np.full(DRAWS, 1 / DRAWS))
    for i in range(STATIONS):
        centre, spread = exact(design, measured, covariance, np.array([i]))
        one = scipy.stats.norm(centre[0], np.sqrt(spread[0, 0]))
        assert found.score[i] == pytest.approx(one.logpdf(measured[i]), abs=0.05)
        assert found.below[i] == pytest.approx(one.cdf(measured[i]), abs=0.02)
    assert np.all(found.k < 0.7)


@pytest.mark.parametrize("out", [[0, 1, 2], [3, 7, 11]])
def test_a_section_left_out(linear: tuple[np.ndarray, ...], out: list[int]) -> None:
    design, measured, covariance, draws = linear
    group = np.array(out)
    found = leave_out(measured - draws @ design.T, np.linalg.inv(covariance), np.full(DRAWS, 1 / DRAWS), group)
    centre, spread = exact(design, measured, covariance, group)
    wanted = scipy.stats.multivariate_normal(centre, spread).logpdf(measured[group])
    assert found.score == pytest.approx(wanted, abs=0.1)
    assert found.k < 0.7


def test_weights_of_the_draws_count(linear: tuple[np.ndarray, ...]) -> None:
    design, measured, covariance, draws = linear
    wide = 2.0 * (draws - draws.mean(axis=0)) + draws.mean(axis=0)
    mean, spread = posterior(design, measured, covariance, np.arange(STATIONS))
    narrow, broad = (scipy.stats.multivariate_normal(mean, k * spread).logpdf(wide) for k in (1.0, 4.0))
    weights = np.exp(narrow - broad)
    precision, group = np.linalg.inv(covariance), np.array([4, 5])
    found = leave_out(measured - wide @ design.T, precision, weights / weights.sum(), group)
    plain = leave_out(measured - draws @ design.T, precision, np.full(DRAWS, 1 / DRAWS), group)
    assert found.score == pytest.approx(plain.score, abs=0.05)


def test_too_much_left_out_is_not_trusted(linear: tuple[np.ndarray, ...]) -> None:
    design, measured, covariance, draws = linear
    steep = 300.0 * design
    found = leave_out(measured - draws @ steep.T, np.linalg.inv(covariance), np.full(DRAWS, 1 / DRAWS), np.arange(25))
    assert found.k > 0.7
    assert np.isfinite(found.score)


def test_draws_that_weigh_next_to_nothing_raise_no_warning(linear: tuple[np.ndarray, ...]) -> None:
    design, measured, covariance, draws = linear
    weights = np.where(np.arange(DRAWS) % 2, 1.0, 1e-320)
    found = leave_one_out(measured - draws @ design.T, np.linalg.inv(covariance), weights / weights.sum())
    half = draws[1::2]
    plain = leave_one_out(measured - half @ design.T, np.linalg.inv(covariance), np.full(DRAWS // 2, 2 / DRAWS))
    assert found.score == pytest.approx(plain.score, abs=0.02)


def test_parameters_that_the_data_leave_open_cost_no_degree_of_freedom() -> None:
    random = np.random.default_rng(3)
    slope = random.normal(size=(12, 5)) * [20.0, 20.0, 0.05, 0.05, 0.05]  # three of five are left at their priors
    spread = np.linalg.inv(slope.T @ slope + np.eye(5))
    values = (slope @ random.normal(size=(5, 4000))) + random.normal(size=(12, 4000))
    chi2 = np.sum((values - slope @ spread @ slope.T @ values) ** 2, axis=0)
    freedom = freedom_of_misfit(12, spread)
    assert freedom == 10
    alarms = np.mean([chance_of_misfit(float(one), freedom) < 0.05 for one in chi2])
    assert alarms == pytest.approx(0.05, abs=0.012)  # 0.17 of 12 - 5


def test_independent_errors_give_the_plain_likelihood() -> None:
    left, sd = np.array([[0.1, -0.3], [0.0, 0.2]]), np.array([0.1, 0.2])
    found = log_likelihoods(left, np.diag(sd**-2))
    assert found == pytest.approx(scipy.stats.norm.logpdf(left, scale=sd))


def test_bands_hold_their_share() -> None:
    below = (np.arange(1000) + 0.5) / 1000
    assert share_inside(below, 0.5) == pytest.approx(0.5, abs=0.002)
    assert share_inside(below, 0.95) == pytest.approx(0.95, abs=0.002)


def test_members_of_no_weight_are_given_none() -> None:
    heavy = np.linspace(0.0, -3.0, 8)
    log_weights = np.full(1000, -2000.0)  # below rounding, as of draws in a mode that a section rules out
    log_weights[:8] = heavy
    weights, _ = pareto_smoothed(log_weights)
    assert np.count_nonzero(weights) == 8
    assert weights[:8] == pytest.approx(np.exp(heavy) / np.exp(heavy).sum(), abs=0.05)


@pytest.mark.slow  # arviz takes a second to import
def test_smoothed_weights_are_those_of_arviz() -> None:
    arviz = pytest.importorskip("arviz")
    if not hasattr(arviz, "psislw"):
        pytest.skip("ArviZ 1.0 has moved it")
    log_weights = 1.5 * np.random.default_rng(2).normal(size=4000)
    weights, k = pareto_smoothed(log_weights)
    theirs, their_k = arviz.psislw(log_weights)
    assert k == pytest.approx(float(their_k))
    assert weights == pytest.approx(np.exp(np.asarray(theirs)), rel=1e-6)
