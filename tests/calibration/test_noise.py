"""The noise of the data: its covariance, and its correlation told apart from missing physics."""

import numpy as np
import pandas as pd
import pytest
import scipy.stats

from vegglue.calibration.noise import (
    covariance_of,
    draw_whitened_errors,
    estimate_noise,
    noise_of,
    with_correlation,
    with_grid_error,
    with_scale,
    with_unknown_errors,
)
from vegglue.errors import InputError

SECTIONS, STATIONS, TRIES = 8, 20, 60


def stations(error: float = 0.01) -> pd.DataFrame:
    section, y = np.divmod(np.arange(SECTIONS * STATIONS), STATIONS)
    return pd.DataFrame(
        {"experiment": "e", "kind": "velocity", "section": section.astype(str), "x": 10.0 * section, "y": 0.3 * y,
         "value": 0.5, "standard_error": error, "used": True}
    )  # fmt: skip


def correlated(rho: float, random: np.random.Generator, error: float = 0.01) -> np.ndarray:
    noise = with_correlation(noise_of(stations(error)), rho, 1.0)
    return noise.lower @ random.standard_normal(SECTIONS * STATIONS)


def smooth() -> np.ndarray:
    """What physics could do: cosines along each section, of their own in each."""
    y = np.arange(STATIONS) / STATIONS
    shapes = np.column_stack([np.cos(np.pi * k * y) for k in range(4)])
    return np.kron(np.eye(SECTIONS), shapes)


def test_neighbours_are_correlated_only_within_their_section() -> None:
    noise = with_correlation(noise_of(stations()), 0.5, 2.0)
    covariance = covariance_of(noise) / 0.01**2
    assert covariance[0, :3] == pytest.approx([4.0, 2.0, 1.0])
    assert covariance[STATIONS - 1, STATIONS] == 0.0


def test_stations_along_the_channel_are_as_far_apart_as_they_are() -> None:
    along = stations()[:5].assign(x=2.0 * np.arange(5), y=0.0)
    correlations = covariance_of(with_correlation(noise_of(along), 0.4, 1.0)) / 0.01**2
    assert correlations[0] == pytest.approx(0.4 ** np.arange(5))


def test_a_boat_that_does_not_keep_its_line_measures_across_all_the_same() -> None:
    wavy = stations()[:5].assign(x=[0.0, 0.2, 0.0, 0.2, 0.0])
    assert covariance_of(with_correlation(noise_of(wavy), 0.4, 1.0)) == pytest.approx(
        covariance_of(with_correlation(noise_of(stations()[:5]), 0.4, 1.0))
    )


def test_two_lines_under_one_name_are_two_readings_wherever_they_are() -> None:
    """Stations at the same y of both lines were one reading: the covariance had no inverse."""
    one = stations()[:5]
    two = pd.concat([one, one.assign(x=0.6)], ignore_index=True)
    correlations = covariance_of(with_correlation(noise_of(two), 0.4, 1.0)) / 0.01**2
    assert correlations[0, [1, 5, 6]] == pytest.approx(0.4 ** np.array([1.0, 2.0, np.hypot(1.0, 2.0)]))


def test_components_at_one_place_are_neighbours_of_their_own_kind_alone() -> None:
    both = pd.concat([stations(), stations().assign(kind="velocity_across")], ignore_index=True)
    others = stations().assign(kind="discharge")
    covariance = covariance_of(with_correlation(noise_of(both), 0.5, 1.0)) / 0.01**2
    many = SECTIONS * STATIONS
    assert covariance[many, many : many + 3] == pytest.approx([1.0, 0.5, 0.25])
    assert not covariance[:many, many:].any()
    alone = covariance_of(with_correlation(noise_of(others), 0.5, 1.0)) / 0.01**2
    assert alone == pytest.approx(np.eye(many))


