"""Where something unlisted lies: the mean of all spots where it may be is nearer than the best of them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from coarse_twin import CASE, coarse_twin

from vegglue.arrays import Array
from vegglue.diagnosis.centred_place import mean_place
from vegglue.effects.library import library
from vegglue.engine.interface import Model, Point, responses
from vegglue.screening import score_test
from vegglue.screening.candidates import cause_of, place_candidate
from vegglue.screening.evidence import HypothesisKind, kind_of_hypotheses
from vegglue.screening.places import Places, places_of
from vegglue.site.channel_geometry import half_width

# A bar, its length in standard errors, how many of them are drawn, and how near is near [m].
BAR, VISIBLE, DRAWN, NEAR = {"length": 1.3, "width": 0.55}, 6.0, 30, 1.5


@pytest.fixture(scope="module")
def bed() -> tuple[Model, Point, Places]:
    model, point = coarse_twin()
    places = places_of(model, point, half_width(model.site))
    return model, point, next(one for one in places if one.term == "bed")


def hidden_bars(model: Model, point: Point, places: Places) -> Iterator[tuple[Array, HypothesisKind]]:
    """Where a bar truly lies (2,), between the spots, and the evidence for each of these."""
    random, weight = np.random.default_rng(7), 1.0 / model.station["standard_error"].to_numpy(float)[:, None]
    slope, spots = weight * point.slope, places.x.size
    for _ in range(DRAWN):
        true = random.uniform((4.0, -1.3), (28.0, 1.3))
        shapes = {"x": true[0], "y": true[1], **BAR}
        candidate = place_candidate(library()["unlisted_bed"], shapes, places.plausible)
        trace = weight * responses(model, point, [cause_of(CASE, candidate, shapes)])
        nothing, z = np.zeros(len(trace)), np.zeros(slope.shape[1])
        length = score_test.project(slope, nothing, z, trace).length[0]
        residual = VISIBLE / length * trace[:, 0] + random.standard_normal(len(trace))
        projected = score_test.project(slope, residual, z, weight * places.fingerprints)
        yield true, kind_of_hypotheses("bed", projected, np.full(spots, places.plausible), np.full(spots, 1.0 / spots))


def test_the_mean_of_where_it_may_be_is_nearer_than_the_best_spot(bed: tuple[Model, Point, Places]) -> None:
    """Within 1.5 m in as many cases, and a tenth nearer (root mean square)."""
    _, _, places = bed
    away = []
    for true, kind in hidden_bars(*bed):
        best = kind.best
        x, y, *_ = mean_place(places, kind.log_evidence, float(places.length[best]))
        away.append([np.hypot(*(true - (places.x[best], places.y[best]))), np.hypot(*(true - (x, y)))])
    of_best, of_mean = np.array(away).T
    assert np.mean(of_mean < NEAR) >= np.mean(of_best < NEAR)
    assert np.sqrt(np.mean(of_mean**2)) < 0.9 * np.sqrt(np.mean(of_best**2))


def test_two_spots_alike_are_told_as_the_middle_and_how_far_they_lie_apart(bed: tuple[Model, Point, Places]) -> None:
    _, _, places = bed
    two = replace(places, x=np.array([4.0, 6.0, 20.0]), y=np.zeros(3), length=np.array([0.5, 0.5, 2.0]))
    x, y, x_error, y_error = mean_place(two, np.array([3.0, 3.0, 9.0]), 0.5)
    assert (x, y, x_error, y_error) == pytest.approx((5.0, 0.0, 1.0, 0.0))
