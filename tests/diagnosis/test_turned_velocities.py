"""Velocities that point to one side of the channel at all sections are told; bends and plants turn only some."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from sound_case import SOUND

from vegglue.case.config import load_case
from vegglue.case.gridded_site import build_site
from vegglue.diagnosis.case_check import check_case, doubts_about
from vegglue.diagnosis.turned_velocities import remarks_on_turned_velocities
from vegglue.measurements.observations import read_observations

ACROSS = (-1.5, -0.5, 0.5, 1.5)


def said_of(folder: Path, angles: Mapping[str, Sequence[float]]) -> list[str]:
    """What is said of velocities of 0.5 m/s with these angles to the left at sections of each experiment [degrees]."""
    places = [(name, i, y, angle) for name, some in angles.items() for i, angle in enumerate(some) for y in ACROSS]
    for column, part in (("u", np.cos), ("v", np.sin)):
        rows = [f"{name},s{i},{5 + 8 * i},{y},{0.5 * part(np.radians(a)):.5f}\n" for name, i, y, a in places]
        (folder / f"{column}.csv").write_text(f"experiment,section,x,y,{column}\n" + "".join(rows), encoding="utf-8")
    files = "{kind: velocity, file: u.csv}\n  - {kind: velocity_across, file: v.csv}"
    text = SOUND.replace("{kind: velocity, file: velocities.csv}", files)
    text = text.replace("level: 1.0}", "level: 1.0}\n  high: {discharge: 2.0, level: 1.0}")
    (folder / "sound.yaml").write_text(text, encoding="utf-8")
    case = load_case(folder / "sound.yaml")
    site, observations = build_site(case), read_observations(case)
    said = list(remarks_on_turned_velocities(case, observations))
    assert set(said) <= {*doubts_about(case, site, observations)} & {*check_case(case, site, observations)}
    return said


def test_one_campaign_is_turned(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, {"low": (-12.0, -12.7, -11.9), "high": (0.3, -0.5, 0.8)})
    assert "of experiment low point 12.2 degrees to the right of the channel on average over 3 sections" in said
    assert "(0.2 in high)" in said


def test_all_are_turned(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, {"low": (5.0, 5.5, 4.8), "high": (5.1, 5.2, 5.0)})
    assert "of experiments low and high point 5.1 and 5.1 degrees to the left" in said
    assert "or the `frame` or the centreline" in said


@pytest.mark.parametrize(
    "angles",
    [(2.0, 2.1, 1.9), (15.0, 0.5, -0.3), (9.0, -8.0, 7.5, 8.0), (12.0, 12.0), (16.0, 1.0, 2.0)],
    ids=["small", "one section", "a bend", "two sections", "one side by chance"],
)
def test_what_plants_and_bends_do_is_not_told(tmp_path: Path, angles: tuple[float, ...]) -> None:
    assert said_of(tmp_path, {"low": angles}) == []
