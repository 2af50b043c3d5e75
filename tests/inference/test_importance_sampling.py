"""Draws by importance sampling against posteriors whose moments are known, and the parts they are made of."""

import math

import numpy as np
import pytest
import scipy.stats

from vegglue.errors import InputError
from vegglue.inference.importance_sampling import (
    Mixture,
    Sample,
    draw,
    emulator_of_density,
    fit_emulator,
    log_density,
    mixture_at_modes,
    pooled_weights,
    sample,
    tempered,
)
from vegglue.inference.weighted_statistics import effective_size, pareto_shape

pytestmark = pytest.mark.slow

SEEDS = range(4)


def squares(z: np.ndarray, values: np.ndarray) -> np.ndarray:
    """ln p of values that are standard normal."""
    return -0.5 * np.sum(values**2, axis=1)


def bent(z: np.ndarray) -> np.ndarray:
    """z_0 and (z_1 - z_0^2 + 1) / 0.3 standard normal: mean 0 and 0, standard deviations 1 and sqrt(2.09)."""
    values = z.copy()
    values[:, 1] = (z[:, 1] - z[:, 0] ** 2 + 1) / 0.3
    return values


def start(dimensions: int, width: float = 0.8) -> Mixture:
    return mixture_at_modes(np.zeros((1, dimensions)), width**2 * np.eye(dimensions)[None], np.zeros(1))


def moments(drawn: Sample) -> tuple[np.ndarray, np.ndarray]:
    mean = drawn.weights @ drawn.z
    return mean, np.sqrt(drawn.weights @ (drawn.z - mean) ** 2)


@pytest.mark.parametrize("dimensions", [2, 5, 10])
def test_moments_of_a_normal_posterior(dimensions: int) -> None:
    random = np.random.default_rng(dimensions)
    design = random.normal(size=(12, dimensions))
    measured = design @ random.normal(size=dimensions) + random.normal(size=12)
    covariance = np.linalg.inv(design.T @ design + np.eye(dimensions))
    centre, sd = covariance @ design.T @ measured, np.sqrt(np.diag(covariance))

    def density(z: np.ndarray, values: np.ndarray) -> np.ndarray:
        return -0.5 * np.sum((measured - values) ** 2, axis=1) - 0.5 * np.sum(z**2, axis=1)

    first = mixture_at_modes(centre[None] + 0.5 * sd, 1.5 * covariance[None], np.zeros(1))
    drawn = sample(lambda z: z @ design.T, density, first, 1000, seed=1)
    mean, spread = moments(drawn)
    assert drawn.effective[-1] >= 1000
    assert np.all(np.abs(mean - centre) < 4 * sd / math.sqrt(1000))
    assert spread == pytest.approx(sd, rel=4 / math.sqrt(2000))
    assert pareto_shape(drawn.weights) < 0.5


@pytest.mark.parametrize("dimensions", [2, 4])
def test_moments_of_a_banana(dimensions: int) -> None:
    found = [moments(sample(bent, squares, start(dimensions, 0.5), 1000, seed)) for seed in SEEDS]
    mean, spread = np.mean([one[0] for one in found], axis=0), np.mean([one[1] for one in found], axis=0)
    # Of 4,000 effective draws: the variance of z_1 has the heavy tail of a square.
    assert mean[:2] == pytest.approx([0, 0], abs=4 * 1.45 / math.sqrt(4000))
    assert spread[0] == pytest.approx(1, abs=4 / math.sqrt(2 * 4000))
    assert spread[1] == pytest.approx(math.sqrt(2.09), abs=4 * 0.037)


