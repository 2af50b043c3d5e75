"""What a survey leaves open in the model's own error, and what the flow says about it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from coarse_twin import coarse_twin

from vegglue.calibration.baseline import baseline, model_that_errs
from vegglue.calibration.fingerprints import least_depth
from vegglue.calibration.learned_bed import changed_by, learned_bed, wet_cells
from vegglue.calibration.model_error import cell_responses, model_error_columns
from vegglue.case.bed_error import bed_error_columns, without_surveys
from vegglue.case.schema import ModelError, Planned, PlannedErrors
from vegglue.case.site_schema import BedLayer, CovarianceOfBed, SurveyOfBed
from vegglue.case.survey_error import BedSurvey, bed_survey_text
from vegglue.diagnosis.next_measurement import surveys
from vegglue.engine.interface import Model, Point

OF_BED = CovarianceOfBed(chance=1.0, along=4.0, across=1.5, sd=0.05, point_error=0.005)


@pytest.fixture(scope="module")
def surveyed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Point]:
    """The twin with its own bed as a raster that comes from lines across the channel."""
    model, point = coarse_twin()
    folder, grid = Path(tmp_path_factory.mktemp("survey")), model.site.grid
    size = min(grid.dx, grid.dy)
    x = np.arange(grid.x[0] - grid.dx, grid.x[-1] + 2.0 * grid.dx, size)
    y = np.arange(grid.y[0] - grid.dy, grid.y[-1] + 2.0 * grid.dy, size)
    level = np.stack([np.interp(y, grid.y, model.site.bed[int(np.abs(grid.x - at).argmin())]) for at in x])
    head = f"ncols {x.size}\nnrows {y.size}\nxllcenter {x[0]}\nyllcenter {y[0]}\ncellsize {size}\n"
    rows = "\n".join(" ".join(f"{one:.5f}" for one in row) for row in level.T[::-1])
    (folder / "bed.asc").write_text(head + rows + "\n", encoding="utf-8")
    every = np.linspace(0, grid.x.size - 1, 5).astype(int)
    points = [(grid.x[i], grid.y[j], model.site.bed[i, j]) for i in every for j in range(grid.y.size)]
    line = np.repeat(np.arange(every.size), grid.y.size)
    (folder / "survey.csv").write_text(bed_survey_text(BedSurvey(np.array(points), line)), encoding="utf-8")
    survey = SurveyOfBed(file=folder / "survey.csv", covariances=(OF_BED,))
    layer = BedLayer(raster=folder / "bed.asc", survey=survey)
    return replace(model, case=model.case.model_copy(update={"bed": (layer,)})), point


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


def test_the_flow_finds_a_bed_that_was_drawn(surveyed: tuple[Model, Point]) -> None:
    """Of a bed drawn from the covariance, velocities recover part, with an error as stated."""
    model, _ = surveyed
    before = baseline(model)
    columns = bed_error_columns(model.case, model.site.grid)
    true = columns @ np.random.default_rng(3).standard_normal(columns.shape[1])
    answers = cell_responses(model, before.fitted.point, ("bed",)).of["bed"].reshape(len(model.station), -1) @ true
    value = before.fitted.point.prediction + answers
    changed = replace(before, model=replace(model, station=model.station.assign(value=value)), coarse=None)
    changed = replace(changed, on_coarse=None, noise=replace(before.noise, value=value[before.noise.rows]))
    found = learned_bed(changed)
    assert found is not None
    left = true - found.correction.ravel()
    assert np.sum(left**2) < np.sum(true**2)
    assert np.mean(np.abs(left) <= 2.5 * found.error.ravel() + 1e-3) > 0.9
    better = value - before.fitted.point.prediction - changed_by(found, model, before.fitted.point)[0]
    assert np.sum(better**2) < 0.7 * np.sum(answers**2)


def test_bed_and_parameters_are_known_as_in_their_joint_gaussian(surveyed: tuple[Model, Point]) -> None:
    """The error of the bed was that of known parameters: in some cells less than half of it."""
    model, _ = surveyed
    base = baseline(model)
    found, where = learned_bed(base), model_that_errs(base)
    assert found is not None
    columns = bed_error_columns(where.model.case, where.model.site.grid)
    bed = cell_responses(where.model, where.point, ("bed",)).of["bed"].reshape(len(where.model.station), -1) @ columns
    both = where.noise.used(np.hstack([bed, where.point.slope]))
    other = where.noise.lower @ where.noise.lower.T - both[:, : bed.shape[1]] @ both[:, : bed.shape[1]].T
    known = np.linalg.inv(np.eye(both.shape[1]) + both.T @ np.linalg.solve(other, both))
    error = np.sqrt(np.diag(columns @ known[: bed.shape[1], : bed.shape[1]] @ columns.T))
    assert found.error.ravel() == pytest.approx(error, rel=1e-3, abs=1e-6)


def test_shallow_water_of_a_shallow_site_is_water(
    surveyed: tuple[Model, Point], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The limit was 5 cm, whatever the depth: in a flume of 5 cm of water no cell was wet, and no correction stated."""
    base, flow = baseline(surveyed[0]), SimpleNamespace(depth=np.array([[0.9, 1.1]]) * least_depth(surveyed[0]))
    monkeypatch.setattr("vegglue.calibration.learned_bed.flow_at_centres", lambda *_: flow)
    monkeypatch.setattr("vegglue.calibration.fingerprints.LEAST_DEPTH", 0.01)
    assert wet_cells(base).tolist() == [[True, True]]
    monkeypatch.setattr("vegglue.calibration.fingerprints.LEAST_DEPTH", 0.05)
    assert wet_cells(base).tolist() == [[False, True]]


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
