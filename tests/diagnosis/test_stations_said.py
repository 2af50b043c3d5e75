"""What `check` says of measurements: their places, values and heights."""

import numpy as np
import pytest
from sound_case import ROWS, SOUND, odd


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        (
            "low,A,12,4.6,0.3,0.01",
            "The station at x = 12, y = 4.6 m of experiment low is outside the wet channel, about 0.3",
        ),
        ("low,A,12,5.6,0.3,0.01", "The station at x = 12, y = 5.6 m of experiment low is outside the grid"),
        ("low,A,45,0,0.3,0.01", "The station at x = 45, y = 0 m of experiment low is outside the grid"),
        ("low,A,12,1.5,0.3,0.01", "Stations of A at y = 1.5 m lie on the edge of patch p1"),
    ],
)
def test_an_odd_station_is_said(tmp_path, row, expected):
    assert [sentence for sentence in odd(tmp_path, rows=ROWS + row + "\n") if sentence.startswith(expected)]


def test_many_stations_outside_are_one_sentence(tmp_path):
    said = odd(tmp_path, rows=ROWS + "".join(f"low,A,-{x},0,0.3,0.01\n" for x in (1, 2)))
    of_grid = [sentence for sentence in said if "outside the grid" in sentence]
    assert of_grid == ["2 places of experiment low, the first at x = -1, y = 0 m, are outside the grid, and not used."]


def test_places_of_a_map_are_said_first(tmp_path):
    heading, *rows = ROWS.splitlines()
    on_map = "".join(f"low,A,{683_120 + x},{247_480 + y},0.3,0.01\n" for x in (12, 20) for y in (-1, 0.7))
    first, *_ = odd(tmp_path, rows=f"{heading}\n{on_map}")
    assert first.startswith(
        "All velocities lie more than the length of the grid away from it, the first at x = 683132, y"
    )
    one_inside = f"{heading}\n{on_map}{rows[0]}\n"
    assert not [one for one in odd(tmp_path, rows=one_inside) if "on a map" in one]


HEAD = ROWS.splitlines()[0] + "\n"
PLACES = [(x, y) for x in (8, 20, 36) for y in (-1, 0.7)]


@pytest.mark.parametrize(
    ("size", "said"),
    [
        (
            0.3048,
            "4 of 6 velocities are outside the grid, the first at x = 65.6168, y = -3.28084 m, and all would lie ",
        ),
        (
            0.01,
            "6 of 6 velocities are outside the grid, the first at x = 800, y = -100 m, and all would lie inside if ",
        ),
        (0.001, "all would lie inside if x and y were in mm: check their unit."),
        (1000.0, "within 0.028 m of a grid of 40 m, the first at x = 0.008, y = -1 m, as if x were in km: check its "),
    ],
)
def test_places_in_another_unit_are_said(tmp_path, size, said):
    """Stations at 0.1, 0.3 and 0.5 km stood within half a metre, and nothing was odd."""
    across = 1.0 if size > 1.0 else size
    rows = "".join(f"low,A{x},{x / size},{y / across},0.4,0.01\n" for x, y in PLACES)
    assert [one for one in odd(tmp_path, rows=HEAD + rows) if said in one]


def test_places_of_one_section_are_in_no_other_unit(tmp_path):
    rows = "".join(f"low,A,{x},{y},0.4,0.01\n" for x in (0.01, 0.02) for y in (-1, 0.7, 30))
    assert not [one for one in odd(tmp_path, rows=HEAD + rows) if "unit" in one]


def test_a_floor_that_rises_is_said(tmp_path):
    """A slope with the sign of dz/dx was taken for what it says."""
    found = odd(tmp_path, text=SOUND.replace("bed_slope: 0.001", "bed_slope: -0.001"))
    assert "The floor rises by 0.04 m downstream (`bed_slope` -0.001): the slope of a floor that falls" in found[0]


def test_exchanged_axes_are_said_first(tmp_path):
    exchanged = "".join(f"low,A,{y},{x},0.3,0.01\n" for x in (12, 20) for y in (-1, 0.7))
    first, second, *_ = odd(tmp_path, rows=ROWS.splitlines()[0] + "\n" + exchanged)
    assert first.startswith("All 4 velocities outside the grid, the first at x = -1, y = 12 m, would lie inside with x")
    assert second.startswith("4 places of experiment low")
    beyond = exchanged.replace(",20,", ",50,")  # which no exchange brings inside
    assert not [one for one in odd(tmp_path, rows=ROWS.splitlines()[0] + "\n" + beyond) if "exchanged" in one]


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (ROWS + "low,A,12,-1.1,-999,0.01\n", "The velocity -999 m/s at x = 12, y = -1.1 m (section A of exp"),
        (ROWS.replace(",0.3,", ",30,").replace(",0.5,", ",50,"), "3 values of velocity (all there are; the first 30 "),
        (ROWS.replace("0.01", "1"), "3 values of velocity (all there are; the first 0.3 m/s at x = 12, y = 0.7 m): "),
    ],
)
def test_values_that_no_flow_can_have_are_said_first(tmp_path, rows, expected):
    said = odd(tmp_path, rows=rows)
    assert len(said) == 1
    assert said[0].startswith(expected)


