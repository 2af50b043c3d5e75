"""Measurements that no calibration has seen: errors of the size that was to be expected have a ratio of one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_baseline import CASE_OF_TWINS, at_best, measured_linearly, stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.noise import with_grid_error
from vegglue.diagnosis.unseen import unseen_ratio
from vegglue.engine.interface import Point
from vegglue.engine.newton import NEWTON

SECTIONS, POINTS = ("A", "B", "C", "D", "E", "F"), 40


@pytest.fixture
def base() -> Baseline:
    slope, values = measured_linearly(("A",), 8, 3)
    return at_best(CASE_OF_TWINS, stations_of(CASE_OF_TWINS, ("A",), 8), values, slope)


def ratio(
    base: Baseline, monkeypatch: pytest.MonkeyPatch, error: Array, slope: Array | float = 0.0, **columns: object
) -> float:
    """Where predictions at unseen stations are off by error (station,); slope (station, p) there."""
    station = stations_of(CASE_OF_TWINS, SECTIONS, POINTS).assign(value=0.4 + error).assign(**columns)
    whole = np.zeros((len(station), base.fitted.point.z.size)) + slope
    point = Point(base.fitted.point.z, np.full(len(station), 0.4), whole, {})
    monkeypatch.setattr("vegglue.diagnosis.unseen.linearise", lambda *_: point)
    unseen = SimpleNamespace(case=CASE_OF_TWINS, site=base.model.site, station=station, engine=NEWTON)
    return unseen_ratio(base, unseen)


def drawn(size: float) -> Array:
    return size * np.random.default_rng(1).standard_normal(len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS)))


def test_errors_as_stated_have_a_ratio_of_one(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    assert ratio(base, monkeypatch, drawn(0.01)) == pytest.approx(1.0, rel=0.1)
    assert ratio(base, monkeypatch, drawn(0.03)) == pytest.approx(3.0, rel=0.1)


def test_where_no_error_is_stated_that_of_what_was_seen_counts(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    assert ratio(base, monkeypatch, drawn(0.01), standard_error=np.nan) == pytest.approx(1.0, rel=0.1)
    larger = replace(base, noise=replace(base.noise, scale=2.0))
    assert ratio(larger, monkeypatch, drawn(0.02), standard_error=np.nan) == pytest.approx(1.0, rel=0.1)


def test_what_parameters_and_grid_are_uncertain_by_is_expected(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    """J V J' and the error of the grid add to the errors of measuring, in squares."""
    slope = 0.5 * np.ones((len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS)), 3))
    known = float(np.einsum("i,ij,j->", slope[0], base.fitted.covariance, slope[0]))
    assert known > 1e-4
    size = np.sqrt(0.01**2 + known)
    assert ratio(base, monkeypatch, drawn(size), slope) == pytest.approx(1.0, rel=0.1)
    on_grid = replace(base, noise=with_grid_error(base.noise, np.full(len(base.model.station), 0.05)))
    size = np.sqrt(0.01**2 + np.mean(on_grid.noise.grid_error**2))
    assert size > 0.02
    assert ratio(on_grid, monkeypatch, drawn(size)) == pytest.approx(1.0, rel=0.1)


def test_the_models_own_error_is_expected(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    count = len(stations_of(CASE_OF_TWINS, SECTIONS, POINTS))
    monkeypatch.setattr(
        "vegglue.diagnosis.unseen.model_error_columns", lambda *_: np.full((count, 2), 0.02 / np.sqrt(2.0))
    )
    assert ratio(base, monkeypatch, drawn(np.hypot(0.01, 0.02))) == pytest.approx(1.0, rel=0.1)


def test_only_velocities_that_are_used_count(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    far = drawn(0.01)
    count = far.size
    far[: count // 2] += 5.0
    first = np.arange(count) < count // 2
    assert ratio(base, monkeypatch, far, used=~first) == pytest.approx(1.0, rel=0.1)
    assert ratio(base, monkeypatch, far, kind=np.where(first, "level", "velocity")) == pytest.approx(1.0, rel=0.1)
    assert np.isnan(ratio(base, monkeypatch, far, used=False))


def test_no_flow_for_what_was_not_seen_is_no_agreement(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vegglue.diagnosis.unseen.linearise", lambda *_: None)
    station = stations_of(CASE_OF_TWINS, SECTIONS, POINTS)
    unseen = SimpleNamespace(case=CASE_OF_TWINS, site=base.model.site, station=station, engine=NEWTON)
    assert unseen_ratio(base, unseen) == np.inf
    none = SimpleNamespace(case=CASE_OF_TWINS, site=base.model.site, station=station.assign(used=False), engine=NEWTON)
    assert np.isnan(unseen_ratio(base, none))
