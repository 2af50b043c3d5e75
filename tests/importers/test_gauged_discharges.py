"""Discharges beside the verticals of a gauging are those of the section once, or shares that are no discharge of it."""

from pathlib import Path

import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.measurements.observations import read_observations

SQUARE, OBLIQUE = "[[12, 1.5], [12, -1.5]]", "[[12, 1.5], [15, -1.5]]"


def gauging(tmp_path: Path, line: str, discharges: list[str]) -> tuple[list[tuple[str, str, float]], str]:
    """Kind, section and value of each station of one gauging along a tape, and what was said of it."""
    verticals = zip(("0.3", "1.0", "2.0", "2.7"), ("0.3", "0.5", "0.5", "0.3"), discharges, strict=True)
    table = "\n".join(["Dist (m);Velocity (m/s);Q (m3/s)", *(";".join(one) for one in verticals)])
    site = CHANNEL + JUNE + f"files: {{a.csv: {{line: {line}}}}}\n"
    case = vegglue.import_folder(folder_of(tmp_path / "brook", site, a__csv=table), tmp_path / "brook.yaml")
    found = read_observations(case).table
    assert case.imported is not None
    rows = zip(found["kind"].astype(str), found["section"].astype(str), found["value"].tolist(), strict=True)
    return sorted(rows), case.imported[0].taken


@pytest.mark.parametrize(("line", "section"), [(SQUARE, "x12.00"), (OBLIQUE, "x13.06")])
def test_shares_of_verticals_are_no_discharge_of_the_section(tmp_path: Path, line: str, section: str) -> None:
    """They were refused as repeated rows of a table that the user had not written; each vertical of an oblique tape was
    a section with its share as the discharge of all.
    """
    found, said = gauging(tmp_path, line, ["0.12", "0.25", "0.25", "0.12"])
    assert found == [("velocity", section, value) for value in (0.3, 0.3, 0.5, 0.5)]
    assert "4 discharges left out, as those of one section differ: shares of its verticals" in said


def test_a_discharge_that_every_row_repeats_counts_once(tmp_path: Path) -> None:
    found, said = gauging(tmp_path, SQUARE, ["1.8"] * 4)
    assert found == [("discharge", "x12.00", 1.8), *(("velocity", "x12.00", value) for value in (0.3, 0.3, 0.5, 0.5))]
    assert "1 of discharge" in said
    assert "left out" not in said


@pytest.mark.parametrize(
    ("levels", "kept"),
    [
        (["0.97", "0.97", "0.97"], [0.97]),
        (["0.97", "0.98", "0.97"], [0.97, 0.98, 0.97]),
        (["0.97", "", "0.97"], [0.97, 0.97]),
    ],
)
def test_a_level_that_every_vertical_repeats_counts_once(tmp_path: Path, levels: list[str], kept: list[float]) -> None:
    """One reading of a gauge weighed as many as there were verticals."""
    rows = (f"8,{y},0.4,{level}" for y, level in zip((-1, 0, 1), levels, strict=True))
    folder = folder_of(tmp_path / "brook", CHANNEL + JUNE, a__csv="\n".join(["x,y,u,WSE (m)", *rows]))
    case = vegglue.import_folder(folder, tmp_path / "brook.yaml")
    found = read_observations(case).table
    assert found[found["kind"] == "level"]["value"].tolist() == kept
    assert case.imported is not None
    assert ("levels of 1 section once" in case.imported[0].taken) == (len(kept) == 1)
