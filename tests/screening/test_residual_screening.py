"""Screening of a residual that is errors only: the whole way, errors estimated as for any other."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.stats
from linear_baseline import at_best, stations_of

from vegglue.arrays import Array
from vegglue.case.config import load_case
from vegglue.effects.definition import Amplitude
from vegglue.screening.family_wise_p import Family
from vegglue.screening.fingerprints import Fingerprints
from vegglue.screening.residual_screening import Screening, screen
from vegglue.screening.spatial_scan import DragSpots

CASE = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
STATION = stations_of(CASE, ("A", "B"), 6)
EFFECTS, SPOTS, NULLS = 12, 8, 150
AMPLITUDES = [Amplitude("a", "-", "", 1.0, 0.0 if column % 3 == 0 else -9.0, 9.0) for column in range(EFFECTS)]


def changes() -> tuple[Array, Array, Array]:
    """Slopes, fingerprints of effects and of spots (station, ...): what a standard deviation of each changes [m/s]."""
    random = np.random.default_rng(4)
    sizes = len(CASE.parameters), EFFECTS, SPOTS
    slope, of_effects, of_spots = (0.02 * random.standard_normal((len(STATION), size)) for size in sizes)
    return slope, of_effects, of_spots


def screened(values: Array, effects: int = EFFECTS) -> Screening:
    """With the first so many effects to be tested."""
    slope, of_effects, of_spots = changes()
    base = at_best(CASE, STATION, values, slope)
    spots = DragSpots(np.arange(SPOTS), np.arange(SPOTS), 1.0, of_spots)
    columns = [np.array([column]) for column in range(effects)]
    tested = columns, [{}] * effects, AMPLITUDES[:effects], of_effects[:, :effects]
    known = Fingerprints(base.fitted.point, [], *tested, spots)
    return screen(base, before=SimpleNamespace(fingerprints=known))


def measured(random: np.random.Generator, missing: Array | float = 0.0) -> Array:
    slope = changes()[0]
    return slope @ random.standard_normal(slope.shape[1]) + missing + 0.01 * random.standard_normal(len(STATION))


@pytest.fixture(scope="module")
def nulls() -> list[Screening]:
    """Of NULLS residuals that are errors only."""
    random = np.random.default_rng(8)
    return [screened(measured(random)) for _ in range(NULLS)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["effects", "spots", "stations"])
def test_chances_are_uniform_when_nothing_is_missing(nulls: list[Screening], name: str) -> None:
    """That which is told everywhere, that which is decided by where it decides."""
    families: list[Family] = [getattr(one, name) for one in nulls]
    told = [family.p_of(float(np.abs(family.scores).max())) for family in families]
    assert scipy.stats.kstest(told, "uniform").pvalue > 1e-3
    decided = np.exp([family.log_p() for family in families])
    for level in (0.1, 0.05):
        assert scipy.stats.binomtest(int(np.sum(decided <= level)), decided.size, level).pvalue > 1e-3, level


def test_an_effect_that_is_missing_stands_out_alone() -> None:
    missing = 4.0 * changes()[1][:, 5]
    found = screened(measured(np.random.default_rng(0), missing))
    assert found.effects.best == 5
    assert found.effects.log_p() < np.log(1e-6)
    assert found.effects.p_of(found.best_score(5)) == pytest.approx(1 / (1 + found.effects.maxima.size))
    gain = found.effects.scores[5] / found.effects.length[5]
    assert gain == pytest.approx(4.0, abs=4.0 / found.effects.length[5])


def test_where_every_effect_is_at_work_already_none_stands_out() -> None:
    found = screened(measured(np.random.default_rng(0)), effects=0)
    assert found.effects.log_p() == 0.0
    assert found.ranking == []
    assert found.stations.log_p() > np.log(0.01)


def test_an_outlier_is_a_station_and_no_effect() -> None:
    values = measured(np.random.default_rng(3))
    values[7] += 0.15
    found = screened(values)
    assert found.stations.best == 7
    assert found.stations.log_p() < found.effects.log_p() - 3.0
    assert found.stations.without((7,)).best != 7
