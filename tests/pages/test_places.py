"""Maps of places and of a field: everything that was found is marked, and told as what it is."""

import numpy as np
import pytest
from diagnoses import a_diagnosis
from drawings import off_the_sheet, points, texts
from matplotlib.patches import Ellipse, Polygon

from vegglue.pages.flow_maps import Outline
from vegglue.pages.place_maps import (
    FADED,
    DrawnField,
    MarkedSpot,
    PlanMarks,
    draw_field_map,
    draw_places,
    strongest_spots,
)
from vegglue.wording.sentences import phrase

NOWHERE = np.zeros((0, 2))
MAP = a_diagnosis().place_map
FOUND = (MarkedSpot(33.0, -0.6, 1.8, 0.45, "x = 33.0 m"), MarkedSpot(30.0, 0.6, 0.9, 0.9, "less drag: x = 30.0 m"))


def test_every_place_is_marked_with_its_size_and_words() -> None:
    marks = PlanMarks([], np.array([[31.0, 0.5]]), NOWHERE, FOUND)
    (axes,) = draw_places(MAP.x, MAP.y, MAP.score, "drag", marks).axes
    assert points(axes, "*") == [(33.0, -0.6), (30.0, 0.6)]
    assert {"x = 33.0 m", "less drag: x = 30.0 m"} <= set(texts(axes))
    outlined = [one for one in axes.patches if isinstance(one, Ellipse)]
    assert [(one.get_center(), one.width, one.height) for one in outlined] == [
        ((33.0, -0.6), 3.6, 0.9), ((30.0, 0.6), 1.8, 1.8),
    ]  # fmt: skip


def test_plants_that_are_not_on_the_map_are_drawn_as_a_turned_rectangle() -> None:
    marks = PlanMarks([], NOWHERE, NOWHERE, [MarkedSpot(33.0, -0.6, 3.0, 1.0, "plants", 90.0)])
    (axes,) = draw_places(MAP.x, MAP.y, MAP.score, "drag", marks).axes
    (outline,) = [one for one in axes.patches if isinstance(one, Polygon)]
    low, high = outline.get_xy().min(axis=0), outline.get_xy().max(axis=0)
    assert (*low, *high) == pytest.approx((32.0, -3.6, 34.0, 2.4))


def test_stations_set_aside_are_crossed() -> None:
    marks = PlanMarks([], np.array([[31.0, 0.5], [35.0, -0.5]]), np.array([[35.0, -0.5]]))
    (axes,) = draw_places(MAP.x, MAP.y, MAP.score, "drag", marks).axes
    assert points(axes, "x") == [(35.0, -0.5)]
    assert any("×" in text for text in texts(axes))


@pytest.mark.parametrize("term", ["drag", "bed", "inflow", "viscosity"])
def test_labels_name_the_term(term: str) -> None:
    figure = draw_places(MAP.x, MAP.y, 9.0 * MAP.score, term, PlanMarks([], NOWHERE, NOWHERE, FOUND))
    words = " ".join(texts(figure.axes[0]))
    for sign in (1, -1):
        assert phrase("acting", term, sign) in words
    assert off_the_sheet(figure) == []


@pytest.mark.parametrize("places", [1, 2])
def test_places_too_few_for_a_map_can_be_drawn(places: int) -> None:
    part = MAP.x[:places], MAP.y[:places], MAP.score[:places]
    (axes,) = draw_places(*part, "drag", PlanMarks([], np.array([[31.0, 0.5]]), NOWHERE)).axes
    assert points(axes, ".") == [(31.0, 0.5)]
    assert not axes.collections, "no contours"
    assert texts(axes) == [], "no key of contours, and nothing found"


def test_places_draw_contours_patches_and_stations() -> None:
    corners = np.array([[30.0, 0.0], [34.0, 0.0], [34.0, 0.5], [30.0, 0.5]])
    spots = np.array([[31.0, 0.5], [35.0, -0.5]])
    figure = draw_places(MAP.x, MAP.y, 9.0 * MAP.score, "drag", PlanMarks([Outline("p1", corners)], spots, NOWHERE))
    (axes,) = figure.axes
    assert len(axes.collections) == 4, "more and less drag, faces and lines"
    assert points(axes, ".") == [tuple(spot) for spot in spots]
    assert np.array_equal(axes.patches[0].get_xy()[:4], corners)
    assert points(axes, "*") == []
    assert f"largest {9.0 * np.abs(MAP.score).max():.1f}" in " ".join(texts(axes))
    assert off_the_sheet(figure) == []


def test_a_place_shows_the_strongest_spot_of_any_length() -> None:
    """Short spots at x = 0, 1, 2, 3, long ones at 0 and 3, of which those at y = 0 score more."""
    x = np.array([0, 0, 1, 1, 2, 3, 3, 0, 0, 3, 3], float)
    y = np.array([0, 1, 0, 1, 0, 0, 1, 0, 1, 0, 1], float)
    score = np.array([1, 1, 1, 1, 1, -9, 1, -3, 0, -6, 0], float)
    along, across, field = strongest_spots(x, y, score)
    assert (along.tolist(), across.tolist()) == ([0.0, 1.0, 2.0, 3.0], [0.0, 1.0])
    np.testing.assert_allclose(field, [[-3, 1], [-4, 1], [-5, np.nan], [-9, 1]])


def a_drawn_field() -> DrawnField:
    x, y = np.linspace(30.0, 36.0, 7), np.linspace(-1.0, 1.0, 5)
    value = 60.0 * np.exp(-((x[:, None] - 33.0) ** 2) - y**2)
    return DrawnField(x, y, value, np.full(value.shape, 10.0), "change of friction", "%")


def test_a_field_is_pale_where_it_is_not_told_from_nothing() -> None:
    field = a_drawn_field()
    figure = draw_field_map(field, PlanMarks([], np.array([[31.0, 0.5]]), np.array([[31.0, 0.5]]), FOUND[:1]))
    upper, lower, *bars = figure.axes
    told = np.abs(field.value) >= 20.0
    assert 0 < told.sum() < told.size
    mesh = upper.collections[0]
    np.testing.assert_allclose(np.ravel(mesh.get_alpha()), np.where(told, 1.0, FADED).T.ravel())
    np.testing.assert_array_equal(np.ravel(mesh.get_array()), field.value.T.ravel())
    assert mesh.get_clim() == (-60.0, 60.0), "nothing lies in the middle of the colours"
    np.testing.assert_array_equal(np.ravel(lower.collections[0].get_array()), field.error.T.ravel())
    assert [bar.get_ylabel() for bar in bars] == ["change of friction [%]", "standard error [%]"]
    assert points(upper, "*") == [(33.0, -0.6)]
    assert points(upper, ".") == points(lower, ".") == [(31.0, 0.5)]
    assert off_the_sheet(figure) == []


@pytest.mark.parametrize("factor", [0.0, 0.1, 100.0])
def test_a_field_of_one_kind_only_can_be_drawn(factor: float) -> None:
    field = a_drawn_field()
    whole = DrawnField(field.x, field.y, factor + 0.0 * field.value, field.error, field.what, field.unit)
    assert off_the_sheet(draw_field_map(whole, PlanMarks([], NOWHERE, NOWHERE))) == []
