"""Score tests on problems whose answer is known: fingerprints and residuals made by hand."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

from vegglue import score

ROWS, SLOPES, PRINTS = 60, 3, 8


@pytest.fixture
def problem() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    return 3.0 * random.standard_normal((ROWS, SLOPES)), random.standard_normal((ROWS, PRINTS))


def test_calibration_takes_away_what_it_can_mimic(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, prints = problem
    prints = np.column_stack([prints, slopes @ np.array([1.0, -2.0, 0.5])])
    projected = score.project(100.0 * slopes, np.zeros(ROWS), np.zeros(SLOPES), prints)
    assert projected.visible[-1] < 0.01
    assert (projected.visible[:-1] > 0.8).all()


def test_a_prior_keeps_a_parameter_from_mimicking(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, _ = problem
    # A slope of length one against a prior of one standard deviation: cos = 1 / sqrt(2) is left.
    direction = slopes[:, :1] / np.linalg.norm(slopes[:, 0])
    projected = score.project(direction, np.zeros(ROWS), np.zeros(1), direction)
    assert projected.visible[0] == pytest.approx(np.sqrt(0.5))


def test_the_score_of_a_planted_effect_is_its_length(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, prints = problem
    residual = 2.5 * prints[:, 3]
    projected = score.project(slopes, residual, np.zeros(SLOPES), prints)
    found = score.scores(projected, np.zeros(PRINTS, bool))
    assert int(np.argmax(np.abs(found))) == 3
    assert found[3] == pytest.approx(2.5 * projected.length[3])
    assert found[3] / projected.length[3] == pytest.approx(2.5), "the amplitude to first order"


def test_an_effect_with_one_sign_is_not_accused_of_the_other(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, prints = problem
    projected = score.project(slopes, -2.5 * prints[:, 3], np.zeros(SLOPES), prints)
    one_sided = np.zeros(PRINTS, bool)
    one_sided[3] = True
    assert score.scores(projected, one_sided)[3] == 0.0
    assert score.scores(projected, ~one_sided)[3] < -5.0


def test_family_wise_chances_are_uniform_under_the_null(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, prints = problem
    random = np.random.default_rng(11)
    projected = score.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), prints)
    errors = random.standard_normal((score.DRAWS, ROWS))
    maxima = (score.null_draws(projected, np.zeros(PRINTS, bool), errors, 3) ** 2).max(axis=1)
    chances = []
    for _ in range(400):
        again = score.project(slopes, random.standard_normal(ROWS), random.standard_normal(SLOPES), prints)
        strongest = np.abs(score.scores(again, np.zeros(PRINTS, bool))).max()
        chances.append(score.family_p(float(strongest), maxima))
    assert scipy.stats.kstest(chances, "uniform").pvalue > 1e-3


def test_the_true_effect_is_seldom_rejected(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, prints = problem
    random = np.random.default_rng(12)
    # A second fingerprint that is almost the first one.
    prints[:, 1] = prints[:, 0] + 0.3 * prints[:, 1]
    family = [np.array([j]) for j in range(PRINTS)]
    kept, size = 0, 0
    for trial in range(200):
        residual = 0.8 * prints[:, 0] + random.standard_normal(ROWS)
        projected = score.project(slopes, residual, random.standard_normal(SLOPES), prints)
        found = score.scores(projected, np.zeros(PRINTS, bool))
        slack = score.rivals(projected, family, found / projected.length, seed=trial)
        behind = (found**2).max() - found**2
        kept += bool(behind[0] <= slack[0])
        size += int((behind <= slack).sum())
    assert kept >= 182, "at least 91 % of 200"
    assert size / 200 < 4.0, "not by keeping everything"


def test_chances_are_kept(problem: tuple[np.ndarray, np.ndarray]) -> None:
    """One of six effects, the last of three shapes, is there, 3 standard errors long: sets hold it as often as said."""
    slopes, prints = problem
    random, family, tries = np.random.default_rng(2), [np.array([j]) for j in range(5)] + [np.array([5, 6, 7])], 800
    projected = score.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), prints)
    one_sided = np.arange(PRINTS) % 2 == 0
    said, held, sizes = 0.0, 0, []
    for _ in range(tries):
        true = int(random.integers(len(family)))
        column = int(random.choice(family[true]))
        sign = 1.0 if one_sided[column] else random.choice([-1.0, 1.0])
        residual = sign * 3.0 * projected.units[:, column] + random.standard_normal(ROWS + SLOPES)
        chance = score.chances(replace(projected, residual=residual), one_sided, family, 3.0)
        kept = score.fewest(chance, 0.9)
        said, held = said + chance[kept].sum(), held + (true in kept)
        sizes.append(len(kept))
    assert held == pytest.approx(said, abs=4.0 * np.sqrt(0.09 * tries))
    assert said >= 0.9 * tries
    assert np.mean(sizes) < 3.0, "six would hold everything and say nothing"


def test_without_a_score_all_are_as_likely(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, prints = problem
    projected = score.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), prints)
    family = [np.arange(3), np.arange(3, PRINTS)]
    assert score.chances(projected, np.zeros(PRINTS, bool), family, 3.0) == pytest.approx([0.5, 0.5])
    assert score.fewest(np.array([0.2, 0.5, 0.3]), 0.6) == [1, 2]
    assert score.fewest(score.chances(projected, np.zeros(PRINTS, bool), [], 3.0), 0.9) == []


def test_names_with_one_trace_form_a_group() -> None:
    cosine = np.array([[1.0, 0.95, 0.1], [0.95, 1.0, 0.2], [0.1, 0.2, 1.0]])
    assert score.groups(["a", "b", "c"], cosine) == [["a", "b"], ["c"]]
    chained = np.array([[1.0, 0.95, 0.8], [0.95, 1.0, -0.95], [0.8, -0.95, 1.0]])
    assert score.groups(["a", "b", "c"], chained) == [["a", "b", "c"]]
