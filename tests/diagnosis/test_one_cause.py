"""One cause is one remark of `check`: what follows from it is left out, or folded into one sentence."""

import re
from pathlib import Path

import pytest
from sound_case import SOUND, odd

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis.case_check import doubts_about
from vegglue.measurements.observations import read_observations

LEVELS = "  - {kind: level, file: levels.csv}\n"
PLACES = [(x, y) for x in (20, 30) for y in (-1.5, -0.5, 0.5, 1.5)]
BOTH = SOUND.replace("level: 1.0}", "level: 1.0}\n  high: {discharge: 2.2, level: 1.1}").replace(
    "k_s: 0.5", "k_s: 0.05"
)
COMPONENTS = BOTH.replace("velocities.csv}\n", "velocities.csv}\n  - {kind: velocity_across, file: across.csv}\n")


def table(column: str, value: float) -> str:
    """Two sections in both experiments, in which everything reads about as much."""
    rows = "".join(f"{name},A{x},{x},{y},{value + 0.01 * y:g},0.01\n" for name in ("low", "high") for x, y in PLACES)
    return f"experiment,section,x,y,{column},{column}_se\n{rows}"


def test_exchanged_components_are_one_remark(tmp_path: Path) -> None:
    """They ran upstream, too, and too slowly, and carried another discharge."""
    (tmp_path / "across.csv").write_text(table("v", 0.33))
    said = odd(tmp_path, COMPONENTS, table("u", -0.005))
    assert len(said) == 1, said
    assert (
        "across of experiments low and high are larger than those along, 0.33 and 0.01 m/s in the middle of" in said[0]
    )
    case = load_case(tmp_path / "sound.yaml")
    assert doubts_about(case, build_site(case), read_observations(case)) == said


def test_a_stream_reversed_is_one_remark(tmp_path: Path) -> None:
    said = odd(tmp_path, BOTH, table("u", -0.33))
    assert len(said) == 1, said
    assert said[0].startswith("Velocities of experiments low and high run upstream, -0.33 m/s in the middle of low: x")


def with_gauges(folder: Path, middle: float) -> list[str]:
    """What is said of verticals of points in whose middle a gauge reads as much in both experiments [m]."""
    (folder / "levels.csv").write_text(
        "experiment,section,x,y,level,level_se\n"
        + "".join(
            f"{name},G{x},{x},0,{z},0.002\n"
            for name, surface in (("low", 1.0), ("high", 1.1))
            for x, z in ((2, surface + 0.02), (20, surface + middle), (38, surface))
        )
    )
    points = "".join(
        f"s{x},{name},{x},{y},{z},{0.34 + 0.1 * z:g},0.01\n"
        for name in ("low", "high") for x in (20, 26) for y in (-1.5, -0.5, 0.5, 1.5) for z in (0.2, 0.4, 0.6, 0.8)
    )  # fmt: skip
    entries = "".join(
        f"  - {{kind: adv, file: {name}.csv, experiment: {name}, section: s{x}, case: s{x}, average: profile}}\n"
        for name in ("low", "high") for x in (20, 26)
    )  # fmt: skip
    for name in ("low", "high"):
        own = "".join(row + "\n" for row in points.splitlines() if f",{name}," in row)
        (folder / f"{name}.csv").write_text("case,device,x,y,height,u,u_se\n" + own)
    return odd(folder, BOTH.replace("  - {kind: velocity, file: velocities.csv}\n", entries + LEVELS))


def test_gauges_that_agree_raise_no_question(tmp_path: Path) -> None:
    assert with_gauges(tmp_path, 0.01) == []


@pytest.mark.parametrize(
    ("middle", "cause"),
    [
        (-0.7, r"2 values of level \(gauge G20 of experiment low, gauge G20 .*more than half the depth there"),
        (-0.4, r"Levels of experiments low and high rise downstream, by 0\.4 m from x = 20 to 38 m"),
    ],
)
def test_a_wrong_gauge_is_one_remark_and_one_on_the_points_that_it_loses(tmp_path: Path, middle, cause) -> None:
    """Of three experiments there were 13 sentences; and a gauge 0.4 m too low among others was not told."""
    first, second = with_gauges(tmp_path, middle)
    assert re.match(cause, first), first
    assert re.match(r"\d+ points of s20 and s26 in experiments low and high not used: above the water surface", second)
    assert second.endswith("correct the levels told of above first.")
