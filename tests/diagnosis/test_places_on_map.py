"""Places that were found are told where they lie on the map, if the case knows one."""

import pytest
from diagnoses import an_anomaly
from linear_baseline import CASE_OF_TWINS
from verdicts import inputs, said

from vegglue.case.frame import Frame
from vegglue.case.schema import Case
from vegglue.case.site_schema import CentrelineShape
from vegglue.diagnosis.causes_in_words import places_told
from vegglue.diagnosis.places_on_map import places_on_map_in_words
from vegglue.diagnosis.search_state import SearchState


def on_a_map(frame: Frame | None, centreline: CentrelineShape | None = None) -> Case:
    grid = CASE_OF_TWINS.grid.model_copy(update={"centreline": centreline})
    return CASE_OF_TWINS.model_copy(update={"frame": frame, "grid": grid})


@pytest.mark.parametrize(
    ("frame", "centreline", "told"),
    [
        (None, None, ""),
        # Ten metres to the north, two to its left, which is west.
        (Frame(origin=(155000.0, 463000.0), angle=90.0), None, "x = 10.0, y = 2.0 m at 154998.0, 463010.0."),
        (None, CentrelineShape(points=((5.0, 7.0), (25.0, 7.0), (65.0, 7.0))), "x = 10.0, y = 2.0 m at 15.0, 9.0."),
    ],
)
def test_a_place_is_told_on_the_map(frame: Frame | None, centreline: CentrelineShape | None, told: str) -> None:
    said_of_it = places_on_map_in_words(on_a_map(frame, centreline), [(10.0, 2.0)])
    assert said_of_it == (f"On the map lies {told}" if told else "")
    assert places_on_map_in_words(on_a_map(frame, centreline), []) == ""


def test_it_stands_beside_what_was_found() -> None:
    place = an_anomaly()
    assert places_told(SearchState(places=(place,))) == [(place.x, place.y)]
    words = "On the map lies x = 10.0, y = 2.0 m at 154998.0, 463010.0."
    assert words in said(inputs(on_map=words))[2]
