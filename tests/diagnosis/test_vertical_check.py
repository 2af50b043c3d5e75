"""Remarks on the heights, columns and errors of ADV verticals."""

from pathlib import Path

import numpy as np
import pytest
from sound_case import SOUND, found_in, odd, read_case

from vegglue.case.config import load_case
from vegglue.diagnosis.case_check import check_case, critical_remarks
from vegglue.diagnosis.station_check import (
    ErrorsAcrossPlants,
    HeightsExchanged,
    HeightsFromSurface,
    HeightsTakenForLevels,
    PointsOutsideWater,
    remarks_on_errors_across_plants,
    remarks_on_unmoved_heights,
)
from vegglue.measurements.kinds import Unused
from vegglue.measurements.observations import read_observations

CONFIGS = Path(__file__).parents[2] / "configs"
VELOCITIES = "{kind: velocity, file: velocities.csv}"


def adv(*sections: int) -> str:
    """The sound case with ADV sections at these x [m] in place of its velocities."""
    entry = "{{kind: adv, file: velocities.csv, experiment: low, section: s{0}, case: s{0}, average: profile}}"
    return SOUND.replace(VELOCITIES, "\n  - ".join(entry.format(x) for x in sections))


@pytest.mark.parametrize("turned", [True, False])
def test_heights_that_count_from_the_surface(tmp_path, turned):
    """A log law of 0.71 m/s, upside down, was 0.64 m/s, and nothing was odd."""
    law = [(z, 0.125 * np.log(1000.0 * z)) for z in (0.1, 0.3, 0.5, 0.8)]
    points = [(x, y, 0.99 - z if turned else z, u) for x in (20, 30) for y in (-1, 0.7) for z, u in law]
    rows = "".join(f"s{x},ADV,{x},{y},{z},{u:.4f},0.01\n" for x, y, z, u in points)
    found = found_in(odd(tmp_path, adv(20, 30), "case,device,x,y,z,u,u_se\n" + rows), HeightsFromSurface)
    assert found == ([HeightsFromSurface(4, 4, (20.0, -1.0))] if turned else [])


@pytest.mark.parametrize("exchanged", [True, False])
def test_heights_and_velocities_that_are_exchanged(tmp_path, exchanged):
    """Only the discharge was remarked on: 5.1 m3/s instead of 1.6."""
    law = [(z, 0.08 * np.log(600.0 * z)) for z in (0.05, 0.2, 0.4, 0.6, 0.8)]
    pairs = [(y, *((u, z) if exchanged else (z, u))) for y in (-1, -0.5, 0, 0.7) for z, u in law]
    rows = "".join(f"s30,ADV,30,{y},{z:.4f},{u:.4f},0.01\n" for y, z, u in pairs)
    found = found_in(odd(tmp_path, adv(30), "case,device,x,y,z,u,u_se\n" + rows), HeightsExchanged)
    file = tmp_path / "velocities.csv"
    assert found == ([HeightsExchanged(file, "z", 4, 4, (30.0, -1.0))] if exchanged else [])


@pytest.mark.parametrize(("height", "reason"), [(-0.1, Unused.BELOW_BED), (8.0, Unused.ABOVE_SURFACE), (None, "")])
def test_points_outside_the_water_are_a_remark(tmp_path, height, reason):
    """One height with a wrong sign was dropped from its vertical, and nothing was odd."""
    heights = (0.2, 0.4, 0.6, *([height] if reason else []))
    rows = "".join(f"s20,ADV,20,{y},{z},{0.4 + 0.1 * k},0.01\n" for y in (-1, 0.7) for k, z in enumerate(heights))
    found = found_in(odd(tmp_path, adv(20), "case,device,x,y,height,u,u_se\n" + rows), PointsOutsideWater)
    expected = PointsOutsideWater(
        2, ("s20",), ("low",), reason, (20.0, -1.0), pytest.approx(height), pytest.approx(1.0395), False
    )
    assert found == ([expected] if reason else [])


IMPORTED = """
imported:
  - {name: points.csv, sha256: "0", taken: points, columns: {z: "z [mm]", u: "u"}}
"""


