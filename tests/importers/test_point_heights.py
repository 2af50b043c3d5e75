"""Velocities of one vertical are no repeats, wherever their heights are counted from."""

from pathlib import Path

import numpy as np
import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations

DEPTH = 0.9
# A log law over k_s = 0.03 m with u* = 0.05 m/s: u(z) = 2.5 u* ln(30 z / k_s); its mean is 2.5 u* (ln(30 h / k_s) - 1).
MEAN = 0.125 * (np.log(30.0 * DEPTH / 0.03) - 1.0)


def law(z: float) -> float:
    return float(0.125 * np.log(30.0 * z / 0.03))


def verticals(heading: str, *columns: str) -> str:
    """Four heights at four places; `columns` from z above the bed: `below`, `share`, `water`."""
    of = {"above": lambda z: z, "below": lambda z: DEPTH - z, "share": lambda z: z / DEPTH, "water": lambda z: DEPTH}
    rows = [
        ";".join(f"{value:.5f}" for value in (x, y, *(of[one](z) for one in columns), law(z)))
        for x in (8, 20)
        for y in (-0.5, 0.5)
        for z in (0.1, 0.3, 0.5, 0.7)
    ]
    return "\n".join([f"x;y;{heading};u", *rows])


@pytest.mark.parametrize(
    ("heading", "columns"),
    [
        ("depth", ["below"]),
        ("Depth below surface (m)", ["below"]),
        ("Messtiefe", ["below"]),
        ("Profundidad [m]", ["below"]),
        ("Abstand Sohle [m]", ["above"]),
        ("Messhöhe [m]", ["above"]),
        ("dist. to bed", ["above"]),
        ("hoogte", ["share"]),
        ("rel. depth", ["share"]),
        ("z/h", ["share"]),
        ("Tiefe [m];Wassertiefe [m]", ["below", "water"]),
    ],
)
def test_heights_that_are_not_known_are_asked_for(tmp_path: Path, heading: str, columns: list[str]) -> None:
    """Four points of a vertical were averaged as four repeats of one depth average, with their shear as its error."""
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=verticals(heading, *columns))
    with pytest.raises(InputError, match=r"several at one place that differ in '.*'; name it in `columns`"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize("heading", ["Water depth;Measurement depth", "h [m];Distance from surface [m]"])
def test_depths_below_the_surface_are_heights_above_the_bed(tmp_path: Path, heading: str) -> None:
    table = verticals(heading, "water", "below")
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    assert case.imported is not None
    assert "height above the bed from both depths" in case.imported[0].taken
    assert (tmp_path / "brook-data" / "a.csv").read_text(encoding="utf-8").startswith("case,device,x,y,height,u\n")
    found = read_observations(case).table["value"].to_numpy()
    assert found == pytest.approx(np.full(4, MEAN), rel=0.02)


def test_a_depth_of_the_water_that_stands_once_is_asked_for(tmp_path: Path) -> None:
    """Points whose height could not be told were averaged with the others of their place."""
    rows = (f"{x};0;{depth};{below};0.4" for x in (8, 20) for depth, below in ((0.9, 0.2), ("", 0.7)))
    table = "\n".join(["x;y;water depth;measurement depth;u", *rows])
    with pytest.raises(InputError, match="differ in 'measurement depth'"):
        vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")


def test_a_depth_of_the_water_that_is_read_again_is_no_height(tmp_path: Path) -> None:
    table = "x;y;depth;u\n8;0;0.90;0.4\n8;0;0.93;0.42\n20;0;0.5;0.4\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    assert read_observations(case).table["value"].tolist() == [0.41, 0.4]


def test_heights_whose_unit_nobody_stated_are_refused_with_what_came(tmp_path: Path) -> None:
    """Heights in cm under `Height above bed`: the message named `floor` and `offset`, and neither unit nor heights."""
    rows = "".join(f"A;20;{y};{100 * z:g};{law(z):g}\n" for y in (-1, 0, 1) for z in (0.1, 0.2, 0.4))
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv="section;x;y;Height above bed;u\n" + rows)
    said = r"got none: at x = 20 m and y = -1 to 1 m the bed lies at .* m, the points 10 to 40 m above it; check unit"
    with pytest.raises(InputError, match=said):
        read_observations(vegglue.import_folder(folder, tmp_path / "brook.yaml"))


@pytest.mark.parametrize(
    "heading", ["Sohlabstand [m]", "Abstand von der Sohle [m]", "Höhe ü. Sohle", "hoehe ueber sohle"]
)
def test_heights_above_the_bed_are_known_in_german(tmp_path: Path, heading: str) -> None:
    """A log law at four heights was four repeats at one place: `Sohlabstand` was not read."""
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=verticals(heading, "above"))
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert case.imported is not None
    assert case.imported[0].columns["height"] == heading


@pytest.mark.parametrize("heading", ["height above bed", "z above bed"])
def test_heights_that_are_not_used_are_said(tmp_path: Path, heading: str) -> None:
    """The line told `height from Height above bed`, as if it had made averages of points at 0.2 of the depth."""
    rows = "".join(f"8;{y};0.1;0.4\n" for y in (-1, 0, 1))
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=f"x;y;{heading};u\n{rows}")
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert case.imported is not None
    assert "3 of velocity, taken for averages over the depth, as few places have several" in case.imported[0].taken


@pytest.mark.parametrize(("below", "average"), [(0.54, True), (0.81, False)])
def test_a_point_at_four_tenths_of_the_depth_is_its_average_and_no_other(
    tmp_path: Path, below: float, average: bool
) -> None:
    """Of a point at a tenth of the depth, where a log law has 0.8 of its average, nothing was to be done."""
    rows = "".join(f"8;{y};{DEPTH};{below};0.4\n" for y in (-1, 0, 1))
    table = f"x;y;Water depth;Measurement depth;u\n{rows}"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    assert case.imported is not None
    taken = case.imported[0].taken
    assert ("3 of velocity, at about 0.4 of the depth above the bed, and so taken for averages" in taken) == average
    assert ("correct others, or state errors that hold the difference" in taken) != average
    assert read_observations(case).table["value"].tolist() == [0.4, 0.4, 0.4]
