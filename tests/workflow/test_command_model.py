"""Models of a case whose engine is a command: the corrected engine, the place where it fits best, effects on top."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from built_models import model_of
from commands import SMOOTH, commanded
from reach import COARSE

import vegglue
from vegglue.calibration.baseline import CommandPlace, command_place
from vegglue.calibration.candidates import Candidate, candidates_of, cause_of, with_effect
from vegglue.case.parameter_space import theta_at
from vegglue.case.resolved_config import case_hash
from vegglue.case.schema import Case
from vegglue.engine.command import command_runs
from vegglue.engine.corrected import Correction, corrected, correction_at
from vegglue.engine.interface import Model, Point, linearise, linearise_around, predict, responses
from vegglue.engine.model import coarser
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.progress import silent
from vegglue.wording.sentences import sentence
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.command_model import command_compared, command_tried, kept_place, with_command

SMALL = ("members: 1024", "members: 8")
WITH_ERROR = ("experiment: June}", "experiment: June, standard_error: 0.02}")
HERE = np.array([0.3, -0.2])
Z = np.array([[0.3, -0.2], [0.5, 0.1], [-0.4, 0.8]])


@pytest.fixture
def case(tmp_path: Path) -> Case:
    """The brook with a command whose predictions are no flow's: smooth in both parameters."""
    return commanded(tmp_path, SMOOTH, "", COARSE, SMALL, WITH_ERROR)


def models(case: Case, folder: Path) -> tuple[Model, Model]:
    """The built-in model and that of the command, corrected at HERE."""
    own, runs = model_of(case, read_observations(case)), command_runs(case, folder)
    return own, replace(own, engine=corrected(correction_at(runs, own, HERE, watch=silent), runs, watch=silent))


def of_the_command(model: Model, z: np.ndarray) -> np.ndarray:
    """What SMOOTH predicts at z (m, p), (m, station)."""
    theta = {name: value[:, None] for name, value in theta_at(model.case, z).items()}
    x = model.station["x"].to_numpy(float)
    return np.asarray(0.2 / theta["n_b"] ** 0.5 - 0.05 * theta["phi"] ** 0.2 + x / 1000)


def wind(model: Model) -> Candidate:
    return next(one for one in candidates_of(model.case, model.station) if one.name == "wind")


def test_where_it_is_corrected_predictions_and_slopes_are_those_of_the_command(case: Case, tmp_path: Path) -> None:
    _, model = models(case, tmp_path)
    point = linearise(model, HERE)
    assert point is not None
    np.testing.assert_allclose(point.prediction, of_the_command(model, HERE[None])[0], atol=1e-12)
    steps = 1e-4 * np.eye(2)
    slope = (of_the_command(model, HERE + steps) - of_the_command(model, HERE - steps)).T / 2e-4
    np.testing.assert_allclose(point.slope, slope, rtol=0.01, atol=1e-4)


def test_places_around_a_point_are_corrected_as_each_alone(case: Case, tmp_path: Path) -> None:
    _, model = models(case, tmp_path)
    near = linearise(model, HERE)
    assert near is not None
    for z, around in zip(Z, linearise_around(model, Z, near), strict=True):
        alone = linearise(model, z, near)
        assert around is not None
        assert alone is not None
        np.testing.assert_allclose(around.prediction, alone.prediction, atol=1e-5)
        np.testing.assert_allclose(around.slope, alone.slope, atol=1e-3)


def test_many_predictions_are_runs_of_the_command(case: Case, tmp_path: Path) -> None:
    _, model = models(case, tmp_path)
    point = linearise(model, HERE)
    assert point is not None
    np.testing.assert_allclose(predict(model, [point], Z), of_the_command(model, Z), atol=1e-12)


def test_what_an_effect_changes_is_the_word_of_the_built_in_engine(case: Case, tmp_path: Path) -> None:
    own, model = models(case, tmp_path)
    points = linearise(own, HERE), linearise(model, HERE)
    assert points[0] is not None
    assert points[1] is not None
    cause = [cause_of(case, wind(own), {})]
    np.testing.assert_allclose(responses(model, points[1], cause), responses(own, points[0], cause), atol=1e-12)


def test_effects_are_added_to_the_predictions_of_the_command(case: Case, tmp_path: Path) -> None:
    """At a place and by runs; of no size they change nothing."""
    own, model = (replace(one, case=with_effect(case, wind(one), {})) for one in models(case, tmp_path))
    bare, _ = models(case, tmp_path)
    for size in (0.0, 1.5):
        z = np.append(HERE, size)
        point, inside, without = linearise(model, z), linearise(own, z), linearise(bare, HERE)
        assert point is not None
        assert inside is not None
        assert without is not None
        added = inside.prediction - without.prediction
        assert (np.abs(added).max() > 1e-4) == (size > 0)
        wanted = of_the_command(bare, HERE[None])[0] + added
        np.testing.assert_allclose(point.prediction, wanted, atol=1e-6)
        np.testing.assert_allclose(predict(model, [point], z[None])[0], wanted, atol=1e-5)


