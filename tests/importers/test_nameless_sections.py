"""Measurements of which no section is named: what stands together across the channel is one, and nothing else."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.measurements.observations import read_observations

MAY = "experiments: {May: {discharge: 1500 l/s, level: 90 cm}, June: {discharge: 2000 l/s, level: 95 cm}}\n"
# Two sections of a total station, some centimetres off their lines.
OFF = 0.01 * np.array([3.1, -4.2, 0.7, 5.3, -2.6, 1.9, -6.4, 4.4, -0.8, 2.2])
SCATTERED = [(x + off, y) for (x, y), off in zip([(x, y) for x in (12, 18) for y in range(-2, 3)], OFF, strict=True)]


def imported(folder: Path, site: str, rows: list[str], heading: str = "x;y;u") -> tuple[pd.DataFrame, str]:
    """Stations of a table, and what is said of it."""
    table = "\n".join([heading, *rows]) + "\n"
    case = vegglue.import_folder(folder_of(folder / "brook", site, adv__csv=table), folder / "brook.yaml")
    assert case.imported is not None
    return read_observations(case).table, case.imported[0].taken


def test_scattered_places_are_sections_also_where_two_experiments_share_them(tmp_path: Path) -> None:
    """Each x that was measured twice was a section of its own."""
    rows = [f"{name};{x:.3f};{y};0.4" for name in ("May", "June") for x, y in SCATTERED]
    table, _ = imported(tmp_path, CHANNEL + MAY, rows, "experiment;x;y;u")
    assert sorted(table["section"].unique()) == ["x12.01", "x18.02"]


def test_scattered_verticals_are_sections(tmp_path: Path) -> None:
    """With several heights each vertical was a section of its own; that they are moved to one line is said."""
    rows = [f"{x:.3f};{y};{z};{0.3 + z}" for x, y in SCATTERED if abs(y) < 2 for z in (0.1, 0.2, 0.3, 0.4)]
    table, said = imported(tmp_path, CHANNEL + JUNE, rows, "x;y;height above bed;u")
    assert table.groupby("section")["y"].nunique().tolist() == [3, 3]
    assert "moved to the middle x of their section by up to 0.056 m" in said


@pytest.mark.parametrize("heights", [1, 5])
def test_what_lies_along_the_channel_is_no_section(tmp_path: Path, heights: int) -> None:
    """Places 0.2 m apart on the axis were one section of 8 m."""
    rows = [f"{10 + 0.2 * i:.1f};0;{0.1 * (j + 1):.1f};0.4" for i in range(40) for j in range(heights)]
    table, said = imported(tmp_path, CHANNEL + JUNE, rows, "x;y;height above bed;u")
    assert table["section"].nunique() == 40
    assert "moved" not in said


def test_equal_places_on_many_lines_are_sections_however_near(tmp_path: Path) -> None:
    rows = [f"{10 + 0.1 * i:.1f};{y};0.4" for i in range(6) for y in (-1, 0, 1)]
    assert imported(tmp_path, CHANNEL + JUNE, rows)[0]["section"].nunique() == 6


LEVELS = ["P1;5;0;0.97", "P2;25;0;0.95"]


def test_a_gauge_has_the_name_that_its_table_gives(tmp_path: Path) -> None:
    """It was called section x5.00, and the column was not read."""
    table, said = imported(tmp_path, CHANNEL + JUNE, LEVELS, "Gauge;x;y;level")
    assert list(table["section"]) == ["P1", "P2"]
    assert "section from Gauge" in said


@pytest.mark.parametrize(
    ("heading", "rows", "sections"),
    [
        ("Section;Gauge;x;y;level", [f"A;{row}" for row in LEVELS], ["A", "A"]),
        ("Gauge;x;y;u", ["P1;5;0;0.4", "P1;25;0;0.5"], ["x5.00", "x25.00"]),
    ],
)
def test_a_gauge_names_no_section_of_velocities_nor_where_one_is_named(
    tmp_path: Path, heading: str, rows: list[str], sections: list[str]
) -> None:
    table, said = imported(tmp_path, CHANNEL + JUNE, rows, heading)
    assert list(table["section"]) == sections
    assert "not read: Gauge" in said


def test_a_column_of_readings_of_a_gauge_is_not_taken_for_its_name(tmp_path: Path) -> None:
    site = CHANNEL + JUNE + "files: {adv.csv: {columns: {level: Gauge}}}\n"
    table, _ = imported(tmp_path, site, ["5;0;0.97", "25;0;0.95"], "x;y;Gauge")
    assert list(table["value"]) == [0.97, 0.95]
    assert list(table["section"]) == ["x5.00", "x25.00"]
