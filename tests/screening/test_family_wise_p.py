"""Family-wise p under the null: what is decided by is uniform where it decides, and agrees with what is told."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

from vegglue.arrays import Array
from vegglue.screening import score_test
from vegglue.screening.family_wise_p import FITTED_AT, Family, family_of, family_p, log_family_p

ROWS, SLOPES, PRINTS, NULLS = 60, 3, 40, 5000
# Rates of false alarms, and what counts as detectable (`suspects`), down to what this many draws resolve.
LEVELS = (0.05, 0.04, 0.01, 0.008)
# What p may be off by itself: 8 % from the 150 of 3,000 draws it is fitted to, and a tail that falls more slowly than
# that of any number of independent tests.
OWN_ERROR = 0.15


def smooth_fingerprints() -> tuple[Array, Array, np.ndarray]:
    """Slopes (rows, p) and fingerprints (rows, c) like those of a flow: each like its neighbours; some one-sided."""
    random = np.random.default_rng(5)
    place, centres = np.linspace(0.0, 1.0, ROWS), np.linspace(0.0, 1.0, PRINTS)
    prints = np.exp(-(((place[:, None] - centres) / 0.03) ** 2)) + 0.1 * random.standard_normal((ROWS, PRINTS))
    return 3.0 * random.standard_normal((ROWS, SLOPES)), prints, np.arange(PRINTS) % 3 == 0


@pytest.fixture(scope="module")
def family() -> Family:
    slopes, prints, one_sided = smooth_fingerprints()
    errors = np.random.default_rng(11).standard_normal((score_test.NULL_DRAWS, ROWS))
    return family_of(score_test.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), prints), one_sided, errors, 3)


@pytest.fixture(scope="module")
def best_scores(family: Family) -> Array:
    """|T| of the best fingerprint of residuals that are errors only, after the true parameters were calibrated."""
    slopes, prints, one_sided = smooth_fingerprints()
    random, found = np.random.default_rng(12), []
    for _ in range(NULLS):
        values = slopes @ random.standard_normal(SLOPES) + random.standard_normal(ROWS)
        z = np.linalg.solve(slopes.T @ slopes + np.eye(SLOPES), slopes.T @ values)
        projected = score_test.project(slopes, values - slopes @ z, z, prints)
        found.append(np.abs(score_test.scores(projected, one_sided)).max())
    return np.array(found)


def departures(p: Array) -> list[float]:
    """Levels that p falls below more often, or less often, than their own chance and OWN_ERROR account for; and 0.1
    where p below it is not spread evenly.
    """
    expected = np.array(LEVELS) * p.size
    apart = np.abs([np.sum(p <= level) for level in LEVELS] - expected)
    wrong = apart > 3.0 * np.sqrt(expected) + OWN_ERROR * expected
    uneven = scipy.stats.kstest(p[p < 0.1] / 0.1, "uniform").pvalue < 1e-3
    return [level for level, off in zip(LEVELS, wrong, strict=True) if off] + [0.1] * bool(uneven)


def test_what_is_decided_by_is_uniform_under_the_null(family: Family, best_scores: Array) -> None:
    p = np.exp([replace(family, scores=np.array([score])).log_p() for score in best_scores])
    assert departures(p) == []


@pytest.mark.parametrize("factor", [1 / 20, 1 / 2, 2])
def test_another_number_of_tests_is_noticed(factor: float, family: Family, best_scores: Array) -> None:
    p = np.exp([log_family_p(score, factor * family.effective_tests) for score in best_scores])
    assert departures(p) != []


def test_what_is_told_is_uniform_under_the_null(family: Family, best_scores: Array) -> None:
    assert scipy.stats.kstest([family.p_of(score) for score in best_scores[:1000]], "uniform").pvalue > 1e-3


def test_what_is_told_and_what_is_decided_by_agree(family: Family) -> None:
    """Within the error of counting where draws are counted, and exactly where the tail is fitted."""
    tests = family.effective_tests
    at = family.threshold(FITTED_AT)
    assert np.exp(log_family_p(at, tests)) == pytest.approx(FITTED_AT, rel=2e-3)  # to first order
    assert family.p_of(at) == pytest.approx(FITTED_AT, abs=1.0 / family.maxima.size)
    for score in [family.threshold(level) for level in LEVELS]:
        counted = family.p_of(score)
        error = 3.0 / np.sqrt(counted * family.maxima.size)
        assert np.exp(log_family_p(score, tests)) == pytest.approx(counted, rel=error + OWN_ERROR)


def test_the_tail_ranks_where_no_draw_reaches() -> None:
    maxima = np.full(3000, 9.0)
    assert family_p(20.0, maxima) == family_p(30.0, maxima) == pytest.approx(1 / 3001)
    assert log_family_p(30.0, 40.0) < log_family_p(20.0, 40.0) < np.log(1e-80)


def test_the_number_of_tests_is_theirs_if_they_are_independent() -> None:
    errors = np.random.default_rng(2).standard_normal((20_000, 12))
    units = score_test.project(np.zeros((12, 0)), np.zeros(12), np.zeros(0), np.eye(12))
    assert family_of(units, np.zeros(12, bool), errors, 1).effective_tests == pytest.approx(12.0, rel=0.1)


def test_nothing_to_test_is_no_alarm() -> None:
    """No candidate is left, or no water to put a spot into."""
    none = score_test.project(np.zeros((9, 0)), np.ones(9), np.zeros(0), np.zeros((9, 0)))
    empty = family_of(none, np.zeros(0, bool), np.ones((20, 9)), 1)
    assert empty.log_p() == 0.0
    assert empty.threshold(FITTED_AT) == 0.0


def test_what_is_set_aside_scores_nothing(family: Family) -> None:
    scored = replace(family, scores=np.array([1.0, -9.0, 2.0]))
    assert scored.best == 1
    assert scored.without((1,)).best == 2
    assert scored.without((1,)).log_p() > scored.log_p()
    assert scored.log_p(slack=9.0) == pytest.approx(0.0, abs=1e-9)
