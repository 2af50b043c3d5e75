"""The error ladder on a model that is linear in z, where one linear step is exact."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from linear_baseline import at_best, stations_of

from vegglue.arrays import Array
from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import at_point
from vegglue.calibration.noise import covariance_of, noise_of, with_model_error
from vegglue.case.config import load_case
from vegglue.cli.printed import show_ladder
from vegglue.diagnosis.comparison import held_out_rmse, homogeneity, improvement, model_score, model_score_in_short
from vegglue.results.loop_results import ModelScore
from vegglue.workflow.compare import Comparison

CASE = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
SECTIONS, POINTS = ("A", "B", "C"), 6


def stations() -> pd.DataFrame:
    return stations_of(CASE, SECTIONS, POINTS)


def calibrated(values: Array, slope: Array) -> Baseline:
    return at_best(CASE, stations(), values, slope)


@pytest.fixture
def slope() -> Array:
    return 0.05 * np.random.default_rng(1).standard_normal((len(stations()), len(CASE.parameters)))


def measured(slope: Array, truth: Array) -> Array:
    """Values at z (station, p) with errors."""
    error = 0.01 * np.random.default_rng(2).standard_normal(len(slope))
    return np.sum(slope * truth, axis=1) + error


def test_a_parameter_that_differs_between_experiments_is_named(slope: Array) -> None:
    truth = np.zeros(slope.shape)
    alike = homogeneity(calibrated(measured(slope, truth), slope))
    assert set(alike) == set(CASE.parameters)
    assert min(alike.values()) > 0.01
    truth[stations()["experiment"] == "high", 1] = 0.6
    apart = homogeneity(calibrated(measured(slope, truth), slope))
    named = list(CASE.parameters)[1]
    assert min(apart, key=lambda name: apart[name]) == named
    assert apart[named] < 1e-6
    assert min(p for name, p in apart.items() if name != named) > 1e-3


def test_an_error_that_experiments_share_makes_no_difference_of_theirs(slope: Array) -> None:
    """Taken for independent, equal values looked more alike than they may, and real differences were overlooked."""
    table, random = stations(), np.random.default_rng(8)
    columns = 0.1 * slope[:, :1]  # as friction that is a little off everywhere acts like the roughness of the bed
    base = calibrated(np.zeros(len(table)), slope)
    noise = with_model_error(base.noise, columns)
    lower = np.linalg.cholesky(covariance_of(noise))
    found = []
    for _ in range(300):
        values = lower @ random.standard_normal(len(table))
        one = at_best(CASE, table, values, slope)
        found.append(homogeneity(replace(one, noise=replace(noise, value=values)))[next(iter(CASE.parameters))])
    assert 0.02 < np.mean(np.array(found) < 0.05) < 0.1
    assert np.median(found) == pytest.approx(0.5, abs=0.1)


def test_what_an_experiment_does_not_tell_is_left_out(slope: Array) -> None:
    slope[stations()["experiment"] != "high", 0] = 0.0
    told = homogeneity(calibrated(measured(slope, np.zeros(slope.shape)), slope))
    assert set(told) == set(CASE.parameters) - {next(iter(CASE.parameters))}


def test_held_out_errors_are_those_of_calibrating_without_the_section(slope: Array) -> None:
    values = measured(slope, 0.2 * np.ones(slope.shape))
    base = calibrated(values, slope)
    found = model_score(base)
    out = (stations()["section"] == "B").to_numpy()
    station = base.model.station.assign(used=~out)
    white, kept = slope[~out] / 0.01, values[~out] / 0.01
    z = np.linalg.solve(white.T @ white + np.eye(slope.shape[1]), white.T @ kept)
    assert found.held_out.sections[out] == pytest.approx(values[out] - slope[out] @ z)
    without = model_score(replace(base, model=replace(base.model, station=station), noise=noise_of(station)))
    assert without.in_sample.stations == (~out).sum()


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_held_out_velocities_lie_within_their_band_as_often_as_told(slope: Array, friction: float) -> None:
    """Friction that is a little off everywhere acts like the roughness of the bed, which is calibrated to the other
    sections: taken for independent of that, nearly all lay within the band of half of them.
    """
    table, random = stations(), np.random.default_rng(9)
    noise = with_model_error(noise_of(table.assign(value=0.0)), friction * slope[:, :1])
    inside = []
    for _ in range(200):
        truth = random.standard_normal(slope.shape[1])
        values = slope @ truth + noise.lower @ random.standard_normal(len(table))
        here, start = replace(noise, value=values), at_best(CASE, table, values, slope)
        white = here.whiten(slope)
        z = np.linalg.solve(white.T @ white + np.eye(slope.shape[1]), white.T @ here.whiten(values))
        fitted = at_point(here, replace(start.fitted.point, z=z, prediction=slope @ z))
        found = model_score(replace(start, noise=here, fitted=fitted)).predictive
        inside.append((found.inside50, found.inside95))
    half, most = np.mean(inside, axis=0)
    assert half == pytest.approx(0.5, abs=0.02)
    assert most == pytest.approx(0.95, abs=0.01)


def test_the_error_of_a_gain_holds_for_sections_of_unequal_size(slope: Array) -> None:
    """Sections of 40, 5, 5, 5, 5 and 5 velocities, each with a gain of its own that all of them share, 0 on average."""
    found = model_score(calibrated(measured(slope, np.zeros(slope.shape)), slope))
    sizes, random = [40, 5, 5, 5, 5, 5], np.random.default_rng(4)
    clusters = tuple(("low", name) for name, size in zip("ABCDEF", sizes, strict=True) for _ in range(size))
    held = replace(found.held_out, velocity=np.ones(len(clusters), bool), clusters=clusters)

    def with_errors(errors: Array) -> ModelScore:
        return replace(found, held_out=replace(held, sections=errors))

    after = with_errors(np.ones(len(clusters)))
    told = []
    for _ in range(2000):
        shared = np.repeat(0.2 * random.standard_normal(len(sizes)), sizes)
        told.append(improvement(with_errors(np.sqrt(1.0 + np.clip(shared, -0.9, None))), after))
    means, errors = np.array(told).T
    assert np.sqrt(np.mean(errors**2)) > 0.8 * means.std(), "of the unweighted means it is 0.6"
    assert np.mean(means > 2.0 * errors) < 0.1


@pytest.mark.parametrize("kind", ["speed", "velocity_across"])
def test_velocities_of_other_directions_judge_where_none_is_along_the_channel(slope: Array, kind: str) -> None:
    """Of speeds alone nothing was held out, and `extend --auto` could keep no effect."""
    station, values = stations(), measured(slope, np.zeros(slope.shape))
    along, other = (model_score(at_best(CASE, one, values, slope)) for one in (station, station.assign(kind=kind)))
    assert np.isfinite(held_out_rmse(along))
    assert held_out_rmse(other) == held_out_rmse(along)
    assert other.in_sample.velocity == along.in_sample.velocity
    assert other.in_sample.noise_floor == along.in_sample.noise_floor


def test_a_ladder_of_levels_alone_tells_no_number_that_is_none(
    slope: Array, capsys: pytest.CaptureFixture[str]
) -> None:
    station = stations().assign(kind="level")
    one = model_score(at_best(CASE, station, measured(slope, np.zeros(slope.shape)), slope))
    assert model_score_in_short(one) == "twin, 4 parameters: no velocity"
    show_ladder(Comparison((one, one), pd.DataFrame()))
    told = capsys.readouterr().out
    assert "nan" not in told