@pytest.mark.slow
def test_an_ensemble_of_a_child_holds_the_effect(case: Case, tmp_path: Path) -> None:
    child = vegglue.extend(case, ["wind"])
    assert child.engine == case.engine
    found = vegglue.simulate(child, runs=tmp_path / "runs", jobs=1)
    n, phi, speed = (found.parameters[name][:, None] for name in child.parameters)
    x = found.station["x"].to_numpy(float)
    added = found.prediction - (0.2 / n**0.5 - 0.05 * phi**0.2 + x / 1000)
    assert found.by_command
    assert np.corrcoef(added.mean(axis=1), speed[:, 0] * np.abs(speed[:, 0]))[0, 1] > 0.8


def test_a_station_the_command_knows_nothing_of_is_the_built_in_engines(case: Case, tmp_path: Path) -> None:
    own, model = models(case, tmp_path)
    elsewhere = own.station.assign(x=own.station["x"] + 0.25)
    points = [linearise(replace(one, station=elsewhere), HERE) for one in (own, model)]
    assert points[0] is not None
    assert points[1] is not None
    np.testing.assert_array_equal(points[0].prediction, points[1].prediction)


def test_on_larger_cells_it_is_corrected_alike(case: Case, tmp_path: Path) -> None:
    own, model = models(case, tmp_path)
    fine = [linearise(one, HERE) for one in (own, model)]
    wide = [linearise(one, HERE) for one in (coarser(own), coarser(model)) if one is not None]
    assert len(wide) == 2
    (a, b), (c, d) = ([one.prediction for one in pair if one is not None] for pair in (fine, wide))
    np.testing.assert_allclose(d - c, b - a, atol=1e-12)


@pytest.mark.slow
def test_the_place_is_where_the_command_fits_best(case: Case, tmp_path: Path) -> None:
    """The measurements are those of the command at a place that the built-in engine would put elsewhere."""
    own = model_of(case, read_observations(case))
    wanted = of_the_command(own, np.array([[1.0, 0.4]]))[0]
    found = command_place(
        command_runs(case, tmp_path), replace(own, station=own.station.assign(value=wanted)), watch=silent
    )
    assert found.settled
    left = wanted - of_the_command(own, found.z[None])[0]
    assert np.abs(left).max() < 0.02


@pytest.mark.slow
def test_the_place_is_kept_for_the_next_verb(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = model_of(case, read_observations(case))
    first = linearise(with_command(own, tmp_path, watch=silent), HERE)
    monkeypatch.setattr("vegglue.workflow.command_model.command_place", None)
    monkeypatch.setattr("vegglue.engine.command.run_command_once", None)
    again = linearise(with_command(own, tmp_path, watch=silent), HERE)
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.prediction, again.prediction)


@pytest.mark.slow
def test_a_start_that_fails_is_left_for_another(tmp_path: Path) -> None:
    picky = f"{SMOOTH}\nif abs(n - 0.06) < 0.005: raise SystemExit('dry')\n"
    case = commanded(tmp_path, picky, "", COARSE, SMALL, WITH_ERROR)
    own = model_of(case, read_observations(case))
    assert command_place(command_runs(case, tmp_path), own, watch=silent).model.engine.name == "command"


def test_a_parameter_without_slope_is_named(tmp_path: Path) -> None:
    picky = f"{SMOOTH}\nif abs(phi - 10) > 0.01: raise SystemExit('dry')\n"
    case = commanded(tmp_path, picky, "", COARSE, SMALL, WITH_ERROR)
    own = model_of(case, read_observations(case))
    with pytest.raises(InputError, match=r"failed on both sides of its best place for phi.*its last line: dry"):
        correction_at(command_runs(case, tmp_path), own, np.zeros(2), watch=silent)


def test_a_slope_may_be_of_one_side(tmp_path: Path) -> None:
    picky = f"{SMOOTH}\nif phi > 10.01: raise SystemExit('dry')\n"
    case = commanded(tmp_path, picky, "", COARSE, SMALL, WITH_ERROR)
    own = model_of(case, read_observations(case))
    runs = command_runs(case, tmp_path)
    point = linearise(
        replace(own, engine=corrected(correction_at(runs, own, np.zeros(2), watch=silent), runs, watch=silent)),
        np.zeros(2),
    )
    assert point is not None
    steps = 1e-4 * np.eye(2)
    slope = (of_the_command(own, steps) - of_the_command(own, -steps)).T / 2e-4
    np.testing.assert_allclose(point.slope, slope, rtol=0.05)


