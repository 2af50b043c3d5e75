"""The bed between surveyed lines: kriging against dense formulas, against fields that are drawn, and as a file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from linear_baseline import CASE_OF_TWINS as CASE
from surveyed_twin import OF_BED, surveyed_twin

from vegglue.arrays import Array
from vegglue.case.bed import read_bed_survey
from vegglue.case.channel_geometry import site_scales
from vegglue.case.site_schema import CovarianceOfBed
from vegglue.case.survey_error import (
    BedSurvey,
    bed_survey_text,
    correlation_of_bed,
    covariances_beside_wrong_line,
    evidence_of_lines,
    fitted_covariances,
    left_out,
    line_offsets,
    line_weights,
    lines_left_out,
    mean_level,
    root_of_covariance,
    stands_out,
)
from vegglue.effects.library import library
from vegglue.effects.scales import at_site, rounded
from vegglue.errors import InputError

SMOOTH = CovarianceOfBed(chance=1.0, rough=False, along=6.0, across=2.5, sd=0.1, point_error=0.01)
ROUGH = SMOOTH.model_copy(update={"rough": True, "along": 9.0})
ALONE = [SMOOTH, ROUGH]
BOTH = [SMOOTH.model_copy(update={"chance": 0.7}), ROUGH.model_copy(update={"chance": 0.3})]
# Between lines every 9 or 12 m: the square root leaves out what is little on a line.
MIDDLE = np.array(
    [[x, y] for x in (14.5, 20.5, 22.0, 30.0, 32.0, 40.5, 42.0, 51.0, 57.0) for y in np.arange(-5.0, 5.1, 1.0)]
)


def lines(spacing: float, length: float = 72.0) -> tuple[Array, Array]:
    """Places (n, 2) of lines across, a point every 0.75 m, and the number of the line of each."""
    x, y = np.arange(0.0, length + 0.1, spacing), np.arange(-6.0, 6.1, 0.75)
    places = np.array([[one, other] for one in x for other in y])
    return places, np.repeat(np.arange(len(x)), len(y))


def drawn(spacing: float, one: CovarianceOfBed, seed: int) -> tuple[BedSurvey, Array]:
    """A survey of a bed that is drawn, and the bed at MIDDLE (m,) [m]."""
    random, (places, line) = np.random.default_rng(seed), lines(spacing)
    every = np.vstack([places, MIDDLE])
    factor = np.linalg.cholesky(
        correlation_of_bed(every, every, one.along, one.across, one.rough) + 1e-9 * np.eye(len(every))
    )
    shape = 0.3 - 0.002 * every[:, 0] + 0.02 * every[:, 1] ** 2
    bed = shape + one.sd * factor @ random.standard_normal(len(every))
    z = bed[: len(places)] + one.point_error * random.standard_normal(len(places))
    return BedSurvey(np.column_stack([places, z]), line), bed[len(places) :]


def test_correlations_are_those_of_matern_and_of_exponentials() -> None:
    here, there = np.zeros((1, 2)), np.array([[3.0, 0.0], [0.0, 2.0], [3.0, 2.0]])
    m = {d: (1.0 + q + q**2 / 3.0) * np.exp(-q) for d in (0.5, 1.0, 1.25**0.5) for q in [np.sqrt(5.0) * d]}
    assert correlation_of_bed(here, there, 6.0, 2.0, False)[0] == pytest.approx([m[0.5], m[1.0], m[1.25**0.5]])
    e = np.exp(-0.5)
    assert correlation_of_bed(here, there, 6.0, 2.0, True)[0] == pytest.approx([e, m[1.0], e * m[1.0]])


@pytest.mark.parametrize("one", [SMOOTH, ROUGH])
def test_mean_and_covariance_are_those_of_universal_kriging(one: CovarianceOfBed) -> None:
    survey, _ = drawn(12.0, one, seed=1)
    points, n = survey.points, len(survey.points)
    basis, there = survey.basis(points), survey.basis(MIDDLE)
    readings = one.sd**2 * correlation_of_bed(points, points, one.along, one.across, one.rough)
    readings += one.point_error**2 * np.eye(n)
    between = one.sd**2 * correlation_of_bed(points, MIDDLE, one.along, one.across, one.rough)
    zero = np.zeros((basis.shape[1], basis.shape[1]))
    # The weights W that have least variance among those without bias, with multipliers below them.
    system, right = np.block([[readings, basis], [basis.T, zero]]), np.vstack([between, there.T])
    weights = np.linalg.solve(system, right)
    covariance = one.sd**2 * correlation_of_bed(MIDDLE, MIDDLE, one.along, one.across, one.rough) - right.T @ weights
    found = root_of_covariance(survey, [one], MIDDLE)
    assert mean_level(survey, [one], MIDDLE) == pytest.approx(weights[:n].T @ points[:, 2], abs=1e-6)
    left = covariance - found @ found.T
    assert np.abs(left).max() < 0.05 * np.diag(covariance).max()
    assert 0.0 <= np.trace(left) <= 0.0101 * np.trace(covariance)


def test_several_covariances_average_and_hold_how_far_their_means_lie_apart() -> None:
    survey, _ = drawn(12.0, SMOOTH, seed=2)
    mean, means = mean_level(survey, BOTH, MIDDLE), [mean_level(survey, [one], MIDDLE) for one in ALONE]
    assert mean == pytest.approx(sum(one.chance * part for one, part in zip(BOTH, means, strict=True)), abs=1e-9)
    mixed = root_of_covariance(survey, BOTH, MIDDLE)
    parts = [root_of_covariance(survey, [one], MIDDLE) for one in ALONE]
    variance = sum(
        one.chance * ((part**2).sum(axis=1) + (own - mean) ** 2)
        for one, part, own in zip(BOTH, parts, means, strict=True)
    )
    assert (mixed**2).sum(axis=1) == pytest.approx(variance, rel=0.1)


@pytest.mark.parametrize("one", [SMOOTH, ROUGH])
def test_ninety_five_per_cent_lie_within_two_standard_errors(one: CovarianceOfBed) -> None:
    within = []
    for seed in range(30):
        survey, bed = drawn(12.0, one, seed)
        stated = np.linalg.norm(root_of_covariance(survey, [one], MIDDLE), axis=1)
        within.append(np.abs(bed - mean_level(survey, [one], MIDDLE)) <= 1.96 * stated)
    assert np.mean(within) == pytest.approx(0.95, abs=0.02)


@pytest.mark.slow
def test_so_they_do_by_the_covariance_fitted_to_the_survey() -> None:
    within, ratios = [], []
    for seed in range(12):
        survey, bed = drawn(9.0, SMOOTH, seed)
        fitted = fitted_covariances(survey)
        stated = np.linalg.norm(root_of_covariance(survey, fitted, MIDDLE), axis=1)
        off = bed - mean_level(survey, fitted, MIDDLE)
        within.append(np.abs(off) <= 1.96 * stated)
        ratios.append(np.mean(stated**2) / np.mean(off**2))
    assert 0.92 <= np.mean(within) <= 0.99
    assert 0.8 <= np.mean(ratios) <= 2.0


def test_close_lines_determine_length_and_smoothness() -> None:
    survey, _ = drawn(3.0, SMOOTH, seed=3)
    found = fitted_covariances(survey)
    chance = np.array([one.chance for one in found])
    assert chance.sum() == pytest.approx(1.0)
    assert sum(one.chance for one in found if one.rough) < 0.05
    assert sum(one.chance * one.along for one in found) == pytest.approx(6.0, rel=0.35)
    assert sum(one.chance * one.across for one in found) == pytest.approx(2.5, rel=0.35)
    assert sum(one.chance * one.point_error for one in found) == pytest.approx(0.01, rel=0.3)


def test_lines_far_apart_leave_length_and_smoothness_open() -> None:
    found = fitted_covariances(drawn(18.0, SMOOTH, seed=4)[0])
    assert 0.1 < sum(one.chance for one in found if one.rough) < 0.9
    along = [one.along for one in found]
    assert max(along) > 3.0 * min(along)


def test_what_is_left_out_is_predicted_as_if_it_had_not_been_surveyed() -> None:
    survey, _ = drawn(12.0, SMOOTH, seed=5)
    error, stated = left_out(survey, BOTH)
    rows = survey.lines[3]
    # The others span the same width, so that the mean cross-section has the same splines.
    rest = BedSurvey(np.delete(survey.points, rows, axis=0), np.delete(survey.line, rows))
    means, variances = [], []
    for one in ALONE:
        means.append(mean_level(rest, [one], survey.points[rows, :2]))
        found = root_of_covariance(rest, [one], survey.points[rows, :2])
        variances.append((found**2).sum(axis=1) + one.point_error**2)
    mean = 0.7 * means[0] + 0.3 * means[1]
    variance = sum(w * (v + (m - mean) ** 2) for w, v, m in zip((0.7, 0.3), variances, means, strict=True))
    assert error[rows] == pytest.approx(survey.points[rows, 2] - mean, abs=1e-6)
    assert stated[rows] == pytest.approx(np.sqrt(variance), rel=0.05)


def test_points_in_no_line_are_left_out_one_by_one() -> None:
    survey, _ = drawn(12.0, SMOOTH, seed=6)
    scattered = BedSurvey(survey.points, np.full(len(survey.points), -1))
    error, stated = left_out(scattered, [SMOOTH])
    assert np.sqrt(np.mean((error / stated) ** 2)) == pytest.approx(1.0, abs=0.25)


def test_a_line_surveyed_too_low_stands_out() -> None:
    survey, _ = drawn(6.0, SMOOTH, seed=7)
    points = survey.points.copy()
    points[survey.lines[5], 2] -= 0.3
    wrong = BedSurvey(points, survey.line)
    straight = np.where(np.isin(np.arange(len(points)), np.concatenate(survey.lines[1:-1])), 0.1, np.nan)
    found = lines_left_out(wrong, [SMOOTH], straight)
    assert found.most_at == pytest.approx(30.0)
    assert found.most > 2.0
    assert found.count == len(survey.lines) - 2
    assert found.straight == pytest.approx(0.1)


def test_a_survey_is_read_as_it_was_written(tmp_path: Path) -> None:
    survey, _ = drawn(12.0, SMOOTH, seed=8)
    path = tmp_path / "survey.csv"
    path.write_text(bed_survey_text(survey), encoding="utf-8")
    read = read_bed_survey(path)
    assert read.points == pytest.approx(survey.points, abs=1e-4)
    assert (read.line == survey.line).all()
    path.write_text("x,y,z,line\n1,2,3,0\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"survey\.csv"):
        read_bed_survey(path)


@pytest.mark.parametrize(
    ("count", "line", "tells"),
    [
        (39, np.repeat(np.arange(13), 3), False),
        (60, np.repeat(np.arange(3), 20), False),
        (60, np.repeat(np.arange(4), 15), True),
        (60, np.full(60, -1), True),
        (1001, np.full(1001, -1), False),
    ],
)
def test_few_points_or_lines_and_very_many_points_state_no_error(count: int, line: Array, tells: bool) -> None:
    assert BedSurvey(np.random.default_rng(1).uniform(size=(count, 3)), line).tells_its_error is tells


def test_a_line_that_was_levelled_wrongly_is_that_line() -> None:
    """Its offset is that of generalised least squares with one more column for the line."""
    survey, _ = drawn(9.0, SMOOTH, seed=4)
    rows = survey.lines[3]
    wrong = survey.points.copy()
    wrong[rows, 2] += 0.18
    too_high = BedSurvey(wrong, survey.line)
    off, error, _ = line_offsets(too_high, [SMOOTH])
    own = np.zeros((len(wrong), 1))
    own[rows] = 1.0
    basis = np.hstack([survey.basis(wrong), own])
    covariance = SMOOTH.sd**2 * correlation_of_bed(wrong, wrong, SMOOTH.along, SMOOTH.across, False)
    inverse = np.linalg.inv(covariance + SMOOTH.point_error**2 * np.eye(len(wrong)))
    whole = np.linalg.pinv(basis.T @ inverse @ basis)
    assert off[3] == pytest.approx((whole @ basis.T @ inverse @ wrong[:, 2])[-1], rel=1e-3)
    assert error[3] == pytest.approx(np.sqrt(whole[-1, -1]), rel=1e-3)
    # What the survey says of all lines as rows: of each line alone it is the same.
    h, columns = evidence_of_lines(too_high, [SMOOTH])
    squares = (columns**2).sum(axis=0)
    assert columns.T @ h / squares == pytest.approx(off, rel=1e-6)
    assert squares**-0.5 == pytest.approx(error, rel=1e-6)
    # Any level and slope of all lines is the mean's, and no offset.
    assert np.abs(columns @ np.column_stack([np.ones(off.size), np.arange(off.size)])).max() < 1e-3 * columns.max()
    straight = np.where(np.isin(np.arange(len(wrong)), np.concatenate(survey.lines[1:-1])), 0.1, np.nan)
    assert stands_out(lines_left_out(too_high, [SMOOTH], straight))
    assert not stands_out(lines_left_out(survey, [SMOOTH], straight))


def test_the_bed_without_a_level_is_the_bed_less_the_weights_of_the_line_times_its_offset() -> None:
    survey, _ = drawn(9.0, SMOOTH, seed=4)
    wrong = survey.points.copy()
    wrong[survey.lines[3], 2] += 0.18
    too_high = BedSurvey(wrong, survey.line)
    weights = line_weights(too_high, [SMOOTH], MIDDLE)
    raised = mean_level(too_high, [SMOOTH], MIDDLE) - mean_level(survey, [SMOOTH], MIDDLE)
    assert raised == pytest.approx(0.18 * weights[:, 3], abs=1e-6)
    assert weights.sum(axis=1) == pytest.approx(1.0, abs=1e-3)
    loose = mean_level(replace(too_high, loose=(3,)), [SMOOTH], MIDDLE)
    offset = line_offsets(too_high, [SMOOTH])[0][3]
    assert loose == pytest.approx(mean_level(too_high, [SMOOTH], MIDDLE) - offset * weights[:, 3], abs=1e-3)


def test_a_wrong_line_does_not_make_the_bed_look_rough() -> None:
    survey, _ = drawn(4.5, SMOOTH, seed=4)
    wrong = survey.points.copy()
    wrong[survey.lines[7], 2] += 0.15
    too_high = BedSurvey(wrong, survey.line)
    off, error, _ = line_offsets(too_high, fitted_covariances(too_high))
    beside, error_beside, _ = line_offsets(too_high, covariances_beside_wrong_line(too_high))
    assert beside[7] / error_beside[7] > 1.4 * off[7] / error[7]
    assert beside[7] == pytest.approx(0.15, abs=2.5 * error_beside[7])


@pytest.mark.slow
def test_surveys_without_a_wrong_line_name_none() -> None:
    """Of drawn beds, with the covariance fitted to each survey, as many stand out as errors alone make."""
    found = []
    for seed in range(16):
        survey, _ = drawn(9.0, SMOOTH, seed)
        left = lines_left_out(survey, covariances_beside_wrong_line(survey), np.full(len(survey.points), 0.1))
        found.append(stands_out(left))
    assert sum(found) <= 3  # of 16; 0.05 of each is expected, and more than three are one in 140


def test_the_slope_of_a_surveyed_bed_is_known_to_an_error_of_a_point(tmp_path: Path) -> None:
    """A slope that differs by a fifth of itself was as plausible as on a channel that is stated by its numbers."""
    model, _ = surveyed_twin(tmp_path)
    low, high = model.case.grid.x
    assert site_scales(model.case).slope_error == pytest.approx(OF_BED.point_error / (high - low))
    stated = site_scales(CASE)
    assert stated.slope_error == pytest.approx(0.2 * stated.slope)
    assert at_site(library()["bed_slope_error"], stated).amplitude.scale == rounded(0.2 * stated.slope)
