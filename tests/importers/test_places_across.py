"""Where across the channel velocities stand: a wading survey must not fall on the axis unsaid."""

from pathlib import Path

import pytest
from field_folders import CHANNEL, JUNE, folder_of

import vegglue
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations


@pytest.mark.parametrize("heading", ["Dist. from left bank (m)", "Rive gauche [cm]", "Distance", "Punkt, m"])
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
    assert "1 repeats averaged, too few" in case.imported[0].taken
    assert "y = 0 for want of a column" in case.imported[0].taken