@pytest.mark.parametrize(("kind", "column"), [("level", "level_se"), ("velocity_across", "v_se")])
def test_a_missing_error_is_refused_by_the_column_of_its_kind(kind: str, column: str) -> None:
    with pytest.raises(InputError, match=f"`{column}`"):
        noise_of(stations(0.0).assign(kind=kind))


def test_whitened_errors_are_independent_and_of_size_one() -> None:
    noise = with_correlation(noise_of(stations()), 0.7, 1.0)
    assert noise.whiten(noise.lower) == pytest.approx(np.eye(SECTIONS * STATIONS), abs=1e-9)


def test_the_error_of_the_grid_makes_errors_larger() -> None:
    difference = np.zeros(SECTIONS * STATIONS)
    difference[3] = 0.05
    before, after = noise_of(stations()), with_grid_error(noise_of(stations()), difference)
    assert covariance_of(after)[3, 3] == pytest.approx(0.01**2 + (0.6 * 0.05) ** 2)
    assert covariance_of(after)[4, 4] == covariance_of(before)[4, 4]


@pytest.mark.slow
@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_correlation_is_found_beside_missing_physics(rho: float) -> None:
    random, physics = np.random.default_rng(4), smooth()
    found = []
    for _ in range(6):
        missing = physics @ random.standard_normal(physics.shape[1]) * 0.03
        left = correlated(rho, random) + missing
        noise = estimate_noise(noise_of(stations()), left, physics @ physics.T)
        found.append(noise.correlation)
        assert noise.scale < 1.3, "missing physics is not taken for noise"
    assert np.mean(found) == pytest.approx(rho, abs=0.12)


@pytest.mark.slow
@pytest.mark.parametrize(("rho", "grid"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.02), (0.5, 0.005)])
def test_errors_smaller_than_allowed_do_not_look_correlated(rho: float, grid: float) -> None:
    """Half of the stated errors, and an error of the grid (m/s) that is not there."""
    random, physics = np.random.default_rng(11), smooth()
    wary = with_grid_error(noise_of(stations()), np.full(SECTIONS * STATIONS, grid))
    found = [estimate_noise(wary, correlated(rho, random, error=0.005), physics @ physics.T) for _ in range(6)]
    assert np.mean([one.correlation for one in found]) == pytest.approx(rho, abs=0.15)
    assert [one.scale for one in found] == [1.0] * 6, "errors are never taken as smaller than stated"


def test_what_a_section_shows_by_chance_is_no_correlation() -> None:
    """Of independent errors the best correlation is seldom zero, and seldom likelier than none."""
    random, physics = np.random.default_rng(12), np.zeros((SECTIONS * STATIONS, 1))
    found = [estimate_noise(noise_of(stations()), correlated(0.0, random), physics @ physics.T) for _ in range(10)]
    assert sum(one.correlation > 0.0 for one in found) <= 1
    assert all(one.correlation_chances[1, 1:].sum() > 0.0 for one in found), "it is doubted all the same"


def test_one_reading_a_section_tells_nothing_of_neighbours() -> None:
    """However alike the readings are."""
    alone = stations()[:6].assign(section=list("abcdef"), x=10.0 * np.arange(6))
    noise = estimate_noise(noise_of(alone), np.full(6, 0.02), np.zeros((6, 6)))
    assert noise.correlation == 0.0
    assert noise.correlation_chances.tolist() == [[0.0], [1.0]]


def test_stated_errors_that_are_far_too_small_are_scaled() -> None:
    random = np.random.default_rng(6)
    left = correlated(0.0, random, error=0.02)
    noise = estimate_noise(noise_of(stations(0.01)), left, smooth() @ smooth().T)
    assert noise.scale == pytest.approx(2.0, rel=0.2)


def among(readings: list[int], value: float | np.ndarray = 1.0) -> np.ndarray:
    """A column of the values at the readings, zero elsewhere (n,)."""
    column = np.zeros(SECTIONS * STATIONS)
    column[readings] = value
    return column


