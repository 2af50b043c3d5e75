"""Heights above the bed that were taken for levels are told by lowest points that do not follow a falling bed."""

from pathlib import Path

import numpy as np
import pytest
from sound_case import SOUND

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis.case_check import doubts_about
from vegglue.diagnosis.heights_or_levels import remarks_on_unmoved_heights
from vegglue.measurements.observations import read_observations

PLACES = [(x, y) for x in (5.0, 20.0, 35.0) for y in (-1.5, -0.5, 0.5, 1.5)]
HEIGHTS = (0.05, 0.2, 0.4, 0.7)
CONFIGS = Path(__file__).parents[2] / "configs"
IMPORTED = """
imported:
  - {name: points.csv, sha256: "0", taken: points, columns: {z: "z [mm]", u: "u"}}
"""


def said_of(folder: Path, column: str, *, follows: float, scatter: float = 0.0, more: str = "") -> list[str]:
    """What is said of verticals in a flume that falls by 1 mm/m, whose heights follow so much of its bed."""
    off = np.random.default_rng(1).normal(0.0, scatter, len(PLACES))
    rows = [
        f"June/{x:g},adv,{x},{y},{height + one - follows * 0.001 * x:.5f},{0.1 * np.log(height / 0.001):.4f}"
        for (x, y), one in zip(PLACES, off, strict=True)
        for height in HEIGHTS
    ]
    (folder / "points.csv").write_text("\n".join([f"case,device,x,y,{column},u", *rows]), encoding="utf-8")
    one = "  - {{kind: adv, file: points.csv, experiment: low, section: s{0}, case: June/{0}, average: profile{1}}}\n"
    listed = "".join(one.format(x, more) for x in (5, 20, 35))
    before, after = SOUND.split("  - {kind: velocity, file: velocities.csv}\n")
    (folder / "sound.yaml").write_text(before + listed + after + IMPORTED, encoding="utf-8")
    case = load_case(folder / "sound.yaml")
    observations = read_observations(case)
    said = list(remarks_on_unmoved_heights(case, observations))
    assert set(said) <= set(doubts_about(case, build_site(case), observations))
    return said


def test_heights_taken_for_levels(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, "z", follows=0.0, scatter=0.002)
    assert "of experiment low lie at z = 0.051 m from x = 5 to 35 m, where the bed falls by 30 mm" in said
    assert '`columns: {height: "z [mm]"}` of points.csv' in said


def test_levels_follow_the_bed(tmp_path: Path) -> None:
    assert said_of(tmp_path, "z", follows=1.0, scatter=0.002) == []


def test_points_that_scatter_more_than_the_bed_falls_tell_nothing(tmp_path: Path) -> None:
    assert said_of(tmp_path, "z", follows=0.0, scatter=0.04) == []


def test_heights_that_are_said_to_be_heights(tmp_path: Path) -> None:
    assert said_of(tmp_path, "height", follows=0.0) == []


def test_sections_that_count_from_a_floor_of_their_own(tmp_path: Path) -> None:
    assert said_of(tmp_path, "z", follows=0.0, more=", floor: 0.0") == []


@pytest.mark.parametrize("name", ["d0_d3a", "joint", "campaign"])
def test_measurements_of_the_shipped_configs(name: str) -> None:
    case = load_case(CONFIGS / f"{name}.yaml")
    assert list(remarks_on_unmoved_heights(case, read_observations(case))) == []
