"""Pictures of places, instruments and fields on a page: what is marked is what was found."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnoses import EVERY_KIND, NO_LOCATION, NOTHING, a_diagnosis, a_field, an_anomaly, an_instrument

from vegglue.case.config import load_case
from vegglue.pages.headline import diagnosis_section
from vegglue.pages.place_maps import field_picture, outlines, place_picture, plan_marks
from vegglue.pages.run import Run, accepted_causes
from vegglue.results.causes import FieldMapKept
from vegglue.wording.sentences import phrase

CASE = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
MAP = FieldMapKept(np.array([30.0, 31.0]), np.array([-0.5, 0.5]), np.full((2, 2), 0.6), np.array([[0.1, 0.4]] * 2))


def run_in(folder: Path) -> Run:
    """Only what pictures of causes ask of a run."""
    return Run(folder, CASE, *[None] * 7)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("odds", "counted"),
    [({"wind": 1e9, "bed": 210.4, "inflow": 4.0}, 2), ({"wind": 1e9}, 1), ({}, 0), ({"bed": 0.25, "wind": 1e-6}, 2)],
)
def test_odds_are_those_against_the_nearest_rivals(odds: dict[str, float], counted: int) -> None:
    assert phrase("against_rivals", an_anomaly(odds=odds)).count("likely") == counted


@pytest.mark.parametrize(("term", "amplitude"), [("drag", 0.4), ("bed", -0.1), ("inflow", 0.1), ("viscosity", -0.01)])
def test_a_place_is_marked_and_named_by_its_term_and_sign(tmp_path: Path, term: str, amplitude: float) -> None:
    place = an_anomaly(term=term, amplitude=amplitude)
    found = replace(a_diagnosis(place_map={"term": term}, steps=()), places=(place,))
    acting = phrase("acting", term, amplitude)
    assert acting != phrase("acting", term, -amplitude)
    assert accepted_causes(found).startswith(acting)
    (picture,) = place_picture(run_in(tmp_path), found)
    for words in (picture.caption, picture.alt):
        assert f"{acting}, " in words
    assert "<" not in picture.alt


def test_every_place_and_every_excluded_reading_is_marked() -> None:
    marks = plan_marks(EVERY_KIND, outlines(CASE))
    assert [(one.x, one.y) for one in marks.spots] == [(one.x, one.y) for one in EVERY_KIND.places]
    assert len(marks.spots[1].words) > len(marks.spots[0].words), "one of another term than the map is named"
    assert marks.aside.tolist() == [[36.0, 1.0]]
    assert len(marks.patches) == len(CASE.plants.patches)


def test_odds_of_instruments_are_bayes_factors() -> None:
    everywhere = an_instrument(kind="probe", x=np.nan, stations=(0, 3), offset=-0.0433, log_factor=2.0)
    section = diagnosis_section(replace(NOTHING, instruments=(an_instrument(), everywhere)))
    assert section.odds == pytest.approx([np.exp(9.5), np.exp(2.0)])


def test_without_a_place_the_map_is_drawn_and_without_scores_it_is_not(tmp_path: Path) -> None:
    (picture,) = place_picture(run_in(tmp_path), replace(NO_LOCATION, steps=()))
    assert picture.name == "missing-places"
    assert not list(place_picture(run_in(tmp_path), NOTHING))


@pytest.mark.parametrize(
    ("term", "number"), [("friction", "60 ± 10"), ("bed", "−0.050 ± 0.10"), ("viscosity", "0.020")]
)
def test_a_field_is_drawn_in_its_unit(tmp_path: Path, term: str, number: str) -> None:
    value = {"friction": 0.6, "bed": -0.05, "viscosity": 0.02}[term]
    found = replace(NOTHING, field=a_field(term=term, value=value), field_map=MAP)
    (picture,) = field_picture(run_in(tmp_path), found)
    assert number in picture.caption
    assert not list(field_picture(run_in(tmp_path), NOTHING))
