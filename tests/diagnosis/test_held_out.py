"""Measurements that no calibration has seen: errors of the size that was to be expected have a ratio of one."""

from dataclasses import replace

import numpy as np
import pytest
from linear_baseline import CASE_OF_TWINS, at_best, linear_engine, measured_linearly, stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.noise import with_grid_error
from vegglue.case.schema import ModelError
from vegglue.diagnosis.comparison import HeldOutErrors, held_out_errors
from vegglue.engine.interface import Model

SECTIONS, POINTS = ("A", "B", "C", "D", "E", "F"), 40


@pytest.fixture
def base() -> Baseline:
    slope, values = measured_linearly(("A",), 8, 3)
    return at_best(CASE_OF_TWINS, stations_of(CASE_OF_TWINS, ("A",), 8), values, slope)


def told(
    base: Baseline, error: Array, slope: Array | float = 0.0, of_causes: Array | None = None, **columns: object
) -> HeldOutErrors:
    """Where predictions at held-out stations are off by error (station,); slope (station, p) there."""
    station = stations_of(CASE_OF_TWINS, SECTIONS, POINTS).assign(value=0.4 + error).assign(**columns)
    z = base.fitted.point.z
    whole = np.zeros((len(station), z.size)) + slope
    engine = linear_engine(lambda _: (0.4 - whole @ z, whole), of_causes)
    return held_out_errors(base, Model(CASE_OF_TWINS, base.model.site, station, engine))


def drawn(size: float) -> Array:
    return size * np.random.default_rng(1).standard_normal(len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS)))


def test_errors_as_stated_have_a_ratio_of_one(base: Baseline) -> None:
    assert told(base, drawn(0.01)).ratio == pytest.approx(1.0, rel=0.1)
    assert told(base, drawn(0.03)).ratio == pytest.approx(3.0, rel=0.1)


def test_where_no_error_is_stated_that_of_what_was_seen_counts(base: Baseline) -> None:
    assert told(base, drawn(0.01), standard_error=np.nan).ratio == pytest.approx(1.0, rel=0.1)
    larger = replace(base, noise=replace(base.noise, scale=2.0))
    assert told(larger, drawn(0.02), standard_error=np.nan).ratio == pytest.approx(1.0, rel=0.1)


def test_what_parameters_and_grid_are_uncertain_by_is_expected(base: Baseline) -> None:
    """J V J' and the error of the grid add to the errors of measuring, in squares."""
    slope = 0.5 * np.ones((len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS)), 3))
    known = float(np.einsum("i,ij,j->", slope[0], base.fitted.covariance, slope[0]))
    assert known > 1e-4
    size = np.sqrt(0.01**2 + known)
    assert told(base, drawn(size), slope).ratio == pytest.approx(1.0, rel=0.1)
    on_grid = replace(base, noise=with_grid_error(base.noise, np.full(len(base.model.station), 0.05)))
    size = np.sqrt(0.01**2 + np.mean(on_grid.noise.grid_error**2))
    assert size > 0.02
    assert told(on_grid, drawn(size)).ratio == pytest.approx(1.0, rel=0.1)


def test_the_models_own_error_is_expected(base: Baseline) -> None:
    """Of the discharge of each experiment, 2 %: where predictions follow it one to one, 0.02 m/s."""
    case = CASE_OF_TWINS.model_copy(update={"model_error": ModelError(discharge=0.02)})
    station = stations_of(CASE_OF_TWINS, SECTIONS, POINTS)
    experiments = station["experiment"].to_numpy()
    of_causes = np.stack([experiments == name for name in case.experiments], axis=1).astype(float)
    known = replace(base, model=replace(base.model, case=case))
    assert told(known, drawn(np.hypot(0.01, 0.02)), of_causes=of_causes).ratio == pytest.approx(1.0, rel=0.1)


def test_only_velocities_that_are_used_count(base: Baseline) -> None:
    far = drawn(0.01)
    count = far.size
    far[: count // 2] += 5.0
    first = np.arange(count) < count // 2
    assert told(base, far, used=~first).ratio == pytest.approx(1.0, rel=0.1)
    assert told(base, far, kind=np.where(first, "level", "velocity")).ratio == pytest.approx(1.0, rel=0.1)
    assert np.isnan(told(base, far, used=False).ratio)


@pytest.mark.parametrize(("used", "ratio"), [(True, np.inf), (False, np.nan)])
def test_no_flow_for_held_out_measurements_is_no_agreement(base: Baseline, used: bool, ratio: float) -> None:
    station = stations_of(CASE_OF_TWINS, SECTIONS, POINTS).assign(used=used, value=0.4)
    without = Model(CASE_OF_TWINS, base.model.site, station, linear_engine(lambda _: None))
    assert held_out_errors(base, without).ratio == pytest.approx(ratio, nan_ok=True)


@pytest.mark.parametrize("readings", [1, 3, 30])
def test_errors_alone_exceed_what_is_told_of_them_in_five_of_a_hundred(readings: int, base: Baseline) -> None:
    """One reading exceeds 1.3 of its errors in 19."""
    random = np.random.default_rng(readings)
    count = len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS))
    used = np.arange(count) < readings
    drawn = [told(base, 0.01 * random.standard_normal(count), used=used) for _ in range(400)]
    beyond = sum(one.ratio > one.by_chance for one in drawn)
    assert 8 <= beyond <= 34  # 20 are meant: 99.8 % of binomial draws


def test_many_that_err_alike_are_few(base: Baseline) -> None:
    """An error of the parameters is one error, however many stations see it: 1.96 of it is a chance of 5 %."""
    count = len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS))
    assert told(base, drawn(0.01)).by_chance < 1.1
    assert told(base, drawn(0.01), 50.0 * np.ones((count, 3))).by_chance == pytest.approx(1.96, abs=0.02)
