"""Twins: hidden effects are as visible as asked, errors as stated, and the answer stays sealed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnoses import a_candidate_effect, a_diagnosis, an_anomaly, candidate_laws_of
from reach import Say

from vegglue.calibration.candidates import cause_of, with_effect
from vegglue.calibration.noise import noise_of, with_grid_error
from vegglue.calibration.score_test import project
from vegglue.case.config import load_case
from vegglue.case.resolved_config import case_hash, resolved_yaml
from vegglue.cli.main import main
from vegglue.diagnosis.child_config import candidate_named
from vegglue.engine.interface import Cause, responses
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.results.causes import Step
from vegglue.results.result_files import write_diagnosis
from vegglue.wording.sentences import sentence
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.hidden_effect import Answer, Hidden, TwinBase, errors_named, measured_twin, true_place, twin_base
from vegglue.workflow.twin import (
    Mark,
    NothingHidden,
    TrueParameters,
    compared_with_truth,
    config_in,
    in_rows_of_twin,
    marks,
    opened_answer,
    sealed_answer,
    write_twin,
)

pytestmark = pytest.mark.slow

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"


@pytest.fixture(scope="module")
def ground() -> TwinBase:
    model = CaseRun(load_case(CONFIG)).model
    return twin_base(model, true_place(len(model.names), 3))


def test_errors_by_name() -> None:
    assert errors_named("white") == (0.0, 1.0)
    assert errors_named("ar1:0.5") == (0.5, 1.0)
    assert errors_named("understated:1.5") == (0.0, 1.5)
    for wrong in ("pink", "ar1", "ar1:1.2", "understated:0.5", "white:1", "ar1:x"):
        with pytest.raises(InputError, match="--noise"):
            errors_named(wrong)


def test_true_parameters_lie_off_the_centre_and_follow_the_seed() -> None:
    places = np.array([true_place(4, seed) for seed in range(50)])
    assert (np.abs(places) >= 0.3).all()
    assert (np.abs(places) <= 1.0).all()
    assert abs(places.mean()) < 0.2, "on both sides"
    assert (true_place(4, 7) == true_place(4, 7)).all()


def test_the_truth_is_computed_on_other_cells(ground: TwinBase) -> None:
    assert ground.fine.site.bed.shape == (96, 60)
    assert ground.model.site.bed.shape == (64, 40)
    difference = ground.there.prediction - ground.here.prediction
    assert 1e-4 < np.sqrt(np.mean(difference**2)) < 0.01


@pytest.mark.parametrize(
    ("noise", "correlation", "size"), [("white", 0.0, 1.0), ("ar1:0.6", 0.6, 1.0), ("understated:2", 0.0, 2.0)]
)
def test_errors_are_as_stated(ground: TwinBase, noise: str, correlation: float, size: float) -> None:
    """Over 60 seeds: 4,860 velocities and their neighbours along a section."""
    errors = []
    for seed in range(60):
        station, answer = measured_twin(ground, ["nothing"], 6.0, noise, seed)
        assert answer.hidden == ()
        errors.append((station["value"] - ground.there.prediction) / station["standard_error"])
    velocity = (station["kind"] == "velocity").to_numpy()
    drawn = np.array(errors)[:, velocity].reshape(60, -1, 9)
    assert drawn.std() == pytest.approx(size, rel=0.04)
    assert np.mean(drawn[..., 1:] * drawn[..., :-1]) / size**2 == pytest.approx(correlation, abs=0.05)


@pytest.mark.parametrize("name", ["discharge_error[high]", "viscosity", "station_shift[B]", "smagorinsky"])
@pytest.mark.parametrize("snr", [3.0, 6.0])
def test_an_effect_is_as_visible_as_asked(ground: TwinBase, name: str, snr: float) -> None:
    _, answer = measured_twin(ground, [name], snr, "white", 4)
    (hidden,) = answer.hidden
    assert hidden.name == name
    assert hidden.signal == pytest.approx(snr, rel=0.1)


def test_a_linear_effect_has_the_size_of_its_fingerprint(ground: TwinBase) -> None:
    """a = snr / |S_perp|, S from the exact tangent instead of the two flows that `twin` compares."""
    _, answer = measured_twin(ground, ["discharge_error[mid]"], 3.0, "white", 4)
    candidate = candidate_named(ground.model.case, ground.model.station, "discharge_error[mid]")
    case = with_effect(ground.model.case, candidate, {})
    trace = responses(ground.model, ground.here, [Cause(case, candidate.parameter, candidate.effect.amplitude)])
    noise = with_grid_error(noise_of(ground.model.station), ground.difference)
    white, slopes = noise.whiten(noise.used(trace)), noise.whiten(noise.used(ground.here.slope))
    length = project(slopes, white[:, 0], np.zeros(4), white).length[0]
    assert abs(answer.hidden[0].amplitude) == pytest.approx(3.0 / length, rel=0.05)


def test_a_size_that_is_given_is_kept(ground: TwinBase) -> None:
    station, answer = measured_twin(ground, ["gauge_datum=0.4", "bad_probe=-8"], 6.0, "white", 4)
    level = (station["kind"] == "level").to_numpy()
    above = (station["value"] - ground.there.prediction).to_numpy()
    assert above[level] == pytest.approx(0.4, abs=0.015)
    assert [one.name for one in answer.hidden] == ["gauge_datum", "bad_probe"]
    row = answer.hidden[1].station
    assert above[row] / station["standard_error"][row] == pytest.approx(-8.0, abs=4.0)


@pytest.mark.parametrize(("patch", "number"), [("p1", 1.0), ("p2", 2.0)])
def test_a_patch_that_is_named_is_the_one_that_hides_it(ground: TwinBase, patch: str, number: float) -> None:
    station, answer = measured_twin(ground, [f"patch_density[{patch}]=2"], 6.0, "white", 4)
    (hidden,) = answer.hidden
    assert (hidden.name, hidden.shapes) == (f"patch_density[{patch}]", {"patch": number})
    candidate = candidate_named(ground.model.case, station, hidden.name)
    trace = responses(ground.model, ground.here, [cause_of(ground.model.case, candidate, {})])[:, 0]
    changed = (station["value"] - ground.there.prediction).to_numpy()
    assert np.corrcoef(trace, changed)[0, 1] > 0.5, "the change is that of the patch"


def test_something_unlisted_at_a_named_place_stands_there(ground: TwinBase) -> None:
    _, answer = measured_twin(ground, ["unlisted_object[x15,y0.5]"], 6.0, "white", 4)
    (hidden,) = answer.hidden
    assert hidden.shapes == {"x": 15.0, "y": 0.5, "length": 0.45, "width": 0.45}, "0.3 half widths of the floor"
    assert hidden.signal == pytest.approx(6.0, rel=0.1)


def test_the_seed_decides_everything(ground: TwinBase) -> None:
    first, again = (measured_twin(ground, ["?"], 6.0, "white", 5) for _ in range(2))
    assert first[0]["value"].tolist() == again[0]["value"].tolist()
    assert first[1] == again[1]
    assert len({measured_twin(ground, ["?"], 6.0, "white", seed)[1].hidden[0].name for seed in range(4)}) > 1


@pytest.mark.parametrize("name", ["pier", "jet", "sink", "fallen_tree", "scour_hole"])
def test_what_is_in_no_list_can_be_hidden(ground: TwinBase, name: str) -> None:
    _, answer = measured_twin(ground, [f"unlisted:{name}"], 6.0, "white", 2)
    (hidden,) = answer.hidden
    assert not hidden.listed
    assert hidden.signal == pytest.approx(6.0, rel=0.1)
    assert 0.0 < hidden.shapes["x"] < 32.0


@pytest.mark.parametrize(
    ("wanted", "named"),
    [("meander", "meander"), ("unlisted:whale", "whale"), ("wind=strong", "wind=strong"), ("wind", "plausible")],
)
def test_what_cannot_be_hidden_is_said(ground: TwinBase, wanted: str, named: str) -> None:
    with pytest.raises(InputError, match=named):
        measured_twin(ground, [wanted], 6.0, "white", 1)


def an_answer(*hidden: Hidden) -> Answer:
    return Answer(hidden, {"n_b": 0.03}, 0.5, 1.0, 9)


def test_a_seal_hides_and_opens(tmp_path: Path) -> None:
    answer = an_answer(Hidden("streamlining", -0.4, {"reference_speed": 0.3}, 5.9))
    path = tmp_path / "answer.sealed"
    path.write_text(sealed_answer(answer), encoding="utf-8")
    assert opened_answer(path) == answer
    assert "stream" not in path.read_text(encoding="utf-8")
    path.write_text(sealed_answer(answer)[:-20], encoding="utf-8")
    with pytest.raises(InputError, match="answer is damaged"):
        opened_answer(path)
    with pytest.raises(InputError, match="cannot be read"):
        opened_answer(tmp_path / "none")


def test_marks_of_every_kind() -> None:
    """In the set with its size, missed, found by its place, set aside."""
    found = a_diagnosis()
    effect, missed = Hidden("eddies", 0.3, {}, 6.0), Hidden("wind", 8.0, {}, 6.0)
    thing, probe = Hidden("unlisted:pier", 1.0, {"x": 33.0, "y": 0.4}, 6.0), Hidden("bad_probe", 9.0, {}, 0.0, 1)
    first, second, third, fourth = marks(an_answer(effect, missed, thing, probe), found)
    assert (first.inside, first.named, first.holds) == (True, False, True)
    assert not second.inside
    assert third.away == pytest.approx(1.0)
    assert not third.found, "the verdict was one-of"
    assert fourth.found, "row 1 is flagged"
    step = Step("eddies", ("eddies",), (1.0,), (("eddies",),), 9.0, 1.0, 0.0)
    alone = a_diagnosis(verdict={"kind": "identified"}, steps=(step,))
    assert marks(an_answer(effect), alone)[0].named
    beside = replace(effect, amplitude=2.0)
    assert marks(an_answer(beside), alone)[0].holds is False
    location = an_anomaly(x=30.0, y=0.4)
    nowhere = a_diagnosis(verdict={"kind": "none-of-these", "places": (location,)})
    assert marks(an_answer(thing), nowhere)[0].found


def test_what_reveal_compares() -> None:
    effect = Hidden("eddies", 0.3, {}, 6.0)
    truth, mark = compared_with_truth(an_answer(effect), a_diagnosis())
    assert truth == TrueParameters({"n_b": 0.03}, 1.0, 0.5)
    assert isinstance(mark, Mark)
    assert mark.holds
    assert compared_with_truth(an_answer(), None)[1] == NothingHidden("")
    assert marks(an_answer(effect), None)[0].verdict == ""
    silent = a_diagnosis(verdict={"kind": "nothing-missing"}, candidate_effects=(a_candidate_effect("wind"),), steps=())
    assert compared_with_truth(an_answer(), silent)[1] == NothingHidden("nothing-missing")
    assert not marks(an_answer(effect), silent)[0].inside
    wide, alike = (Hidden("mixing[D3]", 0.3, {"width": width}, 6.0) for width in (0.6, 0.101))
    assert marks(an_answer(wide), a_diagnosis())[0].shapes == (("width", 0.1, 0.6),)
    assert marks(an_answer(alike), a_diagnosis())[0].shapes == ()
    assert all(sentence(one) for one in compared_with_truth(an_answer(effect, wide), a_diagnosis()))


def test_a_hidden_law_is_told_by_its_term_and_quantity() -> None:
    """Its form is not asked for: those of one quantity leave traces that hardly differ."""
    told = replace(a_diagnosis(steps=()), laws=candidate_laws_of("law_bank_speed_step"))
    ramp, other = (Hidden(name, 0.3, {}, 6.0) for name in ("law_bank_speed_ramp", "law_floor_speed_ramp"))
    assert [one.found for one in marks(an_answer(ramp, other), told)] == [True, False]


def test_the_folder_of_a_twin(ground: TwinBase, tmp_path: Path) -> None:
    """Its config runs as it is, and its measurements are the ones made, to the last digit written."""
    station, answer = measured_twin(ground, ["viscosity"], 6.0, "white", 1)
    target = write_twin(ground.model.case, tmp_path / "Riddle 1", station, sealed_answer(answer))
    assert config_in(tmp_path / "Riddle 1") == target
    assert all(observation.synthetic for observation in load_case(target).observations)
    target.with_name("riddle-1+viscosity.yaml").touch()
    assert config_in(tmp_path / "Riddle 1") == target, "beside a child that `run` has written"
    model = CaseRun(load_case(target)).model
    assert model.case.name == "riddle-1"
    assert model.station["value"].to_numpy() == pytest.approx(station["value"].to_numpy(), abs=6e-6)
    assert model.names == ground.model.names
    with pytest.raises(InputError, match="expected one config"):
        config_in(tmp_path)


def test_a_bad_probe_is_named_by_its_row_in_the_twin(tmp_path: Path) -> None:
    """It was that of the case, whose gauges may come first, and some of whose stations may not be in use."""
    case = load_case(CONFIG)
    table = read_observations(case).table.iloc[::-1].reset_index(drop=True)
    station = table.assign(used=table.index != 20, value=np.arange(len(table)) / 100.0)
    answer = in_rows_of_twin(an_answer(Hidden("wind", 8.0, {}, 6.0), Hidden("bad_probe", 9.0, {}, 0.0, 40)), station)
    twin = load_case(write_twin(case, tmp_path / "riddle", station, sealed_answer(answer)))
    wind, probe = answer.hidden
    assert wind.station == -1
    assert read_observations(twin).table["value"][probe.station] == pytest.approx(station["value"][40])
    assert probe.station != 40


def test_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, say: Say, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert say("twin", CONFIG, "--hide", "gauge_datum=0.1", "--seed", 2, "--to", "play") == (
        0,
        "",
    )
    assert say("twin", CONFIG, "--hide", "meander", "--to", "other")[0] == 2
    monkeypatch.setattr("sys.argv", ["vegglue", "reveal", "play"])
    case = load_case(tmp_path / "play" / "play.yaml")
    steps = (Step("gauge_datum", ("gauge_datum",), (1.0,), (("gauge_datum",),), 900.0, 90.0, 0.0),)
    suspect = a_candidate_effect("gauge_datum", amplitude={"value": 0.1, "interval95": (0.09, 0.11)})
    (tmp_path / "runs" / "play").mkdir(parents=True)
    found = a_diagnosis(verdict={"kind": "identified"}, steps=steps, candidate_effects=(suspect,))
    write_diagnosis(tmp_path / "runs" / "play" / "diagnosis.h5", found, resolved_yaml(case), case_hash(case))

    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code in (0, None)
    said = capsys.readouterr().out
    assert "gauge_datum of 0.1" in said
    assert "named alone; the interval holds" in said
