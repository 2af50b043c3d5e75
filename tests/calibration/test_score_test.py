"""Score tests on problems whose answer is known: fingerprints and residuals made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from vegglue.calibration import score_test

ROWS, SLOPES, PRINTS = 60, 3, 8
LENGTHS = (2.0, 3.0, 4.0)


@pytest.fixture
def problem() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    return 3.0 * random.standard_normal((ROWS, SLOPES)), random.standard_normal((ROWS, PRINTS))


def test_calibration_takes_away_what_it_can_mimic(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, fingerprints = problem
    fingerprints = np.column_stack([fingerprints, slopes @ np.array([1.0, -2.0, 0.5])])
    projected = score_test.project(100.0 * slopes, np.zeros(ROWS), np.zeros(SLOPES), fingerprints)
    assert projected.visible[-1] < 0.01
    assert (projected.visible[:-1] > 0.8).all()


def test_a_prior_keeps_a_parameter_from_mimicking(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, _ = problem
    # A slope of length one against a prior of one standard deviation: cos = 1 / sqrt(2) is left.
    direction = slopes[:, :1] / np.linalg.norm(slopes[:, 0])
    projected = score_test.project(direction, np.zeros(ROWS), np.zeros(1), direction)
    assert projected.visible[0] == pytest.approx(np.sqrt(0.5))


def test_the_score_of_a_planted_effect_is_its_length(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, fingerprints = problem
    residual = 2.5 * fingerprints[:, 3]
    projected = score_test.project(slopes, residual, np.zeros(SLOPES), fingerprints)
    found = score_test.scores(projected, np.zeros(PRINTS, bool))
    assert int(np.argmax(np.abs(found))) == 3
    assert found[3] == pytest.approx(2.5 * projected.length[3])
    assert found[3] / projected.length[3] == pytest.approx(2.5), "the amplitude to first order"


@pytest.mark.parametrize("sign", [1, -1])
def test_an_effect_with_one_sign_is_not_accused_of_the_other(problem: tuple[np.ndarray, np.ndarray], sign: int) -> None:
    slopes, fingerprints = problem
    projected = score_test.project(slopes, -2.5 * sign * fingerprints[:, 3], np.zeros(SLOPES), fingerprints)
    only_sign = sign * np.eye(PRINTS, dtype=int)[3]
    assert score_test.scores(projected, only_sign)[3] == 0.0
    assert sign * score_test.scores(projected, -only_sign)[3] < -5.0
    assert sign * score_test.scores(projected, 0 * only_sign)[3] < -5.0


def test_the_fewest_groups_hold_what_is_asked() -> None:
    chance = np.array([0.5, 0.04, 0.3, 0.16])
    assert score_test.fewest_groups([[0, 1], [2], [3]], chance, 0.5) == [[0, 1]]
    assert score_test.fewest_groups([[3], [2], [0, 1]], chance, 0.6) == [[0, 1], [2]]
    assert score_test.fewest_groups([[0], [1], [2], [3]], chance, 0.95) == [[0], [2], [3]]
    assert score_test.fewest_groups([[0], [1], [2], [3]], chance, 0.97) == [[0], [2], [3], [1]]


def test_chances_are_kept(problem: tuple[np.ndarray, np.ndarray]) -> None:
    """One of six effects, the last of three shapes, is there, of three lengths: sets hold it as often as said."""
    slopes, fingerprints = problem
    random, family, tries = np.random.default_rng(2), [np.array([j]) for j in range(5)] + [np.array([5, 6, 7])], 800
    projected = score_test.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), fingerprints)
    allowed = np.array([[True] * PRINTS, [j % 2 == 0 for j in range(PRINTS)]])
    ways = [[(sign, j) for j in columns for sign in (0, 1) if allowed[sign, j]] for columns in family]
    said, held, sizes = 0.0, 0, []
    for _ in range(tries):
        true = int(random.integers(len(family)))
        sign, column = ways[true][random.integers(len(ways[true]))]
        length = LENGTHS[random.integers(3)]
        residual = (1 - 2 * sign) * length * projected.units[:, column] + random.standard_normal(ROWS + SLOPES)
        drawn = replace(projected, residual=residual)
        chance = score_test.chances(drawn, family, dict.fromkeys(LENGTHS, allowed))
        kept = [j for group in score_test.likeliest_families(drawn, family, chance, 0.9) for j in group]
        said, held = said + sum(chance[family[j]].sum() for j in kept), held + (true in kept)
        sizes.append(len(kept))
    assert held == pytest.approx(said, abs=4.0 * np.sqrt(0.09 * tries))
    assert said >= 0.9 * tries
    assert np.mean(sizes) < 3.0, "six would hold everything and say nothing"


def test_without_a_score_all_that_may_be_are_as_likely(problem: tuple[np.ndarray, np.ndarray]) -> None:
    slopes, fingerprints = problem
    projected = score_test.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), fingerprints)
    family = [np.arange(3), np.arange(3, 6), np.arange(6, PRINTS)]
    allowed = np.ones((2, PRINTS), bool)
    allowed[:, 6:] = False
    chance = score_test.chances(projected, family, {3.0: allowed})
    assert [chance[columns].sum() for columns in family] == pytest.approx([0.5, 0.5, 0.0])
    assert score_test.likeliest_families(projected, family, chance, 0.9) == [[0], [1]]
    assert score_test.likeliest_families(projected, [], np.zeros(0), 0.9) == []


def test_what_looks_alike_shares_its_chances(problem: tuple[np.ndarray, np.ndarray]) -> None:
    """Two families with one fingerprint hold 0.3 each and come before one with 0.4, in one group."""
    slopes, fingerprints = problem
    projected = score_test.project(slopes, np.zeros(ROWS), np.zeros(SLOPES), fingerprints[:, [0, 1, 0]])
    family = [np.array([j]) for j in range(3)]
    assert score_test.likeliest_families(projected, family, np.array([0.3, 0.4, 0.3]), 0.55) == [[0, 2]]
    assert score_test.likeliest_families(projected, family, np.array([0.3, 0.4, 0.3]), 0.9) == [[0, 2], [1]]


def test_names_with_one_trace_form_a_group() -> None:
    cosine = np.array([[1.0, 0.95, 0.1], [0.95, 1.0, 0.2], [0.1, 0.2, 1.0]])
    assert score_test.alike_groups(["a", "b", "c"], cosine) == [["a", "b"], ["c"]]
    chained = np.array([[1.0, 0.95, 0.8], [0.95, 1.0, -0.95], [0.8, -0.95, 1.0]])
    assert score_test.alike_groups(["a", "b", "c"], chained) == [["a", "b", "c"]]
