"""Data sets of the blind study: what is hidden in them, and what is true of their sites."""

import json

import numpy as np
import pytest
from blind import SIZES, planned_trials, records_in, study, truth_of
from blind_sets import Trial, data_set, hash_of, model_of, unseen_stations
from blind_truth import PROBE, perfect_site, site_of_nature
from second_channel import SHORT
from second_solver import Flow
from site_reach import Truth, bed_level, reach_of

from vegglue.calibration.candidates import candidates_of

pytestmark = pytest.mark.slow

THETA = {"n_b": 0.03, "k_s": 0.5, "phi": 2.0, "canopy_height": 0.7, "eddy_viscosity": 0.008}


def trial(group, hide=(), truth="own", signal=6.0, noise="white", number=0):
    return Trial(truth, "twin", group, number, hide, signal, noise, imperfect=False)


def test_every_data_set_is_planned_once_and_all_kinds_begin_early():
    trials = planned_trials()
    assert len({one.key for one in trials}) == len(trials) == sum(sum(sizes.values()) for sizes in SIZES.values())
    assert {one.group for one in trials[: len(trials) // 10]} == {one.group for one in trials}
    assert all(one.imperfect == (one.truth == "second" and one.group != "null-perfect") for one in trials)
    assert all(bool(one.hide) != one.group.startswith("null") for one in trials)


def test_a_perfect_site_is_as_configured_and_one_of_nature_is_not():
    case = model_of("twin").case
    perfect = perfect_site(case, "twin", THETA, 500)
    nature, again, other = (site_of_nature(perfect, case, seed) for seed in (3, 3, 4))
    assert repr(nature) == repr(again) != repr(other)
    assert not perfect.also_true
    assert not perfect.shifts.any()
    assert nature.shifts.std() == pytest.approx(PROBE, rel=0.1)
    assert 0.005 <= nature.truth.nu <= 0.025
    assert all(abs(factor - 1.0) < 0.05 for factor in nature.discharges.values())
    x, y = np.linspace(0, 32, 200)[:, None], np.linspace(-3, 3, 60)[None, :]
    assert (bed_level(x, y, nature.truth) - bed_level(x, y, perfect.truth)).std() == pytest.approx(0.01, rel=0.3)
    (moved, _), (mapped, _) = nature.truth.planted.patches[0], perfect.truth.planted.patches[0]
    assert 0.0 < abs(moved[0] - mapped[0]) <= 0.1


def test_names_of_imperfections_are_those_that_are_there():
    case = model_of("twin").case
    for seed in range(20):
        site = site_of_nature(perfect_site(case, "twin", THETA, 10), case, seed)
        off = site.truth.nu / 0.01 - 1.0
        assert "elder" not in site.also_true, "another law of mixing is not what is off"
        assert site.also_true.get("viscosity", 0.0) == (pytest.approx(off) if abs(off) > 0.2 else 0.0)
        for name, factor in site.discharges.items():
            assert (f"discharge_error[{name}]" in site.also_true) == (abs(factor - 1.0) > 0.004)
        assert ("emergent_part" in site.also_true) == bool(site.truth.formulation.emergent)
        own = site_of_nature(perfect_site(case, "twin", THETA, 10), case, seed, ("viscosity", "discharge_error[low]"))
        assert own.truth.nu == 0.01, "what is hidden is no imperfection besides"
        assert set(own.discharges.values()) == {1.0}
        assert own.truth.stems == site.truth.stems


@pytest.mark.parametrize("case", ["twin", "campaign"])
def test_as_many_effects_are_hidden_as_there_are_sets_for(case):
    model = model_of(case)
    count = len(candidates_of(model.case, model.station))
    hidden = {
        one.hide for one in planned_trials() if one.case == case and one.truth == "second" and one.group == "listed6"
    }
    assert len(hidden) == min(count, SIZES["second", case]["listed6"])


def test_a_wider_patch_resists_more():
    """By a tenth of a cell on one side: the strip has its share of the plants."""
    flow, drags = Flow(*(np.full((64, 40), value) for value in (0.9, 0.5, 0.0))), []
    for side in (0.0, 0.02, 0.05):
        edges = (((8.0, 12.0 + side), (-1.5, side)), SHORT.patches[1])
        truth = Truth(0.03, 0.5, 2.0, 0.7, {}, stems=(1.0, 1.0), channel=SHORT, edges=edges)
        drags.append(reach_of(truth, (0.5, 0.1875), 0.9).closure(flow).drag.sum())
    assert drags[0] < drags[1] < drags[2]


def test_unseen_stations_stand_elsewhere():
    model = model_of("twin")
    unseen = unseen_stations(model)
    measured = set(model.station["x"])
    assert not measured & set(unseen["x"])
    assert unseen["x"].max() < model.case.grid.x[1]
    assert len(unseen) == (model.station["kind"] == "velocity").sum()


def test_errors_and_what_is_off_are_those_of_the_trial():
    clean, off, again = (data_set(trial("instrument", hide=("position",), signal=signal)) for signal in (0.0, 6.0, 6.0))
    difference = (off.model.station["value"] - clean.model.station["value"]).to_numpy()
    (hidden,) = off.hidden
    assert sorted(np.flatnonzero(np.abs(difference) > 1e-12)) == hidden["stations"]
    assert len(hidden["stations"]) == 3  # the same place in three experiments
    np.testing.assert_allclose(difference[hidden["stations"]], hidden["amplitude"])
    assert again.model.station.equals(off.model.station)


def test_a_seed_is_the_same_on_every_machine():
    assert hash_of("ab") == 97 * 256 + 98
    assert hash_of("second/twin/listed6/0") != hash_of("second/twin/listed6/1")


def test_the_record_of_a_data_set_holds_what_the_page_asks_for(tmp_path):
    hidden = trial("listed6", hide=("discharge_error[high]",))
    record = study(hidden, tmp_path)
    assert truth_of(hidden, tmp_path / "truths")["hidden"] == record["hidden"], "kept, and not made again"
    assert len(list((tmp_path / "truths").rglob("*.json"))) == 1
    path = tmp_path / "records.jsonl"
    other = json.dumps(record | {"edition": "an earlier one"})
    path.write_text(json.dumps(record) + "\n" + other + '\n{"key": "cut of', encoding="utf-8")
    (read,) = records_in(path)
    assert read["hidden"][0]["name"] == "discharge_error[high]"
    assert "discharge_error[high]" in read["set"]
    assert read["held_out"]["after"] < read["held_out"]["before"]
    assert read["held_out"]["kept_names"] == ["discharge_error[high]"]
    assert read["held_out"]["kept"] < read["held_out"]["parent"]
    assert read["held_out"]["oracle"] is not None
    assert read["amplitudes"][0]["low"] < read["amplitudes"][0]["true"] < read["amplitudes"][0]["high"]
