"""Bayes factors of hypotheses against their closed form, and the alarm on errors alone."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.score_test import NULL_DRAWS_TOGETHER, HypothesisKind, alarm_p, kind_of_hypotheses, log_factors

ROWS, SLOPES, DRAWS, NULLS = 40, 3, 400, 500


def made(random: np.random.Generator, columns: int) -> tuple[Array, Array]:
    """Whitened slopes (rows, p) and fingerprints (rows, c)."""
    return random.standard_normal((ROWS, SLOPES)), random.standard_normal((ROWS, columns))


def at_best(slopes: Array, values: Array) -> tuple[Array, Array]:
    """The residual at the best z, and z, under a standard normal prior."""
    z = np.linalg.solve(slopes.T @ slopes + np.eye(SLOPES), slopes.T @ values)
    return values - slopes @ z, z


def kind_of(slopes: Array, prints: Array, values: Array, size: float = 1.0, only_sign: int = 0) -> HypothesisKind:
    columns = prints.shape[1]
    projected = score_test.project(slopes, *at_best(slopes, values), prints)
    sizes, prior = np.full(columns, size), np.full(columns, 0.1 / columns)
    return kind_of_hypotheses("made", projected, sizes, prior, np.full(columns, only_sign))


@pytest.mark.parametrize("size", [0.02, 0.3, 5.0])
def test_the_bayes_factor_is_that_of_two_gaussians(size: float) -> None:
    """ln N(y; 0, 1 + J J' + s^2 S S') - ln N(y; 0, 1 + J J'), whatever y."""
    slopes, prints = made(np.random.default_rng(1), 1)
    values = 0.4 * prints[:, 0] + np.random.default_rng(2).standard_normal(ROWS)
    nothing = np.eye(ROWS) + slopes @ slopes.T
    with_it = nothing + size**2 * prints @ prints.T
    densities = [scipy.stats.multivariate_normal(np.zeros(ROWS), cov).logpdf(values) for cov in (with_it, nothing)]
    found = kind_of(slopes, prints, values, size)
    assert found.log_evidence[0] - np.log(0.1) == pytest.approx(densities[0] - densities[1])
    assert found.total == pytest.approx(float(found.log_evidence[0]))


def test_the_width_of_a_prior_is_charged() -> None:
    """What explains nothing has the less evidence the larger it might have been, and all are near 1 for nothing."""
    assert log_factors(np.zeros(3), np.array([0.0, 1.0, 1e3])) == pytest.approx(
        [0.0, -0.5 * np.log(2.0), -6.9078], 1e-4
    )
    assert log_factors(np.array([4.0]), np.array([1e3]))[0] < log_factors(np.array([4.0]), np.array([4.0]))[0]


def test_a_kind_has_the_evidence_of_all_its_hypotheses() -> None:
    slopes, prints = made(np.random.default_rng(3), 8)
    found = kind_of(slopes, prints, 2.0 * prints[:, 5] + np.random.default_rng(4).standard_normal(ROWS))
    assert found.best == 5
    assert np.exp(found.total) == pytest.approx(np.exp(found.log_evidence).sum())
    apart = kind_of(slopes, prints[:, :1], prints[:, 0])
    twice = kind_of(slopes, np.repeat(prints[:, :1], 2, axis=1), prints[:, 0])
    assert twice.total == pytest.approx(apart.total), "to list a hypothesis twice makes it no likelier"


@pytest.mark.parametrize("sign", [1, -1])
def test_what_can_only_have_the_other_sign_explains_nothing(sign: int) -> None:
    slopes, prints = made(np.random.default_rng(3), 1)
    against = -2.0 * sign * prints[:, 0]
    assert kind_of(slopes, prints, against).total > 10.0
    assert kind_of(slopes, prints, against, only_sign=-sign).total > 10.0
    found = kind_of(slopes, prints, against, only_sign=sign)
    assert found.total == pytest.approx(float(np.log(0.1) - 0.5 * np.log1p(found.size[0] ** 2)))


def kinds_of(values: Array) -> list[HypothesisKind]:
    """A kind of many hypotheses, two of a few that have one sign, and one of a single hypothesis of another size."""
    random = np.random.default_rng(7)
    slopes, prints = made(random, 31)
    return [
        kind_of(slopes, prints[:, :20], values),
        kind_of(slopes, prints[:, 20:25], values, 0.3, only_sign=1),
        kind_of(slopes, prints[:, 25:30], values, 0.3, only_sign=-1),
        kind_of(slopes, prints[:, 30:], values, 3.0),
    ]


def drawn(seed: int, missing: float = 0.0) -> tuple[list[HypothesisKind], Array]:
    """Kinds of a residual of errors, calibrated, and further draws of errors alone; missing: size of hypothesis 4."""
    random = np.random.default_rng((8, seed))
    slopes, prints = made(np.random.default_rng(7), 31)
    values = slopes @ random.standard_normal(SLOPES) + random.standard_normal(ROWS) + missing * prints[:, 4]
    return kinds_of(values), random.standard_normal((DRAWS, ROWS))


@pytest.mark.slow
def test_alarms_are_as_rare_as_said() -> None:
    chances = np.array([alarm_p(*drawn(seed), seed) for seed in range(NULLS)])
    assert scipy.stats.kstest(chances, "uniform").pvalue > 1e-3
    for level in (0.1, 0.05, 0.01):
        assert scipy.stats.binomtest(int(np.sum(chances <= level)), NULLS, level).pvalue > 1e-3, level


def test_what_is_missing_sounds_the_alarm() -> None:
    chances = [alarm_p(*drawn(seed, missing=2.0), seed) for seed in range(5)]
    assert chances == [pytest.approx(1.0 / (1 + DRAWS))] * 5


def test_the_alarm_hangs_on_the_sum_over_all_kinds() -> None:
    """A second kind that explains more can only make it louder than the first alone, one without any evidence not."""
    (one, *others), errors = drawn(3, missing=0.45)
    deaf = replace(others[1], scores=np.zeros(1), log_prior=np.array([-50.0]))
    assert alarm_p([one, deaf], errors, 1) == alarm_p([one], errors, 1)
    loud = replace(others[1], scores=np.array([9.0]))
    assert alarm_p([one, loud], errors, 1) < alarm_p([one], errors, 1)


def test_slack_makes_the_alarm_less_loud() -> None:
    kinds, errors = drawn(3, missing=0.6)
    loud, quiet, silent = (alarm_p(kinds, errors, 1, slack) for slack in (0.0, 1.5, 50.0))
    assert loud < quiet < silent
    assert silent == 1.0


def test_draws_are_counted_alike_however_many_are_worked_on_together(monkeypatch: pytest.MonkeyPatch) -> None:
    kinds, errors = drawn(1)
    assert NULL_DRAWS_TOGETHER < DRAWS
    together = alarm_p(kinds, errors, 1)
    monkeypatch.setattr("vegglue.calibration.score_test.NULL_DRAWS_TOGETHER", 7)
    assert alarm_p(kinds, errors, 1) == together
