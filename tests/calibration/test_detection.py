"""Chances of detection in closed form, against draws of linear Gaussian problems; information of pieces by sums."""

import numpy as np
import pytest
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration.detection import (
    chance_over_prior,
    chance_to_separate,
    detected_length,
    detection_chance,
    own_and_shared,
    possible_measurements,
    single_threshold,
    squared_distance,
    trace_lengths,
)
from vegglue.calibration.score_test import alarm_level, alarm_p, kind_of_hypotheses, project

ROWS, SLOPES, SHARED, TRACES = 80, 3, 5, 6
DRAWS = 20_000


@pytest.fixture
def linear() -> tuple[Array, Array, Array, Array]:
    """Own variances (n,), slopes, shared errors and traces of measurements y = J z + U c + S g + e."""
    random = np.random.default_rng(7)
    own = random.uniform(0.5, 2.0, ROWS) ** 2
    return (
        own, 2.0 * random.standard_normal((ROWS, SLOPES)), random.standard_normal((ROWS, SHARED)),
        random.standard_normal((ROWS, TRACES)),
    )  # fmt: skip


def whitened(linear: tuple[Array, Array, Array, Array]) -> tuple[Array, Array, Array]:
    """Cholesky factor of all errors, and slopes and traces whitened by it."""
    own, slopes, shared, traces = linear
    lower = np.linalg.cholesky(np.diag(own) + shared @ shared.T)
    return lower, np.linalg.solve(lower, slopes), np.linalg.solve(lower, traces)


def standard_error(chance: float) -> float:
    return float(np.sqrt(chance * (1.0 - chance) / DRAWS))


def test_the_chance_is_that_of_a_noncentral_chi2() -> None:
    length, threshold = np.array([0.0, 1.0, 3.0, 6.0])[:, None], np.array([2.0, 3.5])
    expected = scipy.stats.ncx2.sf(threshold**2, 1, length**2)
    assert detection_chance(length, threshold) == pytest.approx(np.asarray(expected), abs=1e-9)
    assert detection_chance(detected_length(threshold), threshold) == pytest.approx(np.full(2, 0.9))


@pytest.mark.parametrize("gain", [0.0, 0.3, 0.6])
def test_an_effect_is_detected_as_often_as_predicted(linear: tuple[Array, Array, Array, Array], gain: float) -> None:
    """Data with shared errors, parameters drawn from their priors, calibrated, and tested against a threshold."""
    own, slopes, shared, traces = linear
    lower, white_slopes, white_traces = whitened(linear)
    length = project(white_slopes, np.zeros(ROWS), np.zeros(SLOPES), white_traces).length[2]
    random, threshold = np.random.default_rng(3), 3.0
    z, c, e = (random.standard_normal((DRAWS, k)) for k in (SLOPES, SHARED, ROWS))
    data = z @ slopes.T + c @ shared.T + e * np.sqrt(own) + gain * traces[:, 2]
    residual = np.linalg.solve(lower, data.T)
    best = np.linalg.solve(white_slopes.T @ white_slopes + np.eye(SLOPES), white_slopes.T @ residual)
    found = project(white_slopes, np.zeros(ROWS), np.zeros(SLOPES), white_traces[:, 2:3]).units[:, 0]
    score = found[:ROWS] @ (residual - white_slopes @ best) - found[ROWS:] @ best
    predicted = float(detection_chance(gain * length, np.array(threshold)))
    assert np.mean(np.abs(score) > threshold) == pytest.approx(predicted, abs=3.5 * standard_error(predicted) + 1e-9)


def test_a_size_from_its_prior_is_detected_as_often_as_predicted() -> None:
    random, size, threshold = np.random.default_rng(1), 2.5, 3.2
    score = size * random.standard_normal(DRAWS) + random.standard_normal(DRAWS)
    predicted = float(chance_over_prior(np.array(size), np.array(threshold)))
    assert np.mean(np.abs(score) > threshold) == pytest.approx(predicted, abs=3.5 * standard_error(predicted))


