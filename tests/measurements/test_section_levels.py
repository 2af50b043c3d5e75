"""Where a section says no floor and no surface, the bed of the case and the level measured or expected there hold."""

from pathlib import Path

import numpy as np
import pytest
from reach import write_reach

from vegglue.case.config import load_case
from vegglue.case.schema import Case
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations

# Of the brook: a floor that falls by 0.001, and 0.95 m at the outlet, 30 m down.
FLOOR_THERE, EXPECTED_THERE = -0.008, 0.95 + (0.0295 - 0.008)
ADV = "{kind: adv, file: adv.csv, experiment: June, section: A, case: A, average: profile%s}"
LEVELS = "  - {kind: level, file: levels.csv, experiment: June}\n"
TWO_GAUGES = "4,0,1.00\n12,0,0.98\n"


def section_at_8(
    folder: Path, more: str = "", levels: bool = False, header: str = "x,y,z,u,v", gauges: str = TWO_GAUGES
) -> Case:
    """The brook with ADV points at x = 8 m, z in the datum of the bed; v is a tenth of u."""
    rows = [f"case,device,{header}"]
    for y in (-1.0, -0.5, 0.0, 0.5, 1.0):
        for z in (0.05, 0.2, 0.4, 0.6, 0.8):
            u = 0.1 * np.log((z - FLOOR_THERE) / 0.002)
            rows.append(f"A,ADV,8,{y},{z},{u:.6f}" + (f",{0.1 * u:.6f}" if "v" in header else ""))
    (folder / "adv.csv").write_text("\n".join(rows), encoding="utf-8")
    (folder / "levels.csv").write_text(f"x,y,level\n{gauges}", encoding="utf-8")
    line = "{kind: velocity, file: velocities.csv, experiment: June}"
    config = write_reach(folder, (f"  - {line}\n", f"  - {ADV % more}\n" + (LEVELS if levels else "")))
    return load_case(config)


def test_the_bed_and_the_expected_level_hold(tmp_path: Path) -> None:
    points = read_observations(section_at_8(tmp_path)).points
    assert np.allclose(points["bed"], FLOOR_THERE)
    assert np.allclose(points["depth"], EXPECTED_THERE - FLOOR_THERE, atol=1e-9)


def test_measured_levels_hold_before_expected_ones(tmp_path: Path) -> None:
    points = read_observations(section_at_8(tmp_path, levels=True)).points
    assert np.allclose(points["depth"], 0.99 - FLOOR_THERE)


@pytest.mark.parametrize(
    ("gauges", "level"), [("28,0,0.96\n", 0.98), ("2,0,0.98\n", 0.974), ("20,0,0.98\n28,0,0.97\n", 0.992)]
)
def test_beyond_the_gauges_the_surface_falls_as_the_floor_does(tmp_path: Path, gauges: str, level: float) -> None:
    """It was flat: of a single gauge down a steep reach most points lay above the water."""
    points = read_observations(section_at_8(tmp_path, levels=True, gauges=gauges)).points
    assert np.allclose(points["depth"], level - FLOOR_THERE)


def test_a_level_that_is_given_holds_before_all(tmp_path: Path) -> None:
    points = read_observations(section_at_8(tmp_path, ", surface: 0.9", levels=True)).points
    assert np.allclose(points["depth"], 0.9 - FLOOR_THERE)


def test_velocities_across_are_averaged_like_those_along(tmp_path: Path) -> None:
    table = read_observations(section_at_8(tmp_path, ", across: true")).table
    along, across = (table[table["kind"] == kind] for kind in ("velocity", "velocity_across"))
    assert len(along) == len(across) == 5
    assert np.allclose(across["value"], 0.1 * along["value"], rtol=0.03), "linear below, a law of the wall above"
    assert (across["standard_error"] > 0.0).all()


def test_without_a_column_there_is_nothing_across(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"adv\.csv, row 1: .* v .*`across`"):
        read_observations(section_at_8(tmp_path, ", across: true", header="x,y,z,u"))


def test_even_velocities_among_plants_are_their_own_average(tmp_path: Path) -> None:
    """With zero at the bed the average was 5 % too low, and a diagnosis named `among_plants` for it."""
    case = section_at_8(tmp_path)
    rows = [f"A,ADV,14,{y},{z},0.2" for y in (-1.0, 0.5, 1.0) for z in (0.1, 0.2, 0.4, 0.6, 0.8)]
    (tmp_path / "adv.csv").write_text("\n".join(["case,device,x,y,z,u", *rows]), encoding="utf-8")
    found = read_observations(case)
    plants = found.profiles["plants"].to_numpy(dtype=bool)
    assert plants.tolist() == [False, True, True]
    assert np.allclose(found.table["value"][plants], 0.2)
    assert (found.profiles["fitted_error"][plants] > 0.02 * 0.2).all(), "what the lowest part may be is in the error"
