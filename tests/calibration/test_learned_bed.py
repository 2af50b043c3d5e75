"""What a survey leaves open in the model's own error, and what the flow says about it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coarse_twin import coarse_twin
from surveyed_twin import OF_BED, surveyed_twin

from vegglue.calibration.baseline import Baseline, baseline, model_that_errs, with_error_there
from vegglue.calibration.fit import at_point
from vegglue.calibration.learned_bed import LearnedBed, bed_of_spots, learned_bed
from vegglue.calibration.model_error import cell_responses, model_error_columns
from vegglue.calibration.noise import noise_of, with_model_error
from vegglue.case.bed import SPACING, cell_places, read_bed_survey, read_raster
from vegglue.case.bed import surveyed as surveyed_points
from vegglue.case.bed_error import bed_error_columns, surveyed_lines, without_surveys
from vegglue.case.gridded_site import build_site
from vegglue.case.schema import ModelError, Planned, PlannedErrors
from vegglue.case.site_schema import BedLayer
from vegglue.case.survey_error import BedSurvey, bed_survey_text, line_weights, root_of_covariance
from vegglue.decision_constants import constants
from vegglue.diagnosis.comparison import expected_errors
from vegglue.diagnosis.next_measurement import surveys
from vegglue.diagnosis.refits import relevelled
from vegglue.engine.interface import Model, Point, linearise
from vegglue.engine.model import coarser


@pytest.fixture(scope="module")
def surveyed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Point]:
    return surveyed_twin(Path(tmp_path_factory.mktemp("survey")))


def test_the_survey_adds_its_error_and_a_case_without_one_has_none(surveyed: tuple[Model, Point]) -> None:
    model, point = surveyed
    plain = replace(model, case=coarse_twin()[0].case)
    assert bed_error_columns(plain.case, plain.site.grid).shape[1] == 0
    without = model_error_columns(plain, point, ModelError(bed=0.01))
    with_it = model_error_columns(model, point, ModelError(bed=0.01))
    columns = bed_error_columns(model.case, model.site.grid)
    answers = cell_responses(model, point, ("bed",)).of["bed"].reshape(len(model.station), -1) @ columns
    assert with_it @ with_it.T == pytest.approx(without @ without.T + answers @ answers.T, rel=1e-3, abs=1e-8)
    # Known on the lines, less so between them, and never worse than the bed varies.
    stated = np.linalg.norm(columns, axis=1).reshape(model.site.bed.shape)
    middle = stated[:, stated.shape[1] // 2]
    assert middle[np.linspace(0, middle.size - 1, 5).astype(int)].max() < 0.5 * middle.max() <= 0.5 * 1.5 * OF_BED.sd
    # A column of cells by itself has the error that it has among all.
    grid, column = model.site.grid, stated.shape[0] // 8
    alone = bed_error_columns(model.case, replace(grid, x=grid.x[[column]]))
    among = columns.reshape(*stated.shape, -1)[column]
    assert np.linalg.norm(alone.sum(axis=0)) == pytest.approx(np.linalg.norm(among.sum(axis=0)), rel=0.02)


def test_cells_finer_than_the_bed_varies_have_its_error_from_places_between(surveyed: tuple[Model, Point]) -> None:
    """Means over Gaussians of 1 m half width have the standard deviation that all their cells together give."""
    case, grid = surveyed[0].case, surveyed[0].site.grid
    (west, east), (south, north), size = case.grid.x, case.grid.y, 0.25
    fine = replace(grid, x=np.arange(west, east, size), y=np.arange(south, north, size), dx=size, dy=size)
    columns, places = bed_error_columns(case, fine), cell_places(fine)
    survey = case.bed[-1].survey
    assert survey is not None
    assert size < 0.5 * SPACING * OF_BED.across
    stated, dense = [], []
    for x in np.linspace(west + 8.0, east - 8.0, 7):
        near = np.hypot(places[:, 0] - x, places[:, 1]) < 3.0
        weight = np.exp(-0.5 * ((places[near, 0] - x) ** 2 + places[near, 1] ** 2))
        root = root_of_covariance(surveyed_points(survey), survey.covariances, places[near])
        stated.append(np.linalg.norm(weight @ columns[near, 1:]))  # the first is how far the bed is off the mean
        dense.append(np.linalg.norm(weight @ root))
    assert stated == pytest.approx(dense, rel=0.04)
    assert np.linalg.norm(stated) == pytest.approx(np.linalg.norm(dense), rel=0.01)


def learned_from(before: Baseline, true: np.ndarray) -> tuple[np.ndarray, LearnedBed]:
    """Responses to the bed (station, cells), and what is learned of one off by `true` (cells,) [m], to first order."""
    model, point = before.model, before.fitted.point
    cells = cell_responses(model, point, ("bed",)).of["bed"].reshape(len(model.station), -1)
    value = point.prediction + cells @ true
    changed = replace(before, model=replace(model, station=model.station.assign(value=value)), coarse=None)
    found = learned_bed(replace(changed, on_coarse=None, noise=replace(before.noise, value=value[before.noise.rows])))
    assert found is not None
    return cells, found


def test_the_flow_finds_a_bed_that_was_drawn(surveyed: tuple[Model, Point]) -> None:
    """Of a bed drawn from the covariance, velocities recover part, with an error as stated."""
    model, _ = surveyed
    before = baseline(model)
    columns = bed_error_columns(model.case, model.site.grid)
    true = columns @ np.random.default_rng(3).standard_normal(columns.shape[1])
    cells, found = learned_from(before, true)
    left = true - found.correction.ravel()
    assert np.sum(left**2) < np.sum(true**2)
    assert np.mean(np.abs(left) <= 2.5 * found.error.ravel() + 1e-3) > 0.9
    answers = cells @ true
    better = answers - cells @ found.correction.ravel()
    assert np.sum(better**2) < 0.7 * np.sum(answers**2)


def test_bed_and_parameters_are_known_as_in_their_joint_gaussian(surveyed: tuple[Model, Point]) -> None:
    """The error of the bed was that of known parameters: in some cells less than half of it."""
    model, _ = surveyed
    base = baseline(model)
    found, where = learned_bed(base), with_error_there(model_that_errs(base))
    assert found is not None
    columns = bed_error_columns(where.model.case, where.model.site.grid)
    bed = cell_responses(where.model, where.point, ("bed",)).of["bed"].reshape(len(where.model.station), -1) @ columns
    both = where.noise.used(np.hstack([bed, where.point.slope]))
    other = where.noise.lower @ where.noise.lower.T - both[:, : bed.shape[1]] @ both[:, : bed.shape[1]].T
    known = np.linalg.inv(np.eye(both.shape[1]) + both.T @ np.linalg.solve(other, both))
    error = np.sqrt(np.diag(columns @ known[: bed.shape[1], : bed.shape[1]] @ columns.T))
    assert found.error.ravel() == pytest.approx(error, rel=1e-3, abs=1e-6)


def test_a_spot_is_off_by_the_mean_over_it_with_its_error_and_evidence(surveyed: tuple[Model, Point]) -> None:
    """Of a bed that lies lower over a spot midway between two lines."""
    model, _ = surveyed
    before = baseline(model)
    grid, columns = model.site.grid, bed_error_columns(model.case, model.site.grid)
    # The bed of largest chance that is 0.1 m lower on average over the spot.
    x, y, half = 0.5 * (grid.x[0] + 3.0 * grid.x[-1]) / 2.0, 0.0, 1.3
    places = np.array([[x, y, half, half], [grid.x[0] + 2.0 * grid.dx, y, half, half]]).T
    weight = np.exp(-(((grid.x[:, None] - x) / half) ** 2) - ((grid.y[None] - y) / half) ** 2).ravel()
    weight /= weight.sum()
    at_spot = weight @ columns
    true = -0.1 * columns @ at_spot / (at_spot @ at_spot)
    _, found = learned_from(before, true)
    there, elsewhere = (bed_of_spots(found, *places[:, j : j + 1]) for j in range(2))
    assert there.before[0] == pytest.approx(np.linalg.norm(at_spot), rel=1e-6)
    assert there.mean[0] == pytest.approx(float(weight @ found.correction.ravel()), rel=1e-6)
    own = np.linalg.norm(weight @ found.before @ found.left)
    assert there.error[0] == pytest.approx(np.hypot(own, 0.15 * there.mean[0]), rel=1e-6)
    ratio = there.mean[0] / there.error[0]
    assert there.log_factor[0] == pytest.approx(0.5 * ratio**2 - np.log(there.before[0] / there.error[0]))
    assert there.log_factor[0] > elsewhere.log_factor[0]
    assert there.mean[0] < 0.0


def test_spots_some_at_a_time_are_those_of_all_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    grid, random = coarse_twin()[0].site.grid, np.random.default_rng(5)
    learned = LearnedBed(
        grid,
        correction=random.standard_normal((grid.x.size, grid.y.size)),
        before=random.standard_normal((grid.x.size * grid.y.size, 7)),
        left=random.standard_normal((7, 7)),
    )
    x, y = random.uniform(grid.x[0], grid.x[-1], 23), random.uniform(grid.y[0], grid.y[-1], 23)
    whole = bed_of_spots(learned, x, y, 3.0 + 0.0 * x, 1.0 + 0.0 * y)
    monkeypatch.setattr("vegglue.calibration.learned_bed.MOST_WEIGHTS", 4 * grid.x.size * grid.y.size)
    parts = bed_of_spots(learned, x, y, 3.0 + 0.0 * x, 1.0 + 0.0 * y)
    for name in ("mean", "error", "before", "columns"):
        assert getattr(parts, name) == pytest.approx(getattr(whole, name), rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("offset", [0.0, 0.12])
def test_a_line_levelled_wrongly_is_that_by_flow_and_survey(
    surveyed: tuple[Model, Point], tmp_path: Path, offset: float
) -> None:
    model, _ = surveyed
    layer = model.case.bed[0]
    assert layer.survey is not None
    assert layer.raster is not None
    read, raster = read_bed_survey(layer.survey.file), read_raster(layer.raster)
    points, middle = read.points.copy(), read.lines[2]
    points[middle, 2] += offset
    (tmp_path / "survey.csv").write_text(bed_survey_text(BedSurvey(points, read.line)), encoding="utf-8")
    places = np.column_stack([part.ravel() for part in np.meshgrid(raster.x, raster.y, indexing="ij")])
    raised = offset * line_weights(read, layer.survey.covariances, places)[:, 2].reshape(raster.values.shape)
    head = layer.raster.read_text(encoding="utf-8").splitlines()[:5]
    rows = [" ".join(f"{one:.5f}" for one in row) for row in (raster.values + raised).T[::-1]]
    (tmp_path / "bed.asc").write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    survey = layer.survey.model_copy(update={"file": tmp_path / "survey.csv"})
    case = model.case.model_copy(update={"bed": (BedLayer(raster=tmp_path / "bed.asc", survey=survey),)})
    base = baseline(replace(model, case=case, site=build_site(case)))
    lines = surveyed_lines(case, base.model.site.grid)
    assert [one.number for one in lines.lines] == [1, 2, 3]  # not the outermost
    found = relevelled(base, lines.lines[1])
    assert found is not None
    assert found.offset == pytest.approx(offset, abs=2.5 * found.error)
    assert (found.log_factor > 3.0) == (offset > 0.0)
    # Its level is not used: the bed is that of a survey without the error.
    without = found.base.model.case.bed[0].survey
    assert without is not None
    assert without.relevelled == (2,)
    assert np.abs(found.base.model.site.bed - model.site.bed).max() < 0.5 * max(offset, 0.1)


def test_a_line_midway_takes_its_share_of_the_error(surveyed: tuple[Model, Point]) -> None:
    """L L' of a further line lies between nothing and M, and is most of M for velocities on that line."""
    model, point = surveyed
    columns = bed_error_columns(model.case, model.site.grid)
    answers = cell_responses(model, point, ("bed",)).of["bed"].reshape(len(model.station), -1) @ columns
    whole = answers @ answers.T
    found = [one for one in surveys(model, point) if "line of the bed" in one.name]
    assert len(found) == 4
    for one in found:
        assert one.less is not None
        left = whole - one.less @ one.less.T
        assert np.linalg.eigvalsh(left).min() > -1e-6 * np.trace(whole)
        assert 0.0 < np.trace(left) < np.trace(whole)
    assert not surveys(replace(model, case=without_surveys(model.case)), point)
    rough = model.case.model_copy(update={"planned": Planned(errors=PlannedErrors(survey=0.5))})
    for exact, one in zip(found, surveys(replace(model, case=rough), point), strict=False):
        assert exact.less is not None
        assert one.less is not None
        assert np.trace(one.less @ one.less.T) < 0.5 * np.trace(exact.less @ exact.less.T)


