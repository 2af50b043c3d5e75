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
from vegglue.case.channel_geometry import site_scales
from vegglue.case.parameter_space import z_of
from vegglue.decision_constants import constants, using
from vegglue.diagnosis.competition import Hypothesis, chances_of, hypotheses_of, promising_spots
from vegglue.diagnosis.place_search import Window, cannot_be, found_place, possible_change, window_around
from vegglue.diagnosis.refits import Refit, RefitTrial, refits_of, start_with
from vegglue.diagnosis.search_state import rivals_in, undecided_of
from vegglue.effects.definition import Effect
from vegglue.effects.library import library
from vegglue.engine.interface import flow_at_centres, linearise
from vegglue.progress import silent

# Between the spots, which stand 0.5 m and 0.45 m apart: drag below zero pushes, as a jet does.
OBJECT, BARRIER = library()["unlisted_object"], library()["unlisted_barrier"]


def measured_with(place: dict[str, float], size: float, effect: Effect = OBJECT) -> Screening:
    """A screening of the coarse twin, measured without errors where something lies."""
    model, point = coarse_twin("mid")
    candidate = place_candidate(effect, place, 1.0)
    case = with_effect(CASE, candidate, place)
    there = np.append(point.z, z_of(case.parameters[candidate.parameter], size))
    truth = linearise(replace(model, case=case), there, point)
    assert truth is not None
    model = replace(model, station=model.station.assign(value=truth.prediction))
    noise = noise_of(model.station)
    return screen(Baseline(model, noise, fit(model, noise, point), None, None))


@pytest.mark.slow
@pytest.mark.parametrize("loss", [1.0, 3.0])  # a sill, a row of logs
def test_an_obstacle_across_the_channel_is_found_as_that(loss: float) -> None:
    """Hidden between two barriers of the screening, and half as long as these are."""
    screening = measured_with({"x": 17.3, "y": 0.0, "length": 0.6, "width": 30.0}, loss, BARRIER)
    best = max(hypotheses_of(screening, silent), key=lambda one: one.log_evidence)
    assert best.kind == "barrier"
    assert isinstance(best.what, Refit)
    assert abs(best.what.shapes["x"] - 17.3) < 1.0
    low, high = best.what.interval95
    assert low < loss < high


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