def test_a_station_set_aside_counts_for_nothing() -> None:
    noise = with_unknown_errors(noise_of(stations()), among([5])[:, None])
    assert np.abs(noise.whiten(among([5]))).max() < 0.2


def test_of_an_instrument_that_is_off_only_differences_count() -> None:
    """Where three readings share an offset, it counts for nothing, and two independent errors are left."""
    readings = [5, 30, 60]
    before, shared = noise_of(stations()), among(readings)
    noise, own = with_unknown_errors(before, shared[:, None]), among(readings, np.array([0.02, -0.01, -0.01]))
    assert np.abs(noise.whiten(shared)).max() < 0.2
    assert np.sum(noise.whiten(own) ** 2) == pytest.approx(np.sum((own / 0.01) ** 2), rel=1e-3)
    others = np.ones(before.rows.size) - shared
    assert np.sum(noise.whiten(others) ** 2) == pytest.approx(np.sum(before.whiten(others) ** 2))
    again = with_unknown_errors(noise, among([7])[:, None])
    assert again.unknown.shape == (before.rows.size, 2), "one instrument after another"
    assert np.abs(again.whiten(shared)).max() < 0.2


def test_neither_offset_nor_factor_of_a_probe_that_is_off_counts() -> None:
    """Of four readings two independent errors are left."""
    readings, value = [5, 30, 45, 60], np.array([0.2, 0.5, 0.3, 0.6])
    before, columns = noise_of(stations()), np.column_stack([among(readings), among(readings, value)])
    noise = with_unknown_errors(before, columns)
    assert np.abs(noise.whiten(columns @ np.array([0.1, 0.2]))).max() < 0.2
    slopes = np.linalg.svd(columns[readings], full_matrices=True)[0][:, 2:]
    own = among(readings, 0.01 * slopes @ np.array([1.0, 2.0]))
    assert np.sum(noise.whiten(own) ** 2) == pytest.approx(np.sum((own / 0.01) ** 2), rel=1e-3)


def test_a_scale_that_is_set_is_that_of_the_covariance() -> None:
    """It stayed that of the estimate where sizes are those of the best member, and weights and bands differed."""
    noise = with_scale(with_correlation(noise_of(stations()), 0.4, 9.0), 1.0)
    np.testing.assert_allclose(noise.lower @ noise.lower.T, covariance_of(noise), atol=1e-12)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance_of(noise))), noise.data_error)
    assert noise.correlation == 0.4


def test_a_station_without_a_standard_error_is_named() -> None:
    table = stations()
    table.loc[7, "standard_error"] = np.nan
    with pytest.raises(InputError, match=r"x = 0, y = 2\.1 m"):
        noise_of(table)
    assert noise_of(table, {"velocity": 0.02}).error[7] == 0.02


@pytest.mark.slow
def test_doubt_about_the_correlation_keeps_alarms_rare() -> None:
    random, physics = np.random.default_rng(9), smooth()
    traces = np.linalg.qr(np.kron(np.ones((SECTIONS, 1)), smooth()[:STATIONS, :4]))[0]
    alarms = {"known": 0, "doubted": 0}
    for _ in range(TRIES):
        left = correlated(0.6, random)
        noise = estimate_noise(noise_of(stations()), left, physics @ physics.T)
        white = noise.whiten(traces)
        score = np.abs(noise.whiten(left) @ white / np.linalg.norm(white, axis=0)).max()
        certain = with_correlation(noise, noise.correlation, noise.scale)
        for name, one in (("known", certain), ("doubted", noise)):
            errors = draw_whitened_errors(one, 1000, random) @ white / np.linalg.norm(white, axis=0)
            alarms[name] += int(score > np.quantile(np.abs(errors).max(axis=1), 0.95))
    assert alarms["doubted"] < alarms["known"], "a correlation that is only estimated makes alarms of its own"
    assert scipy.stats.binomtest(alarms["doubted"], TRIES, 0.05).pvalue > 1e-3