def test_the_likelier_of_two_is_true_as_often_as_predicted() -> None:
    random, distance = np.random.default_rng(2), 2.0
    data = distance + random.standard_normal(DRAWS)
    predicted = float(chance_to_separate(np.array(distance**2)))
    assert np.mean(np.abs(data - distance) < np.abs(data)) == pytest.approx(
        predicted, abs=3.5 * standard_error(predicted)
    )


def test_measurements_given_others_add_up_to_what_projection_leaves(linear: tuple[Array, Array, Array, Array]) -> None:
    own, slopes, shared, traces = linear
    nuisances = np.hstack([slopes, shared])
    none = possible_measurements(own, nuisances, traces)
    _, white_slopes, white_traces = whitened(linear)
    projected = project(white_slopes, np.zeros(ROWS), np.zeros(SLOPES), white_traces)
    step = none
    for rows in np.array_split(np.arange(ROWS), 4):
        before, step = step, step.made(rows)
        assert before.with_each(rows[None])[0] == pytest.approx(step.squares)
        assert (before.lengths <= step.lengths + 1e-9).all(), "a piece never hides anything"
    assert step.lengths == pytest.approx(projected.length)
    assert trace_lengths(own, nuisances, traces) == pytest.approx(projected.length)
    pieces = np.arange(ROWS).reshape(-1, 4)
    some = none.made(np.arange(20))
    expected = [some.made(rows).squares for rows in pieces[5:]]
    assert some.with_each(pieces[5:]) == pytest.approx(np.array(expected))


def test_distances_are_those_of_traces_with_another_one_free() -> None:
    random = np.random.default_rng(4)
    first, second = random.standard_normal((2, 20))
    left = [a - b * (b @ a) / (b @ b) for a, b in ((first, second), (second, first))]
    both = first + second
    found = squared_distance(np.array(first @ first), np.array(second @ second), np.array(both @ both))
    assert found == pytest.approx(min(one @ one for one in left))


def test_many_shared_errors_are_few_with_the_variance_of_each_station() -> None:
    random = np.random.default_rng(6)
    own = random.uniform(0.5, 1.5, 400)
    x = np.linspace(0.0, 1.0, 400)
    shared = 2.0 * np.exp(-(((x[:, None] - np.linspace(0.0, 1.0, 900)) / 0.1) ** 2)) / 9.0
    less, few = own_and_shared(own, shared)
    assert few.shape[1] < 40
    assert less + (few**2).sum(axis=1) == pytest.approx(own + (shared**2).sum(axis=1))
    assert np.diag(less) + few @ few.T == pytest.approx(np.diag(own) + shared @ shared.T, abs=0.01)


def test_the_alarm_sounds_at_least_as_often_as_one_score_predicts() -> None:
    """Hypotheses of two kinds; with one of them true the alarm sounds at least as often as its own score predicts."""
    random = np.random.default_rng(8)
    prints = random.standard_normal((60, 12))
    nothing = project(np.zeros((60, 0)), np.zeros(60), np.zeros(0), prints)
    of_first, of_second = (
        project(np.zeros((60, 0)), np.zeros(60), np.zeros(0), part) for part in (prints[:, :4], prints[:, 4:])
    )
    kinds = [
        kind_of_hypotheses("effect", of_first, np.full(4, 0.8), np.full(4, 1 / 16)),
        kind_of_hypotheses("place", of_second, np.full(8, 0.8), np.full(8, 1 / 32)),
    ]
    errors = random.standard_normal((6000, 60))
    level = alarm_level(kinds, errors, 1, 0.05)
    length = float(detected_length(single_threshold(kinds[0].size[2:3], kinds[0].log_prior[2:3], level))[0])
    alarms = 0
    for error in random.standard_normal((200, 60)):
        residual = error + length * nothing.units[:60, 2]
        found = []
        for one, part in zip(kinds, (prints[:, :4], prints[:, 4:]), strict=True):
            projected = project(np.zeros((60, 0)), residual, np.zeros(0), part)
            found.append(kind_of_hypotheses(one.name, projected, np.full(part.shape[1], 0.8), np.exp(one.log_prior)))
        alarms += alarm_p(found, errors[:1500], 1) < 0.05
    assert alarms / 200 > 0.9 - 3.0 * np.sqrt(0.09 / 200)
