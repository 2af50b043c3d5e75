"""Spots of something unlisted: their fingerprints are responses to the effects that stand for them."""

import numpy as np
import pytest
from coarse_twin import CASE, coarse_twin

from vegglue.calibration.candidates import cause_of, place_candidate
from vegglue.calibration.fingerprints import (
    EFFECT_AT_PLACE,
    SPOT_LENGTHS,
    Places,
    places_around,
    places_of,
    plausible_size,
)
from vegglue.case.channel_geometry import half_width
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point, flow_at_centres, responses
from vegglue.flow.local_changes import Term


@pytest.fixture(scope="module")
def flowing() -> tuple[Model, Point]:
    return coarse_twin()


@pytest.fixture(scope="module")
def places(flowing: tuple[Model, Point]) -> dict[Term, Places]:
    return {one.term: one for one in places_of(*flowing, half_width(flowing[0].site))}


@pytest.mark.parametrize("term", EFFECT_AT_PLACE)
def test_a_fingerprint_is_the_response_to_the_effect_there(
    flowing: tuple[Model, Point], places: dict[Term, Places], term: Term
) -> None:
    """For a spot of every length in the middle of the channel."""
    model, point = flowing
    one = places[term]
    for length in np.unique(one.length):
        same = np.flatnonzero(one.length == length)
        spot = int(same[np.argmin((one.x[same] - 15.0) ** 2 + (one.y[same] - 0.3) ** 2)])
        shapes = {name: float(getattr(one, name)[spot]) for name in ("x", "y", "length", "width")}
        candidate = place_candidate(library()[EFFECT_AT_PLACE[term]], shapes, one.plausible)
        exact = responses(model, point, [cause_of(CASE, candidate, shapes)])[:, 0]
        found = one.fingerprints[:, spot]
        assert found @ exact > 0.99 * np.linalg.norm(found) * np.linalg.norm(exact), length
        assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(exact), rel=0.05), length


@pytest.mark.parametrize("term", EFFECT_AT_PLACE)
def test_spots_lie_in_the_water_and_reach_all_of_it(
    flowing: tuple[Model, Point], places: dict[Term, Places], term: Term
) -> None:
    model, point = flowing
    one, grid = places[term], model.site.grid
    depths = np.array([flow_at_centres(model, point, name).depth for name in CASE.experiments])
    deepest = depths.max(axis=0)
    cell = np.argmin(np.abs(grid.x[:, None] - one.x), axis=0), np.argmin(np.abs(grid.y[:, None] - one.y), axis=0)
    assert np.mean(deepest[cell] > 0.0) > 0.95
    assert one.fingerprints.shape == (len(model.station), one.x.size)
    assert np.unique(one.length).size == len(SPOT_LENGTHS[term])
    short = one.length == one.length.min()
    i, j = np.nonzero(depths.min(axis=0) > 0.3)
    away = np.hypot(
        (grid.x[i][:, None] - one.x[short]) / one.length[short], (grid.y[j][:, None] - one.y[short]) / one.width[short]
    )
    assert away.min(axis=1).max() < 1.0, "no place in deep water is further than a half length from a spot"


@pytest.mark.parametrize("end", [1.0, 31.0])
def test_nothing_is_looked_for_outside_the_channel(flowing: tuple[Model, Point], end: float) -> None:
    """All cells of the edge of a long spot lie under water, and water of one 10 m before the inlet left a trace."""
    around = places_around(*flowing, "inflow", {"x": end, "y": 0.0, "length": 5.4, "width": 0.45}, 0.5)
    low, high = CASE.grid.x
    assert end in around.x
    assert low - 0.5 < around.x.min() < around.x.max() < high + 0.5


def test_a_plausible_inflow_is_a_share_of_what_flows() -> None:
    totals = [1.0, 2.0, *(float(sum(one.discharge.values())) for one in list(CASE.experiments.values())[2:])]
    assert plausible_size(CASE, "inflow", 1.0) == pytest.approx(0.05 * float(np.mean(totals)))
    assert {plausible_size(CASE, term, 1.0) > 0.0 for term in EFFECT_AT_PLACE} == {True}


def test_a_plausible_rise_of_the_bed_is_a_share_of_the_depth() -> None:
    assert plausible_size(CASE, "bed", 0.12) == pytest.approx(0.12 * plausible_size(CASE, "bed", 1.0))
    assert plausible_size(CASE, "drag", 0.12) == plausible_size(CASE, "drag", 1.0)


def test_shapes_are_those_of_the_effect_to_a_centimetre() -> None:
    one = np.ones(2)
    two = Places("drag", one, np.array([0.123, 0.456]), 2.0 * one, one / 3.0, 0.3, np.zeros((5, 2)))
    assert two.shapes(1) == {"x": 1.0, "y": 0.46, "length": 2.0, "width": 0.33}
    named = {shape.name for shape in library()["unlisted_object"].shapes}
    assert set(two.shapes(0)) == named


@pytest.mark.filterwarnings("error")
def test_water_too_shallow_for_a_spot_has_none(flowing: tuple[Model, Point], monkeypatch: pytest.MonkeyPatch) -> None:
    """A flume of 4 cm: the mean of no depth was a warning on the screen, and a plausible size of nan."""
    monkeypatch.setattr("vegglue.calibration.fingerprints.LEAST_DEPTH", 10.0)
    for one in places_of(*flowing, half_width(flowing[0].site)):
        assert (one.x.size, one.fingerprints.shape[1]) == (0, 0)
        assert np.isfinite(one.plausible)
