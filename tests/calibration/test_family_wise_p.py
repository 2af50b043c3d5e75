"""Family-wise p, as it is told: uniform under the null."""

import numpy as np
import pytest
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.score_test import Family, family_of

ROWS, SLOPES, PRINTS, NULLS = 60, 3, 40, 1000


def smooth_fingerprints() -> tuple[Array, Array, np.ndarray]:
    """Slopes (rows, p) and fingerprints (rows, c) like those of a flow: each like its neighbours; some one-sided."""
    random = np.random.default_rng(5)
    place, centres = np.linspace(0.0, 1.0, ROWS), np.linspace(0.0, 1.0, PRINTS)
    prints = np.exp(-(((place[:, None] - centres) / 0.03) ** 2)) + 0.1 * random.standard_normal((ROWS, PRINTS))
    return 3.0 * random.standard_normal((ROWS, SLOPES)), prints, np.arange(PRINTS) % 3 == 0


@pytest.fixture(scope="module")
def family() -> Family:
    slopes, prints, only_sign = smooth_fingerprints()
    errors = np.random.default_rng(11).standard_normal((score_test.NULL_DRAWS, ROWS))
    return family_of(score_test.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), prints), only_sign, errors, 3)


@pytest.fixture(scope="module")
def best_scores(family: Family) -> Array:
    """|T| of the best fingerprint of residuals that are errors only, after the true parameters were calibrated."""
    slopes, prints, only_sign = smooth_fingerprints()
    random, found = np.random.default_rng(12), []
    for _ in range(NULLS):
        values = slopes @ random.standard_normal(SLOPES) + random.standard_normal(ROWS)
        z = np.linalg.solve(slopes.T @ slopes + np.eye(SLOPES), slopes.T @ values)
        projected = score_test.project(slopes, values - slopes @ z, z, prints)
        found.append(np.abs(score_test.scores(projected, only_sign)).max())
    return np.array(found)


def test_what_is_told_is_uniform_under_the_null(family: Family, best_scores: Array) -> None:
    assert scipy.stats.kstest([family.p_of(score) for score in best_scores], "uniform").pvalue > 1e-3


@pytest.mark.parametrize("rate", [0.05, 0.01])
def test_a_threshold_is_passed_as_often_as_said(rate: float, family: Family, best_scores: Array) -> None:
    passed = int(np.sum(best_scores > family.threshold(rate)))
    assert scipy.stats.binomtest(passed, best_scores.size, rate).pvalue > 1e-3


def test_no_p_is_below_what_the_draws_resolve(family: Family) -> None:
    assert family.p_of(30.0) == pytest.approx(1 / (1 + family.maxima.size))


def test_nothing_to_test_is_no_alarm() -> None:
    """No candidate is left, or no water to put a spot into."""
    none = score_test.project(np.zeros((9, 0)), np.ones(9), np.zeros(0), np.zeros((9, 0)))
    assert family_of(none, np.zeros(0, bool), np.ones((20, 9)), 1).threshold(0.05) == 0.0
