"""Files of sets with hidden effects, of flows that cost nothing."""

import json

import numpy as np
import pandas as pd
import pytest
import sites
from drawn_sites import KINDS, make_site
from second_solver import Flow
from site_reach import FINE, SETTINGS, Truth, centres, reach_of
from sites import make_set, truth_of


@pytest.fixture(autouse=True)
def _at_once(monkeypatch):
    """Instead of solving: level water that flows at 0.1 m/s for each m3/s."""

    def flow(truth, discharge, level):
        depth = np.maximum(level - reach_of(truth, FINE, level).z, 0.0)
        return Flow(depth, np.full(depth.shape, 0.1 * discharge), 0 * depth)

    monkeypatch.setattr(sites, "steady_flow", flow)


def made(folder, settings, nature=False):
    make_set(folder, 5, "something", settings, nature)
    tables = (pd.read_csv(folder / f"{name}.csv") for name in ("velocities", "levels", "holdout"))
    return (*tables, json.loads((folder / "answer.json").read_text(encoding="utf-8")))


def test_a_set_has_what_the_open_cases_have(tmp_path):
    velocities, levels, held, answer = made(tmp_path / "k", {})
    assert list(velocities) == ["experiment", "section", "x", "y", "u", "u_se"]
    assert set(velocities["section"]) == {"D0", "D3", "D5", "D7"}
    assert set(held["section"]) == {"D0", "D3", "D6", "D7", "D11"}
    assert list(levels["x"]) == [10.0, 30.0, 45.0, 60.0, 80.0] * 3
    np.testing.assert_allclose(held["u"], 0.33, atol=1e-9)
    spread = (velocities["u"] - velocities["experiment"].map({"low": 0.14, "mid": 0.266, "high": 0.4})).std()
    assert spread == pytest.approx(0.012, rel=0.2)
    site = json.loads((tmp_path / "k" / "site.json").read_text(encoding="utf-8"))
    assert site["canopy_height_guess_m"] == pytest.approx(answer["truth"]["hd"], rel=0.12)
    assert "settings" not in site
    assert "truth" not in site


def test_instruments_err_where_they_should(tmp_path):
    velocities, levels, held, _ = made(tmp_path / "a", {})
    wrong, off, as_held, _ = made(tmp_path / "b", {"station": 0.9, "bias": -0.06, "gauge": 45.0, "shift": 0.02})
    np.testing.assert_allclose(wrong["u"] - velocities["u"], np.where(velocities["y"] == 0.9, -0.06, 0.0), atol=2e-4)
    np.testing.assert_allclose(off["level"] - levels["level"], np.where(levels["x"] == 45.0, 0.02, 0.0), atol=2e-4)
    pd.testing.assert_frame_equal(held, as_held)


def test_a_wrong_discharge_is_that_of_one_experiment(tmp_path):
    velocities, _, held, _ = made(tmp_path / "a", {})
    more, _, as_held, _ = made(tmp_path / "b", {"exp": "mid", "factor": 1.07})
    expected = np.where(velocities["experiment"] == "mid", 0.07 * 0.266, 0.0)
    np.testing.assert_allclose(more["u"] - velocities["u"], expected, atol=2e-4)
    pd.testing.assert_frame_equal(held, as_held)


def test_nature_is_small_and_stated(tmp_path):
    *_, answer = made(tmp_path / "k", {}, nature=True)
    small = answer["small imperfections"]
    assert 0.005 <= small["eddy_viscosity"] <= 0.025
    assert max(abs(value) for value in small["discharge"].values()) < 0.04
    truth = truth_of(5, {}, nature=True)
    error = reach_of(truth, FINE, 1.0).z - reach_of(Truth(0.04, 0.6, 3.0, 0.8, {}), FINE, 1.0).z
    assert error.std() == pytest.approx(0.01, rel=0.15)
    along, across = (
        np.corrcoef(error[:-8].ravel(), error[8:].ravel()),
        np.corrcoef(error[:, 3:-3][:, 3:].ravel(), error[:, 3:-3][:, :-3].ravel()),
    )
    assert 0.2 < along[0, 1] < 0.6
    assert 0.1 < across[0, 1] < 0.6


@pytest.mark.parametrize(
    ("settings", "field", "place"),
    [
        ({"pier": [27.0, 0.7, 2.5]}, "drag", (27.1, 0.7)),
        ({"seep": [14.0, 26.0, 2.0, 2.6, 0.12]}, "source", (20.1, 2.3)),
        ({"scour": [58.0, -0.5, 0.2, 1.5, 0.5]}, "z", (58.1, -0.5)),
        ({"banktrend": -0.025}, "drag", (0.1, 2.0)),
    ],
)
def test_what_is_hidden_is_where_it_is_said_to_be(settings, field, place):
    plain, hidden = (reach_of(Truth(0.04, 0.6, 3.0, 0.8, given), FINE, 1.0) for given in ({}, settings))
    still = Flow(*(np.ones(plain.z.shape) for _ in range(3)))
    fields = [reach.closure(still).drag if field == "drag" else getattr(reach, field) for reach in (plain, hidden)]
    change = np.abs(fields[1] - fields[0])
    x, y = (axis.ravel() for axis in centres(FINE, 1.0))
    here = change[np.abs(x - place[0]).argmin(), np.abs(y - place[1]).argmin()]
    assert here > 0.9 * change.max() > 0
    if field == "source":
        assert change.sum() * FINE[0] * FINE[1] == pytest.approx(0.12)


def test_a_setting_nobody_knows_is_refused(tmp_path):
    with pytest.raises(ValueError, match="expected some of"):
        make_set(tmp_path, 1, "none", {"wind": 1.0})
    assert "chi" in SETTINGS


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_seed_draws_can_be_hidden(kind):
    for seed in range(20):
        drawn = KINDS[kind](np.random.default_rng([seed, 3]))
        assert drawn.keys() <= SETTINGS.keys()
        assert drawn == KINDS[kind](np.random.default_rng([seed, 3]))
        json.dumps(drawn)


def test_kinds_follow_each_other_and_every_other_site_has_imperfections(tmp_path):
    for seed in (26, 27):
        make_site(tmp_path, seed)
    plain, real = (
        json.loads((tmp_path / f"site-{seed}" / "answer.json").read_text(encoding="utf-8")) for seed in (26, 27)
    )
    assert [plain["hidden"], real["hidden"]] == list(KINDS)[:2]
    assert ["small imperfections" in answer for answer in (plain, real)] == [False, True]