@pytest.mark.parametrize(("across", "kept"), [(1, 4.0 + 9 / 2), (9, 81.0 - 25.0 + 81 / 4)])  # a barrier, a spot
def test_a_window_counts_by_the_places_that_it_has_seen_again(
    monkeypatch: pytest.MonkeyPatch, across: int, kept: float
) -> None:
    """Where ln B is the same everywhere, places half as far apart count half each along every axis that they span."""
    steps = np.arange(9.0)
    x, y = (one.ravel() for one in np.meshgrid(steps, steps[:across]))
    zero, one, spot = np.zeros(x.size), np.ones(x.size), int(x.size // 2)
    places = Places("barrier" if across == 1 else "drag", x, y, one, one, 1.0, zero[None])
    near = Window(0.5 * (x + x[spot]), 0.5 * (y + y[spot]), zero, zero)
    monkeypatch.setattr("vegglue.diagnosis.place_search.window_around", lambda *_: near)
    prior = 1.0 / x.size
    logs = zero + np.log(prior)
    kind: Any = SimpleNamespace(scores=zero, size=zero, log_evidence=logs, log_prior=logs)
    refit: Any = SimpleNamespace(log_factor=0.0, shapes=places.shapes(spot))
    nothing: Any = None
    found = found_place(nothing, places, kind, spot, refit)
    assert found.log_evidence == pytest.approx(np.log(kept * prior))


def test_what_its_mirror_image_explains_as_well_may_lie_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Levels on the axis cannot show on which side of it something lies; moved by 0.1 m it gained, and its mirror image
    did not: y = 2.6 +- 0.2 m.
    """
    y = np.linspace(-3.0, 3.0, 7)
    one, evidence = np.ones(7), -10.0 * (np.abs(y) - 2.0) ** 2
    places = Places("drag", 0.0 * y, y, one, one, 1.0, np.zeros((1, 7)))
    at = np.linspace(1.0, 3.0, 21)
    near = Window(0.0 * at, at, 6.0 - 10.0 * (at - 2.1) ** 2, 0.0 * at)
    monkeypatch.setattr("vegglue.diagnosis.place_search.window_around", lambda *_: near)
    fitted: Any = SimpleNamespace(point=SimpleNamespace(z=np.zeros(2)))
    candidate = place_candidate(OBJECT, places.shapes(5), 1.0)
    refit = Refit(candidate, places.shapes(5), fitted, 0.0, 1.0, (0.5, 1.5))
    moved = replace(refit, shapes={**places.shapes(5), "y": 2.1}, log_factor=6.0)
    monkeypatch.setattr("vegglue.diagnosis.place_search.refits_of", lambda *_: (moved,))
    search: Any = SimpleNamespace(model=SimpleNamespace(case=SimpleNamespace(effects={})))
    kind: Any = SimpleNamespace(scores=np.zeros(7), size=np.zeros(7), log_evidence=evidence, log_prior=np.zeros(7))
    found = found_place(search, places, kind, 5, refit)
    assert found.refit is moved
    assert found.spread[1] == pytest.approx(4.1 / 2**0.5, abs=0.3)
    assert found.errors[1] > 2.5


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


def test_a_bed_moves_by_the_depth_at_most_and_no_more_enters_than_flows() -> None:
    """A tidal reach lay 7 m lower in 3.6 m of water, and a flume of 2 m had a bed 2.8 m higher."""
    model, point = coarse_twin("mid")
    scales, grid = site_scales(model.case, model.site), model.site.grid
    depth = np.max([flow_at_centres(model, point, name).depth for name in point.flows], axis=0)
    i, j = grid.x.size // 2, grid.y.size // 2
    x, y = float(grid.x[i]), float(grid.y[j])
    assert depth[i, j] > scales.mean_depth
    assert possible_change(model, point, "bed", x, y) == pytest.approx((-depth[i, j], depth[i, j]))
    on_bank = float(grid.y[np.flatnonzero(depth[i] > 0.01)[0]])
    assert possible_change(model, point, "bed", x, on_bank)[1] == pytest.approx(scales.mean_depth)
    assert possible_change(model, point, "inflow", x, y) == (-scales.discharge, scales.discharge)
    assert possible_change(model, point, "viscosity", x, y) == (-0.01, np.inf)
    assert possible_change(model, point, "friction", x, y) == (-1.0, np.inf)
    assert possible_change(model, point, "drag", x, y) == (-np.inf, np.inf)


@pytest.mark.parametrize(("interval", "impossible"), [
    ((-9.0, -4.9), True), ((2.1, 3.5), True), ((-9.0, -3.5), False), ((1.9, 3.5), False), ((-1.0, 1.0), False),
])  # fmt: skip
def test_what_cannot_be_lies_outside_with_its_whole_interval(interval: tuple[float, float], impossible: bool) -> None:
    assert cannot_be(interval, (-3.6, 2.0)) is impossible


def refit_of(amplitude: float, error: float) -> Refit:
    place = {"x": 14.0, "y": 0.0, "length": 0.5, "width": 0.45}
    candidate = place_candidate(library()["unlisted_bed"], place, 0.3)
    around = (amplitude - 2.0 * error, amplitude + 2.0 * error)
    return Refit(candidate, place, None, 30.0, amplitude, around)  # type: ignore[arg-type]


def test_what_cannot_be_has_no_chance_and_is_not_told() -> None:
    hypotheses = [
        Hypothesis("drag", "a", 3.0, 0, refit_of(0.2, 0.1)),
        Hypothesis("bed", "b", -np.inf, 0, refit_of(4.0, 0.1)),
    ]
    assert list(chances_of(hypotheses)) == [1.0, 0.0]
    assert [one.name for one in rivals_in(undecided_of(hypotheses, (), np.array([])))] == ["a"]


@pytest.mark.slow
def test_effects_that_no_plausible_size_would_show_are_not_accepted_at_sizes_that_are_not() -> None:
    """In a compound channel banks that grow rougher with depth were accepted at 4.8 plausible sizes, where the data
    show them from 3.5 on.
    """
    screening = measured_with({"x": 14.3, "y": 0.2, "length": 0.5, "width": 0.45}, 0.3)
    names = [one.name for one in screening.fingerprints.candidates]
    untestable = {name for j, name in enumerate(names) if not screening.testable(screening.best_column(j))}
    with using(replace(constants(), implausible_size=0.0)):
        found = {one.name: one.log_evidence for one in hypotheses_of(screening, silent) if one.kind == "effect"}
    assert found
    assert {name for name, evidence in found.items() if np.isinf(evidence)} == untestable & set(found)


@pytest.mark.slow
def test_something_near_the_outlet_moves_no_further_than_spots_stand() -> None:
    """A bed 7 m lower lay in the last column of cells, where it only changed how the water left."""
    end = CASE.grid.x[1]
    screening = measured_with({"x": end - 0.3, "y": 0.2, "length": 0.5, "width": 0.45}, 0.3)
    search, kind = search_model(screening.base), next(one for one in screening.kinds if one.name == "drag")
    places = next(one for one in screening.fingerprints.places if one.term == "drag")
    last = float(places.x[places.length == places.length.min()].max())
    spot = int(np.flatnonzero((places.length == places.length.min()) & (places.x == last))[0])
    shapes = {**places.shapes(spot), "y": 0.2}
    candidate = place_candidate(OBJECT, shapes, places.plausible)
    (refit,) = refits_of(search, [RefitTrial(candidate, shapes, (start_with(candidate, search.point.z, 0.1),))])
    assert refit is not None
    assert window_around(search, places, refit).x.max() <= last + 0.005
    assert found_place(search, places, kind, spot, refit).refit.shapes["x"] <= last + 0.005
