"""Where across the channel velocities stand: a wading survey must not fall on the axis unsaid."""

import re
from pathlib import Path

import numpy as np
import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations


@pytest.mark.parametrize("heading", ["Dist. from left bank (m)", "Rive gauche [cm]", "Distance", "Punkt, m", "y/B"])
def test_velocities_of_a_section_are_no_repeats_on_its_axis(tmp_path: Path, heading: str) -> None:
    """70 velocities of a wading survey became 7 on the axis, with their scatter across as errors."""
    table = f"Chainage (m);{heading};Velocity (m/s)\n10;0.5;0.41\n10;1.5;0.52\n18;0.5;0.40\n"
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, wading__csv=table)
    with pytest.raises(InputError, match=r"at x = 10 m that differ in '.*'; name it by `columns: \{y: \.\.\.\}`"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


@pytest.mark.parametrize(
    "table",
    [
        "x;time (s);u\n10;1;0.41\n10;2;0.52\n",
        "x;Probe (cm);u\n10;3.5;0.41\n10;3.5;0.52\n18;4;0.5\n",
        "x;Remark (m);u\n10;at the pole;0.41\n10;later;0.52\n",
    ],
)
def test_repeats_on_the_axis_are_averaged_and_it_is_said(tmp_path: Path, table: str) -> None:
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, adv__csv=table), tmp_path / "brook.yaml")
    found = read_observations(case).table
    assert found["y"].tolist() == [0.0] * len(found)
    assert case.imported is not None
    assert "1 repeat averaged at x = 10, y = 0 m, too few" in case.imported[0].taken
    assert "y = 0 for want of a column" in case.imported[0].taken


WADING = "Chainage (m);Dist. from left bank (m);Velocity (m/s)\n10;0.5;0.41\n10;1.5;0.52\n18;0.5;0.40\n"
FROM_THE_BANK = '{columns: {y: "Dist. from left bank (m)"}, flip: y, zero: [1, 250 cm]}'


@pytest.mark.parametrize(
    ("words", "table", "places"),
    [
        (FROM_THE_BANK, WADING, [(11, 2.0), (11, 1.0), (19, 2.0)]),
        ("{zero: [0, -1]}", "x;y;u\n1;0.5;0.4\n", [(1, -0.5)]),
        ("{x: 12 m}", "y;u\n-1;0.4\n1;0.5\n", [(12, -1), (12, 1)]),
        ("{line: [[8, 2], [8, -2]]}", "Distance (m);Velocity\n0.5;0.4\n1;0.5\n", [(8, 1.5), (8, 1)]),
        ("{line: [[8, 2], [8, -2]]}", "DMG (m);Depth (m);Mean Speed (m/s)\n0.5;1;0.4\n1;1;0.5\n", [(8, 1.5), (8, 1)]),
    ],
)
def test_the_site_file_helps_a_table_to_its_places(
    tmp_path: Path, words: str, table: str, places: list[tuple[float, float]]
) -> None:
    """A table without x was told to give `line`, and refused with it."""
    site = CHANNEL + JUNE + f"files: {{a.csv: {words}}}\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", site, a__csv=table), tmp_path / "brook.yaml")
    found = read_observations(case).table
    assert found[["x", "y"]].to_numpy() == pytest.approx(np.array(places, dtype=float))


@pytest.mark.parametrize(
    ("words", "table", "said"),
    [
        ("{line: [[8, 2], [8, -2]]}", "y;u\n1;0.4\n", "in y; take it out"),
        ("{line: [[8, 2], [8, -2]]}", "when;u\n1;0.4\n", "column with readings of the tape for `line`, got u, when;"),
        ("{x: 8}", "x;y;u\n1;1;0.4\n", "expected no `x` in its entry of `files`"),
        ("{zero: [0, 1], coordinates: map}", "x;y;u\n1;1;0.4\n", "either `zero`, a place in the channel, or"),
        ("{zero: 3}", "x;y;u\n1;1;0.4\n", "zero expected 2 numbers in m, got 3"),
    ],
)
def test_words_of_places_that_make_no_sense_are_refused(tmp_path: Path, words: str, table: str, said: str) -> None:
    site = CHANNEL + JUNE + f"files: {{a.csv: {words}}}\n"
    with pytest.raises(InputError, match=re.escape(said)):
        vegglue.import_folder(folder_of(tmp_path / "brook", site, a__csv=table), tmp_path / "brook.yaml")


def test_depths_of_a_wading_sheet_are_told_as_not_read(tmp_path: Path) -> None:
    """They were told among what was read, and nothing was made of them."""
    table = "x;y;Depth (m);Velocity (m/s)\n10;-1;0.8;0.41\n10;0;0.9;0.52\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv=table), tmp_path / "brook.yaml")
    assert case.imported is not None
    assert case.imported[0].taken.endswith("not read: Depth (m)")
    assert "depth" not in case.imported[0].columns


def test_velocities_of_other_depths_are_no_repeats_on_the_axis(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv="x;Depth (m);u\n10;0.8;0.41\n10;0.9;0.52\n")
    with pytest.raises(InputError, match=r"at x = 10 m that differ in 'Depth \(m\)'"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


def test_depths_that_read_as_names_of_experiments_are_depths(tmp_path: Path) -> None:
    """Where depths were whole numbers, and experiments called so, each row was of the experiment that was its depth."""
    site = CHANNEL + "experiments: {'1': {discharge: 1, level: 0.8}, '2': {discharge: 2, level: 1}}\n"
    folder = folder_of(tmp_path / "brook", site, a__csv="x;y;depth;u\n10;-1;1;0.41\n10;0;2;0.52\n")
    with pytest.raises(InputError, match="expected a column with the experiment of each row"):
        vegglue.import_folder(folder, tmp_path / "brook.yaml")


SURVEY = "x;y;z\n" + "".join(f"{x};{y};{abs(y - 3) / 4}\n" for x in (0, 20) for y in range(7))
POINTS = "x;Dist. from left bank (m);height above bed;u\n" + "".join(
    f"10;{y};{height};0.4\n" for y in (2, 3, 4) for height in (0.1, 0.2)
)


def test_verticals_beside_a_survey_are_told_as_such(tmp_path: Path) -> None:
    """Without `zero` the bed of a temporary file was said to give no level to 6 of 6 cells."""
    zero = "zero: [0, 10], columns: {y: 'Dist. from left bank (m)'}"
    site = f"bed: {{file: bed.csv, sections: true}}\n{JUNE}files: {{adv.csv: {{{zero}}}}}\n"
    folder = folder_of(tmp_path / "brook", site, bed__csv=SURVEY, adv__csv=POINTS)
    with pytest.raises(InputError, match=r"y = 0 and 6 m, got 3 verticals beside it, the first at y = 12 m") as told:
        vegglue.import_folder(folder, tmp_path / "brook.yaml")
    assert "brook-data/adv.csv: expected verticals" in str(told.value)