def unmoved(folder: Path, column: str, *, follows: float, scatter: float = 0.0, more: str = "") -> list[object]:
    """Remarks on verticals in a flume that falls by 1 mm/m, whose heights follow so much of its bed."""
    places = [(x, y) for x in (5.0, 20.0, 35.0) for y in (-1.5, -0.5, 0.5, 1.5)]
    off = np.random.default_rng(1).normal(0.0, scatter, len(places))
    rows = [
        f"June/{x:g},adv,{x},{y},{height + one - follows * 0.001 * x:.5f},{0.1 * np.log(height / 0.001):.4f}"
        for (x, y), one in zip(places, off, strict=True)
        for height in (0.05, 0.2, 0.4, 0.7)
    ]
    (folder / "points.csv").write_text("\n".join([f"case,device,x,y,{column},u", *rows]), encoding="utf-8")
    one = "{{kind: adv, file: points.csv, experiment: low, section: s{0}, case: June/{0}, average: profile{1}}}"
    listed = "\n  - ".join(one.format(x, more) for x in (5, 20, 35))
    case, site, observations = read_case(folder, SOUND.replace(VELOCITIES, listed) + IMPORTED)
    found = list(remarks_on_unmoved_heights(case, observations))
    assert found == [one for one in critical_remarks(case, site, observations) if one in found]
    return found


def test_heights_taken_for_levels(tmp_path):
    (one,) = unmoved(tmp_path, "z", follows=0.0, scatter=0.002)
    expected = {"file": "points.csv", "experiments": ("low",), "first": 5.0, "last": 35.0, "heading": "z [mm]"}
    assert found_in([one], HeightsTakenForLevels, **expected)
    assert (*one.z, one.fall) == pytest.approx((0.051, 0.03), abs=1e-3)


@pytest.mark.parametrize(
    "heights",
    [
        {"column": "z", "follows": 1.0, "scatter": 0.002},
        {"column": "z", "follows": 0.0, "scatter": 0.04},  # more than the bed falls
        {"column": "height", "follows": 0.0},
        {"column": "z", "follows": 0.0, "more": ", floor: 0.0"},  # they count from there
    ],
)
def test_levels_that_follow_the_bed_and_stated_heights(tmp_path, heights):
    assert unmoved(tmp_path, **heights) == []


@pytest.mark.parametrize("name", ["d0_d3a", "joint", "campaign"])
def test_verticals_of_the_shipped_configs(name):
    case = load_case(CONFIGS / f"{name}.yaml")
    observations = read_observations(case)
    assert list(remarks_on_unmoved_heights(case, observations)) == []
    assert list(remarks_on_errors_across_plants(case, observations)) == []


def across(folder: Path, x: float, among: float, rough: float = 0.0, more: str = "") -> list[object]:
    """Remarks on verticals at x, uniform from bed to surface in the plants, at so much of the speed beside them.

    rough: by how much verticals differ from their neighbours [m/s].
    """
    rows = []
    for i, y in enumerate(np.arange(-1.8, 1.9, 0.3)):
        inside = 0.0 < y < 1.5
        for height in (0.06, 0.15, 0.3, 0.5, 0.8):
            law = among * 0.4 if inside else 0.06 * np.log(height / 0.001)
            rows.append(f"June,adv,{x},{y:.2f},{height},{law + rough * (-1) ** i:.4f},0.002")
    (folder / "points.csv").write_text("\n".join(["case,device,x,y,height,u,u_se", *rows]), encoding="utf-8")
    one = f"{{kind: adv, file: points.csv, experiment: low, section: D3, case: June, average: profile{more}}}"
    case, site, observations = read_case(folder, SOUND.replace(VELOCITIES, one))
    found = list(remarks_on_errors_across_plants(case, observations))
    assert found == found_in(check_case(case, site, observations), ErrorsAcrossPlants)
    return found


def test_a_jump_at_the_side_of_plants(tmp_path):
    (one,) = across(tmp_path, 12.0, 0.4)
    assert one.sections == (("low", "D3"),)
    assert one.neighbours[0] > 3.0 * one.points[0]
    assert one.neighbours[0] > 2.0 * one.one_side[0]


@pytest.mark.parametrize(
    "verticals",
    [
        {"x": 12.0, "among": 0.4, "more": ", standard_error: 0.003"},
        {"x": 30.0, "among": 0.4},  # no plants
        {"x": 12.0, "among": 0.8, "rough": 0.06},  # differ everywhere
    ],
)
def test_errors_that_are_stated_or_no_jump(tmp_path, verticals):
    assert across(tmp_path, **verticals) == []
