"""The chance to be named before there is data, against the competition of drawn residuals."""

import numpy as np
import pytest
from scipy.special import logsumexp

from vegglue.arrays import Array
from vegglue.calibration.score_test import HypothesisKind, alarm_level, cosines, kind_of_hypotheses, project
from vegglue.decision_constants import constants
from vegglue.diagnosis.competition import What, chosen_hypothesis
from vegglue.diagnosis.odds import tempered_probabilities
from vegglue.diagnosis.plan_search import NAMED_AT, chances_named, first_competition
from vegglue.diagnosis.search_state import rivals_among

ROWS, TRIES = 50, 400
COLUMNS = [np.array([0, 1]), np.array([2]), np.array([3]), np.array([4])]


@pytest.fixture(scope="module")
def prints() -> list[Array]:
    """Traces of four effects, the first with two settings, the last like the third; of places and of a probe."""
    random = np.random.default_rng(3)
    listed, places, probe = (random.standard_normal((ROWS, count)) for count in (5, 12, 3))
    listed[:, 1] += listed[:, 0]
    listed[:, 4] = listed[:, 3] + 0.2 * listed[:, 4]
    places[:, 0] = listed[:, 2] + 0.5 * places[:, 0]
    return [listed, places, probe]


def kinds_of(prints: list[Array], residual: Array) -> list[HypothesisKind]:
    found = []
    for name, part in zip(("effect", "drag", "probe"), prints, strict=True):
        projected = project(np.zeros((ROWS, 0)), residual, np.zeros(0), part)
        count = part.shape[1]
        found.append(kind_of_hypotheses(name, projected, np.full(count, 1.0), np.full(count, 1 / (4 * count))))
    return found


def named_in_full(kinds: list[HypothesisKind], level: float) -> list[int]:
    """Effects that the functions of the diagnosis name."""
    if logsumexp([one.total for one in kinds]) < level:
        return []
    listed = kinds[0]
    evidence = np.array([*(logsumexp(listed.log_evidence[own]) for own in COLUMNS), *(one.total for one in kinds[1:])])
    chance = tempered_probabilities(evidence)
    what: list[What] = ["effect", "effect", "effect", "effect", "place", "instrument"]
    chosen = chosen_hypothesis(what, evidence, float(chance[4]))
    if chosen is None or chosen > 3:
        return []
    first = [own[np.argmax(listed.size[own])] for own in COLUMNS]
    rivals, _ = rivals_among("0123", chance[:4], cosines(listed.projected)[np.ix_(first, first)])
    return [int(name) for name, one in rivals.items() if one >= constants().rival_share * chance.max()]


def test_an_effect_is_named_as_often_as_by_the_diagnosis(prints: list[Array]) -> None:
    random = np.random.default_rng(4)
    nothing = kinds_of(prints, np.zeros(ROWS))
    errors = random.standard_normal((2000, ROWS))
    level = alarm_level(nothing, errors, 1, 0.05)
    truths = [project(np.zeros((ROWS, 0)), np.zeros(ROWS), np.zeros(0), prints[0][:, own]) for own in COLUMNS]
    chances = chances_named(first_competition(nothing, COLUMNS, ["drag"], errors, level), truths)
    assert chances.shape == (4, NAMED_AT.size)
    for effect, length in ((0, 3.0), (1, 3.0), (1, 4.0), (3, 3.0)):
        own = COLUMNS[effect]
        count = 0
        for number in range(TRIES):
            unit = truths[effect].units[:, number % own.size]
            residual = random.choice([-1.0, 1.0]) * length * unit + random.standard_normal(ROWS)
            count += effect in named_in_full(kinds_of(prints, residual), level)
        expected = float(chances[effect, length == NAMED_AT][0])
        assert 0.2 < expected < 0.995
        assert count / TRIES == pytest.approx(expected, abs=3.5 * np.sqrt(0.25 / 192 + 0.25 / TRIES) * 0.8)
