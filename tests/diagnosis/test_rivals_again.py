"""Rivals of an earlier step, compared again with what came later."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from coarse_twin import coarse_twin
from diagnoses import a_suspect
from linear_baseline import CASE_OF_TWINS, at_best, measured_linearly, stations_of

from vegglue.calibration.baseline import Baseline, SearchModel, baseline, search_model
from vegglue.calibration.noise import with_unknown_errors
from vegglue.diagnosis.child_config import candidate_named, with_additions
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of
from vegglue.diagnosis.rivals_again import settings_charge, with_rivals_again
from vegglue.effects.library import library
from vegglue.progress import silent
from vegglue.results.diagnosis import Step
from vegglue.screening.candidates import Candidate

EARLIER, LATER = "viscosity", "floor_level_error"


def a_step(*rivals: str, **others: float) -> Step:
    """Rivals that are as likely; others: chances of what else it may be."""
    groups, left = tuple((name,) for name in rivals), 1.0 - sum(others.values())
    return Step(rivals[0], rivals, tuple(left / len(rivals) for _ in rivals), groups, 200.0, 100.0, 1e-4, others)


@pytest.fixture(scope="module")
def base() -> Baseline:
    """A model that two effects act in."""
    model, _ = coarse_twin()
    added = [(candidate_named(model.case, model.station, name), {}) for name in (EARLIER, LATER)]
    return baseline(replace(model, case=with_additions(model.case, added)))


def compared_again(base: Baseline, *rivals: str, **others: float) -> Step:
    suspects = {name: a_suspect(name) for name in (*rivals, LATER)}
    _, (first, second) = with_rivals_again(base, (a_step(*rivals, **others), a_step(LATER)), suspects, silent)
    assert second == a_step(LATER), "without rivals there is nothing to compare"
    return first


@pytest.mark.slow
def test_what_a_later_step_accepted_is_no_rival_any_more(base: Baseline) -> None:
    first = compared_again(base, EARLIER, "elder", LATER)
    assert LATER not in first.rivals
    assert sum(first.chances) > 0.9, "the others share all that is left"


@pytest.mark.slow
def test_a_rival_of_which_no_flow_is_found_keeps_its_chance(base: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    """It vanished, and what was left was told to be surely it."""

    def without_elder(search: SearchModel, trials: Sequence[RefitTrial]) -> list[Refit | None]:
        return [None if one is None or one.candidate.name == "elder" else one for one in refits_of(search, trials)]

    monkeypatch.setattr("vegglue.diagnosis.rivals_again.refits_of", without_elder)
    assert compared_again(base, EARLIER, "elder", LATER).chance == pytest.approx({EARLIER: 0.5, "elder": 0.5})


@pytest.mark.slow
@pytest.mark.parametrize(("aside", "told"), [(False, {"probe": 0.4}), (True, {})])
def test_what_else_it_may_be_keeps_its_chance_unless_it_was_accepted_since(
    base: Baseline, aside: bool, told: dict[str, float]
) -> None:
    """A probe of 40 % vanished, and the effects were told as surely it."""
    offset = np.ones((base.noise.rows.size, 1))
    known = replace(base, noise=with_unknown_errors(base.noise, offset)) if aside else base
    again = compared_again(known, EARLIER, "elder", probe=0.4)
    assert again.others == pytest.approx(told)
    assert sum(again.chances) > 0.95 - sum(told.values())


@pytest.mark.slow
def test_a_step_stays_where_no_flow_is_found_with_its_effect_again(
    base: Baseline, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vegglue.diagnosis.rivals_again.refits_of", lambda _, trials: [None] * len(trials))
    assert compared_again(base, EARLIER, "elder") == a_step(EARLIER, "elder")


@pytest.mark.parametrize(("alike", "charge"), [(True, 0.0), (False, -np.log(3.0))])
def test_settings_are_charged_by_how_many_say_the_same(
    alike: bool, charge: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of three settings one explains the misfit, or all of them: as in the first competition."""
    station = stations_of(CASE_OF_TWINS, ("A",), 8)
    slope, values = measured_linearly(("A",), 8, 3)
    trace = np.random.default_rng(2).standard_normal(len(station))
    search = search_model(at_best(CASE_OF_TWINS, station, values + 0.1 * trace, slope))
    traces = np.stack([trace, trace if alike else 0.0 * trace, trace if alike else 0.0 * trace], axis=1)
    monkeypatch.setattr("vegglue.diagnosis.rivals_again.responses", lambda *_: 1e3 * traces)
    assert len(Candidate(library()["canopy_bending"]).settings()) == 3
    assert settings_charge(search, Candidate(library()["canopy_bending"])) == pytest.approx(charge, abs=1e-3)
    assert settings_charge(search, Candidate(library()["viscosity"])) == 0.0
