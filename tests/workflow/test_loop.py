"""The loop through the command line: a folder becomes a case, a case a child, a hidden effect a name."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reach import said_to, vegglue

from vegglue.calibration.fit import fit
from vegglue.calibration.noise import noise_of
from vegglue.case.config import load_case
from vegglue.case.parameter_space import theta_at
from vegglue.diagnosis.child_config import candidate_named
from vegglue.engine.interface import linearise
from vegglue.engine.model import coarser, model_of
from vegglue.engine.newton import predict_near
from vegglue.measurements.observations import read_observations
from vegglue.screening.candidates import at_work, candidates_of, with_effect
from vegglue.workflow.loop import write_child

ROOT = Path(__file__).parents[2]
SITE: dict[str, Any] = {
    "channel": {"length_m": 40.0, "bottom_width_m": 3.0, "bank_slope_v_per_h": 0.6667, "bed_slope": 0.001},
    "patches": [{"x": [16, 20], "y": [0, 1.5], "stems_per_m2": 20}, {"x": [26, 30], "y": [-1.5, 0]}],
    "canopy_height_guess_m": 0.6,
    "experiments": {"low": {"discharge_m3_s": 1.2, "downstream_level_m": 0.7}},
    "holdout": {"high": {"discharge_m3_s": 2.0, "downstream_level_m": 0.9}},
}


def field_folder(folder: Path, **changes: Any) -> Path:
    """What a field team would hand over."""
    folder.mkdir()
    (folder / "site.json").write_text(json.dumps(SITE | changes), encoding="utf-8")
    (folder / "velocities.csv").write_text("experiment,section,x,y,u,u_se\nlow,A,12,0.5,0.45,0.01\n", encoding="utf-8")
    (folder / "levels.csv").write_text("experiment,x,y,level,level_se\nlow,10,0,0.74,0.002\n", encoding="utf-8")
    (folder / "holdout.csv").write_text("experiment,section,x,y,u\nhigh,A,12,0.5,0.6\n", encoding="utf-8")
    return folder


@pytest.mark.slow
def test_a_folder_becomes_a_case(tmp_path: Path) -> None:
    said = vegglue(tmp_path, "import", field_folder(tmp_path / "Mill Brook"), "--to", "mill.yaml").stdout
    case = load_case(tmp_path / "mill.yaml")
    assert "vegglue run mill.yaml" in said
    assert case.name == "mill-brook"
    assert set(case.parameters) == {"n_b", "k_s", "phi", "canopy_height"}
    assert [patch.stems for patch in case.plants.patches] == [20.0, 1.0]
    assert case.plants.stands["plants"].stems == 20.0
    assert case.grid.cell[1] == pytest.approx(3.0 / 16)
    assert case.grid.y[1] > 1.5 + 0.75 / 0.6667, "the banks reach above the water"
    assert case.validation is not None
    assert list(case.validation.experiments) == ["high"]
    table = read_observations(case).table
    assert table["kind"].tolist() == ["velocity", "level"]
    assert linearise(model_of(case, read_observations(case)), np.zeros(4)) is not None, "water flows in it"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"channel": {"length_m": 40.0}}, "`channel.bottom_width_m` is missing"),
        ({"experiments": {}}, "`experiments` expected one or more"),
        (
            {"experiments": {"low": {"discharge_m3_s": "much", "downstream_level_m": 1}}},
            "expected a number, got 'much'",
        ),
    ],
)
def test_a_folder_that_says_too_little_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    changes: dict[str, Any],
    said: str,
) -> None:
    folder = field_folder(tmp_path / "site", **changes)
    code, error = said_to(monkeypatch, capsys, "import", folder, "--to", tmp_path / "site.yaml")
    assert code == 2
    assert said in error
    assert len(error.strip().splitlines()) == 1


def test_a_child_says_what_it_adds_and_reads_back(tmp_path: Path) -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    station = read_observations(case).table
    added = [(candidate_named(case, station, "discharge_error[high]"), {})]
    child = write_child(case, tmp_path / "child.yaml", added)
    assert child.name == "twin-discharge_error_high"
    assert child.effects["discharge_error_high"].experiments == ("high",)
    assert set(child.parameters) - set(case.parameters) == {"discharge_error_high_relative_error"}
    assert child.observations == case.observations


def test_an_entry_of_a_case_says_which_candidate_it_was() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    station = read_observations(case).table
    every = candidates_of(case, station)
    assert {one.effect.each for one in every} >= {"case", "experiment", "section"}
    for one in every:
        assert at_work(with_effect(case, one, {})) == {one.key: one}
        assert candidate_named(case, station, one.name) == one


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--add", "streamlning"), "did you mean `streamlining`?"),
        (("--add", "discharge_error[none]"), "acts nowhere"),
        (("--add", "streamlining", "--shape", "width=2"), "`width` is no shape"),
        ((), "either --auto or --add"),
    ],
)
def test_what_cannot_be_added_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    said: str,
) -> None:
    code, error = said_to(monkeypatch, capsys, "extend", ROOT / "configs" / "twin.yaml", *arguments, "--runs", tmp_path)
    assert code == 2
    assert said in error


def test_slopes_are_those_of_solved_members() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    model = model_of(case, read_observations(case))
    z = np.array([0.3, -0.2, 0.5, 0.1])
    point = linearise(model, z)
    assert point is not None
    steps = 0.01 * np.eye(4)
    measured = (predict_near(model, point, z + steps) - predict_near(model, point, z - steps)) / 0.02
    assert point.slope == pytest.approx(measured.T, abs=2e-4)


def test_a_point_leads_to_one_on_narrower_cells() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    model = model_of(case, read_observations(case))
    coarse = coarser(model)
    assert coarse is not None
    assert coarse.site.bed.shape == (model.site.bed.shape[0], model.site.bed.shape[1] // 2), "long cells become wider"
    z = np.array([0.3, -0.2, 0.5, 0.1])
    cold, near = linearise(model, z), linearise(coarse, z)
    assert cold is not None
    assert near is not None
    warm = linearise(model, z, near)
    assert warm is not None
    assert warm.prediction == pytest.approx(cold.prediction, abs=1e-6)


def test_a_fit_finds_the_place_the_measurements_were_made_at() -> None:
    case = load_case(ROOT / "configs" / "twin.yaml")
    model = model_of(case, read_observations(case))
    truth = linearise(model, np.array([0.4, -0.3, 0.2, -0.5]))
    assert truth is not None
    exact = model.station.assign(value=truth.prediction)
    made = replace(model, station=exact)
    start = linearise(made, np.zeros(4))
    assert start is not None
    fitted = fit(made, noise_of(exact), start)
    # The prior pulls towards zero, by less than its share of what is known.
    assert np.abs(fitted.point.z - truth.z).max() < 3.0 * np.sqrt(np.diag(fitted.covariance)).max()
    assert fitted.chi2 < 1.0
    assert theta_at(case, fitted.point.z)["n_b"] == pytest.approx(theta_at(case, truth.z)["n_b"], rel=0.02)


@pytest.mark.slow
def test_a_hidden_effect_is_named_added_and_the_error_falls(tmp_path: Path) -> None:
    config = ROOT / "configs" / "twin.yaml"
    vegglue(tmp_path, "twin", config, "--hide", "discharge_error[high]", "--snr", "10", "--seed", "3", "--to", "hidden")
    said = json.loads(vegglue(tmp_path, "diagnose", "hidden/hidden.yaml", "--json").stdout)
    assert said["verdict"] in ("identified", "one-of")
    assert "discharge_error[high]" in said["set"]
    accused = next(one for one in said["effects"] if one["name"] == "discharge_error[high]")
    assert accused["p_family"] < 0.01
    vegglue(tmp_path, "extend", "hidden/hidden.yaml", "--auto")
    child = next((tmp_path / "hidden").glob("hidden+*.yaml"))
    rungs = json.loads(vegglue(tmp_path, "compare", "hidden/hidden.yaml", child, "--json").stdout)["rungs"]
    assert rungs[1]["held_out_sections"] < rungs[0]["held_out_sections"]
    assert rungs[1]["chi2"] < 0.8 * rungs[0]["chi2"]


@pytest.mark.slow
def test_one_command_goes_the_whole_way_and_is_not_repeated(tmp_path: Path) -> None:
    config = ROOT / "configs" / "twin.yaml"
    vegglue(tmp_path, "twin", config, "--hide", "discharge_error[high]", "--snr", "10", "--seed", "3", "--to", "hidden")
    small = tmp_path / "hidden" / "small.yaml"
    told = "extends: hidden.yaml\nname: small\nsimulate: {members: 16}\ninfer: {method: glue}\n"
    small.write_text(told, encoding="utf-8")
    said = vegglue(tmp_path, "run", "hidden/small.yaml").stdout
    assert "discharge_error[high] of -0.0" in said, "names in brackets are no markup"
    child = "small-discharge_error_high"
    for folder in ("small", child):
        made = {path.name for path in (tmp_path / "runs" / folder).iterdir()}
        assert made >= {"ensemble.h5", "posterior.h5", "report.html"}
    assert (tmp_path / "runs" / child / "ladder.png").exists()
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("*.h5")}
    again = vegglue(tmp_path, "run", "hidden/small.yaml").stdout
    assert "up to date" in again
    assert before == {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("*.h5")}
