"""Conditional screenings: one parameter that is off is back in the middle, and all others fit best there."""

from dataclasses import replace

import numpy as np
from linear_baseline import CASE_OF_TWINS, at_best, measured_linearly, stations_of

from vegglue.calibration.baseline import SearchModel, search_model
from vegglue.calibration.fit import objective
from vegglue.calibration.residual_screening import MOST_CONDITIONAL, OFF, conditional_places
from vegglue.case.schema import EffectEntry
from vegglue.engine.interface import Point

SECTIONS, PARAMETERS = ("A", "B"), len(CASE_OF_TWINS.parameters)


def calibrated() -> SearchModel:
    slope, values = measured_linearly(SECTIONS, 10, PARAMETERS)
    return search_model(at_best(CASE_OF_TWINS, stations_of(CASE_OF_TWINS, SECTIONS, 10), values, slope))


def test_there_one_parameter_is_in_the_middle_and_the_others_fit_best() -> None:
    search = calibrated()
    z, places = search.point.z, conditional_places(search)
    off = sorted(np.flatnonzero(np.abs(z) > OFF), key=lambda j: -abs(z[j]))[:MOST_CONDITIONAL]
    assert len(places) == len(off) > 0
    for j, place in zip(off, places, strict=True):
        assert abs(place[j]) < 1e-12
        here = objective_at(search, place)
        for k in range(z.size):
            step = 0.01 * np.eye(z.size)[k] * (k != j)
            assert objective_at(search, place + step) >= here
            assert objective_at(search, place - step) >= here


def objective_at(search: SearchModel, z: np.ndarray) -> float:
    slope = search.point.slope
    return objective(search.noise, Point(z, slope @ z, slope, {}))


def test_amplitudes_of_effects_and_what_lies_as_expected_are_left_alone() -> None:
    search = calibrated()
    case, names = search.model.case, search.model.names
    middle = replace(search.point, z=np.zeros(PARAMETERS))
    assert conditional_places(replace(search, point=middle)) == []
    entry = EffectEntry(effect="wind", values=dict(zip("abcdefgh", names, strict=False)))
    of_effects = replace(search.model, case=case.model_copy(update={"effects": {"wind": entry}}))
    assert conditional_places(replace(search, model=of_effects)) == []
