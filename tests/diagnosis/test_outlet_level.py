"""A level at the outlet that the gauge next to it contradicts is told before anything is solved."""

from pathlib import Path

import pytest
from open_cases import imported
from sound_case import SOUND

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis.case_check import check_case, doubts_about
from vegglue.diagnosis.outlet_level import remarks_on_outlet_levels
from vegglue.measurements.observations import read_observations

CONFIGS = Path(__file__).parents[2] / "configs"


def said_of(folder: Path, last: float, first: float = 1.03, level: str = "1.0") -> list[str]:
    """What is said of a brook at 0.38 m/s, where gauges at x = 5 and 36 m read so much [m]."""
    parts = SOUND.split("simulate:")
    text = parts[0] + "  - {kind: level, file: levels.csv, experiment: low}\nsimulate:" + parts[1]
    (folder / "levels.csv").write_text(f"x,y,level,level_se\n5,0,{first},0.002\n36,0,{last},0.002\n")
    (folder / "velocities.csv").write_text("experiment,section,x,y,u,u_se\nlow,A,12,0.7,0.3,0.01\n")
    deep = "  deep: {distribution: uniform, low: 0.9, high: 1.1, unit: m}\nobservations:"
    (folder / "sound.yaml").write_text(
        text.replace("level: 1.0}", f"level: {level}}}").replace(
            "observations:", deep if level == "deep" else "observations:"
        )
    )
    case = load_case(folder / "sound.yaml")
    site, observations = build_site(case), read_observations(case)
    said = list(remarks_on_outlet_levels(case, site, observations))
    assert set(said) <= {*doubts_about(case, site, observations)} & {*check_case(case, site, observations)}
    return said


def test_an_outlet_above_the_last_gauge(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, 0.95, 0.96)
    assert "gauge at x = 36 m reads 0.95 m in low, 50 mm below the level at the outlet 4 m further downstream" in said


@pytest.mark.parametrize("last", [1.01, 1.0, 0.992])
def test_gauges_above_the_outlet_or_as_high_as_the_velocity_lifts(tmp_path: Path, last: float) -> None:
    assert said_of(tmp_path, last) == []


def test_a_level_that_is_not_known_so_well(tmp_path: Path) -> None:
    assert said_of(tmp_path, 0.95, 0.96, level="deep") == []


@pytest.mark.parametrize("name", ["campaign", "twin"])
def test_levels_of_the_shipped_configs(name: str) -> None:
    case = load_case(CONFIGS / f"{name}.yaml")
    assert list(remarks_on_outlet_levels(case, build_site(case), read_observations(case))) == []


@pytest.mark.parametrize("name", ["open-a", "open-p"])
def test_levels_of_open_cases(tmp_path: Path, name: str) -> None:
    case = imported(name, tmp_path)
    assert list(remarks_on_outlet_levels(case, build_site(case), read_observations(case))) == []
