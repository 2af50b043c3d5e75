"""Remarks on the places and values of stations."""

import pytest
from sound_case import ROWS, SOUND, found_in, odd

from vegglue.diagnosis.station_check import (
    AxesExchanged,
    PlacesInKilometres,
    PlacesInOtherUnit,
    SharedPlaces,
    StationsOnLand,
    StationsOnMap,
    StationsOnPatchEdge,
    StationsOutsideGrid,
)
from vegglue.measurements.plausibility import ImplausibleValues, Symptom

HEAD, *FIRST = ROWS.splitlines(keepends=True)


@pytest.mark.parametrize(
    ("rows", "remark", "expected"),
    [
        ("low,A,12,4.6,0.3,0.01\n", StationsOnLand, {"first": (12.0, 4.6), "above": 0.3355, "most": False}),
        ("low,A,12,5.6,0.3,0.01\n", StationsOutsideGrid, {"places": 1, "first": (12.0, 5.6)}),
        ("low,A,45,0,0.3,0.01\n", StationsOutsideGrid, {"experiment": "low", "first": (45.0, 0.0)}),
        ("low,A,-1,0,0.3,0.01\nlow,A,-2,0,0.3,0.01\n", StationsOutsideGrid, {"places": 2, "first": (-1.0, 0.0)}),
        ("low,A,12,1.5,0.3,0.01\n", StationsOnPatchEdge, {"section": "A", "patch": "p1", "y": (1.5,)}),
        (
            "low,B,12,-0.7,0.45,0.01\n", SharedPlaces,
            {"quantity": "velocity", "experiment": "low", "stations": 2, "first": (12.0, -0.7), "sections": ("A", "B")},
        ),
    ],
)  # fmt: skip
def test_an_odd_station_is_a_remark(tmp_path, rows, remark, expected):
    found = odd(tmp_path, rows=ROWS + rows)
    assert len(found_in(found, remark)) == len(found_in(found, remark, **expected)) == 1


def test_a_section_of_its_own_shares_no_place(tmp_path):
    assert not found_in(odd(tmp_path, rows=f"{ROWS}low,B,14,-0.7,0.45,0.01\n"), SharedPlaces)


def test_places_of_a_map_are_the_first_remark(tmp_path):
    on_map = "".join(f"low,A,{683_120 + x},{247_480 + y},0.3,0.01\n" for x in (12, 20) for y in (-1, 0.7))
    assert odd(tmp_path, rows=HEAD + on_map)[0] == StationsOnMap((683132.0, 247479.0))
    assert not found_in(odd(tmp_path, rows=HEAD + on_map + FIRST[0]), StationsOnMap)


@pytest.mark.parametrize(
    ("size", "remark", "expected"),
    [
        (0.3048, PlacesInOtherUnit, {"outside": 4, "stations": 6, "first": (65.6168, -3.28084), "unit": "ft"}),
        (0.01, PlacesInOtherUnit, {"outside": 6, "stations": 6, "first": (800.0, -100.0), "unit": "cm"}),
        (0.001, PlacesInOtherUnit, {"unit": "mm"}),
        (1000.0, PlacesInKilometres, {"spread": 0.028, "length": 40.0, "first": (0.008, -1.0)}),
    ],
)
def test_places_in_another_unit(tmp_path, size, remark, expected):
    """Stations at 0.1, 0.3 and 0.5 km stood within half a metre, and nothing was odd."""
    across = 1.0 if size > 1.0 else size
    places = [(x, y) for x in (8, 20, 36) for y in (-1, 0.7)]
    rows = "".join(f"low,A{x},{x / size},{y / across},0.4,0.01\n" for x, y in places)
    assert len(found_in(odd(tmp_path, rows=HEAD + rows), remark, **expected)) == 1


def test_places_of_one_section_are_in_no_other_unit(tmp_path):
    rows = "".join(f"low,A,{x},{y},0.4,0.01\n" for x in (0.01, 0.02) for y in (-1, 0.7, 30))
    found = odd(tmp_path, rows=HEAD + rows)
    assert not found_in(found, PlacesInOtherUnit)
    assert not found_in(found, PlacesInKilometres)


def test_exchanged_axes_are_the_first_remark(tmp_path):
    exchanged = "".join(f"low,A,{y},{x},0.3,0.01\n" for x in (12, 20) for y in (-1, 0.7))
    first, second, *_ = odd(tmp_path, rows=HEAD + exchanged)
    assert first == AxesExchanged(4, (-1.0, 12.0))
    assert found_in([second], StationsOutsideGrid, places=4)
    beyond = exchanged.replace(",20,", ",50,")  # which no exchange brings inside
    assert not found_in(odd(tmp_path, rows=HEAD + beyond), AxesExchanged)


@pytest.mark.parametrize(
    ("rows", "symptom", "count"),
    [
        (ROWS + "low,A,12,-1.1,-999,0.01\n", Symptom.MISSING_MARK, 1),
        (ROWS.replace(",0.3,", ",30,").replace(",0.5,", ",50,"), Symptom.FAST, 3),
        (ROWS.replace("0.01", "1"), Symptom.LARGE_ERROR, 3),
    ],
)
def test_values_that_no_flow_can_have_are_the_only_remark(tmp_path, rows, symptom, count):
    assert [type(one) for one in odd(tmp_path, SOUND, rows)] == [ImplausibleValues]
    assert found_in(odd(tmp_path, SOUND, rows), ImplausibleValues, symptom=symptom, count=count)