def test_measurements_for_validation_are_predicted_by_the_command(tmp_path: Path) -> None:
    """In their own experiment and at their own stations, corrected at the place of the calibration."""
    (tmp_path / "unseen.csv").write_text("section,x,y,u\nbelow,20,0.5,0.4\nbelow,20,1.0,0.4\n", encoding="utf-8")
    flow, file = "{May: {discharge: 1.5, level: 0.9}}", "{kind: velocity, file: unseen.csv, experiment: May}"
    unseen = f"validation: {{experiments: {flow}, observations: [{file}]}}\nsimulate:"
    case = commanded(tmp_path, SMOOTH, "", COARSE, SMALL, WITH_ERROR, ("simulate:", unseen))
    run = CaseRun(case, tmp_path / "runs")
    found = {"z": HERE.tolist(), "settled": True, "places": 1, "run": [HERE.tolist()], "failed": 0}
    place = {"config_hash": case_hash(case)} | found
    (run.folder / "engine").mkdir(parents=True)
    (run.folder / "engine" / "place.json").write_text(json.dumps(place), encoding="utf-8")
    model = run.validation_model
    assert model is not None
    point = linearise(model, HERE)
    assert point is not None
    np.testing.assert_allclose(point.prediction, of_the_command(model, HERE[None])[0], atol=1e-12)


ANOTHER = '{"config_hash": "x", "z": [0, 0], "settled": true, "places": 1, "run": [[0, 0]], "failed": 0}'


@pytest.mark.parametrize("text", ["", "{}", ANOTHER])
def test_a_place_that_is_damaged_or_another_is_not_taken(tmp_path: Path, text: str) -> None:
    (tmp_path / "place.json").write_text(text, encoding="utf-8")
    assert kept_place(tmp_path / "place.json", "y", 2) is None


@pytest.mark.parametrize(("noise", "step", "rough"), [(0.0, 0.1, ()), (0.0, 1.0, ()), (0.5, 0.1, ("n_b", "phi"))])
def test_slopes_of_a_code_that_does_not_rest_are_told_to_be_rough(
    tmp_path: Path, noise: float, step: float, rough: tuple[str, ...]
) -> None:
    """Its predictions move by more than the step moves them; a smooth code is not blamed, nor at the largest step."""
    restless = SMOOTH.replace("/ 1000!r}", f"/ 1000 + {noise} * math.sin(1e6 * n * phi * float(row['x']))!r}}")
    case = commanded(tmp_path, f"import math\n{restless}", f", step: {step}", COARSE, SMALL)
    own = model_of(case, read_observations(case))
    assert correction_at(command_runs(case, tmp_path), own, HERE, watch=silent).rough == rough


@pytest.mark.parametrize(
    ("times", "sign", "unit"), [("100 * (", False, True), ("-(", True, False), ("(", False, False)]
)
def test_velocities_of_another_unit_or_sign_are_noticed(tmp_path: Path, times: str, sign: bool, unit: bool) -> None:
    program = SMOOTH.replace("{0.2 / n**0.5 - 0.05 * phi**0.2 + float(row['x']) / 1000!r}",
                             f"{{{times}0.2 / n**0.5 - 0.05 * phi**0.2 + float(row['x']) / 1000)!r}}")  # fmt: skip
    case = commanded(tmp_path, program, "", COARSE, SMALL, WITH_ERROR)
    tried = command_tried(model_of(case, read_observations(case)), tmp_path)
    assert [(one.opposite, one.of_another_unit) for one in tried.kinds] == [(sign, unit)]
    assert sentence(tried)


def test_what_cannot_be_compared_has_no_distance() -> None:
    error = np.array([0.1, np.nan])
    point = Point(np.zeros(1), np.array([0.4, 0.4]), np.zeros((2, 1)), {})
    none = cast(Any, None)
    correction = Correction((), np.zeros(0), none, np.zeros(2), np.zeros((2, 0)))
    place = CommandPlace(none, np.zeros(1), True, 1, correction, np.zeros((1, 1)), 0)
    off = command_compared(place, 1, np.array([0.5, 9.0]), "", point, error)
    assert (off.errors, off.careful) == (pytest.approx(1.0), True)
    for failure, linear in (("it ended with code 1.", point), ("", None)):
        unknown = command_compared(place, 1, np.full(2, np.nan), failure, linear, error)
        assert np.isnan(unknown.errors)
        assert unknown.failure == failure.removesuffix(".")
