"""Standard errors that verticals owe to a jump of velocities at plants are told, with what replaces them."""

from pathlib import Path

import numpy as np
import pytest
from sound_case import SOUND

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis.case_check import check_case
from vegglue.diagnosis.errors_across_plants import remarks_on_errors_across_plants
from vegglue.measurements.observations import read_observations

CONFIGS = Path(__file__).parents[2] / "configs"


def said_of(folder: Path, x: float, among: float, rough: float = 0.0, more: str = "") -> list[str]:
    """What is said of verticals at x, uniform from bed to surface in the plants, at so much of the speed beside them.

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
    text = SOUND.replace("{kind: velocity, file: velocities.csv}", one)
    (folder / "sound.yaml").write_text(text, encoding="utf-8")
    case = load_case(folder / "sound.yaml")
    observations = read_observations(case)
    said = list(remarks_on_errors_across_plants(case, observations))
    assert set(said) <= set(check_case(case, build_site(case), observations))
    return said


def test_a_jump_at_the_side_of_plants(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, 12.0, 0.4)
    assert said.startswith("Verticals of D3 in experiment low get standard errors of ")
    assert "`standard_error` of these observations in the config replaces them" in said
    assert said_of(tmp_path, 12.0, 0.4, more=", standard_error: 0.003") == []


def test_sections_without_plants_and_verticals_that_differ_everywhere(tmp_path: Path) -> None:
    assert said_of(tmp_path, 30.0, 0.4) == []
    assert said_of(tmp_path, 12.0, 0.8, rough=0.06) == []


@pytest.mark.parametrize("name", ["d0_d3a", "joint"])
def test_sections_of_the_shipped_configs(name: str) -> None:
    case = load_case(CONFIGS / f"{name}.yaml")
    assert list(remarks_on_errors_across_plants(case, read_observations(case))) == []