@pytest.mark.parametrize(("turned", "said"), [(True, True), (False, False)])
def test_heights_that_count_from_the_surface_are_said(tmp_path, turned, said):
    """A log law of 0.71 m/s, upside down, was 0.64 m/s, and nothing was odd."""
    law = [(z, 0.125 * np.log(1000.0 * z)) for z in (0.1, 0.3, 0.5, 0.8)]
    points = [(x, y, 0.99 - z if turned else z, u) for x in (20, 30) for y in (-1, 0.7) for z, u in law]
    rows = "".join(f"s{x},ADV,{x},{y},{z},{u:.4f},0.01\n" for x, y, z, u in points)
    adv = "case,device,x,y,z,u,u_se\n" + rows
    entries = "".join(
        f"  - {{kind: adv, file: velocities.csv, experiment: low, section: s{x}, case: s{x}, average: profile}}\n"
        for x in (20, 30)
    )
    text = SOUND.replace("  - {kind: velocity, file: velocities.csv}\n", entries)
    found = [one for one in odd(tmp_path, text=text, rows=adv) if "as if their heights counted from the surface" in one]
    assert bool(found) == said
    assert not said or found[0].startswith("Velocities fall from the bed to the surface in 4 of 4 verticals outside ")


@pytest.mark.parametrize("exchanged", [True, False])
def test_heights_and_velocities_that_are_exchanged_are_said(tmp_path, monkeypatch, exchanged):
    """Only the discharge was said to be another: 5.1 m3/s instead of 1.6."""
    monkeypatch.chdir(tmp_path)
    law = [(z, 0.08 * np.log(600.0 * z)) for z in (0.05, 0.2, 0.4, 0.6, 0.8)]
    pairs = [(y, *((u, z) if exchanged else (z, u))) for y in (-1, -0.5, 0, 0.7) for z, u in law]
    rows = "".join(f"s30,ADV,30,{y},{z:.4f},{u:.4f},0.01\n" for y, z, u in pairs)
    entry = "  - {kind: adv, file: velocities.csv, experiment: low, section: s30, case: s30, average: profile}\n"
    text = SOUND.replace("  - {kind: velocity, file: velocities.csv}\n", entry)
    said = [one for one in odd(tmp_path, text, "case,device,x,y,z,u,u_se\n" + rows) if "look exchanged" in one]
    assert bool(said) == exchanged
    if exchanged:
        assert said[0].startswith("velocities.csv: the columns `z` and `u` look exchanged: in 4 of 4 verticals outside")
        assert "exchange the two headings, or say which column is which by `columns: {z: ..., u: ...}`" in said[0]


def adv_case(heights: tuple[float, ...]) -> tuple[str, str]:
    """Config and rows of two verticals with points at these heights [m] over the bed."""
    rows = "".join(f"s20,ADV,20,{y},{z},{0.4 + 0.1 * k},0.01\n" for y in (-1, 0.7) for k, z in enumerate(heights))
    entry = "  - {kind: adv, file: velocities.csv, experiment: low, section: s20, case: s20, average: profile}\n"
    text = SOUND.replace("  - {kind: velocity, file: velocities.csv}\n", entry)
    return text, "case,device,x,y,height,u,u_se\n" + rows


@pytest.mark.parametrize(
    ("height", "said"),
    [
        (
            -0.1,
            "2 points of s20 in experiment low not used: below the bed, the first at x = 20, y = -1 m, -0.1 m",
        ),
        (
            8.0,
            "2 points of s20 in experiment low not used: above the water surface, the first at x = 20, y = -1",
        ),
    ],
)
def test_points_outside_the_water_are_not_left_out_in_silence(tmp_path, height, said):
    """One height with a wrong sign was dropped from its vertical, and nothing was odd."""
    text, rows = adv_case((0.2, 0.4, 0.6, height))
    assert [one for one in odd(tmp_path, text, rows) if one.startswith(said)]
    assert not [one for one in odd(tmp_path, *adv_case((0.2, 0.4, 0.6))) if "not used" in one]


@pytest.mark.parametrize(("x", "said"), [(12, True), (14, False)])
def test_stations_of_two_sections_at_one_place_are_said(tmp_path, x, said):
    """A section with the x of another, and a copied file of levels, counted twice without a word."""
    found = [one for one in odd(tmp_path, rows=f"{ROWS}low,B,{x},-0.7,0.45,0.01\n") if "share places" in one]
    assert bool(found) == said
    assert not said or found[0].startswith(
        "2 stations of velocity in experiment low share places, the first at x = 12, y = -0.7 m (of A and B), and"
    )
