"""Score tests on problems whose answer is known, family-wise p, Bayes factors in closed form, and the alarm."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

from vegglue.arrays import Array
from vegglue.calibration import score_test
from vegglue.calibration.score_test import (
    NULL_DRAWS_TOGETHER,
    Family,
    HypothesisKind,
    alarm_p,
    family_of,
    kind_of_hypotheses,
    log_factors,
)

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


SMOOTH_PRINTS, NULLS = 40, 1000


def smooth_fingerprints() -> tuple[Array, Array, np.ndarray]:
    """Slopes (rows, p) and fingerprints (rows, c) like those of a flow: each like its neighbours; some one-sided."""
    random = np.random.default_rng(5)
    place, centres = np.linspace(0.0, 1.0, ROWS), np.linspace(0.0, 1.0, SMOOTH_PRINTS)
    prints = np.exp(-(((place[:, None] - centres) / 0.03) ** 2)) + 0.1 * random.standard_normal((ROWS, SMOOTH_PRINTS))
    return 3.0 * random.standard_normal((ROWS, SLOPES)), prints, np.arange(SMOOTH_PRINTS) % 3 == 0


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


FEWER_ROWS, DRAWS, ALARM_NULLS = 40, 400, 500


def made(random: np.random.Generator, columns: int) -> tuple[Array, Array]:
    """Whitened slopes (rows, p) and fingerprints (rows, c)."""
    return random.standard_normal((FEWER_ROWS, SLOPES)), random.standard_normal((FEWER_ROWS, columns))


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
    values = 0.4 * prints[:, 0] + np.random.default_rng(2).standard_normal(FEWER_ROWS)
    nothing = np.eye(FEWER_ROWS) + slopes @ slopes.T
    with_it = nothing + size**2 * prints @ prints.T
    densities = [
        scipy.stats.multivariate_normal(np.zeros(FEWER_ROWS), cov).logpdf(values) for cov in (with_it, nothing)
    ]
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
    found = kind_of(slopes, prints, 2.0 * prints[:, 5] + np.random.default_rng(4).standard_normal(FEWER_ROWS))
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
    values = slopes @ random.standard_normal(SLOPES) + random.standard_normal(FEWER_ROWS) + missing * prints[:, 4]
    return kinds_of(values), random.standard_normal((DRAWS, FEWER_ROWS))


@pytest.mark.slow
def test_alarms_are_as_rare_as_said() -> None:
    chances = np.array([alarm_p(*drawn(seed), seed) for seed in range(ALARM_NULLS)])
    assert scipy.stats.kstest(chances, "uniform").pvalue > 1e-3
    for level in (0.1, 0.05, 0.01):
        assert scipy.stats.binomtest(int(np.sum(chances <= level)), ALARM_NULLS, level).pvalue > 1e-3, level


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


def test_other_measurements_of_the_same_amplitudes_are_rows_more(problem: tuple[np.ndarray, np.ndarray]) -> None:
    """The score is the estimate of least squares over both over its standard error; the alarm draws the rows, too."""
    slopes, fingerprints = problem
    random = np.random.default_rng(8)
    columns, more = random.standard_normal((5, PRINTS)), random.standard_normal(5)
    residual, nothing = random.standard_normal(ROWS), np.zeros(SLOPES)
    alone = score_test.project(slopes, residual, nothing, fingerprints)
    both = score_test.with_evidence(alone, more, columns)
    for j in range(PRINTS):
        design = np.vstack([
            np.column_stack([slopes, fingerprints[:, j]]),
            np.eye(SLOPES, SLOPES + 1),
            np.column_stack([np.zeros((5, SLOPES)), columns[:, j]]),
        ])  # fmt: skip
        inverse = np.linalg.inv(design.T @ design)
        estimate = (inverse @ design.T @ np.concatenate([residual, nothing, more]))[-1]
        assert both.score[j] == pytest.approx(estimate / np.sqrt(inverse[-1, -1]))
        assert both.length[j] == pytest.approx(inverse[-1, -1] ** -0.5)
    assert (both.visible <= 1.0).all()
    errors = random.standard_normal((400, ROWS))
    quiet = score_test.project(slopes, 0.0 * residual, nothing, fingerprints)
    loud = score_test.with_evidence(quiet, 30.0 * columns[:, 2] / np.linalg.norm(columns[:, 2]), columns)
    p_of = {
        name: alarm_p(
            [
                kind_of_hypotheses("effect", quiet, np.full(PRINTS, 0.5), np.full(PRINTS, 1.0 / PRINTS)),
                kind_of_hypotheses("line", of, np.full(PRINTS, 0.5), np.full(PRINTS, 1.0 / PRINTS)),
            ],
            errors,
            1,
        )
        for name, of in (("quiet", score_test.with_evidence(quiet, 0.0 * more, columns)), ("loud", loud))
    }
    assert p_of["loud"] < 0.02
    assert p_of["quiet"] > 0.9
