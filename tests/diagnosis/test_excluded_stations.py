"""Stations that a diagnosis set aside are left out of every model that is compared afterwards."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnoses import a_diagnosis

from vegglue.calibration.baseline import Baseline
from vegglue.calibration.fit import MapEstimate, chi2, covariance, objective
from vegglue.calibration.noise import noise_of
from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash
from vegglue.cli.commands import compare_command
from vegglue.diagnosis.child_config import candidate_named
from vegglue.diagnosis.comparison import excluded_by, excluding, exclusion_in_words
from vegglue.engine.interface import Model, Point
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.result_files import write_diagnosis
from vegglue.workflow.case_run import CaseRun, excluded_in
from vegglue.workflow.extend import write_child

pytestmark = pytest.mark.slow

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"


@pytest.fixture(scope="module")
def model() -> Model:
    return CaseRun(load_case(CONFIG)).model


def flagging(model: Model, *rows: int) -> Diagnosis:
    nothing = np.full(len(model.station), np.nan)
    predictions = {"station": model.station, "first": nothing, "last": nothing, "error": nothing}
    return a_diagnosis(predictions=predictions, errors={"flagged": rows})


def test_flagged_measurements_are_not_used_and_all_others_are(model: Model) -> None:
    aside = excluded_by(flagging(model, 3, 20), flagging(model, 3))
    assert len(aside) == 2
    used = excluding(model, aside).station["used"]
    assert np.flatnonzero(model.station["used"] & ~used).tolist() == [3, 20]
    other = replace(model, station=model.station.assign(value=model.station["value"] + 0.1))
    assert excluding(other, aside).station["used"].equals(other.station["used"]), "measured again: another measurement"
    assert excluding(model, excluded_by()).station.equals(model.station)


def test_what_is_left_out_is_said(model: Model) -> None:
    station = model.station.iloc[3]
    assert f"at x = {station['x']:g}, y = {station['y']:g} m" in exclusion_in_words(excluded_by(flagging(model, 3)))
    assert exclusion_in_words(excluded_by()) == ""


def quickly(model: Model) -> Baseline:
    """A baseline without any flow: predictions are what was measured, a little off."""
    noise, size = noise_of(model.station), len(model.names)
    slope = 0.01 * np.random.default_rng(1).standard_normal((len(model.station), size))
    point = Point(np.zeros(size), model.station["value"].fillna(0.0).to_numpy() + 0.01, slope, {})
    fitted = MapEstimate(point, chi2(noise, point), objective(noise, point), covariance(noise, point))
    return Baseline(model, noise, fitted, None, None)


def test_compare_leaves_out_what_a_diagnosis_has_flagged(
    model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    case = load_case(CONFIG)
    added = [(candidate_named(case, model.station, "discharge_error[high]"), {})]
    child, runs = write_child(case, tmp_path / "child.yaml", added), tmp_path / "runs"
    monkeypatch.setattr("vegglue.workflow.case_run.kept_baseline", quickly)
    stations = int(model.station["used"].sum())
    for flagged, said in (((), 0), ((3, 20), 2)):
        found = flagging(model, *flagged)
        (runs / case.name).mkdir(parents=True, exist_ok=True)
        write_diagnosis(runs / case.name / "diagnosis.h5", found, "", case_hash(case))
        compare_command([CONFIG, child.source], runs=runs)
        assert ("left out of every model" in capsys.readouterr().out) == bool(flagged)
        compare_command([CONFIG, child.source], runs=runs, as_object=True)
        told = json.loads(capsys.readouterr().out)
        assert [score["stations"] for score in told["rungs"]] == [stations - said] * 2
        assert len(told["left_out"]) == said


def test_a_diagnosis_of_another_state_of_the_case_leaves_nothing_out(model: Model, tmp_path: Path) -> None:
    case = load_case(CONFIG)
    (tmp_path / case.name).mkdir()
    found = flagging(model, 3)
    write_diagnosis(tmp_path / case.name / "diagnosis.h5", found, "", "e" * 64)
    assert excluded_in(CaseRun(case, tmp_path)).empty
