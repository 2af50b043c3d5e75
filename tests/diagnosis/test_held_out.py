"""Measurements that no calibration has seen: errors of the size that was to be expected have a ratio of one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_baseline import CASE_OF_TWINS, at_best, measured_linearly, stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.noise import with_grid_error
from vegglue.diagnosis.errors_elsewhere import HeldOutErrors, held_out_errors
from vegglue.engine.interface import Point
from vegglue.engine.newton import NEWTON

SECTIONS, POINTS = ("A", "B", "C", "D", "E", "F"), 40


@pytest.fixture
def base() -> Baseline:
    slope, values = measured_linearly(("A",), 8, 3)
    return at_best(CASE_OF_TWINS, stations_of(CASE_OF_TWINS, ("A",), 8), values, slope)


def told(
    base: Baseline, monkeypatch: pytest.MonkeyPatch, error: Array, slope: Array | float = 0.0, **columns: object
) -> HeldOutErrors:
    """Where predictions at unseen stations are off by error (station,); slope (station, p) there."""
    station = stations_of(CASE_OF_TWINS, SECTIONS, POINTS).assign(value=0.4 + error).assign(**columns)
    whole = np.zeros((len(station), base.fitted.point.z.size)) + slope
    point = Point(base.fitted.point.z, np.full(len(station), 0.4), whole, {})
    monkeypatch.setattr("vegglue.diagnosis.errors_elsewhere.linearise", lambda *_: point)
    unseen = SimpleNamespace(case=CASE_OF_TWINS, site=base.model.site, station=station, engine=NEWTON)
    return held_out_errors(base, unseen)


def drawn(size: float) -> Array:
    return size * np.random.default_rng(1).standard_normal(len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS)))


def test_errors_as_stated_have_a_ratio_of_one(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    assert told(base, monkeypatch, drawn(0.01)).ratio == pytest.approx(1.0, rel=0.1)
    assert told(base, monkeypatch, drawn(0.03)).ratio == pytest.approx(3.0, rel=0.1)


def test_where_no_error_is_stated_that_of_what_was_seen_counts(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    assert told(base, monkeypatch, drawn(0.01), standard_error=np.nan).ratio == pytest.approx(1.0, rel=0.1)
    larger = replace(base, noise=replace(base.noise, scale=2.0))
    assert told(larger, monkeypatch, drawn(0.02), standard_error=np.nan).ratio == pytest.approx(1.0, rel=0.1)


def test_what_parameters_and_grid_are_uncertain_by_is_expected(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    """J V J' and the error of the grid add to the errors of measuring, in squares."""
    slope = 0.5 * np.ones((len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS)), 3))
    known = float(np.einsum("i,ij,j->", slope[0], base.fitted.covariance, slope[0]))
    assert known > 1e-4
    size = np.sqrt(0.01**2 + known)
    assert told(base, monkeypatch, drawn(size), slope).ratio == pytest.approx(1.0, rel=0.1)
    on_grid = replace(base, noise=with_grid_error(base.noise, np.full(len(base.model.station), 0.05)))
    size = np.sqrt(0.01**2 + np.mean(on_grid.noise.grid_error**2))
    assert size > 0.02
    assert told(on_grid, monkeypatch, drawn(size)).ratio == pytest.approx(1.0, rel=0.1)


def test_the_models_own_error_is_expected(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    count = len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS))
    monkeypatch.setattr(
        "vegglue.diagnosis.errors_elsewhere.model_error_columns", lambda *_: np.full((count, 2), 0.02 / np.sqrt(2.0))
    )
    assert told(base, monkeypatch, drawn(np.hypot(0.01, 0.02))).ratio == pytest.approx(1.0, rel=0.1)


def test_only_velocities_that_are_used_count(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    far = drawn(0.01)
    count = far.size
    far[: count // 2] += 5.0
    first = np.arange(count) < count // 2
    assert told(base, monkeypatch, far, used=~first).ratio == pytest.approx(1.0, rel=0.1)
    assert told(base, monkeypatch, far, kind=np.where(first, "level", "velocity")).ratio == pytest.approx(1.0, rel=0.1)
    assert np.isnan(told(base, monkeypatch, far, used=False).ratio)


def test_no_flow_for_what_was_not_seen_is_no_agreement(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vegglue.diagnosis.errors_elsewhere.linearise", lambda *_: None)
    station = stations_of(CASE_OF_TWINS, SECTIONS, POINTS)
    unseen = SimpleNamespace(case=CASE_OF_TWINS, site=base.model.site, station=station, engine=NEWTON)
    assert held_out_errors(base, unseen).ratio == np.inf
    none = SimpleNamespace(case=CASE_OF_TWINS, site=base.model.site, station=station.assign(used=False), engine=NEWTON)
    assert np.isnan(held_out_errors(base, none).ratio)


@pytest.mark.parametrize("readings", [1, 3, 30])
def test_errors_alone_exceed_what_is_told_of_them_in_five_of_a_hundred(
    readings: int, base: Baseline, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One reading exceeds 1.3 of its errors in 19."""
    random = np.random.default_rng(readings)
    count = len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS))
    used = np.arange(count) < readings
    drawn = [told(base, monkeypatch, 0.01 * random.standard_normal(count), used=used) for _ in range(400)]
    beyond = sum(one.ratio > one.by_chance for one in drawn)
    assert 8 <= beyond <= 34  # 20 are meant: 99.8 % of binomial draws


def test_many_that_err_alike_are_few(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error of the parameters is one error, however many stations see it: 1.96 of it is a chance of 5 %."""
    count = len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS))
    assert told(base, monkeypatch, drawn(0.01)).by_chance < 1.1
    assert told(base, monkeypatch, drawn(0.01), 50.0 * np.ones((count, 3))).by_chance == pytest.approx(1.96, abs=0.02)
