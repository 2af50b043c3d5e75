"""Something at a place is looked for between the spots of the screening, in the flow that it leaves."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from coarse_twin import CASE, coarse_twin

from vegglue.calibration.baseline import Baseline, search_model
from vegglue.calibration.candidates import place_candidate, with_effect
from vegglue.calibration.fingerprints import Places
from vegglue.calibration.fit import fit
from vegglue.calibration.noise import noise_of
from vegglue.calibration.residual_screening import Screening, screen
from vegglue.case.parameter_space import z_of
from vegglue.diagnosis.competition import found_place, promising_spots
from vegglue.diagnosis.refits import RefitTrial, refits_of, start_with
from vegglue.effects.library import library
from vegglue.engine.interface import linearise

# Between the spots, which stand 0.5 m and 0.45 m apart: drag below zero pushes, as a jet does.
OBJECT = library()["unlisted_object"]


def measured_with(place: dict[str, float], drag: float) -> Screening:
    """A screening of the coarse twin, measured without errors where something lies."""
    model, point = coarse_twin()
    candidate = place_candidate(OBJECT, place, 1.0)
    case = with_effect(CASE, candidate, place)
    there = np.append(point.z, z_of(case.parameters[candidate.parameter], drag))
    truth = linearise(replace(model, case=case), there, point)
    assert truth is not None
    model = replace(model, station=model.station.assign(value=truth.prediction))
    noise = noise_of(model.station)
    return screen(Baseline(model, noise, fit(model, noise, point), None, None))


@pytest.mark.slow
@pytest.mark.parametrize("drag", [0.3, 0.15])  # a bare bed has no drag to lose
def test_something_between_the_spots_is_found_where_it_lies(drag: float) -> None:
    screening = measured_with({"x": 14.3, "y": 0.2, "length": 0.5, "width": 0.45}, drag)
    search, kind = search_model(screening.base), next(one for one in screening.kinds if one.name == "drag")
    places = next(one for one in screening.fingerprints.places if one.term == "drag")
    short = np.flatnonzero(places.length == places.length.min())
    spot = int(short[np.argmax(kind.log_evidence[short])])
    shapes = places.shapes(spot)
    candidate = place_candidate(OBJECT, shapes, places.plausible)
    start = start_with(candidate, search.point.z, 0.5 * drag)
    (refit,) = refits_of(search, [RefitTrial(candidate, shapes, (start,))])
    assert refit is not None

    found = found_place(search, places, kind, spot, refit)

    def away(place: dict[str, float]) -> float:
        return float(np.hypot(place["x"] - 14.3, place["y"] - 0.2))

    assert found.refit.log_factor >= refit.log_factor
    assert away(dict(found.refit.shapes)) <= away(shapes)
    assert away(dict(found.refit.shapes)) < 0.35
    assert found.refit.amplitude * drag > 0.0
    assert abs(found.refit.shapes["x"] - 14.3) < 2.0 * found.spread[0] + 0.1


def test_nothing_more_is_looked_for_where_something_acts_already() -> None:
    """Of another length at the same x and y it had the same name, and took the place of the first in the case; a
    parameter without an effect was left.
    """
    x, length = np.array([10.0, 12.0, 10.0, 14.0]), np.array([0.5, 0.5, 2.0, 2.0])
    places = Places("drag", x, np.zeros(4), length, np.full(4, 0.5), 1.0, np.zeros((1, 4)))
    evidence = np.array([9.0, 8.0, 9.5, 7.0])
    kind = SimpleNamespace(name="drag", log_evidence=evidence, total=10.0)
    acting = place_candidate(OBJECT, places.shapes(0))
    for case, spots in ((CASE, [0, 2]), (with_effect(CASE, acting, {}), [1, 3])):
        screening: Any = SimpleNamespace(kinds=(kind,), search=SimpleNamespace(model=SimpleNamespace(case=case)))
        assert promising_spots(screening, places, 10.0) == spots