def test_two_modes_keep_their_masses() -> None:
    centres = np.array([[2.0, 2.0, 2.0], [-2.0, -2.0, -2.0]])

    def density(z: np.ndarray, values: np.ndarray) -> np.ndarray:
        away = np.stack([-0.5 * np.sum((z - centre) ** 2 / 0.25, axis=1) for centre in centres])
        return np.logaddexp(away[0], away[1] - 1.0)

    first = mixture_at_modes(centres, np.tile(0.25 * np.eye(3), (2, 1, 1)), np.zeros(2))
    drawn = sample(lambda z: z, density, first, 1000, seed=2)
    upper = drawn.weights[drawn.z[:, 0] > 0].sum()
    assert upper == pytest.approx(1 / (1 + math.exp(-1)), abs=4 * 0.45 / math.sqrt(1000))


def test_places_that_fail_weigh_nothing_and_are_kept() -> None:
    def half(z: np.ndarray) -> np.ndarray:
        return np.where(z[:, :1] > 0, z, np.nan)

    drawn = sample(half, squares, start(2), 500, seed=3)
    failed = np.isnan(drawn.values[:, 0])
    assert failed.any()
    assert np.all(drawn.log_density[failed] == -np.inf)
    assert np.all(drawn.weights[failed] == 0)
    assert drawn.weights @ drawn.z[:, 0] == pytest.approx(math.sqrt(2 / math.pi), abs=4 * 0.6 / math.sqrt(500))


def test_a_later_round_of_which_nothing_is_solved_is_no_traceback() -> None:
    """How many draws come next was told from weights of such a round, which are no numbers."""
    rounds = list[int]()

    def predict(z: np.ndarray) -> np.ndarray:
        rounds.append(len(z))
        return np.full_like(z, np.nan) if len(rounds) == 2 else z

    def narrow(z: np.ndarray, values: np.ndarray) -> np.ndarray:
        return squares(z, 5.0 * values)

    drawn = sample(predict, narrow, start(2), 1000, 1)
    assert len(rounds) > 2
    assert np.isfinite(drawn.weights).all()


@pytest.mark.parametrize("solved", [0, 1, 2, 5])
def test_a_model_that_fails_almost_everywhere_is_no_traceback(solved: int) -> None:
    def almost_never(z: np.ndarray) -> np.ndarray:
        return np.where(np.arange(len(z))[:, None] < solved, z, np.nan)

    if solved < 2:
        with pytest.raises(InputError, match="of the 192 members drawn around the best fit was solved"):
            sample(almost_never, squares, start(2), 500, seed=3)
    else:
        drawn = sample(almost_never, squares, start(2), 500, seed=3)
        assert drawn.weights.sum() == pytest.approx(1.0)


def test_same_seed_same_draws_and_all_count() -> None:
    first, again = (sample(bent, squares, start(2), 300, seed=4) for _ in range(2))
    assert np.array_equal(first.z, again.z)
    assert np.array_equal(first.weights, again.weights)
    assert first.drawn[-1] == len(first.z)
    assert first.effective[-1] == pytest.approx(effective_size(first.weights))
    assert not np.array_equal(first.z, sample(bent, squares, start(2), 300, seed=5).z)


def test_too_few_rounds_are_no_error() -> None:
    def needle(z: np.ndarray, values: np.ndarray) -> np.ndarray:
        return -0.5 * np.sum((z - 5) ** 2 / 1e-8, axis=1)

    drawn = sample(lambda z: np.ones((len(z), 1)), needle, start(3), 1e9, seed=6)
    assert drawn.effective[-1] < drawn.drawn[-1]
    assert np.isfinite(drawn.weights).all()


def test_a_mixture_is_drawn_from_its_own_density() -> None:
    centres, covariances = np.array([[0.0, 1.0], [3.0, -2.0]]), np.stack([np.eye(2), [[2.0, 0.5], [0.5, 0.3]]])
    mixture = mixture_at_modes(centres, covariances, np.log([3, 1]))
    z = draw(mixture, np.random.default_rng(7).random((40000, 4)))
    assert z.mean(axis=0) == pytest.approx([0.75, 0.25], abs=0.04)
    upper = 0.75 * scipy.stats.t.sf(1.8, 5) + 0.25 * scipy.stats.t.sf(-1.2 / math.sqrt(2), 5)
    assert np.mean(z[:, 0] > 1.8) == pytest.approx(upper, abs=0.01)
    other = mixture_at_modes(np.zeros((1, 2)), 9 * np.eye(2)[None], np.zeros(1))
    mass = np.exp(log_density(other, z) - log_density(mixture, z)).mean()
    assert mass == pytest.approx(1, abs=0.3)


