"""Plants that are not on the map are found as a patch, an object stays a spot, and beside them water has its extent."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_twin import CASE, coarse_twin

from vegglue.calibration.baseline import Baseline, search_model
from vegglue.calibration.candidates import Candidate, place_candidate, start_with, with_effect
from vegglue.calibration.fit import fit
from vegglue.calibration.model_error import EFFECT_AT_PLACE
from vegglue.calibration.noise import noise_of
from vegglue.calibration.residual_screening import Screening, screen
from vegglue.calibration.score_test import kind_named
from vegglue.case.case_effects import effect_named
from vegglue.case.parameter_space import z_of
from vegglue.diagnosis.competition import Hypothesis, with_patch
from vegglue.diagnosis.place_search import drag_of_patches
from vegglue.diagnosis.refits import RefitTrial, refits_of
from vegglue.diagnosis.search_state import anomaly_found
from vegglue.engine.interface import linearise_from
from vegglue.flow.local_changes import Term

# Twice as dense as the patches of the map, in open water downstream of them.
REEDS = {"x": 26.0, "y": -0.6, "length": 2.5, "width": 0.5, "angle": 0.0, "height": 0.7, "proportional": 0.0}
# A ditch of 5 m, narrower than the spots of the screening, 0.45 m.
DITCH = {"x": 24.0, "y": -0.6, "length": 2.5, "width": 0.25}
ENTERING = 0.12
TREE = {"x": 26.0, "y": -0.6, "length": 0.5, "width": 0.45}


def measured_with(candidate: Candidate, amplitude: float) -> Screening:
    """A screening of the coarse twin, measured where this acts, with the errors that the data state."""
    model, point = coarse_twin("mid")
    case = with_effect(CASE, candidate, {})
    z = np.append(point.z, z_of(case.parameters[candidate.parameter], amplitude))
    truth = linearise_from(replace(model, case=case), z, point)
    assert truth is not None
    error = np.random.default_rng(1).standard_normal(len(model.station)) * model.station["standard_error"].to_numpy()
    model = replace(model, station=model.station.assign(value=truth.prediction + error))
    noise = noise_of(model.station)
    return screen(Baseline(model, noise, fit(model, noise, point), None, None))


def best_spot(screening: Screening, term: Term) -> Hypothesis:
    """The best spot of a term, refitted."""
    search, kind = search_model(screening.base), kind_named(screening.kinds, term)
    places = next(one for one in screening.fingerprints.places if one.term == term)
    effect = effect_named(CASE, EFFECT_AT_PLACE[term])
    candidate = place_candidate(effect, places.shapes(kind.best), places.plausible)
    start = start_with(candidate, search.point.z, float(kind.gain[kind.best]))
    (refit,) = refits_of(search, [RefitTrial(candidate, dict(candidate.fixed), (start,))])
    assert refit is not None
    evidence = refit.log_factor + float(kind.log_prior[kind.best])
    return Hypothesis(term, candidate.name, evidence, kind.best, refit)


def hypotheses_at(screening: Screening) -> list[Hypothesis]:
    """The best spot of drag, refitted, and plants in place of it if they explain clearly more."""
    return with_patch(screening, [best_spot(screening, "drag")])


@pytest.mark.slow
def test_plants_that_are_not_on_the_map_have_an_outline() -> None:
    reeds = place_candidate(effect_named(CASE, "unlisted_patch"), REEDS)
    screening = measured_with(reeds, 1.0)
    (found,) = hypotheses_at(screening)
    place = anomaly_found(screening, [found], 0, found.what)
    assert place.effect == "unlisted_patch"
    assert place.outline is not None
    for name, error in (("x", place.x_error), ("y", place.y_error), ("length", place.outline.length_error)):
        assert 0.0 < error < 1.5
        assert abs(place.shapes[name] - REEDS[name]) < 3.0 * error
    assert place.interval95[0] < 1.0 < place.interval95[1]
    told = drag_of_patches(screening.search, place.outline.height)
    assert place.plausible == max(told.values()) == told[place.outline.like]


@pytest.mark.slow
def test_an_object_stays_a_spot() -> None:
    tree = place_candidate(effect_named(CASE, "unlisted_object"), TREE)
    (found,) = hypotheses_at(measured_with(tree, 1.0))
    assert found.outline is None


@pytest.mark.slow
def test_beside_plants_with_an_outline_water_has_its_extent_fitted() -> None:
    """Else a rectangle of plants, whose sizes are free, explains what enters along a ditch better than a round spot."""
    screening = measured_with(place_candidate(effect_named(CASE, "unlisted_inflow"), DITCH), ENTERING)
    plants, spot = best_spot(screening, "drag"), best_spot(screening, "inflow")
    found = {one.kind: one for one in with_patch(screening, [plants, spot])}
    water = found["inflow"]
    assert found["drag"].outline is not None
    assert water.log_evidence > spot.log_evidence + 10.0
    assert water.what.shapes["width"] < spot.what.shapes["width"] < water.what.shapes["length"]
    assert abs(water.what.shapes["y"] - DITCH["y"]) < 0.1
    assert water.what.interval95[0] < ENTERING < water.what.interval95[1]
