"""Fingerprints of spots and of laws are responses to the effects that stand for them, on cells of any size."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_models import model_of
from coarse_twin import CASE, coarse_twin

from vegglue.calibration.baseline import SearchModel
from vegglue.calibration.candidates import Candidate, cause_of, place_candidate
from vegglue.calibration.fingerprints import (
    SPOT_LENGTHS,
    Fingerprints,
    Places,
    fingerprints_of,
    places_around,
    places_of,
    plausible_size,
)
from vegglue.calibration.law_screening import law_traces
from vegglue.calibration.model_error import EFFECT_AT_PLACE, model_error_columns
from vegglue.calibration.noise import noise_of
from vegglue.case.channel_geometry import half_width, site_scales
from vegglue.case.config import load_case
from vegglue.case.schema import ModelError
from vegglue.case.site_schema import FrictionClass
from vegglue.effects.grammar import LAWS
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point, flow_at_centres, linearise, relinearised, responses
from vegglue.engine.model import coarser
from vegglue.flow.local_changes import Term
from vegglue.measurements.observations import read_observations
from vegglue.workflow.case_run import CaseRun


@pytest.fixture(scope="module")
def flowing() -> tuple[Model, Point]:
    return coarse_twin()


@pytest.fixture(scope="module")
def places(flowing: tuple[Model, Point]) -> dict[Term, Places]:
    return {one.term: one for one in places_of(*flowing, half_width(flowing[0].site))}


def test_an_excluded_term_has_no_places(flowing: tuple[Model, Point], places: dict[Term, Places]) -> None:
    model, point = flowing
    case = model.case.model_copy(update={"exclude": {"unlisted_inflow": "glass walls"}})
    of_case = replace(model, case=case)
    assert {one.term for one in places_of(of_case, point, half_width(model.site))} == set(places) - {"inflow"}


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


@pytest.mark.parametrize("term", SPOT_LENGTHS)
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
    from_ends = np.minimum(grid.x - grid.x[0], grid.x[-1] - grid.x) >= one.length.min()
    i, j = np.nonzero((depths.min(axis=0) > 0.3) & from_ends[:, None])
    away = np.hypot(
        (grid.x[i][:, None] - one.x[short]) / one.length[short], (grid.y[j][:, None] - one.y[short]) / one.width[short]
    )
    assert away.min(axis=1).max() < 1.1, "no place in deep water is further than a half length from a spot"


def test_barriers_stand_between_stations_and_are_even_across_the_channel(
    flowing: tuple[Model, Point], places: dict[Term, Places]
) -> None:
    model, barriers = flowing[0], places["barrier"]
    measured = model.station["x"][model.station["used"]]
    assert measured.min() < barriers.x.min() < barriers.x.max() < measured.max()
    assert barriers.x.size > 10
    assert (np.diff(barriers.x) <= 1.1 * barriers.length[0]).all(), "no gap is longer than a half length"
    (width,) = np.unique(barriers.width)
    away = model.site.grid.y - barriers.y[0]
    assert np.exp(-((away / width) ** 2)).min() > 0.98


@pytest.mark.parametrize("end", [1.0, 31.0])
def test_nothing_is_looked_for_outside_the_channel(flowing: tuple[Model, Point], end: float) -> None:
    """All cells of the edge of a long spot lie under water, and water of one 10 m before the inlet left a trace."""
    around = places_around(*flowing, "inflow", {"x": end, "y": 0.0, "length": 5.4, "width": 0.45}, 0.5)
    low, high = CASE.grid.x
    assert end in around.x
    assert low - 0.5 < around.x.min() < around.x.max() < high + 0.5


def test_a_plausible_inflow_is_a_share_of_what_flows() -> None:
    totals = [1.0, 2.0, *(float(sum(one.discharge.values())) for one in list(CASE.experiments.values())[2:])]
    assert plausible_size(CASE, "inflow") == pytest.approx(0.05 * float(np.mean(totals)))
    assert {plausible_size(CASE, term) > 0.0 for term in EFFECT_AT_PLACE} == {True}


def test_a_plausible_rise_of_the_bed_is_a_share_of_the_depth() -> None:
    assert plausible_size(CASE, "bed") == pytest.approx(0.3 * site_scales(CASE).mean_depth)


def test_what_lies_on_a_bare_bed_only_holds_the_water_back(flowing: tuple[Model, Point]) -> None:
    """Where no plants stand there is no drag to lose: nothing pushes. Among plants it may go either way."""
    of_term = {one.term: one for one in places_of(*flowing, 1.5)}
    drag, bed, barrier = (of_term[term] for term in ("drag", "bed", "barrier"))
    assert barrier.only_sign.all()
    assert set(np.unique(drag.only_sign)) == {0, 1}
    assert drag.only_sign[drag.bare].all()
    assert not drag.only_sign[~drag.bare].any()
    assert not bed.only_sign.any()


def test_behind_walls_no_water_enters_and_beside_the_inflow_is_no_place(flowing: tuple[Model, Point]) -> None:
    model, point = flowing
    walls = FrictionClass(law="manning", n=0.01)
    walled = model.case.model_copy(update={"friction": model.case.friction.model_copy(update={"walls": walls})})
    found = places_of(replace(model, case=walled), point, 1.5)
    assert {one.term for one in found} == set(EFFECT_AT_PLACE) - {"inflow"}
    for one in found:
        assert (one.x >= model.case.grid.x[0] + one.length).all()
        assert (one.x <= model.case.grid.x[1] - one.length).all()


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


CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"
NAMES = (
    "law_floor_speed_power", "law_bank_shear_step", "law_bank_depth_hump", "law_plants_along_stretch",
    "law_viscosity_offset_ramp", "law_viscosity_front_fading", "law_advection_speed_step", "law_advection_along_trend",
    "law_advection_edge_fading",
)  # fmt: skip


@pytest.fixture(scope="module")
def model() -> Model:
    coarse = coarser(CaseRun(load_case(CONFIG)).model)
    assert coarse is not None
    return coarse


@pytest.fixture(scope="module")
def borrowed(model: Model) -> Point:
    """A point that leans on the factors of one nearby."""
    near = linearise(model, np.zeros(len(model.names)))
    assert near is not None
    point = linearise(model, np.full(len(model.names), 0.02), near)
    assert point is not None
    assert any(flow.moved > 0.0 for flow in point.flows.values())
    return point


@pytest.mark.parametrize("name", NAMES)
def test_a_trace_is_the_response_to_the_effect(model: Model, borrowed: Point, name: str) -> None:
    law = LAWS[name]
    settings = {shape.name: shape.default for shape in law.effect.shapes}
    exact = responses(model, borrowed, [cause_of(model.case, Candidate(law.effect), settings)])
    trace = law_traces(model, borrowed).of(law, [settings])
    assert trace == pytest.approx(exact, abs=0.02 * np.abs(exact).max())


def test_an_experiment_without_measurements_is_no_obstacle(model: Model) -> None:
    """It was a traceback, after a minute."""
    seen = model.station[model.station["experiment"] != "mid"].reset_index(drop=True)
    part = replace(model, station=seen)
    point = linearise(part, np.zeros(len(part.names)))
    assert point is not None
    assert np.isfinite(law_traces(part, point).of(LAWS[NAMES[0]], [{"reference": 0.5}])).all()
    allowed = ModelError(friction=0.05, edges=0.1)
    assert len(model_error_columns(part, point, allowed)) == len(seen)


def test_a_relinearised_point_reuses_nothing(model: Model, borrowed: Point) -> None:
    alone = relinearised(model, borrowed)
    assert all(flow.moved == 0.0 for flow in alone.flows.values())
    assert relinearised(model, alone).flows["mid"].factors is alone.flows["mid"].factors
    assert np.array_equal(alone.prediction, borrowed.prediction)


# Standard errors at a plausible size below which nobody looks at a trace.
UNSEEN = 0.01
# Length of a trace on coarse cells over that on the case's own. Shear is smoother there, least resolved in a layer of
# 0.3 m on cells of 0.375 m: half as long. A size that is
# counted in cells is off by 1.4 times where cells are wider, by twice or four times where they are longer as well.
SHORTEST, LONGEST = 0.4, 1.1


def traces(model: Model) -> Fingerprints:
    point = linearise(model, np.zeros(len(model.names)))
    assert point is not None
    return fingerprints_of(SearchModel(model, noise_of(model.station), point), half_width(model.site))


@pytest.fixture(scope="module")
def both() -> tuple[Fingerprints, Fingerprints]:
    coarse, _ = coarse_twin()
    return traces(model_of(CASE, read_observations(CASE))), traces(coarse)


def test_a_size_means_the_same_on_coarse_cells(both: tuple[Fingerprints, Fingerprints]) -> None:
    own, coarse = both
    assert own.settings == coarse.settings
    length, other = (np.linalg.norm(one.values, axis=0) for one in both)
    seen = length > UNSEEN
    share = other[seen] / length[seen]
    cosine = np.sum(own.values * coarse.values, axis=0)[seen] / (length * other)[seen]
    assert share.min() > SHORTEST
    assert share.max() < LONGEST
    assert cosine.min() > 0.9