def test_pooled_weights_do_not_depend_on_who_drew() -> None:
    wide, narrow = start(2, 2.0), start(2, 0.3)
    z = np.array([[0.0, 0.0], [2.0, 1.0]])
    weights = pooled_weights(np.zeros(2), z, [(30, wide), (10, narrow)])
    pooled = 0.75 * np.exp(log_density(wide, z)) + 0.25 * np.exp(log_density(narrow, z))
    assert weights == pytest.approx((1 / pooled) / np.sum(1 / pooled))


def test_tempering_asks_for_what_is_wanted() -> None:
    weights = np.exp(8 * np.random.default_rng(8).normal(size=1000))
    weights /= weights.sum()
    milder = tempered(weights, 100)
    assert effective_size(weights) < 20
    assert effective_size(milder) == pytest.approx(100, rel=0.01)
    assert np.array_equal(np.argsort(milder), np.argsort(weights))
    assert np.array_equal(tempered(milder, 50), milder)


def test_an_emulator_is_exact_where_the_model_is_a_polynomial() -> None:
    def cubic(z: np.ndarray) -> np.ndarray:
        return np.column_stack([1 + z[:, 0] - z[:, 1] ** 3, z[:, 0] * z[:, 1] + 2 * z[:, 0] ** 2])

    random = np.random.default_rng(9)
    z, other = random.normal(size=(60, 2)), random.normal(size=(20, 2))
    emulator = fit_emulator(z, cubic(z), np.zeros(60), np.array([0.3, -0.2]), 0.5 * np.eye(2))
    assert emulator.predict(other) == pytest.approx(cubic(other), abs=0.02)


def test_an_emulator_passes_over_places_that_failed() -> None:
    z = np.random.default_rng(10).normal(size=(40, 2))
    logs = np.where(np.arange(40) < 5, -np.inf, 0.0)
    values = np.where(np.arange(40)[:, None] < 5, np.nan, z)
    assert fit_emulator(z, values, logs, np.zeros(2), np.eye(2)).predict(z) == pytest.approx(z, abs=1e-3)


def test_the_degree_is_the_one_that_predicts_runs_held_out() -> None:
    """A model that wriggles leaves nothing to a high degree but its wriggles."""
    z = np.random.default_rng(11).normal(size=(192, 4))

    def highest(values: np.ndarray) -> int:
        return max(sum(powers) for powers in emulator_of_density(z, values, squares, np.zeros(4), np.eye(4)).powers)

    smooth = 2.0 * z + 0.5 * z[:, [1, 2, 3, 0]] ** 2
    assert highest(smooth + 0.02 * z[:, [1, 2, 3, 0]] ** 4) == 4
    assert highest(smooth + np.sin(40 * z)) == 2


def test_a_model_that_wriggles_is_drawn_from_in_about_as_many_runs() -> None:
    def wriggling(z: np.ndarray) -> np.ndarray:
        return z + 0.3 * z[:, [1, 2, 3, 0]] ** 2 + 0.3 * np.sin(25 * z)

    def smooth(z: np.ndarray) -> np.ndarray:
        return z + 0.3 * z[:, [1, 2, 3, 0]] ** 2

    most = [
        max(sample(model, squares, start(4), 1000, seed).drawn[-1] for seed in SEEDS) for model in (smooth, wriggling)
    ]
    assert most[1] < 1.4 * most[0]
