"""What a page says of places, instruments, fields and the model's own error: which, where, how large, at what odds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnoses import EVERY_KIND, NO_LOCATION, NOTHING, a_diagnosis, a_field, an_anomaly, an_instrument

from vegglue.case.config import load_case
from vegglue.pages.cause_words import (
    accepted_causes,
    against_rivals,
    field_in_words,
    instrument_rows,
    place_rows,
)
from vegglue.pages.place_maps import field_picture, outlines, place_picture, plan_marks
from vegglue.pages.run import Run
from vegglue.results.causes import FieldMapKept
from vegglue.results.diagnosis import Diagnosis

CASE = load_case(Path(__file__).parents[2] / "configs" / "twin.yaml")
MAP = FieldMapKept(np.array([30.0, 31.0]), np.array([-0.5, 0.5]), np.full((2, 2), 0.6), np.array([[0.1, 0.4]] * 2))


def run_in(folder: Path) -> Run:
    """Only what pictures of causes ask of a run."""
    return Run(folder, CASE, *[None] * 7)  # type: ignore[arg-type]


def test_odds_are_told_against_the_nearest_rivals() -> None:
    assert against_rivals(an_anomaly(odds={"wind": 1e9, "bed": 210.4, "inflow": 4.0})) == (
        "4.0 to 1 against inflow, 210 to 1 against bed"
    )
    assert against_rivals(an_anomaly(odds={"wind": 1e9})) == "over 1,000 to 1 against all else"
    assert (
        against_rivals(an_anomaly(odds={"position": 20.0, "wind": 1e9}))
        == "20 to 1 against a probe that is off in all experiments"
    )
    assert against_rivals(an_anomaly(odds={})) == ""
    assert against_rivals(an_anomaly(odds={"bed": 0.25, "wind": 1e-6})) == (
        "1 to over 1,000 against wind, 1 to 4.0 against bed"
    ), "as in the verdict, and not 0.25 to 1"


@pytest.mark.parametrize(
    ("term", "amplitude", "said"),
    [("drag", 0.4, "more drag"), ("bed", -0.1, "a lower bed"), ("inflow", 0.1, "water that enters"),
     ("viscosity", -0.01, "less mixing")],
)  # fmt: skip
def test_a_place_is_told_by_its_term_and_sign(tmp_path: Path, term: str, amplitude: float, said: str) -> None:
    place = an_anomaly(term=term, amplitude=amplitude)
    found = replace(a_diagnosis(place_map={"term": term}, steps=()), places=(place,))
    (row,) = place_rows(found)
    assert (row.what, row.x, row.y, row.spot) == (said, "33.0", "−0.6", "3.6 × 0.90")
    assert accepted_causes(found) == f"{said} at x = 33.0 m, y = −0.6 m"
    (picture,) = place_picture(run_in(tmp_path), found)
    for words in (picture.caption, picture.alt):
        assert f"{said}, " in words
        assert "4.0 to 1 against bed, 30 to 1 against eddies" in words
    assert "<" not in picture.alt


def test_every_place_and_every_reading_set_aside_is_marked() -> None:
    marks = plan_marks(EVERY_KIND, outlines(CASE))
    assert [one.words for one in marks.spots] == ["x = 33.0 m, y = −0.6 m", "a higher bed: x = 33.0 m, y = −0.6 m"]
    assert marks.aside.tolist() == [[36.0, 1.0]]
    assert len(marks.patches) == len(CASE.plants.patches)


def test_instruments_are_told() -> None:
    everywhere = an_instrument(kind="probe", x=np.nan, stations=(0, 3), offset=-0.0433, log_factor=2.0)
    rows = instrument_rows(replace(NOTHING, instruments=(an_instrument(), everywhere)))
    assert [row.what for row in rows] == ["one reading", "probe, in all sections"]
    assert [row.where for row in rows] == ["x = 36.0 m, y = 1.0 m", "y = 1.0 m"]
    assert [row.readings for row in rows] == ["1 reading", "2 readings"]
    assert rows[1].offset.startswith("−0.043")
    assert [row.odds for row in rows] == ["over 1,000 to 1", "7.4 to 1"]


def test_without_a_place_the_map_says_so(tmp_path: Path) -> None:
    (picture,) = place_picture(run_in(tmp_path), replace(NO_LOCATION, steps=()))
    assert "No place stands out" in picture.caption
    assert not list(place_picture(run_in(tmp_path), NOTHING))


@pytest.mark.parametrize(
    ("term", "value", "said"),
    [
        ("friction", 0.6, "60 ± 10"),
        ("bed", -0.05, "−0.050 ± 0.10"),
        ("viscosity", 0.02, "0.020"),
        ("inflow", 1e-3, "m/s"),
    ],
)
def test_a_field_is_drawn_in_its_unit(tmp_path: Path, term: str, value: float, said: str) -> None:
    found: Diagnosis = replace(NOTHING, field=a_field(term=term, value=value), field_map=MAP)
    assert said in field_in_words(found)
    (picture,) = field_picture(run_in(tmp_path), found)
    assert said in picture.caption
    assert "50" in picture.caption.split("nothing, ")[1], "half of it lies within two standard errors"
    assert not list(field_picture(run_in(tmp_path), NOTHING))