def test_ninety_five_of_a_hundred_unseen_values_lie_within_their_bands(surveyed: tuple[Model, Point]) -> None:
    """Of parameters, a bed and errors of model and grid that are drawn; every other station is calibrated."""
    model, _ = surveyed
    base = baseline(model)
    point, random = base.fitted.point, np.random.default_rng(5)
    used = model.station["used"] & (np.arange(len(model.station)) % 2 == 0)
    seen = replace(model, station=model.station.assign(used=used))
    alike = np.hstack([point.slope, model_error_columns(model, point, model.case.model_error)])
    error = model.station["standard_error"].to_numpy(float)
    noise = with_model_error(noise_of(seen.station), alike[:, point.z.size :])
    coarse = coarser(model)
    assert coarse is not None
    on_coarse = linearise(coarse, point.z)
    assert on_coarse is not None
    of_grid = constants().grid_error_share * (point.prediction - on_coarse.prediction)
    within, ratios = [], []
    for _ in range(25):
        off = alike @ random.standard_normal(alike.shape[1]) - point.slope @ point.z
        value = point.prediction + off + error * random.standard_normal(error.size)
        its_noise = replace(noise, value=value[noise.rows])
        half = Baseline(seen, its_noise, at_point(its_noise, point), None, None)
        found = expected_errors(half, model, point)
        assert found is not None
        mean, spread = (of_each[~used.to_numpy()] for of_each in found)
        left = (off + of_grid * random.standard_normal(error.size))[~used.to_numpy()] - mean
        within.append(np.abs(left) < 1.96 * spread)
        ratios.append(np.sum(left**2) / np.sum(off[~used.to_numpy()] ** 2))
    assert 0.92 <= np.mean(within) <= 0.975
    assert np.mean(ratios) < 0.5  # what was measured beside them says most of it
