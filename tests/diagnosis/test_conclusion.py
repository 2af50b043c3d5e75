"""What a diagnosis concludes is told in the units that its words say."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from diagnoses import NOTHING, a_candidate_effect, an_anomaly, candidate_laws_of
from linear_baseline import CASE_OF_TWINS, at_best, stations_of
from verdicts import inputs, step

from vegglue.calibration.candidates import with_effect
from vegglue.calibration.noise import with_correlation, with_grid_error
from vegglue.calibration.residual_screening import Screening
from vegglue.case.parameter_space import theta_at
from vegglue.decision_constants import constants
from vegglue.diagnosis import conclusion
from vegglue.diagnosis.child_config import candidate_at
from vegglue.diagnosis.conclusion import estimated_errors, misfit_of, significant_effects
from vegglue.diagnosis.search_state import SearchState, Undecided


@pytest.mark.parametrize(("kinds", "told"), [(("velocity", "discharge"), 0.001), (("level", "discharge"), np.nan)])
def test_the_error_of_the_grid_is_that_of_velocities(kinds: tuple[str, str], told: float) -> None:
    """With discharges, wrong by 0.02 m3/s, and levels beside them the mean of all was told as one of mm/s."""
    station = stations_of(CASE_OF_TWINS, ("A",), 4)
    station = station.assign(kind=np.resize(kinds, len(station)))
    base = at_best(CASE_OF_TWINS, station, np.zeros(len(station)), np.zeros((len(station), 2)))
    difference = np.where(station["kind"] == "velocity", 0.001, 0.02) / constants().grid_error_share
    screening: Any = SimpleNamespace(base=replace(base, noise=with_grid_error(base.noise, difference)))
    assert estimated_errors(screening, SearchState()).grid_error == pytest.approx(told, nan_ok=True)


def test_where_a_law_takes_the_place_of_a_place_effects_are_those_of_the_model_without_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """They were those of the model with the place, beside scores, misfit and parameters of the one without."""
    station = stations_of(CASE_OF_TWINS, ("A",), 4)
    bases = [at_best(CASE_OF_TWINS, station, np.full(12, value), np.zeros((12, 4))) for value in (0.1, 0.2)]
    first, last = (cast("Screening", SimpleNamespace(base=base)) for base in bases)
    laws, make_verdict = candidate_laws_of("law_bank_speed_step", chance=0.99), []
    stubs = {
        "candidate_laws": lambda *_: laws, "candidate_effects_of": lambda one: {"wind": tested[one is first]},
        "misfit_of": lambda *_: NOTHING.misfit, "_field": lambda *_: (None, None), "_first_screening": lambda _: None,
        "_place_map": lambda *_: None, "_parameters": lambda *_: None,
        "_inputs": lambda used, held, *_: make_verdict.append((used, held)) or inputs(),
        "make_verdict": lambda *_: NOTHING.verdict,
    }  # fmt: skip
    tested = {
        True: a_candidate_effect("wind", test={"score": 0.3}),
        False: a_candidate_effect("wind", test={"score": 4.0}),
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(conclusion, name, stub)
    held = SearchState(places=(an_anomaly(),), undecided=Undecided((), ()))
    found = conclusion.assemble_diagnosis(first, last, held, {"wind": tested[False]}, None, lambda: None)
    assert make_verdict == [(first, SearchState())]  # what competed beside the place was told beside the law
    assert (found.places, found.candidate_effects) == ((), (tested[True],))


def test_a_place_is_told_with_its_amplitude_in_the_last_model() -> None:
    """The sentence told that of its refit, and the table of parameters that of the last calibration."""
    place = an_anomaly()
    one = candidate_at(CASE_OF_TWINS, place)
    case = with_effect(CASE_OF_TWINS, one, place.shapes)
    slopes = np.zeros((12, len(case.parameters)))
    base = at_best(case, stations_of(case, ("A",), 4), np.full(12, 0.1), slopes)
    found = conclusion.as_calibrated(place, base)
    assert found.amplitude == pytest.approx(float(theta_at(case, base.fitted.point.z)[one.parameter][0]))
    assert found.amplitude != place.amplitude
    assert found.interval95[0] < found.amplitude < found.interval95[1]


def test_what_stands_out_in_the_last_model_is_kept_unless_it_is_in_it() -> None:
    """At the rate of the alarm beside what was accepted; what was accepted may be tested again."""
    chances = {"wind": 0.008, "elder": 0.02, "jet": 0.001}
    last: Any = SimpleNamespace(
        fingerprints=SimpleNamespace(candidates=[SimpleNamespace(name=name) for name in chances]),
        best_score=lambda j: [-4.0, 3.5, 5.0][j],
        effects=SimpleNamespace(p_of=lambda score: {4.0: 0.008, 3.5: 0.02, 5.0: 0.001}.get(score, 0.3)),
    )  # fmt: skip
    assert significant_effects(last, SearchState(steps=(step("jet"),))) == {"wind": 0.008}
    assert significant_effects(last, SearchState(steps=(step("jet"),)), slack=1.0) == {}


def test_a_misfit_is_told_in_the_errors_of_the_last_model() -> None:
    """In those of the first it was told beside the errors of the last: nobody could say whose they were."""
    station = stations_of(CASE_OF_TWINS, ("A",), 4)
    base = at_best(CASE_OF_TWINS, station, np.full(12, 0.1), np.zeros((12, 4)))
    first, last = (
        SimpleNamespace(base=replace(base, noise=with_correlation(base.noise, 0.0, scale))) for scale in (3.0, 2.0)
    )
    zones = misfit_of(cast("Screening", first), cast("Screening", last), ()).zones
    stated = misfit_of(cast("Screening", SimpleNamespace(base=base)), cast("Screening", SimpleNamespace(base=base)), ())
    assert 4.0 * zones["chi2"].to_numpy() == pytest.approx(stated.zones["chi2"].to_numpy())
