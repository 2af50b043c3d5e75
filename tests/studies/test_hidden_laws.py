"""Laws hidden in the study of laws: which sets there are, and both codings of one law."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from blind_sets import model_of
from hidden_laws import BY_NAME, EFFECTS, HIDDEN_LAWS, RANGES, acting
from law_sets import LISTED, NOTHING, TIMES, held_out_stations, law_trials
from second_hidden_laws import LAW_DRAG, LAW_MIXING

from vegglue.calibration.candidates import candidates_of
from vegglue.effects.grammar import LAWS


def test_every_set_is_planned_once_and_all_kinds_begin_early() -> None:
    trials = law_trials()
    assert len({one.key for one in trials}) == len(trials) == TIMES * len(HIDDEN_LAWS) + NOTHING + len(LISTED)
    assert {one.group for one in trials[:12]} == {"law", "listed", "nothing"}
    assert {one.hide for one in trials if one.group == "law"} == set(BY_NAME)


def test_listed_effects_that_are_hidden_are_listed() -> None:
    model = model_of("twin")
    assert set(LISTED) <= {one.name for one in candidates_of(model.case, model.station)}


def test_hidden_laws_are_in_no_list_and_no_search() -> None:
    model = model_of("twin")
    known = {one.name for one in candidates_of(model.case, model.station)} | set(LAWS)
    assert not known & {effect.name for effect in EFFECTS}
    assert all("law" in effect.tags for effect in EFFECTS)
    assert {(law.term, name) for law in HIDDEN_LAWS for name in law.quantities} <= RANGES.keys()


@pytest.mark.parametrize("law", [law for law in HIDDEN_LAWS if law.quantity != "shear"], ids=lambda law: law.name)
def test_both_codings_of_a_law_agree(law) -> None:
    """On cells with the same water; of the shear each code takes its own differences."""
    random = np.random.default_rng(1)
    h, u, slope, k, nu = random.uniform(0.05, 1.2, (5, 6, 4, 1))
    x, y = np.linspace(0.5, 31.5, 6)[:, None], np.linspace(-2.9, 2.8, 4)[None, :]
    bank, cover = (np.abs(y) > 1.5) + 0.0 * x, ((x > 8.0) & (x < 12.0) & (y < 0.0) & (y > -1.5)).astype(float)
    front = np.where(cover > 0.0, x - 8.0, np.inf)
    edge = np.where((x > 8.0) & (x < 12.0), np.maximum(y, -1.5 - y), np.inf)
    there = {"bank": bank, "front": front, "edge": edge}
    geometry = SimpleNamespace(
        share_along=(x / 32.0 - 0.5)[..., None], offset=(y / 1.5)[..., None], planted=cover[..., None],
        **{name: field[..., None] for name, field in there.items()},
    )  # fmt: skip
    cells = SimpleNamespace(geometry=geometry, depth=h, speed=np.abs(u), u_y=slope, rate=k, viscosity=nu)
    lie = SimpleNamespace(x=x + 0.0 * y, y=y + 0.0 * x, cover=cover, **there)
    state = SimpleNamespace(
        lie=lie, length=32.0, half=1.5, h=h[..., 0], speed=np.abs(u[..., 0]), k=k[..., 0], nu=nu[..., 0],
        eta=lie.y / 1.5, open_floor=(1.0 - bank) * (1.0 - cover),
        flow=SimpleNamespace(h=h[..., 0], u=u[..., 0]), spacing=(1.0, 1.0),
    )  # fmt: skip
    reference = 0.5 * sum(RANGES[law.term, law.quantity])
    (ours,) = acting(law, cells, np.array(0.7), np.array(reference)).values()
    theirs = (LAW_MIXING if law.term == "viscosity" else LAW_DRAG)[law.name](state, 0.7, reference)
    assert np.allclose(ours[..., 0], theirs)
    assert np.ptp(theirs) > 0.0


def test_another_discharge_is_held_out_where_velocities_are_measured() -> None:
    model = model_of("twin")
    stations = held_out_stations(model)
    assert len(stations) == 27
    assert set(stations["kind"]) == {"velocity"}
    assert len(held_out_stations(replace(model, station=model.station.assign(used=False)))) == 0
